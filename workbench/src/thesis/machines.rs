//! The four machines of source 003 as Graver has them, and the twelve letters that it marks on them.

use machine::{DocumentError, Machine};
use planner::job::letters::Letter;
use planner::request::JobRequest;

use super::data::{HEIGHTS, LETTERS, SPEEDS_IMPLIED};

/// A machine of the source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ThesisMachine {
    /// Chapter 3.
    Cartesian,
    /// Chapter 4.
    CoreXy,
    /// Chapter 5.
    FiveBar,
    /// Chapter 6, "assi impropri".
    Prrrp,
}

impl ThesisMachine {
    /// All of them, in the order of the source.
    pub const ALL: [Self; 4] = [Self::Cartesian, Self::CoreXy, Self::FiveBar, Self::Prrrp];

    /// What the source calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cartesian => "Cartesiano",
            Self::CoreXy => "CoreXY",
            Self::FiveBar => "5R",
            Self::Prrrp => "Assi impropri",
        }
    }

    /// Where its file is in the repository.
    pub fn file(self) -> &'static str {
        match self {
            Self::Cartesian => "machines/thesis/cartesian.toml",
            Self::CoreXy => "machines/thesis/corexy.toml",
            Self::FiveBar => "machines/thesis/five_bar.toml",
            Self::Prrrp => "machines/thesis/prrrp.toml",
        }
    }

    /// The machine.
    ///
    /// # Errors
    /// What is wrong with its file; the files here have nothing wrong with them.
    pub fn machine(self) -> Result<Machine, DocumentError> {
        let text = match self {
            Self::Cartesian => include_str!("../../../machines/thesis/cartesian.toml"),
            Self::CoreXy => include_str!("../../../machines/thesis/corexy.toml"),
            Self::FiveBar => include_str!("../../../machines/thesis/five_bar.toml"),
            Self::Prrrp => include_str!("../../../machines/thesis/prrrp.toml"),
        };
        Machine::parse(self.file(), text, &[])
    }
}

/// How a letter of the series is marked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Manner {
    /// Chord by chord at the source's speed.
    Printed,
    /// Chord by chord at the speed that takes the least time.
    Optimum,
    /// As true curves at the speed that takes the least time.
    Curves,
}

/// A letter of the series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeriesLetter {
    /// Which.
    pub letter: Letter,
    /// Height [m].
    pub height: f64,
    /// Marking speed of the source, with its erratum [m/s].
    pub speed: f64,
}

impl SeriesLetter {
    /// Its name, such as `N 1 cm`.
    pub fn name(&self) -> String {
        format!("{:?} {:.0} cm", self.letter, self.height * 1e2)
    }

    /// The job that marks it.
    pub fn request(&self, manner: Manner) -> JobRequest {
        let Self { letter, height, speed } = self;
        let style = if manner == Manner::Curves { "curves" } else { "h1" };
        let speed = match manner {
            Manner::Printed => format!("{speed} m/s"),
            Manner::Optimum | Manner::Curves => "optimum".to_owned(),
        };
        JobRequest {
            job: None,
            set: vec![
                format!("letters.text={letter:?}"),
                format!("letters.height={height} m"),
                format!("letters.style={style}"),
                format!("marking.speed={speed}"),
            ],
            offsets: None,
            confined: false,
        }
    }
}

/// The twelve letters, letter by letter, in the order of the tables.
pub fn series() -> Vec<SeriesLetter> {
    let of = |(letter, speeds): (Letter, [f64; 3])| {
        let sized = HEIGHTS.into_iter().zip(speeds);
        sized.map(move |(height, speed)| SeriesLetter { letter, height, speed })
    };
    LETTERS.into_iter().zip(SPEEDS_IMPLIED).flat_map(of).collect()
}
