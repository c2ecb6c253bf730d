//! The operations of a job, made of its steps as they are asked for, and kept as long as they may be
//! asked for again.

use std::collections::VecDeque;
use std::sync::Arc;

use machine::PathLimits;

use crate::drawing::{Note, Step};
use crate::error::{Place, PlanError};
use crate::geometry::contour::{Contour, GAP};
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
    /// What is passed over, until the stroke to begin with comes.
    passes: Option<Passing>,
    /// Strokes that were passed over before it.
    passed: u64,
}

/// Passes over what comes before a stroke.
struct Passing {
    /// The stroke to begin with, from 1, and how many have been passed over.
    begins: u64,
    passed: u64,
    /// Whether the last path was lit at its end.
    was_lit: bool,
    limits: PathLimits,
}

impl<'a> OperationQueue<'a> {
    /// Of `steps`, which `operations` takes.
    pub(crate) fn new(steps: Steps<'a>, operations: Operations<'a>) -> Self {
        let made = VecDeque::new();
        Self { steps, operations, made, first: 0, is_read: false, passes: None, passed: 0 }
    }

    /// Begins with this stroke, from 1; what is marked before is left out. `limits` are those of paths.
    pub(crate) fn beginning_with(self, begins: u64, limits: &PathLimits) -> Self {
        let passes = Passing { begins, passed: 0, was_lit: false, limits: *limits };
        Self { passes: (begins > 1).then_some(passes), ..self }
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
        self.passes.as_ref().map_or(self.passed, |passing| passing.passed)
    }

    /// What a person should know of what has been made so far.
    pub(crate) fn notes(&self) -> &[Note] {
        &self.operations.notes
    }

    fn make(&mut self) -> Result<Option<Operation>, PlanError> {
        loop {
            if let Some(operation) = self.operations.next() {
                match &mut self.passes {
                    None => return Ok(Some(operation)),
                    Some(passing) => match passing.pass(operation) {
                        Passed::Over => continue,
                        Passed::On(operation) => return Ok(Some(operation)),
                        Passed::Begun(operation) => {
                            self.passed = passing.passed;
                            self.passes = None;
                            return Ok(Some(operation));
                        }
                    },
                }
            }
            if self.is_read {
                return match &self.passes {
                    None => Ok(None),
                    Some(Passing { begins, passed, .. }) => {
                        Err(PlanError::NoStroke { asked: *begins, strokes: *passed })
                    }
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

/// What comes of an operation before the stroke to begin with.
enum Passed {
    /// It is left out.
    Over,
    /// It is done all the same.
    On(Operation),
    /// It begins with the stroke.
    Begun(Operation),
}

impl Passing {
    fn pass(&mut self, operation: Operation) -> Passed {
        let line = operation.line;
        match &operation.kind {
            OperationKind::Output { .. } | OperationKind::Frequency(_) => Passed::On(operation),
            OperationKind::Rapid(_) | OperationKind::Rest(_) | OperationKind::Pause => Passed::Over,
            OperationKind::Dot(_) => {
                self.passed += 1;
                if self.passed == self.begins { Passed::Begun(operation) } else { Passed::Over }
            }
            OperationKind::Path(contour) => {
                let was_lit = self.was_lit && contour.goes_on_from_before();
                self.was_lit = contour.ends_lit();
                let before = (self.begins - self.passed - 1) as usize;
                let Some(demand) = contour.strokes(was_lit).nth(before) else {
                    self.passed += contour.strokes(was_lit).count() as u64;
                    return Passed::Over;
                };
                if demand.from <= GAP && !contour.goes_on_from_before() {
                    return Passed::Begun(operation);
                }
                let line = if demand.line == 0 { line } else { demand.line };
                match contour.rest_from(demand.from, &self.limits) {
                    Some(rest) => {
                        let kind = OperationKind::Path(Arc::new(rest));
                        Passed::Begun(Operation { kind, line })
                    }
                    // Shorter than anything that is marked.
                    None => Passed::Over,
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
