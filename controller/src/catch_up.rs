//! Brings the axes back to the plan after a stall, without a step in the setpoints.
//!
//! An axis that hears nothing goes on at about the speed that it had, a stepper by its pulses, a motor
//! by its voltage and back-EMF; the plan goes on as planned. What lies between the two, in position and
//! in speed, is faded out of the positions that steppers are told. Where the loops are closed here it
//! is a following error, and the loops take it back. Either takes time, which light has to wait for.

use crate::planned::Planned;
use machine::{Machine, Motor};
use messages::math;
use messages::time::Period;
use messages::{ActuatorArray, Nanoseconds};

/// Time to fade over. An axis that kept its speed for 10 ms, while the plan accelerated at 10 m/s²,
/// takes as much acceleration again to come back; over half of this it would take twice that.
const DURATION: Nanoseconds = Nanoseconds(48_000_000);

/// Share of the largest following error within which an axis counts as on the plan: 5 µm of 1 mm.
const ON_PLAN: f64 = 0.005;

/// Beyond this many times [`ON_PLAN`] an error winds up the velocity loop's integral, which takes longer to
/// settle: the wait is then as long as the position loop alone needs to come [`WOUND_UP`] times closer.
const LARGE: f64 = 8.0;
/// See [`LARGE`].
const WOUND_UP: f64 = 5.0;

/// Cycles for which a wrong speed lasts until the loops have it back.
const SPEED_LOSS: f64 = 2.0;

/// What is left of the distance.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CatchUp {
    /// Distance at the start of the fading [rad].
    offset: ActuatorArray,
    /// How fast it grew there [rad/s].
    slope: ActuatorArray,
    /// Cycles that it takes, and how many of them are left.
    cycles: u64,
    left: u64,
    /// Time that it takes [s].
    duration: f64,
}

impl CatchUp {
    /// From `coasted`, where the axes are at an instant, to `planned`, where the plan has them, in cycles of
    /// this `period`.
    pub fn new(coasted: &Planned, planned: &Planned, period: Period) -> Self {
        let difference = |from: &ActuatorArray, to: &ActuatorArray| -> ActuatorArray {
            core::array::from_fn(|index| from[index] - to[index])
        };
        let offset = difference(&coasted.angle, &planned.angle);
        let slope = difference(&coasted.speed, &planned.speed);
        let aligned = offset.iter().chain(&slope).all(|value| *value == 0.0);
        let cycles = period.cycles_for(DURATION);
        let duration = period.of(cycles).seconds();
        Self { offset, slope, cycles, left: if aligned { 0 } else { cycles }, duration }
    }

    /// Cycles until the axes of `machine` are back on the plan but for micrometres; 0 where they are.
    pub fn settling(&self, machine: &Machine) -> u64 {
        let cycle_time = machine.realtime.period.seconds();
        let drives = machine.drives().zip(self.offset.iter().zip(&self.slope));
        let settling = drives.map(|((actuator, axis), (offset, slope))| {
            let off =
                (offset.abs() + slope.abs() * (SPEED_LOSS * cycle_time)) * actuator.ratio.abs();
            let left = off / (ON_PLAN * axis.limits.following_error);
            match actuator.motor {
                _ if left <= 1.0 => 0.0,
                Motor::Stepper(_) => self.cycles as f64,
                // The position loop leaves e^(−ω·t) of it.
                Motor::Dc(_) => {
                    let left = if left > LARGE { left * WOUND_UP } else { left };
                    (math::ln(left) / (actuator.gains.position * cycle_time)).ceil()
                }
            }
        });
        settling.fold(0.0, f64::max) as u64
    }

    /// Whether nothing is left.
    pub fn is_done(&self) -> bool {
        self.left == 0
    }

