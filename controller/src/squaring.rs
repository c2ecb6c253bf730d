//! Brings the actuators of one axis together, before a job can move them.
//!
//! Each comes up at its own home reference, or where it was pushed to while it was unpowered. The joint is in
//! the mean of their springs, and it stays there: every actuator goes to where the joint is.

use crate::planned::Planned;
use machine::Machine;
use messages::{ActuatorArray, MAX_ACTUATORS, Nanoseconds};

use crate::standing::STANDING_COUNTS;

/// Share of an axis' largest speed that its actuators have at most on the way.
const SPEED_SHARE: f64 = 0.02;

/// Time that the way takes at least.
const SHORTEST: Nanoseconds = Nanoseconds(64_000_000);

/// The most time, of an axis that hardly moves.
const LONGEST: Nanoseconds = Nanoseconds(10_000_000_000);

/// The steepest slope of the quintic that is gone along, over its mean one.
const STEEPEST: f64 = 1.875;

/// What is left of the way.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Squaring {
    /// Where it leads.
    end: Planned,
    /// From there to where it begins [rad].
    offset: ActuatorArray,
    cycles: u64,
    left: u64,
    /// Time that the way takes [s].
    duration: f64,
}

impl Squaring {
    /// From where the motors of `machine` stand to where those of each axis are together; done at once where
    /// they are, to what their encoders can tell.
    pub fn new(machine: &Machine, standing: &Planned) -> Self {
        let mut offset = [0.0; MAX_ACTUATORS];
        let period = machine.realtime.period;
        let most = period.cycles_for(LONGEST) as f64;
        let (mut cycles, mut is_square) = (period.cycles_for(SHORTEST), true);
        for (axis, actuators) in machine.driven() {
            let own = axis.actuators.clone().zip(actuators);
            let place = |(index, it): (usize, &machine::Actuator)| {
                it.share * (standing.angle.get(index).copied().unwrap_or_default() * it.ratio)
            };
            let joint: f64 = own.clone().map(place).sum();
            for (index, actuator) in own.take_while(|_| actuators.len() > 1) {
                let Some(angle) = standing.angle.get(index) else { continue };
                let off = angle - joint / actuator.ratio;
                offset[index] = off;
                is_square &= off.abs() <= STANDING_COUNTS * actuator.encoder.resolution();
                let fastest = SPEED_SHARE * axis.limits.velocity / actuator.ratio.abs();
                let needed = STEEPEST * off.abs() / (fastest * period.seconds());
                cycles = cycles.max(needed.min(most).ceil() as u64);
            }
        }
        let mut end = *standing;
        end.angle.iter_mut().zip(&offset).for_each(|(angle, offset)| *angle -= offset);
        let duration = period.of(cycles).seconds();
        Self { end, offset, cycles, left: if is_square { 0 } else { cycles }, duration }
    }

    /// Whether the way has been gone.
    pub fn is_done(&self) -> bool {
        self.left == 0
    }

    /// Goes on by one cycle; where that leads, `None` where there is nowhere to go.
    pub fn advance(&mut self) -> Option<Planned> {
        self.left = self.left.checked_sub(1)?;
        let at = self.left as f64 / self.cycles as f64;
        // The quintic from 0 to 1 with no speed and no acceleration at either end.
        let share = at * at * at * (10.0 + at * (6.0 * at - 15.0));
        let slope = 30.0 * at * at * (1.0 - at) * (1.0 - at);
        let rate = -slope / self.duration;
        let mut planned = self.end;
        for (index, offset) in self.offset.iter().enumerate() {
            planned.angle[index] += offset * share;
            planned.speed[index] = offset * rate;
        }
        Some(planned)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::time::SETPOINT_TIME as CYCLE_TIME;

    /// The built-in machine with two motors on its second axis, one of them mirrored.
    fn gantry() -> Machine {
        let mut machine = Machine::builtin();
        let second = machine.actuators[1].clone();
        machine.actuators[1].share = 0.5;
        machine.actuators.push(machine::Actuator { share: 0.5, ratio: -second.ratio, ..second });
        machine.axes[1].actuators = 1..3;
        machine
    }

    #[test]
    fn actuators_of_one_axis_meet_in_their_mean_and_the_others_stay() {
        let machine = gantry();
        let ratio = machine.actuators[1].ratio;
        let mut standing = Planned::default();
        standing.angle[..3].copy_from_slice(&[5.0, 0.1002 / ratio, -0.1 / ratio]);
        let mut squaring = Squaring::new(&machine, &standing);
        let (mut before, mut cycles) = (standing, 0);
        while let Some(planned) = squaring.advance() {
            cycles += 1;
            assert_eq!(planned.angle[0], 5.0);
            for index in 1..3 {
                let moved = planned.angle[index] - before.angle[index];
                let mean = (planned.speed[index] + before.speed[index]) / 2.0;
                assert!((moved - mean * CYCLE_TIME).abs() < 1e-4, "{moved} {mean}");
                let most = SPEED_SHARE * machine.axes[1].limits.velocity;
                assert!((planned.speed[index] * ratio).abs() <= most);
            }
            before = planned;
        }
        assert!(squaring.is_done() && cycles >= 64);
        let joints = [before.angle[1] * ratio, before.angle[2] * -ratio];
        assert!(joints.iter().all(|joint| (joint - 0.1001).abs() < 1e-12), "{joints:?}");
        assert_eq!(before.speed, [0.0; MAX_ACTUATORS]);
    }

    #[test]
    fn what_is_square_to_a_count_and_single_motors_stay_where_they_are() {
        let mut machine = gantry();
        let count = machine.actuators[1].encoder.resolution();
        let mut standing = Planned::default();
        (standing.angle[0], standing.angle[2]) = (3.0, 2.0 * count);
        assert_eq!(Squaring::new(&machine, &standing).advance(), None);
        standing.angle[2] = 4.0 * count;
        assert!(Squaring::new(&machine, &standing).advance().is_some());
        machine = Machine::builtin();
        standing.angle[1] = 7.0;
        assert_eq!(Squaring::new(&machine, &standing).advance(), None);
    }
}
