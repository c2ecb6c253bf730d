//! Where a motor will be, off its plan, when the newest correction of its torque acts.
//!
//! A correction answers a measurement and acts a cycle and the drive's latencies after it: meanwhile others are on their
//! way. A loop around what was measured alone corrects an error again with each of them, and swings unless it is slow. What they will
//! do is known: the torque beside the plan's speeds the rotor and its load up. So the loops are closed around the error that will
//! be when their answer acts (the predictor of Smith, Chem. Eng. Prog. 53 (1957) 217, on a double integrator, as a
//! state that is carried on: Åström, Wittenmark, Computer-Controlled Systems, 3rd ed., 9.3).
//!
//! The integral is no correction here: what it gives stands against weight, friction and what the file has wrong.

use machine::Actuator;
use messages::Nanoseconds;
use messages::delay::{Delay, Recent};
use messages::time::Period;

/// The corrections of one motor that are on their way.
#[derive(Debug, Clone)]
pub(crate) struct Prediction {
    /// Torques beside those of plan and integral, from the newest one back [N·m].
    sent: Recent<f64>,
    /// From the middle of the cycle in which a speed was measured to when the newest correction acts.
    ahead: Delay,
    cycle_time: f64,
    inertia: f64,
}

impl Prediction {
    /// Of `actuator` in cycles of `period`, with nothing on its way.
    pub(crate) fn new(actuator: &Actuator, period: Period) -> Self {
        let Actuator { latency, torque_delay, age, .. } = *actuator;
        let half = Nanoseconds(period.time().0 / 2);
        let ahead = Delay::of(age + period.time() + latency + torque_delay + half, period);
        Self {
            sent: Recent::of(0.0, ahead.cycles + 1),
            ahead,
            cycle_time: period.seconds(),
            inertia: actuator.gains.inertia,
        }
    }

    /// Nothing is on its way.
    pub(crate) fn reset(&mut self) {
        self.sent.fill(0.0);
    }

    /// A correction is sent [N·m].
    pub(crate) fn send(&mut self, torque: f64) {
        self.sent.push(torque);
    }

    /// By how much the motor will be behind its plan, and how much slower [rad, rad/s], when the next correction acts,
    /// having been measured so much behind and, over the cycle before, so much slower.
    pub(crate) fn error(&self, behind: f64, slower: f64) -> [f64; 2] {
        let (mut behind, mut slower) = (behind, slower);
        // The place was measured half a cycle after the speed.
        let mut until_place = self.cycle_time / 2.0;
        for back in (0..=self.ahead.cycles).rev() {
            let whole = back < self.ahead.cycles;
            let time = self.cycle_time * if whole { 1.0 } else { self.ahead.part };
            let gained = -self.sent.back(back) / self.inertia;
            let before = time.min(until_place);
            let after = time - before;
            until_place -= before;
            slower += gained * before;
            behind += (slower + gained * after / 2.0) * after;
            slower += gained * after;
        }
        [behind, slower]
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use machine::Machine;

    #[test]
    fn what_is_on_its_way_is_in_the_error_that_will_be() {
        let mut actuator = Machine::builtin().actuators[0].clone();
        let period = Period::OF_SETPOINTS;
        for [latency, age, delay] in [[0, 0, 0], [500, 500, 310], [1700, 0, 0], [300, 700, 100]] {
            let times = [latency, age, delay].map(|time| Nanoseconds(time * 1000));
            [actuator.latency, actuator.age, actuator.torque_delay] = times;
            let mut prediction = Prediction::new(&actuator, period);
            let torques = [0.02, -0.01, 0.03, 0.005, -0.02];
            torques.iter().for_each(|torque| prediction.send(*torque));
            // The same in steps of a microsecond, from the middle of the cycle of the speed on.
            let ahead = 1500 + latency + age + delay;
            let (mut behind, mut slower) = (1e-3, -2e-2);
            for at in 0..ahead {
                let back = ((ahead - at - 1) / 1000) as usize;
                let gained = -torques[torques.len() - 1 - back] / actuator.gains.inertia;
                if at >= 500 {
                    behind += (slower + gained * 0.5e-6) * 1e-6;
                }
                slower += gained * 1e-6;
            }
            let found = prediction.error(1e-3, -2e-2);
            assert!((found[0] - behind).abs() < 1e-9, "{found:?} {behind}");
            assert!((found[1] - slower).abs() < 1e-6, "{found:?} {slower}");
            prediction.reset();
            let [behind, slower] = prediction.error(1e-3, 0.0);
            assert!((behind - 1e-3).abs() < 1e-12 && slower == 0.0);
        }
    }
}
