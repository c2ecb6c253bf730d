//! The operations of a job, made of its steps as they are asked for, and kept as long as they may be
//! asked for again.

use std::collections::VecDeque;
use std::sync::Arc;

use crate::drawing::{Note, Step};
use crate::error::{Place, PlanError};
use crate::geometry::contour::Contour;
use crate::geometry::operation::{OffSurface, Operation, OperationKind};
use crate::geometry::operations::Operations;
use crate::job::JobError;

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
    /// The stroke to begin with, from 1, and how many have been passed over.
    begins: u64,
    passed: u64,
}

impl<'a> OperationQueue<'a> {
    /// Of `steps`, which `operations` takes.
    pub(crate) fn new(steps: Steps<'a>, operations: Operations<'a>) -> Self {
        let made = VecDeque::new();
        Self { steps, operations, made, first: 0, is_read: false, begins: 1, passed: 0 }
    }

    /// Begins with the path that has this stroke, from 1, in it; what is marked before is left out.
    pub(crate) fn beginning_with(self, begins: u64) -> Self {
        Self { begins, ..self }
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

    /// Strokes that were passed over before the first.
    pub(crate) fn passed(&self) -> u64 {
        self.passed
    }

    /// What a person should know of what has been made so far.
    pub(crate) fn notes(&self) -> &[Note] {
        &self.operations.notes
    }

    fn make(&mut self) -> Result<Option<Operation>, PlanError> {
        loop {
            if let Some(operation) = self.operations.next() {
                if self.is_passed_over(&operation) {
                    continue;
                }
                return Ok(Some(operation));
            }
            if self.is_read {
                return Ok(None);
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

impl OperationQueue<'_> {
    /// Whether an operation comes before the stroke to begin with; outputs and frequencies are set all the
    /// same.
    fn is_passed_over(&mut self, operation: &Operation) -> bool {
        if self.passed + 1 >= self.begins {
            return false;
        }
        let strokes = match &operation.kind {
            OperationKind::Output { .. } | OperationKind::Frequency(_) => return false,
            OperationKind::Path(contour) => contour.strokes(),
            OperationKind::Dot(_) => 1,
            OperationKind::Rapid(_) | OperationKind::Rest(_) | OperationKind::Pause => 0,
        };
        if strokes > 0 && self.passed + strokes >= self.begins {
            // The next ones are all marked.
            self.begins = 0;
            return false;
        }
        self.passed += strokes;
        true
    }
}

fn off_surface((line, cause): OffSurface) -> PlanError {
    PlanError::Unreachable { line, place: Place { stroke: 0, time: 0.0 }, cause }
}

fn unreadable(error: &JobError) -> PlanError {
    let line = error.position().map_or(0, |(line, _)| line);
    PlanError::Unreadable { line, message: error.to_string() }
}
