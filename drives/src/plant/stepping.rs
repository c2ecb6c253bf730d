//! Steppers with their drivers: a magnetic axis that jumps with each pulse, and a rotor that
//! follows it as if on a spring.
//!
//! The driver's two currents settle within the winding's `L/V`, tens of microseconds, here at once;
//! what the supply cannot drive at speed is in the pull-out torque. The axis' position is what the
//! pulses say: what the rotor does about it, nobody measures. A rotor more than two full steps away
//! has fallen out of step, which this plant knows, and reports as a fault; a real driver may not.
//!
//! Unpowered, only the teeth hold the rotor. The count then follows it, as if it were homed anew
//! when the power comes back.

use machine::{Actuator, Axis, StepperMotor};
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
    /// Commanded angles from home through the cycle at hand.
    segments: [Segment; N],
}

impl<const N: usize> Stepping<N> {
    /// The drivers of `actuators`, which drive `axes`, at home with the magnetic axes at `origin` [rad],
    /// in cycles of `cycle_time` [s]; `None` where they have no steppers.
    pub(super) fn of(
        axes: &[Axis],
        actuators: &[Actuator],
        origin: SVector<f64, N>,
        cycle_time: f64,
    ) -> Option<Self> {
        let first = *actuators.first()?.motor.stepper()?;
        let (mut motors, mut deceleration) = ([first; N], [0.0; N]);
        for (row, actuator) in actuators.iter().enumerate().take(N) {
            motors[row] = *actuator.motor.stepper()?;
            deceleration[row] = brake::deceleration(axes.get(actuator.axis)?, actuator);
        }
        let count = actuators.len().min(N);
        Some(Self {
            motors,
            count,
            deceleration,
            origin,
            segments: [Segment::rest(0.0, cycle_time); N],
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
        let mut segments = self.segments;
        for (row, segment) in segments.iter_mut().enumerate().take(self.count) {
            let motor = &self.motors[row];
            *segment = match (actuation.mode, actuation.freshness) {
                (CommandMode::Disabled, _) => {
                    Segment::rest(state.angle[row] - self.origin[row], segment.time)
                }
                (CommandMode::Driven, Freshness::Fresh) => segment
                    .then(actuation.position[row] - self.origin[row], actuation.velocity[row]),
                // Nobody said where to: on as before, for the few cycles that the bridge allows.
                (CommandMode::Driven, Freshness::Stale) => segment.coast(),
                _ => segment.brake(self.deceleration[row]),
            };
            let rate = segment.fastest() * motor.pulses_per_radian();
            let follows = actuation.mode == CommandMode::Driven;
            if follows && (rate > motor.pulse_rate * EXCESS || rate.is_nan()) {
                let fault = Fault::new(FaultCode::DriveFault).on_actuator(row);
                return Err(fault.beyond(FaultQuantity::PulseRate, rate, motor.pulse_rate));
            }
        }
        self.segments = segments;
        Ok(())
    }

    /// Puts the field where the pulses have it between the shares `from` and `to` of the cycle: in
    /// the mean, so that each pulse counts from its instant on.
    pub(super) fn drive(&self, field: &mut Field<N>, [from, to]: [f64; 2], mode: CommandMode) {
        field.powered = mode != CommandMode::Disabled;
        for (row, segment) in self.segments.iter().enumerate().take(self.count) {
            let pulses = segment.mean_count(self.per_radian(row), from, to);
            let (_, speed) = segment.at(0.5 * (from + to));
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
        core::array::from_fn(|row| count(self.per_radian(row), self.segments[row].to))
    }

    /// Slows all axes down in the next cycle.
    pub(super) fn brake(&mut self) {
        for (segment, deceleration) in self.segments.iter_mut().zip(&self.deceleration) {
            *segment = segment.brake(*deceleration);
        }
    }

    fn per_radian(&self, row: usize) -> f64 {
        self.motors[row].pulses_per_radian()
    }
}
