//! How much later than it is sent a target acts, and how far ahead the plan is played for that.
//!
//! ```text
//! feedback   command sent        it acts on an actuator        plan played to here
//!   │ now       │ next   latency    │                                │ after
//!   └───────────┴───────────────────┴────────── behind ──────────────┘
//! ```
//!
//! The player is ahead by whole cycles, as many as the longest latency takes. Each actuator is given the plan
//! of the cycle in which its target acts: as much behind the player as its own latency is shorter. The gate
//! has a latency too. A torque is there later than the rest of a target, by what a drive's current loop takes.

use machine::Machine;
use messages::delay::Delay;
use messages::{MAX_ACTUATORS, Nanoseconds};

/// The latency of one target.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Latency {
    /// From the deadline at which it is sent until it acts.
    pub acts: Delay,
    /// From there to the instant that the player has come to.
    pub behind: Delay,
    /// From when its torque is there to the instant that the player has come to.
    pub torque: Delay,
    /// From the measurement that is told at a deadline to that deadline.
    pub measured: Delay,
    /// From the deadline at which that was sent which acted at the measurement, to the one at which it is told.
    pub answered: Delay,
}

/// The latencies of a machine's drives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Latencies {
    /// Cycles that the player is ahead of what is sent.
    pub ahead: usize,
    /// Those of the actuators.
    pub actuators: [Latency; MAX_ACTUATORS],
    /// That of the gate.
    pub gate: Latency,
}

impl Latencies {
    /// As `machine` declares them.
    pub fn of(machine: &Machine) -> Self {
        let period = machine.realtime.period;
        let gate = machine.drives.gate_latency;
        let none = Nanoseconds(0);
        let times = machine.actuators.iter().map(|it| it.latency + it.torque_delay);
        let longest = times.fold(gate, Nanoseconds::max);
        let ahead = Delay::of(longest, period).whole_cycles();
        let latency = |[time, torque_delay, age]: [Nanoseconds; 3]| {
            let behind = |time| Delay::of(period.of(ahead as u64) - time, period);
            Latency {
                acts: Delay::of(time, period),
                behind: behind(time),
                torque: behind(time + torque_delay),
                measured: Delay::of(age, period),
                answered: Delay::of(time + age, period),
            }
        };
        let mut actuators = [latency([longest, none, none]); MAX_ACTUATORS];
        for (slot, actuator) in actuators.iter_mut().zip(&machine.actuators) {
            *slot = latency([actuator.latency, actuator.torque_delay, actuator.age]);
        }
        Self { ahead, actuators, gate: latency([gate, none, none]) }
    }

    /// The longest time from a command to what is told of it, in whole cycles.
    pub fn longest_answered(&self) -> usize {
        self.actuators.iter().map(|latency| latency.answered.whole_cycles()).max().unwrap_or(0)
    }

    /// The age of the oldest measurement, in whole cycles.
    pub fn oldest(&self) -> usize {
        self.actuators.iter().map(|latency| latency.measured.whole_cycles()).max().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_player_is_ahead_by_the_longest_latency_and_each_target_behind_it_by_what_it_is_shorter()
    {
        let mut machine = Machine::builtin();
        assert_eq!(Latencies::of(&machine).ahead, 0);
        assert_eq!(Latencies::of(&machine).actuators[0], Latency::default());
        machine.actuators[0].latency = Nanoseconds(1_750_000);
        machine.actuators[1].latency = Nanoseconds(0);
        machine.drives.gate_latency = Nanoseconds(500_000);
        let latencies = Latencies::of(&machine);
        let times = |latency: Latency| {
            [latency.acts, latency.behind].map(|delay| (delay.cycles, delay.part))
        };
        assert_eq!((latencies.ahead, latencies.longest_answered()), (2, 2));
        assert_eq!(times(latencies.actuators[0]), [(1, 0.75), (0, 0.25)]);
        assert_eq!(times(latencies.actuators[1]), [(0, 0.0), (2, 0.0)]);
        assert_eq!(times(latencies.gate), [(0, 0.5), (1, 0.5)]);
    }
}
