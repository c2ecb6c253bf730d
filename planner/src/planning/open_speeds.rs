//! Speeds that a job leaves to the planner: which is quickest, and which corners are passed at it.

use machine::{Machine, PathLimits};

use super::operations::{OperationQueue, Steps};
use super::run::of_steps;
use crate::drawing::{Action, Note, Step, Turns};
use crate::error::PlanError;
use crate::geometry::operation::Operation;
use crate::job::composition::Composition;
use crate::job::{Job, MarkingSpeed};
use crate::joint_space::directions::directions_near;
use crate::law::optimum::{Best, Near, Speeds, Travel};
use crate::light::Policy;
use crate::limits::motion_limits::Scope;

/// How often the time of flights is looked at for one way to divide a drawing into lines, and for the best.
const LOOKS: usize = 2;
const LOOKS_AT_BEST: usize = 5;

/// The most ways to divide a drawing that are tried, and of a drawing with many steps.
const WAYS: usize = 6;
const WAYS_OF_MANY: usize = 1;
const MANY: usize = 3000;

/// Corners that allow about the same speed are passed at the same: within this factor.
const ALIKE: f64 = 1.05;

/// Rounding of a speed that a corner allows just so.
const ROUNDING: f64 = 1.0 - 1e-9;

/// The speeds of a job.
pub(super) struct Chosen {
    pub(super) speeds: Speeds,
    /// What a corner must allow to be passed by lines whose speed is open [m/s].
    pub(super) corners_at: f64,
}

/// A way to divide a drawing into lines.
struct Way<'a> {
    corners_at: f64,
    travel: Travel<'a>,
    /// What the corners that end lines would allow [m/s].
    sharp: Vec<f64>,
    /// How many operations it has.
    count: usize,
}

/// Chooses the speeds that `job` leaves open, so that it takes the least time. A corner that does not allow
/// the speed of its lines ends them, and the tool flies a loop there; a lower speed passes it. Which is
/// quicker is not told by the speed alone: it is tried with lines that end at fewer and fewer corners.
///
/// # Errors
/// A job that cannot be read.
pub(super) fn choose(
    machine: &Machine,
    job: &Job,
    limits: &PathLimits,
    scope: Scope,
    notes: &mut Vec<Note>,
) -> Result<Chosen, PlanError> {
    let mut speeds = Speeds::new(limits, &job.marking, notes);
    let most = speeds.most;
    if !leaves_speeds_open(job) {
        return Ok(Chosen { speeds, corners_at: most });
    }
    let near = directions_near(machine, *limits, job.attitude, scope);
    let chooser = Chooser { machine, job, limits, near: &near, speeds: &speeds };
    let first = chooser.way(most)?;
    let Some(mut best) = first.travel.best(LOOKS) else {
        return Ok(Chosen { speeds, corners_at: most });
    };
    let mut way = first;
    for corners_at in others(&way, &best) {
        let other = chooser.way(corners_at)?;
        if let Some(found) = other.travel.best(LOOKS)
            && found.time < best.time
        {
            (way, best) = (other, found);
        }
    }
    let best = way.travel.best(LOOKS_AT_BEST).unwrap_or(best);
    let corners_at = way.corners_at;
    drop(way);
    speeds.open = best.speed;
    Ok(Chosen { speeds, corners_at })
}

/// The speeds at which corners are to be passed in the other ways that are worth a trial: those of corners
/// that end lines, falling.
fn others(first: &Way<'_>, best: &Best) -> Vec<f64> {
    let least = first.travel.slowest(best.time);
    let mut sharp: Vec<f64> = first.sharp.iter().copied().filter(|sharp| *sharp > least).collect();
    sharp.sort_by(|one, other| one.total_cmp(other));
    let mut speeds: Vec<f64> = Vec::new();
    for speed in sharp {
        if speeds.last().is_none_or(|last| speed > ALIKE * last) {
            speeds.push(speed);
        }
    }
    let most = if first.count > MANY { WAYS_OF_MANY } else { WAYS };
    let apart = speeds.len().div_ceil(most).max(1);
    speeds.into_iter().step_by(apart).rev().map(|speed| speed * ROUNDING).collect()
}

/// Makes operations of a job's steps.
struct Chooser<'a> {
    machine: &'a Machine,
    job: &'a Job,
    limits: &'a PathLimits,
    near: &'a Near<'a>,
    speeds: &'a Speeds,
}

impl<'a> Chooser<'a> {
    fn way(&self, corners_at: f64) -> Result<Way<'a>, PlanError> {
        let Self { machine, job, limits, near, speeds } = *self;
        let operations = of_steps(machine, job, limits, corners_at);
        let mut source = OperationQueue::new(held(job), operations);
        let mut operations: Vec<Operation> = Vec::new();
        while let Some(operation) = source.get(operations.len())? {
            operations.push(operation.clone());
        }
        let flies = job.marking.turns == Turns::Fly;
        let travel = Travel::new(job.drawing.start, &operations, limits, near, speeds, flies);
        let sharp = source.sharp().to_vec();
        Ok(Way { corners_at, travel, sharp, count: operations.len() })
    }
}

/// Whether the speed of some line is for the planner to choose, so that it must know the job before
/// it begins.
fn leaves_speeds_open(job: &Job) -> bool {
    let is_open = |step: &Step| {
        let (speed, power) = match &step.action {
            Action::Mark { speed, power, .. } | Action::Trace { speed, power, .. } => {
                (*speed, power)
            }
            Action::Follow { power, .. } => (None, power),
            _ => return false,
        };
        speed.is_none() && job.marking.policy(power) == Policy::Constant
    };
    match job.marking.speed {
        Some(MarkingSpeed::Constant(_)) => false,
        Some(MarkingSpeed::Optimum) => true,
        None => {
            let composition = job.composition.as_ref();
            job.drawing.steps.iter().any(is_open)
                || composition.is_some_and(Composition::leaves_speeds_open)
        }
    }
}

/// The steps by which speeds are chosen: of a program that is too long to be held, its beginning.
fn held(job: &Job) -> Steps<'_> {
    match job.steps() {
        Ok(steps) => Box::new(steps.take(Job::HELD as usize)),
        Err(_) => Box::new(core::iter::empty()),
    }
}
