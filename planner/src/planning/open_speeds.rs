//! Speeds that a job leaves to the planner.

use super::operations::{OperationQueue, Steps};
use crate::drawing::{Action, Step};
use crate::error::PlanError;
use crate::geometry::operation::Operation;
use crate::job::composition::Composition;
use crate::job::{Job, MarkingSpeed};
use crate::light::Policy;

/// Whether the speed of some line is for the planner to choose, so that it must know the job before
/// it begins.
pub(super) fn leaves_speeds_open(job: &Job) -> bool {
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
pub(super) fn held(job: &Job) -> Steps<'_> {
    match job.steps() {
        Ok(steps) => Box::new(steps.take(Job::HELD as usize)),
        Err(_) => Box::new(core::iter::empty()),
    }
}

pub(super) fn all(mut source: OperationQueue<'_>) -> Result<Vec<Operation>, PlanError> {
    let mut operations = Vec::new();
    while let Some(operation) = source.get(operations.len())? {
        operations.push(operation.clone());
    }
    Ok(operations)
}
