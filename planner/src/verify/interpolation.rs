//! How far the tool strays from the drawn path between two setpoints, where its joints do not go
//! straight with it.
//!
//! Setpoints are exact, a millisecond apart; between them the controller joins their positions and
//! velocities by a cubic for each joint. The tool then leaves the path by what the fourth derivative of
//! the joints makes in that time: nanometres, except where the joints turn fast, as beside the centre
//! of a rotary table.

use machine::Mechanism;
use machine::kinematics::{Joints, KinematicsError};
use machine::path_check::Aim;
use machine::surface::Surface;
use messages::Setpoint;
use messages::plan::InterpolationFacts;
use messages::time::SETPOINT_TIME;

use crate::sampling::sampler::Sampler;
use crate::trajectory::{Errand, Motion, Piece};
use crate::verify::checker::{LimitViolation, Quantity};

/// Looks at the middle between two setpoints that follow each other, where a cubic that fits both
/// ends strays most.
#[derive(Debug, Clone)]
pub(crate) struct InterpolationCheck {
    /// How far the tool may stray [m].
    tolerance: f64,
    /// What it marks on.
    surface: Option<Surface>,
    before: Option<Setpoint>,
    found: InterpolationFacts,
}

impl InterpolationCheck {
    /// Allows the tool to stray by `tolerance` [m] from a path, on `surface` if it lies on one.
    pub(crate) fn new(tolerance: f64, surface: Option<Surface>) -> Self {
        let found =
            InterpolationFacts { surface: surface.map(|_| 0.0), ..InterpolationFacts::default() };
        Self { tolerance, surface, before: None, found }
    }

    /// How far it has strayed so far.
    pub(crate) fn found(&self) -> &InterpolationFacts {
        &self.found
    }

    /// Looks between the setpoint before and this one of `trajectory`, the last that `sampler` has
    /// made, if a stroke is marked there. Gives the violation where the tool strays too far.
    ///
    /// # Errors
    /// Where a chain does not close.
    pub(crate) fn check<const N: usize, M: Mechanism<N>>(
        &mut self,
        setpoint: &Setpoint,
        sampler: &Sampler<N, M>,
    ) -> Result<Option<LimitViolation>, KinematicsError> {
        let Some(before) = self.before.replace(*setpoint) else { return Ok(None) };
        let time = (before.sequence as f64 + 0.5) * SETPOINT_TIME;
        // Where light falls, and not where the source is told to begin and to end.
        let marks =
            |piece: &Piece| matches!(piece.motion, Motion::Path { errand: Errand::Marks, .. });
        let Some(piece) = sampler.piece_at(time).filter(|piece| marks(piece)) else {
            return Ok(None);
        };
        let Some(tool) = sampler.tool_at(time)? else { return Ok(None) };
        let wanted = Aim::of(&tool.pose());
        let there = Aim::of(&sampler.locate(&between(&before, setpoint, 0.5))?);
        // From where it should be at that time: never less than from the path.
        let value = (there.position - wanted.position).norm();
        if value > self.found.deviation {
            (self.found.deviation, self.found.line) = (value, piece.line);
        }
        self.found.axis = self.found.axis.max(there.angle(&wanted));
        if let Some(surface) = &self.surface {
            let height = surface.height(<[f64; 3]>::from(there.position))?.abs();
            self.found.surface = self.found.surface.map(|most| most.max(height));
        }
        if value <= self.tolerance {
            return Ok(None);
        }
        let (value, limit) = (value * 1e6, self.tolerance * 1e6);
        let quantity = Quantity::PathDeviation;
        Ok(Some(LimitViolation { time, axis: None, quantity, value, limit, unit: "µm" }))
    }
}

/// The joints at a `share` of the cycle, on the cubic that has the positions and velocities of both ends.
pub(crate) fn between<const N: usize>(from: &Setpoint, to: &Setpoint, share: f64) -> Joints<N> {
    let rest = 1.0 - share;
    let (before, after) = (rest * rest * (1.0 + 2.0 * share), share * share * (1.0 + 2.0 * rest));
    let (leaving, coming) =
        (rest * rest * share * SETPOINT_TIME, share * share * rest * SETPOINT_TIME);
    Joints::from_fn(|axis, _| {
        from.position[axis] * before + to.position[axis] * after + from.velocity[axis] * leaving
            - to.velocity[axis] * coming
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use machine::{Machine, MechanismVisitor};

    use super::*;
    use crate::{Job, Plan};

    /// Checks between all setpoints of a plan, allowing so much.
    struct CheckAll<'a>(&'a Plan, f64);

    impl MechanismVisitor for CheckAll<'_> {
        type Output = Result<(), LimitViolation>;

        fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
            let Self(plan, tolerance) = self;
            let mut sampler = crate::plan::sampler(plan, mechanism, 1).unwrap();
            let mut check = InterpolationCheck::new(tolerance, None);
            while let Some(setpoint) = sampler.next() {
                if let Some(violation) = check.check(&setpoint, &sampler).unwrap() {
                    return Err(violation);
                }
            }
            Ok(())
        }
    }

    /// On the letters a five-bar strays by a nanometre or less: by the fourth derivative of its joints over
    /// 384 times the fourth power of a millisecond, and by what the steps of the jerk add.
    #[test]
    fn the_tool_strays_by_nanometres_between_setpoints_and_that_is_told() {
        let text = include_str!("../../../machines/five_bar.toml");
        let machine = Machine::parse("five_bar.toml", text, &[]).unwrap();
        let job = Job::builtin(&[], &machine).unwrap();
        let plan = crate::plan(&machine, &job).unwrap();
        let check = |tolerance| machine.mechanism.visit(CheckAll(&plan, tolerance));
        check(5e-9).unwrap();
        let violation = check(1e-10).unwrap_err();
        assert_eq!((violation.quantity, violation.unit), (Quantity::PathDeviation, "µm"));
        assert!((violation.limit - 1e-4).abs() < 1e-15, "{violation:?}");
        assert!(violation.value > 1e-4 && violation.value < 5e-3, "{violation:?}");
        assert!(!violation.quantity.is_place(), "a slower stroke strays less");
        // Half a cycle after a setpoint.
        assert!(((violation.time * 1e3).fract() - 0.5).abs() < 1e-6, "{violation:?}");
    }
}
