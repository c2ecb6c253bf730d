//! The operations of a job, made of its steps as they are asked for, and kept as long as they may be
//! asked for again.

use std::collections::VecDeque;
use std::sync::Arc;

use machine::PathLimits;

use crate::drawing::{Note, Step};
use crate::error::{Place, PlanError};
use crate::geometry::contour::Contour;
use crate::geometry::operation::{OffSurface, Operation, OperationKind};
use crate::geometry::operations::Operations;
use crate::job::JobError;
use crate::planning::passing::{Passed, PassedOver, Passing};

/// Steps of a job in order; the last may be an error.
pub(crate) type Steps<'a> = Box<dyn Iterator<Item = Result<Step, JobError>> + 'a>;

/// What a job does, in order.
pub(crate) struct OperationQueue<'a> {
    steps: Steps<'a>,
    operations: Operations<'a>,
    made: VecDeque<Operation>,
    /// The number of the first operation that is still here.
    first: usize,
    is_read: bool,
    /// What is passed over, until the stroke to begin with comes.
    passes: Option<Passing>,
    /// What was passed over before it.
    passed: PassedOver,
}

impl<'a> OperationQueue<'a> {
    /// Of `steps`, which `operations` takes.
    pub(crate) fn new(steps: Steps<'a>, operations: Operations<'a>) -> Self {
        let made = VecDeque::new();
        Self {
            steps,
            operations,
            made,
            first: 0,
            is_read: false,
            passes: None,
            passed: PassedOver::default(),
        }
    }

    /// Begins with this stroke, from 1, and `along` it [m]; what is marked before is left out. `limits` are those of
    /// paths.
    pub(crate) fn beginning_with(self, begins: u64, along: f64, limits: &PathLimits) -> Self {
        let is_begun = begins > 1 || along > 0.0;
        Self { passes: is_begun.then(|| Passing::new(begins, along, limits)), ..self }
    }

    /// The operation with this number, from 0; `None` behind the last.
    ///
    /// # Errors
    /// A job that cannot be read on, or a place beyond an edge of its surface.
    pub(crate) fn get(&mut self, number: usize) -> Result<Option<&Operation>, PlanError> {
        let index = number.saturating_sub(self.first);
        while self.made.len() <= index {
            match self.make()? {
                Some(operation) => self.made.push_back(operation),
                None => return Ok(None),
            }
        }
        Ok(self.made.get(index))
    }

    /// The path with this number, if it goes on from the one before without a stop.
    ///
    /// # Errors
    /// As of [`Self::get`].
    pub(crate) fn next_part(&mut self, number: usize) -> Result<Option<Arc<Contour>>, PlanError> {
        Ok(self.get(number)?.and_then(|operation| match &operation.kind {
            OperationKind::Path(contour) if contour.goes_on_from_before() => Some(contour.clone()),
            _ => None,
        }))
    }

    /// Lets go of the operations before `number`.
    pub(crate) fn release(&mut self, number: usize) {
        let count = number.saturating_sub(self.first).min(self.made.len());
        self.made.drain(..count);
        self.first += count;
    }

    /// What was passed over before the first stroke.
    pub(crate) fn passed(&self) -> PassedOver {
        self.passes.as_ref().map_or(self.passed, Passing::passed)
    }

    /// What a person should know of what has been made so far.
    pub(crate) fn notes(&self) -> &[Note] {
        &self.operations.notes
    }

    /// What corners of open lines that are not passed would allow, of what has been made so far [m/s].
    pub(crate) fn sharp(&self) -> &[f64] {
        &self.operations.sharp
    }

    fn make(&mut self) -> Result<Option<Operation>, PlanError> {
        loop {
            if let Some(operation) = self.operations.next() {
                match &mut self.passes {
                    None => return Ok(Some(operation)),
                    Some(passing) => match passing.pass(operation)? {
                        Passed::Over => continue,
                        Passed::On(operation) => return Ok(Some(operation)),
                        Passed::Begun(operation) => {
                            self.passed = passing.passed();
                            self.passes = None;
                            return Ok(Some(operation));
                        }
                    },
                }
            }
            if self.is_read {
                return match &mut self.passes {
                    None => Ok(None),
                    Some(passing) => Err(passing.not_found()),
                };
            }
            match self.steps.next() {
                Some(step) => {
                    let step = step.map_err(|error| unreadable(&error))?;
                    self.operations.push(&step).map_err(off_surface)?;
                }
                None => {
                    self.is_read = true;
                    self.operations.finish().map_err(off_surface)?;
                }
            }
        }
    }
}

fn off_surface((line, cause): OffSurface) -> PlanError {
    PlanError::Unreachable { line, place: Place { stroke: 0, time: 0.0 }, cause }
}

fn unreadable(error: &JobError) -> PlanError {
    let line = error.position().map_or(0, |(line, _)| line);
    PlanError::Unreadable { line, message: error.to_string() }
}
