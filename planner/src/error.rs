//! Why a job was refused.

use machine::kinematics::KinematicsError;
use messages::MAX_EDGES;

use crate::verify::checker::LimitViolation;

/// Why a job was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The job is a comparison on paper.
    #[error("this job can be planned, not run: {0}")]
    IdealOnly(&'static str),
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
    /// A motion that would not end while anybody waits for it.
    #[error("this job would take {:.1} days, more than a week", duration / 86_400.0)]
    TooLong {
        /// How long it lasts [s].
        duration: f64,
    },
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
    /// The laser changes more often in one cycle than a setpoint can say.
    #[error("the laser would change more than {MAX_EDGES} times in the millisecond at {time:.3} s")]
    TooManyEdges {
        /// Line of the job file, 0 for none.
        line: u64,
        /// Stream time [s].
        time: f64,
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
    #[error(
        "{place}{}: {} of {:.6} {unit} is beyond the limit of {:.6} {unit}",
        violation.axis.as_ref().map(|axis| format!(", axis {axis}")).unwrap_or_default(),
        violation.quantity,
        violation.value,
        violation.limit,
        unit = violation.unit
    )]
    Limit {
        /// Line of the job file, 0 for none.
        line: u64,
        /// Where in the job.
        place: Place,
        /// Which limit, and by how much.
        violation: LimitViolation,
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

impl PlanError {
    /// Line of the job file that it concerns, from 1; 0 for none.
    pub fn line(&self) -> u64 {
        match self {
            Self::IdealOnly(_) | Self::Abandoned | Self::TooLong { .. } => 0,
            Self::TooShort { line, .. }
            | Self::TooManyEdges { line, .. }
            | Self::Unreadable { line, .. }
            | Self::Unreachable { line, .. }
            | Self::NoConfiguration { line, .. }
            | Self::Limit { line, .. } => *line,
        }
    }
}
