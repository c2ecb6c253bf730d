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

/// `error` with the line of the very step that leaves the area, of all that are followed in one go, how far
/// that leads, and where the program has its zero.
pub(super) fn at_its_step(mut error: PlanError, job: &Job) -> PlanError {
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
        let points = match &step.action {
            Action::Mark { curve, .. } | Action::Feed { curve, .. } => {
                let mut points = vec![curve.from().into()];
                Track::new(curve).sample(CHORD, &mut points);
                points
            }
            Action::Trace { points, .. } => {
                let chords = bezier::samples(points, bezier::chords(points, CHORD));
                core::iter::once(points[0]).chain(chords).map(Into::into).collect()
            }
            Action::Follow { path, .. } => path.points(CHORD),
            Action::Rapid { to } => vec![(*to).into()],
            _ => return None,
        };
        let farthest = points.iter().map(beyond).fold(0.0, f64::max);
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
