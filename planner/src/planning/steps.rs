//! The next thing that a job does.

use machine::Mechanism;
use messages::time::SETPOINT_TIME;
use nalgebra::Vector3;

use super::account::widen;
use super::refusals::too_short;
use super::{Draft, Planning, drawn};
use crate::error::PlanError;
use crate::geometry::operation::OperationKind;
use crate::joint_space::joint_move::JointMove;
use crate::joint_space::route::{Router, still};
use crate::limits::limit_id::LimitId;
use crate::limits::tightening::Tightening;
use crate::trajectory::{Errand, Motion, Piece};

/// Rest before a pause [s], so that the springs of the transmission have settled.
const PAUSE_REST: f64 = 0.1;

/// The longest part of a rest that is one window [s].
const LONGEST_REST: f64 = 2.0;

impl<'a, const N: usize, M: Mechanism<N>> Planning<'a, N, M> {
    /// Adds the next stretch of motion to `draft`. Says whether there was any left.
    pub(super) fn advance(&mut self, draft: &mut Draft<'_>) -> Result<bool, PlanError> {
        if self.front.standing > 0.0 {
            self.stand(self.front.standing, draft);
            return Ok(true);
        }
        if self.front.run.is_some() {
            self.go_on(draft)?;
            return Ok(true);
        }
        if let Some(part) = self.front.parts.pop_front() {
            self.front.line = part.line;
            self.begin_path(part, draft)?;
            return Ok(true);
        }
        let Some(operation) = self.operations.get(self.front.next)?.cloned() else {
            self.halt(draft)?;
            return Ok(false);
        };
        self.front.next += 1;
        self.front.line = operation.line;
        match &operation.kind {
            OperationKind::Path(contour) => {
                let before = self.front.lowest[1].min(self.front.place.z);
                self.front.lowest = [before, f64::INFINITY];
                self.note_rapid(&contour.start().point);
                self.front.estimated += self.estimate_of(contour);
                self.go_as_low_as(contour);
                let contour = self.with_next_parts(contour.clone())?;
                self.front.place = contour.end().point;
                self.begin_path(contour, draft)?;
            }
            OperationKind::Rapid(to) => {
                self.note_rapid(to);
                self.go_to(*to, draft)?;
            }
            OperationKind::Rest(time) => {
                self.front.estimated += time;
                self.halt(draft)?;
                if *time > 0.0 {
                    self.stand(*time, draft);
                }
            }
            OperationKind::Dot(dot) => {
                self.note_rapid(&dot.at);
                self.go_to(dot.at, draft)?;
                let start = self.front.time;
                let light = &mut self.front.light;
                light.dot(start, &dot.exposures, operation.line).map_err(too_short)?;
                draft.strokes.push(drawn::dot(&dot.at, operation.line));
                let powers = dot.exposures.iter().map(|(_, power)| *power);
                powers.for_each(|power| widen(&mut draft.power, power));
                let time = dot.exposures.iter().map(|(time, _)| time).sum();
                self.front.estimated += time;
                self.stand(time, draft);
            }
            OperationKind::Frequency(frequency) => {
                self.halt(draft)?;
                let change = self.change(draft);
                draft.trajectory.frequencies.push((change, *frequency));
            }
            OperationKind::Output { bit, on } => {
                self.halt(draft)?;
                let mask = 1_u64.checked_shl(*bit).unwrap_or(0);
                let outputs = self.front.outputs;
                self.front.outputs = if *on { outputs | mask } else { outputs & !mask };
                let change = self.change(draft);
                draft.trajectory.outputs.push((change, self.front.outputs));
            }
            OperationKind::Pause => {
                self.halt(draft)?;
                // One cycle before the end, so that the sample that pauses is at rest.
                draft.trajectory.pauses.push(self.front.time + PAUSE_REST - SETPOINT_TIME);
                self.stand(PAUSE_REST, draft);
            }
        }
        Ok(true)
    }

    /// Adds a piece of motion.
    pub(super) fn push(
        &mut self,
        duration: f64,
        motion: Motion,
        stroke: u64,
        draft: &mut Draft<'_>,
    ) {
        let line = self.front.line;
        let start = self.front.time;
        match &motion {
            Motion::Flight(flight) => {
                let position = flight.at(duration / 2.0).position.into();
                draft.bound.add(LimitId::DARK_TURN, duration, line, position);
            }
            Motion::Joints(JointMove { law: Some(law), .. })
            | Motion::Path { law, errand: Errand::Dark | Errand::Rapid, .. } => {
                for part in law.binding() {
                    draft.bound.add(LimitId(part.limit), part.duration, line, [0.0; 3]);
                }
            }
            _ => {}
        }
        draft.trajectory.pieces.push(Piece { start, duration, motion, line, stroke });
        self.front.time += duration;
    }

    /// Stands where the joints are, now and in as many of the next windows as `duration` takes [s].
    fn stand(&mut self, duration: f64, draft: &mut Draft<'_>) {
        let now = duration.min(LONGEST_REST);
        self.front.standing = duration - now;
        let rest = JointMove::standing(&self.front.now.joints, self.front.now.branch);
        let stroke = self.front.light.stroke;
        self.push(now, Motion::Rest(rest), stroke, draft);
    }

    /// Rests before and after a change, a control cycle each, so that each of several is seen. The stream
    /// time of the change [s].
    fn change(&mut self, draft: &mut Draft<'_>) -> f64 {
        let rest = self.task.machine.realtime.period.seconds().max(SETPOINT_TIME);
        let change = self.front.time + rest;
        self.stand(2.0 * rest, draft);
        change
    }

    /// Comes to rest, then goes to `to` in the dark.
    fn go_to(&mut self, to: Vector3<f64>, draft: &mut Draft<'_>) -> Result<(), PlanError> {
        self.halt(draft)?;
        let approach = self.router(draft.shares).approach(&still(to), &[]);
        let approach = approach.map_err(|cause| self.refusal(cause))?;
        if let Some((duration, motion)) = approach.motion {
            self.push(duration, motion, self.front.light.stroke, draft);
        }
        self.front.now = approach.start;
        self.settle_at(&still(to))?;
        Ok(())
    }

    /// Puts the joints where the tool's motion says, which the last move led to.
    pub(super) fn settle_at(
        &mut self,
        tool: &machine::kinematics::ToolMotion,
    ) -> Result<(), PlanError> {
        let now = self.joints_at(tool, &self.front.now);
        self.front.now = now.map_err(|cause| self.refusal(cause))?;
        Ok(())
    }

    pub(super) fn router<'r>(&'r self, shares: &'r Tightening) -> Router<'r, 'a, N, M> {
        Router { limits: &self.limits, area: self.area, shares, now: self.front.now }
    }
}
