//! What it means that a job cannot be done, with its place.

use machine::Mechanism;

use super::Planning;
use crate::drawing::{Action, Step};
use crate::error::{Place, PlanError};
use crate::geometry::bezier;
use crate::geometry::track::Track;
use crate::job::Job;
use crate::joint_space::configuration::Refused;
use crate::light::exposure::TooShort;
use crate::sampling::sampler::Unreachable;
use crate::verify::checker::{LimitViolation, Quantity};

/// What it means that light is too short for the source.
pub(super) fn too_short(TooShort { line, duration }: TooShort) -> PlanError {
    PlanError::TooShort { line, duration }
}

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    fn place(&self, time: f64) -> (u64, Place) {
        let piece = self.front.sampler.piece_at(time);
        let stroke = piece.map_or(0, |piece| piece.stroke);
        (piece.map_or(0, |piece| piece.line), Place { stroke, time })
    }

    pub(super) fn limit(&self, violation: LimitViolation) -> PlanError {
        let (line, place) = self.place(violation.time);
        PlanError::Limit { line, place, violation, zero: None }
    }

    pub(super) fn unreachable(&self, found: Unreachable) -> PlanError {
        let (line, place) = self.place(found.time);
        PlanError::Unreachable { line, place, cause: found.cause }
    }

    /// What it means that nothing can be done from where the job is now.
    pub(super) fn refusal(&self, cause: Refused) -> PlanError {
        let line = self.front.line;
        let time = self.duration();
        let place = Place { stroke: self.front.light.stroke + 1, time };
        match cause {
            Refused::Kinematics(cause) => PlanError::Unreachable { line, place, cause },
            Refused::NoConfiguration { tried } => PlanError::NoConfiguration { line, place, tried },
            Refused::Position { axis, value, limit } => {
                let axis = self.limits.axes.get(axis);
                let unit = axis.map_or("", |axis| axis.unit.name());
                let axis = axis.map(|axis| axis.name.clone());
                let quantity = Quantity::JointPosition;
                let violation =
                    LimitViolation { time: place.time, axis, quantity, value, limit, unit };
                PlanError::Limit { line, place, violation, zero: None }
            }
        }
    }
}

/// `error` with its cause: a drawing that is larger than the area; or the very step that leaves the area, of all
/// that are followed in one go.
pub(super) fn explained(error: PlanError, job: &Job) -> PlanError {
    let is_of_place = match &error {
        PlanError::Unreachable { .. } | PlanError::NoConfiguration { .. } => true,
        PlanError::Limit { violation, .. } => {
            matches!(violation.quantity, Quantity::ToolPosition(0 | 1) | Quantity::JointPosition)
        }
        _ => false,
    };
    match job.too_large {
        Some(found) if is_of_place => PlanError::TooLarge(found),
        _ => at_its_step(error, job),
    }
}

/// `error` with the line of the very step that leaves the area, of all that are followed in one go, how far
/// that leads, and where the program has its zero.
fn at_its_step(mut error: PlanError, job: &Job) -> PlanError {
    /// How far a chord may lie from the curve [m].
    const CHORD: f64 = 1e-5;
    let PlanError::Limit { line, violation, zero, .. } = &mut error else { return error };
    let LimitViolation { quantity: Quantity::ToolPosition(row), value, limit, .. } = *violation
    else {
        return error;
    };
    if job.surface.is_some() {
        return error;
    }
    *zero = job.survey.as_ref().and_then(|survey| survey.zero).map(Box::new);
    let beyond = |point: &[f64; 3]| (point[row] - limit) * (value - limit).signum();
    // How far a step goes beyond: by less than a fitted curve strays it does not.
    let leaves = |step: Step| {
        let mut farthest = 0.0_f64;
        let mut take = |point: [f64; 3]| {
            farthest = farthest.max(beyond(&point));
            true
        };
        match &step.action {
            Action::Mark { curve, .. } | Action::Feed { curve, .. } => {
                take(curve.from().into());
                // Of a much bent curve there are more points than memory should hold.
                Track::new(curve).visit(CHORD, &mut take);
            }
            Action::Trace { points, .. } => {
                let chords = bezier::samples(points, bezier::chords(points, CHORD));
                core::iter::once(points[0]).chain(chords).for_each(|point| {
                    take(point.into());
                });
            }
            Action::Follow { path, .. } => path.points(CHORD).into_iter().for_each(|point| {
                take(point);
            }),
            Action::Rapid { to } => {
                take((*to).into());
            }
            _ => return None,
        }
        (farthest > (value - limit).abs() / 2.0).then_some((step.line, farthest))
    };
    let steps = job.steps().into_iter().flatten().map_while(Result::ok);
    let mut near = steps.skip_while(|step| step.line < *line);
    if let Some((step, farthest)) = near.find_map(leaves) {
        *line = step;
        violation.value = limit + farthest * (value - limit).signum();
    }
    error
}
