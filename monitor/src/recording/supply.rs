//! Which setpoints the controller took in which cycle: the planner tells what it sent, the command how many of them were
//! taken, and when the newest of those had been published.

use messages::{Given, Setpoint};
use std::collections::VecDeque;

/// Setpoints that are kept for their cycle at most: more than can be under way.
const MOST: usize = 8192;

/// Setpoints that were sent and, for all that is known, not taken yet.
#[derive(Debug, Clone, Default)]
pub struct Supply {
    waiting: VecDeque<Setpoint>,
}

impl Supply {
    /// Takes one that was sent; they come in order.
    pub fn push(&mut self, setpoint: &Setpoint) {
        if self.waiting.len() >= MOST {
            self.waiting.pop_front();
        }
        self.waiting.push_back(*setpoint);
    }

    /// Those that were taken in a cycle, in order; fewer where they never came here. Cycles come in order.
    pub fn take(&mut self, given: &Given) -> Vec<Setpoint> {
        let count = given.setpoints as usize;
        if count == 0 {
            return Vec::new();
        }
        // What lies before them nobody recorded, or it was sent again.
        let up_to = self.waiting.partition_point(|it| it.published <= given.newest);
        let mut taken: Vec<Setpoint> = self.waiting.drain(..up_to).collect();
        taken.split_off(taken.len().saturating_sub(count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::Nanoseconds;

    fn setpoint(sequence: u64, published: i64) -> Setpoint {
        Setpoint { sequence, published: Nanoseconds(published), ..Setpoint::default() }
    }

    fn given(setpoints: u32, newest: i64) -> Given {
        Given { setpoints, newest: Nanoseconds(newest), ..Given::default() }
    }

    #[test]
    fn each_cycle_gets_what_was_taken_in_it() {
        let mut supply = Supply::default();
        // The channel was full for number 2: it was sent again.
        let sent = [(0, 10), (1, 11), (2, 12), (2, 15), (3, 16), (4, 17)];
        sent.iter().for_each(|(sequence, published)| supply.push(&setpoint(*sequence, *published)));
        let mut numbers = |count, newest| -> Vec<u64> {
            supply.take(&given(count, newest)).iter().map(|it| it.sequence).collect()
        };
        assert!(numbers(0, 0).is_empty());
        assert_eq!(numbers(1, 11), [1], "number 0 was taken before anybody recorded");
        assert_eq!(numbers(2, 16), [2, 3]);
        assert_eq!(numbers(2, 20), [4], "one never came");
        assert!(numbers(1, 30).is_empty());
    }
}
