//! Time of a letter by its marking speed (source 003 fig. 2-12): the faster it is marked, the longer are the
//! run-ins and run-outs of its lines.

use monitor::report::chart::{Chart, Curve, colour};
use nalgebra::Vector3;
use planner::drawing::{Action, Power};
use planner::job::letters::{self, Letter, Style};
use planner::law::profile::{Move, Ramp};

use super::draw::MILLIMETRES;
use super::{Figure, FigureError, Figures, Name, Table};
use crate::thesis::data::{HEIGHTS, LETTERS, RAPID};

/// Accelerations that are compared [m/s²].
const ACCELERATIONS: [f64; 3] = [5.0, 10.0, 20.0];

/// Jerk by acceleration [1/s]: the source's 500 m/s³ for 10 m/s².
const JERKS: f64 = 50.0;

/// Marking speeds: steps of 5 mm/s up to 0.3 m/s.
const STEPS: u32 = 60;
const STEP: f64 = 5e-3;

/// (√5 − 1)/2.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Lines that are marked one after the other, each at one speed from a run-in to a run-out.
#[derive(Debug, Clone)]
pub(super) struct Strokes {
    /// From the first line's place of rest, the middle of the letter [m].
    start: Vector3<f64>,
    /// From and to [m].
    lines: Vec<[Vector3<f64>; 2]>,
}

impl Strokes {
    /// `letter` of `height` [m] in the chords of convention h1.
    pub(super) fn of_letter(letter: Letter, height: f64) -> Self {
        let power = Power { level: 1.0, follows_speed: false };
        let drawing = letters::draw(&[letter], height, Style::H1, power, Vector3::zeros(), 0);
        let lines = drawing.steps.iter().filter_map(|step| match &step.action {
            Action::Mark { curve, .. } => Some([curve.from(), curve.to()]),
            _ => None,
        });
        Self { start: drawing.start, lines: lines.collect() }
    }

    /// The time of all of it with lines at `speed` [m/s] within `acceleration` [m/s²] and `jerk` [m/s³],
    /// moves in the dark going straight from rest to rest (source 003 sec. 2.2) [s].
    pub(super) fn time(&self, speed: f64, acceleration: f64, jerk: f64) -> f64 {
        let ramp = Ramp::to_speed(speed, acceleration, jerk);
        let mut at = self.start;
        let mut total = 0.0;
        for [from, to] in &self.lines {
            let length = (to - from).norm();
            let along = (to - from) / length;
            let run_in = from - along * ramp.length();
            total += Move::new((run_in - at).norm(), RAPID, acceleration, jerk).duration();
            total += 2.0 * ramp.duration() + length / speed;
            at = to + along * ramp.length();
        }
        total
    }

    /// The speed up to the largest of the figure with the least time, and that time [m/s, s].
    pub(super) fn optimum(&self, acceleration: f64, jerk: f64) -> (f64, f64) {
        let time = |speed: f64| self.time(speed, acceleration, jerk);
        let speed = |step: u32| f64::from(step) * STEP;
        let best =
            (1..=STEPS).min_by(|one, other| time(speed(*one)).total_cmp(&time(speed(*other))));
        let best = best.unwrap_or(1);
        let (mut low, mut high) = (speed(best) - STEP + 1e-6, speed((best + 1).min(STEPS)));
        for _ in 0..60 {
            let width = GOLDEN * (high - low);
            let (left, right) = (high - width, low + width);
            if time(left) <= time(right) {
                high = right;
            } else {
                low = left;
            }
        }
        let found = (low + high) / 2.0;
        (found, time(found))
    }
}

