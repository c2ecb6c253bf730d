//! Steppers with their drivers: a magnetic axis that jumps with each pulse, and a rotor that
//! follows it as if on a spring.
//!
//! The driver's two currents settle within the winding's `L/V`, tens of microseconds, here at once;
//! what the supply cannot drive at speed is in the pull-out torque. The axis' position is what the
//! pulses say: what the rotor does about it, nobody measures. A rotor more than two full steps away
//! has fallen out of step, which this plant knows, and reports as a fault; a real driver may not.
//!
//! Positions act by the latency of their actuator after they are sent.
//!
//! Unpowered, only the teeth hold the rotor. The count then follows it, as if it were homed anew
//! when the power comes back.

use machine::{Actuator, Axis, StepperMotor};
use messages::delay::{Delay, Recent};
use messages::time::Period;
use messages::{CommandMode, Fault, FaultCode, FaultQuantity};
use nalgebra::SVector;

use super::brake;
use super::state::State;
use crate::port::{Actuation, Freshness};
use crate::pulses::{Segment, count};

/// Rounding by which a pulse rate may exceed its limit.
const EXCESS: f64 = 1.001;

/// The motors' torque at one state of their drivers.
#[derive(Debug, Clone, Copy)]
pub struct Field<const N: usize> {
    motors: [StepperMotor; N],
    /// How many of them there are.
    count: usize,
    /// Angles of the rotors at home, where a full step is [rad].
    origin: SVector<f64, N>,
    /// Whether the phases are driven.
    powered: bool,
    /// The magnetic axes [rad].
    angle: SVector<f64, N>,
    /// How fast the commanded angles move [rad/s].
    speed: SVector<f64, N>,
    /// Largest torques at those speeds, which are the frequencies that the windings see [N·m].
    most: SVector<f64, N>,
}

impl<const N: usize> Field<N> {
    /// Torque on the rotors [N·m].
    pub fn torque<const J: usize>(&self, state: &State<J, N>) -> SVector<f64, N> {
        let mut torque = SVector::zeros();
        for (row, motor) in self.motors.iter().enumerate().take(self.count) {
            let (angle, speed) = (state.angle[row], state.speed[row]);
            let teeth = motor.teeth_torque(angle - self.origin[row]);
            torque[row] = teeth;
            if self.powered {
                let lag = self.angle[row] - angle;
                let spring = motor.field_torque(self.most[row], lag);
                torque[row] = spring + motor.damping * (self.speed[row] - speed) + teeth;
            }
        }
        torque
    }

    /// The rotors' springs [N·m/rad], at their stiffest.
    pub(super) fn stiffness(&self) -> SVector<f64, N> {
        SVector::from_fn(|row, _| {
            if row >= self.count {
                return 0.0;
            }
            let motor = &self.motors[row];
            motor.stiffness() + 4.0 * motor.periods() * motor.detent_torque
        })
    }

    /// The drivers' damping [N·m·s/rad].
    pub(super) fn damping(&self) -> SVector<f64, N> {
        SVector::from_fn(|row, _| if row < self.count { self.motors[row].damping } else { 0.0 })
    }
}

/// The drivers of all axes.
#[derive(Debug, Clone)]
pub(super) struct Stepping<const N: usize> {
    motors: [StepperMotor; N],
    /// How many of them there are.
    count: usize,
    deceleration: [f64; N],
    /// Commanded angles at home [rad]; pulses count from there.
    origin: SVector<f64, N>,
    latency: [Delay; N],
    /// Commanded angles from home through the newest cycles.
    told: Vec<Recent<Segment>>,
}

impl<const N: usize> Stepping<N> {
    /// The drivers of `actuators`, which drive `axes`, at home with the magnetic axes at `origin` [rad],
    /// in cycles of this `period`; `None` where they have no steppers.
    pub(super) fn of(
        axes: &[Axis],
        actuators: &[Actuator],
        origin: SVector<f64, N>,
        period: Period,
    ) -> Option<Self> {
        let first = *actuators.first()?.motor.stepper()?;
        let (mut motors, mut deceleration) = ([first; N], [0.0; N]);
        let mut latency = [Delay::default(); N];
        for (row, actuator) in actuators.iter().enumerate().take(N) {
            motors[row] = *actuator.motor.stepper()?;
            deceleration[row] = brake::deceleration(axes.get(actuator.axis)?, actuator);
            latency[row] = Delay::of(actuator.latency, period);
        }
        let count = actuators.len().min(N);
        Some(Self {
            motors,
            count,
            deceleration,
            origin,
            told: (latency.iter().take(count))
                .map(|latency| {
                    let rest = Segment::rest(0.0, period.seconds());
                    Recent::of(rest, latency.cycles + 2)
                })
                .collect(),
            latency,
        })
    }

    /// The unpowered field of rotors whose teeth stand on a full step at `rotor` [rad].
    pub(super) fn field(&self, rotor: SVector<f64, N>) -> Field<N> {
        Field {
            motors: self.motors,
            count: self.count,
            origin: rotor,
            powered: false,
            angle: self.origin,
            speed: SVector::zeros(),
            most: SVector::from_fn(|row, _| self.motors[row].pull_out_torque(0.0)),
        }
    }

