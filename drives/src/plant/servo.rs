//! The loops inside a servo drive: what closes a DC motor's current, velocity and position loops where the
//! machine file leaves them to the drive.
//!
//! They run at every substep on the motor's own angle, speed and current, as a drive's firmware does at a rate
//! far above the bridge's: position P, velocity PI with the torque as feedforward, then the current's voltage
//! from the motor's data. A torque and a velocity are held over the cycle. A position is reached at its end,
//! along the cubic with the velocities at both ends. Nobody said where to in a stale cycle: a position then goes on at
//! the speed it had. Targets act by the latency of the actuator after they are sent, a torque by the delay of the
//! current loop later.

use machine::{Actuator, ActuatorMode};
use messages::delay::{Delay, Recent};
use messages::time::Period;
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

/// The targets of one cycle.
#[derive(Debug, Clone, Copy, Default)]
struct Told {
    /// [V].
    voltage: f64,
    /// [N·m].
    effort: f64,
    /// [rad/s].
    velocity: f64,
    /// Position and velocity at the start of the cycle, and at its end [rad, rad/s].
    from: [f64; 2],
    to: [f64; 2],
}

/// The drive of one motor.
#[derive(Debug, Clone)]
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
    latency: Delay,
    /// The same of a torque.
    torque_latency: Delay,
    told: Recent<Told>,
}

impl Servo {
    /// The drive of `actuator` in cycles of this `period`; `None` of a stepper.
    pub(super) fn of(actuator: &Actuator, period: Period) -> Option<Self> {
        let latency = Delay::of(actuator.latency, period);
        let torque_latency = Delay::of(actuator.latency + actuator.torque_delay, period);
        Some(Self {
            mode: actuator.mode,
            cycle_time: period.seconds(),
            motor: *actuator.motor.dc()?,
            position_gain: QUICKER * actuator.gains.position,
            velocity_gain: QUICKER * actuator.gains.velocity,
            inertia: actuator.gains.inertia,
            integral: 0.0,
            latency,
            torque_latency,
            told: Recent::of(Told::default(), torque_latency.cycles + 2),
        })
    }

    /// Takes the targets of motor `row` for the cycle that begins with the motor in `state`.
    pub(super) fn engage(&mut self, actuation: &Actuation, row: usize, state: MotorState) {
        let at = |values: &[f64; MAX_ACTUATORS]| values.get(row).copied().unwrap_or_default();
        if actuation.mode != CommandMode::Driven {
            let rest = [state.angle, 0.0];
            self.integral = 0.0;
            self.told.fill(Told { from: rest, to: rest, ..Told::default() });
            return;
        }
        let from = self.told.back(0).to;
        self.told.push(Told {
            voltage: at(&actuation.voltage),
            effort: at(&actuation.effort),
            velocity: at(&actuation.velocity),
            from,
            to: match actuation.freshness {
                Freshness::Fresh => [at(&actuation.position), at(&actuation.velocity)],
                Freshness::Stale => [from[0] + from[1] * self.cycle_time, from[1]],
            },
        });
    }

    /// The voltage for the substep of `step` [s] that begins at `share` of the cycle, with the motor in `state`
    /// [V], unlimited.
    pub(super) fn voltage(&mut self, [share, step]: [f64; 2], state: MotorState) -> f64 {
        let held = |target: fn(&Told) -> f64| self.held(target, self.latency, [share, step]);
        let effort = self.held(|told| told.effort, self.torque_latency, [share, step]);
        let torque = match self.mode {
            ActuatorMode::Voltage => return held(|told| told.voltage),
            ActuatorMode::Torque => effort,
            ActuatorMode::Velocity => {
                let wanted = held(|told| told.velocity);
                self.velocity_loop(wanted, effort, step, state)
            }
            ActuatorMode::Position => {
                let [angle, speed] = self.reference(share);
                let wanted = speed + self.position_gain * (angle - state.angle);
                self.velocity_loop(wanted, effort, step, state)
            }
        };
        let most = self.motor.current;
        let target = (torque / self.motor.torque_constant).clamp(-most, most);
        let rate = CURRENT_SHARE / step * (target - state.current);
        self.motor.voltage(target, rate, state.speed)
    }

