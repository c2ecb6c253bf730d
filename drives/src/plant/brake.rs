//! The drive's own brake: what a quick stop does, and all that is left when commands stop.
//!
//! Duties: bring every motor from the speed it has to rest at a constant deceleration, then hold
//! it. It knows no path and no other axis.
//!
//! A speed reference ramps to zero, the position reference is its integral, and a cascade with
//! the bandwidths of the machine file follows them: position P, velocity PI, then the current's
//! voltage from the motor's data. It runs at every substep on the motor's own angle, speed and
//! current, as a drive's firmware does at a rate far above the bridge's. Where stiction stops a
//! motor after its ramp, there it is held; within one encoder count the position counts as
//! reached. So integral action and stiction do not hunt.
//!
//! Deceleration: what half the current limit, or half a stepper's torque at its fastest, gives to
//! rotor and load seen at the shaft, leaving the other half to the loops, and never more than the
//! axis's own limit of acceleration.

use machine::{Actuator, Axis};
use nalgebra::SVector;

use super::motors::Motors;
use super::state::State;

/// Share of the current limit that the ramp may use.
const RAMP_SHARE: f64 = 0.5;

/// Corner of the velocity PI as a share of its bandwidth, as in the controller's own cascade.
const INTEGRAL_CORNER: f64 = 0.25;

/// Bandwidth of the current loop as a share of the substep's rate [1/s per 1/s]: a proportional
/// loop that acts on the state at the start of each substep is well damped at a tenth of it.
const CURRENT_SHARE: f64 = 0.1;

/// What the ramp of `actuator`, which drives `axis`, takes from its motor's speed [rad/s²].
pub(crate) fn deceleration(axis: &Axis, actuator: &Actuator) -> f64 {
    let ratio = actuator.ratio.abs();
    let fastest = axis.velocity_limit().plan / ratio;
    let torque = RAMP_SHARE * actuator.motor.largest_torque(fastest);
    (torque / actuator.gains.inertia).min(axis.acceleration_limit().plan / ratio)
}

/// The braking loop of all axes.
#[derive(Debug, Clone, Copy)]
pub struct Brake<const N: usize> {
    position_gain: SVector<f64, N>,
    velocity_gain: SVector<f64, N>,
    inertia: SVector<f64, N>,
    deceleration: SVector<f64, N>,
    resolution: SVector<f64, N>,
    angle: SVector<f64, N>,
    speed: SVector<f64, N>,
    integral: SVector<f64, N>,
}

impl<const N: usize> Brake<N> {
    /// The brake of `actuators`, which drive `axes`: those of one axis at the ramp of the gentlest, so that
    /// they stay together.
    pub fn of(axes: &[Axis], actuators: &[Actuator]) -> Self {
        let each = |value: fn(&Actuator) -> f64, none: f64| {
            SVector::from_fn(|row, _| actuators.get(row).map_or(none, value))
        };
        let ramp = |row: usize| {
            let actuator = actuators.get(row)?;
            let axis = axes.get(actuator.axis)?;
            let of_joint = |it: &Actuator| deceleration(axis, it) * it.ratio.abs();
            let all = axis.driven_by(actuators).iter().map(of_joint);
            let gentlest = all.fold(f64::INFINITY, f64::min) / actuator.ratio.abs();
            Some(if axis.actuators.len() > 1 { gentlest } else { deceleration(axis, actuator) })
        };
        Self {
            position_gain: each(|actuator| actuator.gains.position, 0.0),
            velocity_gain: each(|actuator| actuator.gains.velocity, 0.0),
            inertia: each(|actuator| actuator.gains.inertia, 1.0),
            deceleration: SVector::from_fn(|row, _| ramp(row).unwrap_or(0.0)),
            resolution: each(|actuator| actuator.encoder.resolution(), 1.0),
            angle: SVector::zeros(),
            speed: SVector::zeros(),
            integral: SVector::zeros(),
        }
    }

    /// Takes the references from where the motors are.
    pub fn engage<const J: usize>(&mut self, state: &State<J, N>) {
        self.angle = state.angle;
        self.speed = state.speed;
        self.integral = SVector::zeros();
    }

    /// Moves the references on by `step` [s] and gives the voltages for it [V], unlimited.
    pub fn voltage<const J: usize>(
        &mut self,
        state: &State<J, N>,
        motors: &Motors<N>,
        step: f64,
    ) -> SVector<f64, N> {
        SVector::from_fn(|row, _| {
            let speed = self.speed[row];
            let change = (self.deceleration[row] * step).min(speed.abs()) * speed.signum();
            self.speed[row] = speed - change;
            self.angle[row] += (speed - 0.5 * change) * step;
            if self.speed[row] == 0.0 && state.speed[row] == 0.0 {
                self.angle[row] = state.angle[row];
            }
            let distance = self.angle[row] - state.angle[row];
            let distance = if distance.abs() < self.resolution[row] { 0.0 } else { distance };
            let wanted = self.speed[row] + self.position_gain[row] * distance;
            let error = wanted - state.speed[row];
            let bandwidth = self.velocity_gain[row];
            let direction = if self.speed[row] == 0.0 { 0.0 } else { self.speed[row].signum() };
            let torque = self.inertia[row]
                * (bandwidth * (error + self.integral[row]) - change / step)
                + motors.viscous[row] * self.speed[row]
                + motors.coulomb[row] * direction;
            let limit = motors.current[row];
            let motor = &motors.windings.motors()[row];
            if motor.torque_constant == 0.0 {
                return 0.0;
            }
            let unlimited = torque / motor.torque_constant;
            let target = unlimited.clamp(-limit, limit);
            if unlimited == target {
                self.integral[row] += INTEGRAL_CORNER * bandwidth * error * step;
            }
            let rate = CURRENT_SHARE / step * (target - state.current[row]);
            motor.voltage(target, rate, state.speed[row])
        })
    }
}