pub(super) fn add(figures: &mut Figures) -> Result<(), FigureError> {
    let columns = ["letter", "cm", "acceleration", "speed", "time"];
    let mut optimum = Table::new("speed_optimum", columns);
    let mut best: Vec<Curve> = Vec::new();
    for (index, letter) in LETTERS.into_iter().enumerate() {
        let name = format!("{letter:?}");
        let mut line = Vec::new();
        for height in HEIGHTS {
            let (strokes, cm) = (Strokes::of_letter(letter, height), (height * 1e2).round());
            figures.figures.push(drawn(&name, cm, &strokes)?);
            for acceleration in ACCELERATIONS {
                let (speed, time) = strokes.optimum(acceleration, JERKS * acceleration);
                optimum.rows.push(vec![
                    name.as_str().into(),
                    cm.into(),
                    acceleration.into(),
                    speed.into(),
                    time.into(),
                ]);
                if acceleration == ACCELERATIONS[1] {
                    line.push((cm * 10.0, speed * MILLIMETRES));
                }
            }
        }
        let dots = line.iter().map(|point| vec![*point]);
        let lines = [line.clone()].into_iter().chain(dots).collect();
        best.push(Curve { name, colour: colour(index), lines });
    }
    let axes = ["height of the letter [mm]", "fastest marking speed [mm/s]"];
    figures.figures.push(Figure {
        name: Name::Speed,
        source: String::new(),
        title: "The marking speed with the least time".to_owned(),
        caption: "At 10 m/s² and 500 m/s³, up to 0.3 m/s. Between the three heights the lines only guide \
                  the eye."
            .to_owned(),
        axes: axes.map(str::to_owned),
        svg: chart(axes, best)?,
        table: optimum,
        more: Vec::new(),
    });
    Ok(())
}

fn drawn(name: &str, cm: f64, strokes: &Strokes) -> Result<Figure, FigureError> {
    let columns = ACCELERATIONS.map(|acceleration| format!("time_A{acceleration}"));
    let columns = ["speed".to_owned()].into_iter().chain(columns);
    let mut table = Table::new(format!("speed_{name}{cm}"), columns);
    let mut curves: Vec<Curve> = (0..)
        .zip(ACCELERATIONS)
        .map(|(index, acceleration)| Curve {
            name: format!("{acceleration} m/s²"),
            colour: colour(index),
            lines: vec![Vec::new()],
        })
        .collect();
    let shortest = ACCELERATIONS.map(|one| strokes.optimum(one, JERKS * one).1);
    // What is several times slower than the fastest would flatten the rest.
    let most = 3.0 * shortest.into_iter().fold(0.0, f64::max);
    for step in 1..=STEPS {
        let speed = f64::from(step) * STEP;
        let times = ACCELERATIONS.map(|one| strokes.time(speed, one, JERKS * one));
        table.numbers([speed].into_iter().chain(times));
        for (curve, time) in curves.iter_mut().zip(times) {
            if time <= most {
                curve.lines[0].push((speed * MILLIMETRES, time));
            }
        }
    }
    for (curve, acceleration) in curves.iter_mut().zip(ACCELERATIONS) {
        let (speed, time) = strokes.optimum(acceleration, JERKS * acceleration);
        curve.lines.push(vec![(speed * MILLIMETRES, time)]);
    }
    let axes = ["marking speed [mm/s]", "time [s]"];
    Ok(Figure {
        name: Name::Speed,
        source: "2-12".to_owned(),
        title: format!("Time of the letter {name} of {cm} cm by its marking speed"),
        caption: "The chords of convention h1, each with a run-in and a run-out, for three accelerations, the \
                  jerk 50 times the acceleration each second. Dots mark the least time. True curves need no \
                  stop and are far quicker."
            .to_owned(),
        axes: axes.map(str::to_owned),
        svg: chart(axes, curves)?,
        table,
        more: Vec::new(),
    })
}

fn chart(axes: [&str; 2], curves: Vec<Curve>) -> Result<String, FigureError> {
    let chart = Chart {
        title: "speed",
        across: axes[0],
        up: axes[1],
        height: 380,
        at_least: Some((0.0, 0.0)),
        curves,
    };
    Ok(chart.draw()?)
}
