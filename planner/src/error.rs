//! Why a job was refused.

use machine::kinematics::KinematicsError;

use crate::job::TooLarge;
use crate::verify::checker::{LimitViolation, Quantity};

/// Why a job was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The job is a comparison on paper.
    #[error("this job can be planned, not run: {0}")]
    IdealOnly(&'static str),
    /// The sources' speed profiles know no such job.
    #[error(
        "the profiles of the sources are for drawings without a surface and for a level tool: leave out \
         [surface] and [attitude]"
    )]
    NotOnPaper,
    /// Whoever asked for the plan does not want it any more.
    #[error("planning was given up: the job was withdrawn")]
    Abandoned,
    /// The job's file cannot be read on while it is planned.
    #[error("{message}")]
    Unreadable {
        /// Line of the job file, 0 for none.
        line: u64,
        /// Why.
        message: String,
    },
    /// The stroke to begin with is beyond the last.
    #[error(
        "there is no stroke {asked} to begin with: the job has {strokes} (marking.from_stroke)"
    )]
    NoStroke {
        /// The stroke to begin with, from 1.
        asked: u64,
        /// How many strokes and dots there are.
        strokes: u64,
    },
    /// The place to begin with is beyond the end of its stroke.
    #[error(
        "stroke {stroke} is {:.4} mm long: there is no place {:.4} mm along it to begin with (marking.from_along)",
        length * 1e3,
        asked * 1e3
    )]
    NoPlace {
        /// The stroke, from 1.
        stroke: u64,
        /// How far along it the job is to begin [m].
        asked: f64,
        /// Its length [m], 0 of a dot.
        length: f64,
    },
    /// A motion that would not end while anybody waits for it.
    #[error("this job would take {:.1} days, more than a week", duration / 86_400.0)]
    TooLong {
        /// How long it lasts [s].
        duration: f64,
    },
    /// The area holds the drawing nowhere.
    #[error("{}", too_large(.0))]
    TooLarge(TooLarge),
    /// The laser source cannot switch on and off in the time of a dot.
    #[error(
        "this light lasts {:.3} ms, too short for the laser's switching delays or too close to the \
         light before",
        duration * 1e3
    )]
    TooShort {
        /// Line of the job file, 0 for none.
        line: u64,
        /// How long it lasts [s].
        duration: f64,
    },
    /// The tool cannot get there.
    #[error("{place}: the tool cannot be there: {cause}")]
    Unreachable {
        /// Line of the job file, 0 for none.
        line: u64,
        /// Where in the job.
        place: Place,
        /// Why.
        cause: KinematicsError,
    },
    /// The joints would have to stand otherwise than they can.
    #[error(
        "{place}: of {tried} configurations tried, none in which the axes can follow this stroke can \
         be reached from the one before; move the stroke, or mark it in parts"
    )]
    NoConfiguration {
        /// Line of the job file, 0 for none.
        line: u64,
        /// Where in the job.
        place: Place,
        /// How many were tried.
        tried: usize,
    },
    /// A limit of path, area, axis or motor.
    #[error("{}", beyond(place, violation, zero.as_deref()))]
    Limit {
        /// Line of the job file, 0 for none.
        line: u64,
        /// Where in the job.
        place: Place,
        /// Which limit, and by how much.
        violation: LimitViolation,
        /// Where a G-code program has its X0 Y0 Z0, machine frame [m], if it is one place all along.
        zero: Option<Box<[f64; 3]>>,
    },
}

/// Where in a job something is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// The stroke that is marked, approached or left, from 1; 0 for none.
    pub stroke: u64,
    /// Stream time [s].
    pub time: f64,
}

impl core::fmt::Display for Place {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.stroke {
            0 => write!(formatter, "at {:.3} s", self.time),
            stroke => write!(formatter, "stroke {stroke}, at {:.3} s", self.time),
        }
    }
}

/// What a person reads of a drawing for which there is no room.
fn too_large(found: &TooLarge) -> String {
    let size =
        |[width, height]: [f64; 2]| format!("{:.3} mm × {:.3} mm", width * 1e3, height * 1e3);
    let turned = if found.fits_turned() { ", or turn it by 90 degrees" } else { "" };
    format!(
        "what is drawn is {}, and the area of the machine {}: make it smaller{turned}",
        size(found.drawing),
        size(found.area),
    )
}

/// What a person reads of a limit that is broken.
fn beyond(place: &Place, violation: &LimitViolation, zero: Option<&[f64; 3]>) -> String {
    let LimitViolation { axis, quantity, value, limit, unit, .. } = violation;
    let Quantity::ToolPosition(row) = *quantity else {
        let axis = axis.as_ref().map(|axis| format!(", axis {axis}")).unwrap_or_default();
        return format!(
            "{place}{axis}: {quantity} of {value:.6} {unit} is beyond the limit of {limit:.6} {unit}"
        );
    };
    let stroke = match place.stroke {
        0 => String::new(),
        stroke => format!("stroke {stroke}: "),
    };
    let row = row.min(2);
    let name = ["x", "y", "z"][row];
    let [value, limit] = [value * 1e3, limit * 1e3];
    let is_above = value > limit;
    let Some(zero) = zero.map(|zero| zero[row] * 1e3) else {
        return format!(
            "{stroke}{name} of the tool would be {value:.3} mm in machine coordinates, outside the area, \
             which {} at {limit:.3} mm",
            if is_above { "ends" } else { "begins" },
        );
    };
    // What a person has written stands first.
    let word = name.to_uppercase();
    format!(
        "{stroke}{word}{:.3} is outside the area: {word} can be {} {:.3} mm, it is {:.3} mm too far; {name} \
         of the tool would be {value:.3} mm in machine coordinates, where the area {} at {limit:.3} mm and \
         {word}0 of the program is at {zero:.3} mm",
        value - zero,
        if is_above { "at most" } else { "no less than" },
        limit - zero,
        (value - limit).abs(),
        if is_above { "ends" } else { "begins" },
    )
}

impl PlanError {
    /// Line of the job file that it concerns, from 1; 0 for none.
    pub fn line(&self) -> u64 {
        match self {
            Self::IdealOnly(_)
            | Self::NotOnPaper
            | Self::Abandoned
            | Self::NoStroke { .. }
            | Self::NoPlace { .. }
            | Self::TooLong { .. }
            | Self::TooLarge(_) => 0,
            Self::TooShort { line, .. }
            | Self::Unreadable { line, .. }
            | Self::Unreachable { line, .. }
            | Self::NoConfiguration { line, .. }
            | Self::Limit { line, .. } => *line,
        }
    }
}
