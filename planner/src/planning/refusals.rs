//! What it means that a job cannot be done, with its place.

use machine::Mechanism;

use super::Planning;
use crate::error::{Place, PlanError};
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
