//! The loops inside a servo drive: what closes a DC motor's current, velocity and position loops where the
//! machine file leaves them to the drive.
//!
//! They run at every substep on the motor's own angle, speed and current, as a drive's firmware does at a rate
//! far above the bridge's: position P, velocity PI with the torque as feedforward, then the current's voltage
//! from the motor's data. A torque and a velocity are held over the cycle. A position is reached at its end,
//! along the cubic with the velocities at both ends. Nobody said where to in a stale cycle: a position then goes on at
//! the speed it had.

use machine::{Actuator, ActuatorMode};
use messages::{CommandMode, MAX_ACTUATORS};

use crate::port::{Actuation, Freshness};

/// Bandwidth of the drive's loops, per bandwidth in the machine file: they have no cycle of delay.
const QUICKER: f64 = 2.0;

/// Corner of the velocity PI as a share of its bandwidth.
const INTEGRAL_CORNER: f64 = 0.25;

/// Bandwidth of the current loop as a share of the substep's rate [1/s per 1/s].
const CURRENT_SHARE: f64 = 0.1;

/// Where a motor is, and what flows in it.
#[derive(Debug, Clone, Copy)]
pub(super) struct MotorState {
    /// Angle [rad].
    pub(super) angle: f64,
    /// Speed [rad/s].
    pub(super) speed: f64,
    /// Current [A].
    pub(super) current: f64,
}

/// The drive of one motor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Servo {
    mode: ActuatorMode,
    /// Time of a cycle [s].
    cycle_time: f64,
    motor: machine::DcMotor,
    position_gain: f64,
    velocity_gain: f64,
    inertia: f64,
    /// Of the velocity error [rad/s].
    integral: f64,
    /// Position and velocity at the start of the cycle, and at its end [rad, rad/s].
    from: [f64; 2],
    to: [f64; 2],
}

impl Servo {
    /// The drive of `actuator` in cycles of `cycle_time` [s]; `None` of a stepper.
    pub(super) fn of(actuator: &Actuator, cycle_time: f64) -> Option<Self> {
        Some(Self {
            mode: actuator.mode,
            cycle_time,
            motor: *actuator.motor.dc()?,
            position_gain: QUICKER * actuator.gains.position,
            velocity_gain: QUICKER * actuator.gains.velocity,
            inertia: actuator.gains.inertia,
            integral: 0.0,
            from: [0.0; 2],
            to: [0.0; 2],
        })
    }

    /// Takes the targets of motor `row` for the cycle that begins with the motor in `state`.
    pub(super) fn engage(&mut self, actuation: &Actuation, row: usize, state: MotorState) {
        let at = |values: &[f64; MAX_ACTUATORS]| values.get(row).copied().unwrap_or_default();
        if actuation.mode != CommandMode::Driven {
            (self.integral, self.to) = (0.0, [state.angle, 0.0]);
            return;
        }
        self.from = self.to;
        self.to = match actuation.freshness {
            Freshness::Fresh => [at(&actuation.position), at(&actuation.velocity)],
            Freshness::Stale => [self.from[0] + self.from[1] * self.cycle_time, self.from[1]],
        };
    }

    /// The voltage for the substep of `step` [s] that begins at `share` of the cycle, with the motor in `state`
    /// [V], unlimited.
    pub(super) fn voltage(
        &mut self,
        actuation: &Actuation,
        row: usize,
        [share, step]: [f64; 2],
        state: MotorState,
    ) -> f64 {
        let at = |values: &[f64; MAX_ACTUATORS]| values.get(row).copied().unwrap_or_default();
        let torque = match self.mode {
            ActuatorMode::Voltage => return at(&actuation.voltage),
            ActuatorMode::Torque => at(&actuation.effort),
            ActuatorMode::Velocity => {
                self.velocity_loop(at(&actuation.velocity), at(&actuation.effort), step, state)
            }
            ActuatorMode::Position => {
                let [angle, speed] = self.reference(share);
                let wanted = speed + self.position_gain * (angle - state.angle);
                self.velocity_loop(wanted, at(&actuation.effort), step, state)
            }
        };
        let most = self.motor.current;
        let target = (torque / self.motor.torque_constant).clamp(-most, most);
        let rate = CURRENT_SHARE / step * (target - state.current);
        self.motor.voltage(target, rate, state.speed)
    }

    /// Torque that brings the motor to the speed `wanted` [rad/s], beside the `feedforward` [N·m].
    fn velocity_loop(
        &mut self,
        wanted: f64,
        feedforward: f64,
        step: f64,
        state: MotorState,
    ) -> f64 {
        let error = wanted - state.speed;
        let gain = self.inertia * self.velocity_gain;
        let torque = feedforward + gain * (error + self.integral);
        let most = self.motor.current * self.motor.torque_constant;
        if torque.abs() <= most {
            self.integral += INTEGRAL_CORNER * self.velocity_gain * error * step;
        }
        torque
    }

    /// Position and velocity at `share` of the cycle [rad, rad/s].
    fn reference(&self, share: f64) -> [f64; 2] {
        let ([from, from_speed], [to, to_speed]) = (self.from, self.to);
        let rise = to - from;
        let (start, end) = (from_speed * self.cycle_time, to_speed * self.cycle_time);
        let square = 3.0 * rise - 2.0 * start - end;
        let cube = start + end - 2.0 * rise;
        [
            from + share * (start + share * (square + share * cube)),
            (start + share * (2.0 * square + share * 3.0 * cube)) / self.cycle_time,
        ]
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use machine::Machine;

    #[test]
    fn a_position_is_gone_to_at_an_even_speed_in_a_cycle_of_any_length() {
        let actuator = Machine::builtin().actuators[0].clone();
        for cycle_time in [125e-6, 250e-6, 1e-3, 4e-3] {
            let mut servo = Servo::of(&actuator, cycle_time).unwrap();
            let speed = 7.0;
            let state = MotorState { angle: 0.0, speed, current: 0.0 };
            let mut actuation = Actuation {
                freshness: Freshness::Fresh,
                mode: CommandMode::Driven,
                ..Actuation::DISABLED
            };
            for cycle in 0..3 {
                actuation.position[0] = speed * cycle_time * f64::from(cycle);
                actuation.velocity[0] = speed;
                servo.engage(&actuation, 0, state);
            }
            // Nobody says where to in the next one.
            for freshness in [Freshness::Fresh, Freshness::Stale] {
                let [angle, now] = servo.reference(0.3);
                let expected = servo.from[0] + 0.3 * speed * cycle_time;
                assert!((angle - expected).abs() < 1e-12, "{angle} {expected}, {freshness:?}");
                assert!((now - speed).abs() < 1e-9, "{now} in {cycle_time} s, {freshness:?}");
                servo.engage(&Actuation { freshness: Freshness::Stale, ..actuation }, 0, state);
            }
        }
    }
}
