//! The beginning of a path: how the tool comes to its start, and at which speed.

use std::sync::Arc;

use machine::Mechanism;

use super::{Draft, Planning};
use crate::drawing::Note;
use crate::error::{Place, PlanError};
use crate::geometry::contour::Contour;
use crate::joint_space::configuration::{Refused, trail};
use crate::joint_space::unwind::divide;
use crate::limits::motion_limits::Scope;
use crate::verify::checker::{LimitViolation, Quantity};

/// Notes of paths that are divided, at most.
const MOST_NOTES: usize = 100;

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// Begins a path and times its first window.
    pub(super) fn begin_path(
        &mut self,
        contour: Arc<Contour>,
        draft: &mut Draft<'_>,
    ) -> Result<(), PlanError> {
        self.stays_inside(&contour)?;
        let speeds = self.speed_limits(&contour);
        let fastest = speeds.iter().map(|speed| speed.speed).fold(0.0, f64::max);
        // Told before all of it is timed and sampled.
        let duration = self.front.time + contour.length() / fastest;
        if duration.is_nan() || duration >= super::LONGEST {
            return Err(PlanError::TooLong { duration });
        }
        if contour.is_entered_at_speed() {
            self.begin_constant(contour, draft)
        } else {
            self.begin_from_rest(contour, draft)
        }
    }

    /// That what is drawn lies within the area: told by the tool's place before anything is told by
    /// joints.
    pub(super) fn stays_inside(&self, contour: &Contour) -> Result<(), PlanError> {
        /// How far a chord may lie from the curve [m].
        const CHORD: f64 = 1e-5;
        /// Rounding at the edge [m].
        const ROUNDING: f64 = 1e-9;
        if self.limits.scope == Scope::PathAlone {
            return Ok(());
        }
        let (lower, upper) = (&self.area.lower, &self.area.upper);
        let mut outside = None;
        contour.visit(0.0, contour.length(), CHORD, &mut |point| {
            outside = (0..3).find_map(|row| {
                let limit = point[row].clamp(lower[row], upper[row]);
                ((point[row] - limit).abs() > ROUNDING).then_some((row, point[row], limit))
            });
            outside.is_none()
        });
        let Some((row, value, limit)) = outside else { return Ok(()) };
        let time = self.front.time;
        let place = Place { stroke: self.front.light.stroke + 1, time };
        let quantity = Quantity::ToolPosition(row);
        let violation = LimitViolation { time, axis: None, quantity, value, limit, unit: "m" };
        Err(PlanError::Limit { line: contour.line, place, violation, zero: None })
    }

    /// A path from rest to rest.
    fn begin_from_rest(
        &mut self,
        contour: Arc<Contour>,
        draft: &mut Draft<'_>,
    ) -> Result<(), PlanError> {
        self.halt(draft)?;
        let path = contour.trace(None, &self.limits.path);
        let length = path.length();
        let along = |share: f64| path.tool(length * share, [1.0, 0.0, 0.0]);
        let first = along(0.0);
        let found = self.router(draft.shares).approach(&first, &[&along]);
        let approach = match found {
            Ok(approach) => approach,
            Err(cause) => return self.in_parts(&contour, cause, draft),
        };
        if let Some((duration, motion)) = approach.motion {
            let stroke = self.front.light.stroke + u64::from(contour.is_lit());
            self.push(duration, motion, stroke, draft);
        }
        self.front.now = approach.start;
        self.settle_at(&first)?;
        let trail = trail(&self.limits, &self.front.now, &path)
            .map_err(|cause| self.refusal(Refused::Kinematics(cause)))?;
        let speeds = self.speed_limits(&contour);
        self.front.run = Some(self.run(contour, path, trail, speeds));
        self.go_on(draft)
    }

    /// Divides a path for which a table cannot turn far enough, or says why it cannot be gone.
    pub(super) fn in_parts(
        &mut self,
        contour: &Arc<Contour>,
        cause: Refused,
        draft: &mut Draft<'_>,
    ) -> Result<(), PlanError> {
        let Refused::Position { axis, .. } = cause else { return Err(self.refusal(cause)) };
        let Some(parts) = divide(&self.limits, &self.front.now.joints, contour, axis) else {
            return Err(self.refusal(cause));
        };
        let text = format!(
            "marked in {} parts: between them an axis is turned back in the dark, whose travel is less \
             than the stroke winds up",
            parts.len()
        );
        if self.account.notes.len() < MOST_NOTES {
            draft.notes.push(Note { line: contour.line, text });
        }
        self.front.parts.extend(parts.into_iter().map(Arc::new));
        self.front.goes_on = false;
        Ok(())
    }
}