    /// A target that is held over a cycle and acts by `latency` after it is sent, in the mean of the substep of `step`
    /// [s] that begins at `share`.
    fn held(&self, target: fn(&Told) -> f64, latency: Delay, [share, step]: [f64; 2]) -> f64 {
        let Delay { cycles, part, .. } = latency;
        let later = target(self.told.back(cycles));
        if share >= part {
            return later;
        }
        let earlier = ((part - share) * self.cycle_time / step).min(1.0);
        later + (target(self.told.back(cycles + 1)) - later) * earlier
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
        let Delay { cycles, part, .. } = self.latency;
        let is_begun = share >= part;
        let share = if is_begun { share - part } else { 1.0 + share - part };
        let told = self.told.back(if is_begun { cycles } else { cycles + 1 });
        let ([from, from_speed], [to, to_speed]) = (told.from, told.to);
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
    fn a_position_is_gone_to_at_an_even_speed_in_a_cycle_of_any_length_and_after_any_latency() {
        let mut actuator = Machine::builtin().actuators[0].clone();
        for (steps, latency) in
            [(1, 0.0), (2, 0.0), (8, 0.0), (32, 0.0), (8, 0.4), (8, 1.0), (8, 2.7)]
        {
            let period = Period::new(messages::Nanoseconds(125_000 * steps)).unwrap();
            let cycle_time = period.seconds();
            actuator.latency = messages::Nanoseconds::from_seconds(latency * cycle_time);
            let mut servo = Servo::of(&actuator, period).unwrap();
            let speed = 7.0;
            let state = MotorState { angle: 0.0, speed, current: 0.0 };
            let mut actuation = Actuation {
                freshness: Freshness::Fresh,
                mode: CommandMode::Driven,
                ..Actuation::DISABLED
            };
            for cycle in 1..7 {
                actuation.position[0] = speed * cycle_time * f64::from(cycle);
                actuation.velocity[0] = speed;
                servo.engage(&actuation, 0, state);
            }
            // Nobody says where to in the next one.
            for (cycle, freshness) in [(5.0, Freshness::Fresh), (6.0, Freshness::Stale)] {
                for share in [0.1, 0.3, 0.8] {
                    let [angle, now] = servo.reference(share);
                    let expected = (cycle + share - latency) * speed * cycle_time;
                    assert!((angle - expected).abs() < 1e-9, "{angle} {expected}, {freshness:?}");
                    assert!((now - speed).abs() < 1e-9, "{now} in {cycle_time} s, {freshness:?}");
                }
                servo.engage(&Actuation { freshness: Freshness::Stale, ..actuation }, 0, state);
            }
        }
    }

    #[test]
    fn a_voltage_changes_inside_a_substep_in_the_mean() {
        let mut actuator = Machine::builtin().actuators[0].clone();
        actuator.latency = messages::Nanoseconds(1_260_000);
        let mut servo = Servo::of(&actuator, Period::OF_SETPOINTS).unwrap();
        let state = MotorState { angle: 0.0, speed: 0.0, current: 0.0 };
        for voltage in [2.0, 6.0, 9.0] {
            let mut actuation = Actuation { mode: CommandMode::Driven, ..Actuation::DISABLED };
            actuation.voltage[0] = voltage;
            servo.engage(&actuation, 0, state);
        }
        let at = |share: f64| servo.held(|told| told.voltage, servo.latency, [share, 50e-6]);
        let found = [0.0, 0.2, 0.25, 0.3, 0.95].map(at);
        let expected = [2.0, 2.0, 2.0 + 4.0 * 0.8, 6.0, 6.0];
        let differs = found.iter().zip(expected).any(|(found, it)| (found - it).abs() > 1e-9);
        assert!(!differs, "{found:?}");
    }
}
