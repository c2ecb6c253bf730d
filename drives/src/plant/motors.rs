//! The motors' data in vectors, an entry for each axis.

use machine::{Axis, DcMotor};
use nalgebra::SVector;

use super::winding::Windings;

/// Times that are no more apart than this are the same, rounding left out [s].
const SAME_TIME: f64 = 1e-9;

/// What the motors are made of, one entry each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motors<const N: usize> {
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
    /// The motors of `axes`, of which there are `N`.
    pub fn of(axes: &[Axis; N]) -> Self {
        let each = |value: fn(&Axis) -> f64| SVector::from_fn(|row, _| value(&axes[row]));
        Self {
            windings: Windings::new(core::array::from_fn(|row| dc(&axes[row]))),
            inertia: each(|axis| axis.motor.rotor_inertia()),
            coulomb: each(|axis| axis.friction.coulomb),
            sliding: each(|axis| axis.friction.coulomb),
            brake: each(|axis| axis.brake.torque),
            release: each(|axis| axis.brake.release),
            viscous: each(|axis| axis.friction.viscous),
            ratio: each(|axis| axis.ratio),
            gap: each(|axis| axis.backlash / 2.0),
            voltage: each(|axis| dc(axis).voltage),
            current: each(|axis| dc(axis).current),
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

/// The DC motor of `axis`, or what stands for it in a stepper: a winding without current and torque.
fn dc(axis: &Axis) -> DcMotor {
    const NONE: DcMotor = DcMotor {
        resistance: 1.0,
        inductance: 1.0,
        torque_constant: 0.0,
        rotor_inertia: 0.0,
        voltage: 0.0,
        current: 0.0,
        continuous_current: None,
    };
    axis.motor.dc().copied().unwrap_or(NONE)
}