    /// Takes what the next cycle shall do.
    ///
    /// # Errors
    /// A pulse rate beyond a driver's limit; the cycle is then left as it was.
    pub(super) fn engage<const J: usize>(
        &mut self,
        actuation: &Actuation,
        state: &State<J, N>,
    ) -> Result<(), Fault> {
        let mut next: [Option<Segment>; N] = [None; N];
        for (row, told) in self.told.iter().enumerate() {
            let (motor, newest) = (&self.motors[row], told.back(0));
            let segment = match (actuation.mode, actuation.freshness) {
                (CommandMode::Disabled, _) => {
                    Segment::rest(state.angle[row] - self.origin[row], newest.time)
                }
                (CommandMode::Driven, Freshness::Fresh) => {
                    newest.then(actuation.position[row] - self.origin[row], actuation.velocity[row])
                }
                // Nobody said where to: on as before, for the few cycles that the bridge allows.
                (CommandMode::Driven, Freshness::Stale) => newest.coast(),
                _ => newest.brake(self.deceleration[row]),
            };
            let rate = segment.fastest() * motor.pulses_per_radian();
            let follows = actuation.mode == CommandMode::Driven;
            if follows && (rate > motor.pulse_rate * EXCESS || rate.is_nan()) {
                let fault = Fault::new(FaultCode::DriveFault).on_actuator(row);
                return Err(fault.beyond(FaultQuantity::PulseRate, rate, motor.pulse_rate));
            }
            next[row] = Some(segment);
        }
        for (told, segment) in self.told.iter_mut().zip(next.into_iter().flatten()) {
            // Without power there is nothing on its way.
            match actuation.mode {
                CommandMode::Disabled => told.fill(segment),
                _ => told.push(segment),
            }
        }
        Ok(())
    }

    /// Puts the field where the pulses have it between the shares `from` and `to` of the cycle: in
    /// the mean, so that each pulse counts from its instant on.
    pub(super) fn drive(&self, field: &mut Field<N>, [from, to]: [f64; 2], mode: CommandMode) {
        field.powered = mode != CommandMode::Disabled;
        for row in 0..self.count {
            let pulses = self.mean_count(row, from, to);
            let (segment, at) = self.acting(row, 0.5 * (from + to));
            let (_, speed) = segment.at(at);
            field.angle[row] = self.origin[row] + pulses / self.per_radian(row);
            field.speed[row] = speed;
            field.most[row] = self.motors[row].pull_out_torque(speed);
        }
    }

    /// Whether all rotors are in step with `field`.
    ///
    /// # Errors
    /// One that is not, with how far it is off [rad].
    pub(super) fn in_step<const J: usize>(
        &self,
        field: &Field<N>,
        state: &State<J, N>,
    ) -> Result<(), Fault> {
        for (row, motor) in self.motors.iter().enumerate().take(self.count) {
            let lag = (field.angle[row] - state.angle[row]).abs();
            let limit = motor.stall_angle();
            if field.powered && (lag > limit || lag.is_nan()) {
                let fault = Fault::new(FaultCode::DriveFault).on_actuator(row);
                return Err(fault.beyond(FaultQuantity::Lag, lag, limit));
            }
        }
        Ok(())
    }

    /// Pulses sent to the end of the cycle.
    pub(super) fn counts(&self) -> [i64; N] {
        core::array::from_fn(|row| {
            if row >= self.count {
                return 0;
            }
            let (segment, at) = self.acting(row, 1.0);
            count(self.per_radian(row), segment.at(at).0)
        })
    }

    /// Slows all axes down in the next cycle.
    pub(super) fn brake(&mut self) {
        for (told, deceleration) in self.told.iter_mut().zip(&self.deceleration) {
            let segment = told.back(0).brake(*deceleration);
            told.push(segment);
        }
    }

    /// The count of pulses in the mean over the shares `from` to `to` of the cycle.
    fn mean_count(&self, row: usize, from: f64, to: f64) -> f64 {
        let per_radian = self.per_radian(row);
        let Delay { cycles, part: turn, .. } = self.latency[row];
        if turn == 0.0 {
            return self.told[row].back(cycles).mean_count(per_radian, from, to);
        }
        let mean = |from: f64, to: f64| {
            // What is asked for lies in one segment, whose end counts as its own.
            let (segment, middle) = self.acting(row, 0.5 * (from + to));
            let half = 0.5 * (to - from);
            segment.mean_count(per_radian, middle - half, middle + half)
        };
        if turn <= from || turn >= to {
            return mean(from, to);
        }
        (mean(from, turn) * (turn - from) + mean(turn, to) * (to - turn)) / (to - from)
    }

    /// The segment that acts at `share` of the cycle, and the share of it there.
    fn acting(&self, row: usize, share: f64) -> (&Segment, f64) {
        let Delay { cycles, part, .. } = self.latency[row];
        let told = &self.told[row];
        if share >= part {
            (told.back(cycles), share - part)
        } else {
            (told.back(cycles + 1), 1.0 + share - part)
        }
    }

    fn per_radian(&self, row: usize) -> f64 {
        self.motors[row].pulses_per_radian()
    }
}
