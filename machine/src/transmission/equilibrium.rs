//! Where motors at rest stand beside their joints: ahead by what the load makes of springs, gaps and
//! steppers' fields.

use crate::actuator::Actuator;
use crate::axis::Axis;
use crate::kinematics::{Joints, Mechanism};
use crate::motor::BeyondTorque;

/// Share of a motor's largest torque below which no side of the gap counts as loaded.
const UNLOADED: f64 = 1e-3;

/// Which side of its gap the transmission of `actuator` leans on under `effort` at the joint [N or N·m]:
/// 1, −1, or 0 where nothing presses it to either.
pub fn side(actuator: &Actuator, effort: f64) -> f64 {
    let least = UNLOADED * actuator.effort(actuator.motor.stall_torque());
    if effort.abs() <= least { 0.0 } else { effort.signum() }
}

/// How far rotors at rest are ahead of joints that bear `effort` [N or N·m], in joint units: by the
/// springs, and by half the backlash. The actuators of one axis, which share its springs, are as far ahead
/// as each other.
pub fn rotors_ahead<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    axes: &[Axis],
    actuators: &[Actuator],
    effort: &Joints<N>,
) -> Joints<N> {
    let compliance = mechanism.stiffness().and_then(|stiffness| stiffness.try_inverse());
    let mut ahead = compliance.map_or_else(Joints::zeros, |compliance| compliance * effort);
    for (index, axis) in axes.iter().enumerate().take(N) {
        let Some(first) = axis.driven_by(actuators).first() else { continue };
        ahead[index] += side(first, effort[index]) * axis.backlash / 2.0;
    }
    ahead
}

/// How far the field of `actuator` at rest is ahead of its rotor under `effort` at the joint [N or N·m],
/// of which it bears its share, in joint units; 0 of a DC motor.
///
/// # Errors
/// A torque that the stepper cannot hold.
pub fn field_ahead(actuator: &Actuator, effort: f64) -> Result<f64, BeyondTorque> {
    let Some(stepper) = actuator.motor.stepper() else { return Ok(0.0) };
    let Actuator { ratio, share, .. } = *actuator;
    Ok(stepper.load_angle(ratio * (share * effort), 0.0)? * ratio)
}
