//! Figures of machines and motors, and those of source 003: each a picture and the numbers that it shows.
//!
//! A [`Figure`] comes from the functions that plan and run the machine; nothing is drawn that is not in its
//! [`Table`]. All drawing goes through `monitor::report`.

mod acceleration;
mod beams;
mod chords;
mod draw;
mod ellipses;
pub mod index;
mod modes;
mod motor;
mod singular;
mod speed;
mod stiffness;
mod subject;
mod table;
mod torque;

pub use motor::sized;
pub use subject::{Chapter, Subject, SubjectJob, source_machines};
pub use table::{Cell, Table};

use machine::kinematics::KinematicsError;
use monitor::report::PictureError;

/// What a figure shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Name {
    /// Torque and speed of the motors over a job.
    Torque,
    /// What a motor gives by its speed, and where a job uses it.
    Motor,
    /// Acceleration and force of the tool by direction.
    Acceleration,
    /// Stiffness of screws, belts and of the tool.
    Stiffness,
    /// Velocity and force ellipses.
    Ellipses,
    /// Where a mechanism loses or gains a freedom.
    Singular,
    /// Time of a letter by its marking speed.
    Speed,
    /// Error of a circle drawn in chords.
    Chords,
    /// Natural frequencies.
    Modes,
}

impl Name {
    /// All of them, in the order in which they are drawn.
    pub const ALL: [Self; 9] = [
        Self::Torque,
        Self::Motor,
        Self::Acceleration,
        Self::Stiffness,
        Self::Ellipses,
        Self::Singular,
        Self::Speed,
        Self::Chords,
        Self::Modes,
    ];

    /// The name on the command line.
    pub fn word(self) -> &'static str {
        match self {
            Self::Torque => "torque",
            Self::Motor => "motor",
            Self::Acceleration => "acceleration",
            Self::Stiffness => "stiffness",
            Self::Ellipses => "ellipses",
            Self::Singular => "singular",
            Self::Speed => "speed",
            Self::Chords => "chords",
            Self::Modes => "modes",
        }
    }
}

/// A picture and its numbers.
#[derive(Debug, Clone)]
pub struct Figure {
    /// What it shows.
    pub name: Name,
    /// The source's figure, such as `3-11`; empty where it has none.
    pub source: String,
    /// What it is, in a few words.
    pub title: String,
    /// What is to be known about it.
    pub caption: String,
    /// Names of the axes with their units, across and up.
    pub axes: [String; 2],
    /// The picture.
    pub svg: String,
    /// What it shows; its stem is the picture's too.
    pub table: Table,
    /// Further numbers that belong to it.
    pub more: Vec<Table>,
}

/// A figure that could not be drawn for a machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Skipped {
    /// Which figure.
    pub name: Name,
    /// Of what: a machine, or a machine and a job.
    pub of: String,
    /// Why not.
    pub why: String,
}

/// What was drawn, and what was not.
#[derive(Debug, Clone, Default)]
pub struct Figures {
    /// In the order of their names.
    pub figures: Vec<Figure>,
    /// What could not be drawn.
    pub skipped: Vec<Skipped>,
}

/// Why figures could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    /// A picture could not be drawn.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A machine has no solution at home.
    #[error("{machine} at home: {error}")]
    Home {
        /// Its name.
        machine: String,
        /// What is missing.
        error: KinematicsError,
    },
}

/// Draws the figures of `names` for `subjects`; with `of_source` those of source 003 too that belong to no
/// machine file.
///
/// # Errors
/// Numbers that cannot be drawn, or a machine that has no solution at home.
pub fn draw_all(
    names: &[Name],
    subjects: &[Subject],
    of_source: bool,
) -> Result<Figures, FigureError> {
    let mut figures = Figures::default();
    for name in Name::ALL.into_iter().filter(|name| names.contains(name)) {
        for subject in subjects {
            match name {
                Name::Torque => torque::add(subject, &mut figures)?,
                Name::Motor => motor::add(subject, &mut figures)?,
                Name::Acceleration => acceleration::add(subject, &mut figures)?,
                Name::Stiffness => stiffness::add(subject, &mut figures)?,
                Name::Ellipses => ellipses::add(subject, &mut figures)?,
                Name::Singular => singular::add(subject, &mut figures)?,
                Name::Modes => {
                    modes::add(subject, &mut figures)?;
                    beams::add(subject, &mut figures)?;
                }
                Name::Speed | Name::Chords => {}
            }
        }
        match name {
            Name::Stiffness if of_source => stiffness::add_source(&mut figures)?,
            Name::Modes if of_source => beams::add_source(&mut figures)?,
            Name::Speed => speed::add(&mut figures)?,
            Name::Chords => chords::add(&mut figures)?,
            _ => {}
        }
    }
    Ok(figures)
}

impl Figures {
    /// Notes a figure that cannot be drawn.
    fn skip(&mut self, name: Name, of: &str, why: impl Into<String>) {
        self.skipped.push(Skipped { name, of: of.to_owned(), why: why.into() });
    }
}

#[cfg(test)]
mod tests;
