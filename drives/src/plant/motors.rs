//! The motors' data in vectors, an entry for each actuator, and entries that do nothing behind them.

use machine::{Actuator, Axis, DcMotor};
use nalgebra::SVector;

use super::winding::Windings;

/// Times that are no more apart than this are the same, rounding left out [s].
const SAME_TIME: f64 = 1e-9;

/// What the motors are made of, one entry each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motors<const N: usize> {
    /// Which joint each of them drives; 0 of those that are not there.
    pub joint: [usize; N],
    /// Share of the joint's spring that is behind each; 0 of those that are not there.
    pub share: SVector<f64, N>,
    /// The electrical part.
    pub windings: Windings<N>,
    /// Inertia at the shaft [kg·m²].
    pub inertia: SVector<f64, N>,
    /// Coulomb friction torque in force: that of the shaft, with its brake while that is closed [N·m].
    pub coulomb: SVector<f64, N>,
    /// Coulomb friction torque of the shaft [N·m].
    sliding: SVector<f64, N>,
    /// Torque of the brake [N·m], and how long it takes to open [s].
    brake: SVector<f64, N>,
    release: SVector<f64, N>,
    /// Viscous friction [N·m·s/rad].
    pub viscous: SVector<f64, N>,
    /// Joint units per radian.
    pub ratio: SVector<f64, N>,
    /// Half of the backlash [joint units].
    pub gap: SVector<f64, N>,
    /// Largest voltage of the power stage [V].
    pub voltage: SVector<f64, N>,
    /// Largest current that the power stage lets through [A].
    pub current: SVector<f64, N>,
}

impl<const N: usize> Motors<N> {
    /// The motors of `actuators`, of which there are `N` at most, and which drive `axes`.
    pub fn of(axes: &[Axis], actuators: &[Actuator]) -> Self {
        let gap =
            |actuator: &Actuator| axes.get(actuator.axis).map_or(0.0, |axis| axis.backlash / 2.0);
        let each = |value: fn(&Actuator) -> f64, none: f64| {
            SVector::from_fn(|row, _| actuators.get(row).map_or(none, value))
        };
        let coulomb = each(|actuator| actuator.friction.coulomb, 0.0);
        Self {
            joint: core::array::from_fn(|row| actuators.get(row).map_or(0, |it| it.axis)),
            share: each(|actuator| actuator.share, 0.0),
            windings: Windings::new(core::array::from_fn(|row| dc(actuators.get(row)))),
            inertia: each(|actuator| actuator.motor.rotor_inertia(), 1.0),
            coulomb,
            sliding: coulomb,
            brake: each(|actuator| actuator.brake.torque, 0.0),
            release: each(|actuator| actuator.brake.release, 0.0),
            viscous: each(|actuator| actuator.friction.viscous, 0.0),
            ratio: each(|actuator| actuator.ratio, 1.0),
            gap: SVector::from_fn(|row, _| actuators.get(row).map_or(0.0, gap)),
            voltage: each(|actuator| dc(Some(actuator)).voltage, 0.0),
            current: each(|actuator| dc(Some(actuator)).current, 0.0),
        }
    }

    /// Closes the brakes of motors that have been powered for `time` [s], `None` if they are not, and
    /// opens those that have had the time to.
    pub(super) fn power(&mut self, time: Option<f64>) {
        self.coulomb = SVector::from_fn(|row, _| {
            let opened = time.is_some_and(|time| time + SAME_TIME >= self.release[row]);
            self.sliding[row] + if opened { 0.0 } else { self.brake[row] }
        });
    }
}

/// The DC motor of `actuator`, or what stands for it in a stepper and where there is none: a winding
/// without current and torque.
fn dc(actuator: Option<&Actuator>) -> DcMotor {
    const NONE: DcMotor = DcMotor {
        resistance: 1.0,
        inductance: 1.0,
        torque_constant: 0.0,
        rotor_inertia: 0.0,
        voltage: 0.0,
        current: 0.0,
        continuous_current: None,
    };
    actuator.and_then(|actuator| actuator.motor.dc()).copied().unwrap_or(NONE)
}