    /// Goes on by one cycle, and adds what is left to `angle` [rad] and `speed` [rad/s].
    pub fn apply(&mut self, angle: &mut ActuatorArray, speed: &mut ActuatorArray) {
        if self.is_done() {
            return;
        }
        self.left -= 1;
        let duration = self.duration;
        let at = 1.0 - self.left as f64 / self.cycles as f64;
        let (square, cube) = (at * at, at * at * at);
        // The quintics that begin with a position, and with a speed, without acceleration, and end at
        // rest in 0; and their slopes.
        let by_offset = 1.0 + cube * (at * (15.0 - 6.0 * at) - 10.0);
        let offset_slope = -30.0 * square * (1.0 - at) * (1.0 - at);
        let by_speed = at + cube * (at * (8.0 - 3.0 * at) - 6.0);
        let speed_slope = 1.0 + square * (at * (32.0 - 15.0 * at) - 18.0);
        let each = angle.iter_mut().zip(speed);
        for ((angle, speed), (offset, slope)) in each.zip(self.offset.iter().zip(&self.slope)) {
            *angle += offset * by_offset + slope * duration * by_speed;
            *speed += offset / duration * offset_slope + slope * speed_slope;
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use messages::MAX_ACTUATORS;
    use messages::time::SETPOINT_TIME as CYCLE_TIME;

    #[test]
    fn it_begins_with_position_and_speed_and_ends_on_the_plan_without_a_step() {
        let mut coasted = Planned::default();
        (coasted.angle[0], coasted.speed[0], coasted.angle[1]) = (0.3, -8.0, 0.02);
        let mut fading = CatchUp::new(&coasted, &Planned::default(), Period::OF_SETPOINTS);
        let (mut before, mut speed_before) = (coasted.angle, coasted.speed);
        for _ in 0..48 {
            let mut planned = Planned::default();
            fading.apply(&mut planned.angle, &mut planned.speed);
            for axis in 0..2 {
                // The speed is the derivative of the angle: the trapezoid differs by jerk·T³/12.
                let moved = planned.angle[axis] - before[axis];
                let mean = (planned.speed[axis] + speed_before[axis]) / 2.0;
                assert!((moved - mean * CYCLE_TIME).abs() < 1e-4, "{moved} {mean}");
                let step = planned.speed[axis] - speed_before[axis];
                assert!(step.abs() < 1.5, "{step}");
            }
            (before, speed_before) = (planned.angle, planned.speed);
        }
        assert!(before.iter().chain(&speed_before).all(|rest| rest.abs() < 1e-12));
        let mut planned = Planned::default();
        fading.apply(&mut planned.angle, &mut planned.speed);
        assert_eq!(planned, Planned::default());
    }

    #[test]
    fn light_waits_for_as_long_as_the_axes_are_off_the_plan() {
        let mut machine = Machine::builtin();
        let axis = &machine.actuators[1];
        let (ratio, bandwidth) = (axis.ratio, axis.gains.position);
        let on_plan = 5e-6 / ratio;
        let planned = Planned { angle: [3.0; MAX_ACTUATORS], ..Planned::default() };
        let settling = |machine: &Machine, offset: f64, slope: f64| {
            let mut coasted = planned;
            coasted.angle[1] += offset;
            coasted.speed[1] -= slope;
            CatchUp::new(&coasted, &planned, Period::OF_SETPOINTS).settling(machine)
        };
        assert_eq!(settling(&machine, 0.0, 0.0), 0);
        assert_eq!(settling(&machine, -0.99 * on_plan, 0.0), 0);
        let cycles = |times: f64| (math::ln(times) / bandwidth / CYCLE_TIME).ceil() as u64;
        assert_eq!(settling(&machine, -6.0 * on_plan, 0.0), cycles(6.0));
        assert_eq!(settling(&machine, 0.0, 6.0 * on_plan / (SPEED_LOSS * CYCLE_TIME)), cycles(6.0));
        assert_eq!(settling(&machine, -20.0 * on_plan, 0.0), cycles(20.0 * WOUND_UP));
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../machines");
        machine = Machine::load(&folder.join("cartesian_steppers.toml"), &[]).unwrap();
        let turned = 6e-6 / machine.actuators[1].ratio;
        assert_eq!(settling(&machine, turned, 0.0), 48);
    }
}
