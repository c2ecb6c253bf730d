//! From where the axes stand to where a stream starts, without a jump.
//!
//! Enabling takes the references from an encoder, which rounds to a count; a stream starts at a
//! planned position. The rest between the two is faded out before the first setpoint is played.

use crate::planned::Planned;
use machine::Machine;
use machine::motor::StepperMotor;
use messages::time::Period;
use messages::{ActuatorArray, Fault, FaultCode, FaultQuantity, MAX_ACTUATORS, Nanoseconds};

use crate::supervision::Finding;

/// Encoder counts that a stream may start away from where an axis stands.
const TOLERANCE: f64 = 16.0;

/// Time to fade over: at most 0.7 rad/s for [`TOLERANCE`] of a 4096-count encoder.
const DURATION: Nanoseconds = Nanoseconds(64_000_000);

/// What is left of the distance.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Alignment {
    offset: ActuatorArray,
    /// Cycles that it takes, and how many of them are left.
    cycles: u64,
    left: u64,
    /// Time that it takes [s].
    duration: f64,
}

impl Alignment {
    /// From the angles in `standing` to those in `start`.
    ///
    /// # Errors
    /// An axis that stands too far away, with the distance in joint units.
    pub fn new(machine: &Machine, standing: &Planned, start: &Planned) -> Result<Self, Finding> {
        let mut offset = [0.0; MAX_ACTUATORS];
        for (index, actuator) in machine.actuators.iter().enumerate().take(MAX_ACTUATORS) {
            offset[index] = standing.angle[index] - start.angle[index];
            // A stepper is powered where its rotor stands, and leads it by what gravity asks.
            let load_angle = actuator.motor.stepper().map_or(0.0, StepperMotor::largest_load_angle);
            let limit = (TOLERANCE * actuator.encoder.resolution()).max(load_angle);
            if offset[index].abs() > limit || offset[index].is_nan() {
                let ratio = actuator.ratio.abs();
                let (value, limit) = (offset[index].abs() * ratio, limit * ratio);
                let fault = Fault::new(FaultCode::StreamStart).on_actuator(index);
                let quantity = FaultQuantity::StartDistance;
                return Err(Finding::sound(fault.beyond(quantity, value, limit)));
            }
        }
        let aligned = offset.iter().all(|offset| *offset == 0.0);
        let period: Period = machine.realtime.period;
        let cycles = period.cycles_for(DURATION);
        let duration = period.of(cycles).seconds();
        Ok(Self { offset, cycles, left: if aligned { 0 } else { cycles }, duration })
    }

    /// Whether the axes are where the stream starts.
    pub fn is_done(&self) -> bool {
        self.left == 0
    }

    /// Goes on by one cycle, and adds what is left to `planned`.
    pub fn apply(&mut self, planned: &mut Planned) {
        if self.left == 0 {
            return;
        }
        self.left -= 1;
        let at = self.left as f64 / self.cycles as f64;
        // The quintic from 0 to 1 with no speed and no acceleration at either end.
        let share = at * at * at * (10.0 + at * (6.0 * at - 15.0));
        let slope = 30.0 * at * at * (1.0 - at) * (1.0 - at);
        let rate = -slope / self.duration;
        let planned = planned.angle.iter_mut().zip(&mut planned.speed);
        for ((angle, speed), offset) in planned.zip(&self.offset) {
            *angle += offset * share;
            *speed += offset * rate;
        }
    }
}
