//! Jobs on paper: how long a drawing would take by the speed profiles of the sources, to compare with
//! what Graver plans. Nothing here is ever run.
//!
//! A stroke is a curve of the drawing, with those after it that go on within 1° and at the same speed.
//! The profiles know the path's speed, acceleration and jerk along it; what bends ask for they ignore.

mod course;
mod samples;
mod strokes;
mod task;

use machine::kinematics::{Attitude, ToolMotion};
use machine::{Machine, PathLimits};
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::Serialize;

use crate::drawing::Note;
use crate::error::PlanError;
use crate::geometry::attitude::AttitudeLaw;
use crate::job::Job;
use crate::trajectory::Reference;
use course::Course;
use strokes::{Item, items};
use task::Task;

/// How the speed of a stroke goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Profile {
    /// A trapezoid of acceleration (source 003 eq. 2.1 to 2.5, with their errata): each stroke has a
    /// straight run-in from rest before it and a run-out to rest behind it, and is marked at one speed.
    Trapezoid,
    /// A trapezoid of velocity (source 004 eq. 4.13 to 4.18, with their errata): each stroke goes from
    /// rest to rest along itself, and its acceleration jumps.
    Velocity,
}

/// What a drawing takes on paper.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PaperFacts {
    /// The profile.
    pub profile: Profile,
    /// All of it, from the first motion to the last [s].
    pub time: f64,
    /// The largest speed while the laser is on [m/s], 0 when nothing is drawn.
    pub speed: f64,
    /// The strokes in their order.
    pub strokes: Vec<StrokeTime>,
    /// The time of all of it by the speed of all strokes, up to the largest that the machine allows.
    pub times: Vec<SpeedTime>,
    /// The speed of all strokes with the least time; null when nothing is drawn.
    pub least: Option<SpeedTime>,
}

/// One stroke on paper.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct StrokeTime {
    /// Line of the job file, 0 for none.
    pub line: u64,
    /// What is marked of it [m].
    pub length: f64,
    /// Its largest speed [m/s].
    pub speed: f64,
    /// From rest to rest, run-in and run-out included [s].
    pub time: f64,
}

/// A speed and what all of a drawing takes with it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct SpeedTime {
    /// Of all strokes [m/s].
    pub speed: f64,
    /// All of it [s].
    pub time: f64,
}

/// A drawing by a profile.
#[derive(Debug, Clone, PartialEq)]
pub struct Paper {
    /// What it takes.
    pub facts: PaperFacts,
    /// What a person should know.
    pub notes: Vec<Note>,
    start: Vector3<f64>,
    items: Vec<Item>,
    stretches: Vec<Stretch>,
}

/// From rest to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stretch {
    /// [s].
    start: f64,
    course: Course,
    way: Way,
}

/// Where a stretch goes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    /// Nowhere: at a place [m].
    Stay { at: Vector3<f64>, is_lit: bool },
    /// Straight in the dark from a place [m] in a direction.
    Free { from: Vector3<f64>, direction: Vector3<f64> },
    /// Along the stroke of an item, its `number` from 1, beginning `before` it [m].
    Stroke { item: usize, number: u64, before: f64 },
}

/// Puts `job` on paper for the path limits of `machine`.
///
/// # Errors
/// A job on a surface or with a tool that is not level, which the sources' profiles are not for; a file
/// that cannot be read on.
pub fn on_paper(machine: &Machine, job: &Job, profile: Profile) -> Result<Paper, PlanError> {
    if job.surface.is_some() || job.attitude != AttitudeLaw::Level {
        return Err(PlanError::NotOnPaper);
    }
    let limits = PathLimits { rapid: job.rapid.unwrap_or(machine.path.rapid), ..machine.path };
    let task = Task {
        start: job.drawing.start,
        items: items(job)?,
        limits,
        most: job.marking.max_speed.map_or(limits.speed, |most| most.min(limits.speed)),
        fixed: job.marking.speed,
        profile,
    };
    Ok(task.paper())
}

impl Paper {
    /// The tool at `time` since the start [s], the stroke that is marked, from 1, or 0, and whether the
    /// laser is on; at rest before and after.
    fn at(&self, time: f64) -> (ToolMotion, u64, bool) {
        let after = self.stretches.partition_point(|stretch| stretch.start <= time);
        let standing = (ToolMotion::rest(&machine::Pose::at(self.start)), 0, false);
        let Some(stretch) = self.stretches.get(after.max(1) - 1) else { return standing };
        let along = stretch.course.at(time - stretch.start);
        match &stretch.way {
            Way::Stay { at, is_lit } => {
                let over = time - stretch.start > stretch.course.duration();
                (ToolMotion::rest(&machine::Pose::at(*at)), 0, *is_lit && !over)
            }
            Way::Free { from, direction } => {
                let tool = ToolMotion {
                    position: from + direction * along.position,
                    velocity: direction * along.velocity,
                    acceleration: direction * along.acceleration,
                    jerk: direction * along.jerk,
                    attitude: Attitude::LEVEL,
                };
                (tool, 0, false)
            }
            Way::Stroke { item, number, before } => {
                let Item::Stroke(stroke) = &self.items[*item] else { return standing };
                let place = along.position - before;
                let jet = stroke.at(place);
                let tool = jet.motion([along.velocity, along.acceleration, along.jerk]);
                let is_inside = time - stretch.start <= stretch.course.duration();
                let is_lit = stroke.is_lit && is_inside && (0.0..=stroke.length).contains(&place);
                (tool, *number, is_lit)
            }
        }
    }

    /// The tool's motion `time` after the start [s]; at rest before and after.
    pub fn reference(&self, time: f64) -> Reference {
        Reference::Tool(self.at(time).0)
    }
}
