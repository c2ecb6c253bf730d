//! What is left of each limit to plan with, after the check of a stretch found more used than the
//! rows said: springs, gaps and inductances remember what came before.

use crate::verify::checker::{LimitViolation, Quantity};

/// How far below a limit a stretch is planned that broke it.
const BELOW: f64 = 0.997;

/// The share that one round of tightening leaves at most, and at least.
const ROUND: [f64; 2] = [0.5, 0.995];

/// Fractions of the tool's acceleration and jerk to plan with where a profile keeps its limits at grid points
/// only, since it may exceed them a little between two.
const BY_PLACES: [f64; 2] = [0.999, 0.997];

/// Shares of the limits that a stretch is planned with [1].
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tightening {
    pub(crate) speed: f64,
    pub(crate) acceleration: f64,
    pub(crate) jerk: f64,
    pub(crate) axes: Vec<AxisShares>,
}

/// The same of one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AxisShares {
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
    pub(crate) jerk: f64,
    pub(crate) torque: f64,
    pub(crate) voltage: f64,
}

impl Tightening {
    /// All of every limit.
    pub(crate) fn all(axes: usize) -> Self {
        let all =
            AxisShares { velocity: 1.0, acceleration: 1.0, jerk: 1.0, torque: 1.0, voltage: 1.0 };
        Self { speed: 1.0, acceleration: 1.0, jerk: 1.0, axes: vec![all; axes] }
    }

    /// All of the tool's limits; of those of the axes all but for what a law may be beyond its rows
    /// between the places where it is held to them.
    pub(crate) fn none(axes: usize) -> Self {
        let all = AxisShares {
            velocity: 0.9995,
            acceleration: 0.998,
            jerk: 0.995,
            torque: 0.998,
            voltage: 0.998,
        };
        Self { speed: 1.0, acceleration: 1.0, jerk: 1.0, axes: vec![all; axes] }
    }

    /// Shares of the tool's acceleration and jerk for a law that is held to its rows at places only,
    /// between which it may be a little beyond them.
    pub(crate) fn by_places(&self) -> [f64; 2] {
        [BY_PLACES[0] * self.acceleration, BY_PLACES[1] * self.jerk]
    }

    /// Leaves less of what `violation` says was broken. `index` is that of its axis.
    pub(crate) fn tighten(&mut self, violation: &LimitViolation, index: Option<usize>) {
        let used = violation.value.abs() / violation.limit;
        let share = (BELOW / used).clamp(ROUND[0], ROUND[1]);
        let share = if share.is_finite() { share } else { ROUND[0] };
        let axis = index.and_then(|index| self.axes.get_mut(index));
        match (violation.quantity, axis) {
            (Quantity::ToolSpeed, _) => self.speed *= share,
            (Quantity::ToolAcceleration, _) => self.acceleration *= share,
            (Quantity::ToolJerk, _) => self.jerk *= share,
            (Quantity::JointVelocity, Some(axis)) => axis.velocity *= share,
            (Quantity::JointAcceleration, Some(axis)) => axis.acceleration *= share,
            (Quantity::JointJerk, Some(axis)) => axis.jerk *= share,
            (Quantity::MotorCurrent | Quantity::MotorTorque, Some(axis)) => axis.torque *= share,
            (Quantity::MotorVoltage, Some(axis)) => axis.voltage *= share,
            (Quantity::PulseRate, Some(axis)) => axis.velocity *= share,
            _ => self.slow(0.85),
        }
    }

    /// The same with 1 % of the axes' limits in reserve. The way out of a path is planned with these, so that it
    /// still exists after the check of the samples has tightened a limit.
    pub(crate) fn with_reserve(&self) -> Self {
        /// What is left of each.
        const SHARE: f64 = 0.99;
        let mut shares = self.clone();
        for axis in &mut shares.axes {
            axis.velocity *= SHARE;
            axis.acceleration *= SHARE;
            axis.jerk *= SHARE;
            axis.torque *= SHARE;
            axis.voltage *= SHARE;
        }
        shares
    }

    /// The same with a part of the motors left to the loops, for moves that a mark may follow at once.
    pub(crate) fn with_room_for_loops(&self) -> Self {
        /// What of torque and voltage a move in the dark takes.
        const SHARE: f64 = 0.9;
        let mut shares = self.clone();
        for axis in &mut shares.axes {
            axis.torque *= SHARE;
            axis.voltage *= SHARE;
        }
        shares
    }

    /// Plays everything at `share` of its speed: accelerations by its square, jerks by its cube.
    pub(crate) fn slow(&mut self, share: f64) {
        let (square, cube) = (share * share, share * share * share);
        self.speed *= share;
        self.acceleration *= square;
        self.jerk *= cube;
        for axis in &mut self.axes {
            axis.velocity *= share;
            axis.acceleration *= square;
            axis.jerk *= cube;
        }
    }
}
