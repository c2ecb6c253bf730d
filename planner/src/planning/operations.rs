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
}

impl<'a> OperationQueue<'a> {
    /// Of `steps`, which `operations` takes.
    pub(crate) fn new(steps: Steps<'a>, operations: Operations<'a>) -> Self {
        Self { steps, operations, made: VecDeque::new(), first: 0, is_read: false }
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

    /// What a person should know of what has been made so far.
    pub(crate) fn notes(&self) -> &[Note] {
        &self.operations.notes
    }

    fn make(&mut self) -> Result<Option<Operation>, PlanError> {
        loop {
            if let Some(operation) = self.operations.next() {
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

fn off_surface((line, cause): OffSurface) -> PlanError {
    PlanError::Unreachable { line, place: Place { stroke: 0, time: 0.0 }, cause }
}

fn unreadable(error: &JobError) -> PlanError {
    let line = error.position().map_or(0, |(line, _)| line);
    PlanError::Unreadable { line, message: error.to_string() }
}
