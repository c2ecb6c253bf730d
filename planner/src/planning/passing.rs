//! Passes over what a job marks before the place that it is to begin with: a stroke, and so far along it.

use std::sync::Arc;

use machine::PathLimits;

use crate::error::PlanError;
use crate::geometry::contour::{Contour, GAP, Light};
use crate::geometry::operation::{Operation, OperationKind};

/// What was passed over before the first stroke.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct PassedOver {
    /// Whole strokes and dots.
    pub(crate) strokes: u64,
    /// The beginning of the stroke that is marked first [m].
    pub(crate) along: f64,
}

/// What comes of an operation before the place to begin with.
pub(super) enum Passed {
    /// It is left out.
    Over,
    /// It is done all the same.
    On(Operation),
    /// It begins with the place.
    Begun(Operation),
}

/// Passes over what comes before a place.
pub(super) struct Passing {
    /// The stroke to begin with, from 1, and how much of it is left out [m].
    begins: u64,
    along: f64,
    /// Strokes that have been passed over.
    passed: u64,
    /// Whether the last path was lit at its end.
    was_lit: bool,
    /// How much of the stroke to begin with is still to be left out, where it may go on with the next path [m].
    inside: Option<f64>,
    limits: PathLimits,
}

impl Passing {
    pub(super) fn new(begins: u64, along: f64, limits: &PathLimits) -> Self {
        Self { begins, along, passed: 0, was_lit: false, inside: None, limits: *limits }
    }

    pub(super) fn passed(&self) -> PassedOver {
        PassedOver { strokes: self.passed, along: self.along }
    }

    /// Why the job has come to its end before the place.
    pub(super) fn not_found(&mut self) -> PlanError {
        let missing = |it: &Self| PlanError::NoStroke { asked: it.begins, strokes: it.passed };
        self.leave().err().unwrap_or_else(|| missing(self))
    }

    /// Takes the next operation.
    ///
    /// # Errors
    /// A place beyond the end of its stroke.
    pub(super) fn pass(&mut self, operation: Operation) -> Result<Passed, PlanError> {
        match &operation.kind {
            OperationKind::Path(contour) => {
                let contour = contour.clone();
                return self.pass_path(operation, &contour);
            }
            OperationKind::Dot(_) => {
                self.leave()?;
                if !self.is_next() {
                    self.passed += 1;
                } else if self.along == 0.0 {
                    return Ok(Passed::Begun(operation));
                } else {
                    self.end(self.along)?;
                }
            }
            OperationKind::Output { .. } | OperationKind::Frequency(_) => {
                self.leave()?;
                return Ok(Passed::On(operation));
            }
            OperationKind::Rapid(_) | OperationKind::Rest(_) | OperationKind::Pause => {
                self.leave()?;
            }
        }
        self.was_lit = false;
        Ok(Passed::Over)
    }

    fn pass_path(
        &mut self,
        operation: Operation,
        contour: &Arc<Contour>,
    ) -> Result<Passed, PlanError> {
        let goes_on = contour.goes_on_from_before();
        let was_lit = core::mem::replace(&mut self.was_lit, contour.ends_lit()) && goes_on;
        for Light { from, to, line } in contour.lights() {
            let skip = match self.inside {
                Some(left) if was_lit && from == 0.0 => left,
                // It has been passed over where it began.
                None if was_lit && from == 0.0 => continue,
                _ => {
                    self.leave()?;
                    if !self.is_next() {
                        self.passed += 1;
                        continue;
                    }
                    self.along
                }
            };
            let place = from + skip;
            if place <= GAP && !goes_on {
                return Ok(Passed::Begun(operation));
            }
            let rest = (place < to - GAP).then(|| contour.rest_from(place, &self.limits)).flatten();
            if let Some(rest) = rest {
                let line = if line == 0 { operation.line } else { line };
                return Ok(Passed::Begun(Operation {
                    kind: OperationKind::Path(Arc::new(rest)),
                    line,
                }));
            }
            // The last light may go on with the next path.
            self.inside = Some((place - to).max(0.0));
        }
        Ok(Passed::Over)
    }

    /// Whether the next stroke is the one to begin with.
    fn is_next(&self) -> bool {
        self.passed + 1 == self.begins
    }

    /// The stroke to begin with does not go on, if it was passed at all.
    fn leave(&mut self) -> Result<(), PlanError> {
        self.inside.take().map_or(Ok(()), |left| self.end(left))
    }

    /// The stroke to begin with has ended before the place, by this much [m]: within the tolerance nothing of it is
    /// left, and the next one is meant.
    fn end(&mut self, left: f64) -> Result<(), PlanError> {
        if left > self.limits.tolerance.max(GAP) {
            let (stroke, asked) = (self.begins, self.along);
            return Err(PlanError::NoPlace { stroke, asked, length: asked - left });
        }
        self.passed = self.begins;
        (self.begins, self.along) = (self.begins + 1, 0.0);
        Ok(())
    }
}
