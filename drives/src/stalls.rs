//! The account of stalls: how many, how long, and why, since the newest stream began.

use messages::stall::CAUSES;
use messages::{Cycle, Nanoseconds, StallCause, Stalls};

/// One stall that has ended, or that stopped the axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stall {
    /// The first cycle that it took.
    pub cycle: Cycle,
    /// When that cycle was to begin.
    pub began: Nanoseconds,
    /// How long it was.
    pub length: Nanoseconds,
    /// What explains it where the kernel tells nothing: bits of [`StallCause`].
    pub otherwise: u32,
}

/// Counts stalls, and takes their explanations as they come in.
#[derive(Debug, Clone, Copy, Default)]
pub struct StallAccount {
    /// Stalls noted before the stream at hand began.
    before: u64,
    noted: u64,
    longest: u64,
    stalls: Stalls,
}

impl StallAccount {
    /// Commands are of this stream now, 0 for none: a new one starts the account anew.
    pub fn play(&mut self, stream: u64) {
        if stream != 0 && stream != self.stalls.stream {
            let stalls = Stalls { stream, ..Stalls::default() };
            *self = Self { before: self.noted, noted: self.noted, longest: 0, stalls };
        }
    }

    /// Counts a stall, unexplained so far; gives the number under which it is explained.
    pub fn note(&mut self, stall: &Stall) -> u64 {
        let number = self.noted;
        self.noted += 1;
        let stalls = &mut self.stalls;
        stalls.count += 1;
        stalls.total = stalls.total + stall.length;
        if stall.length > stalls.longest {
            self.longest = number;
            stalls.longest = stall.length;
            stalls.longest_cycle = stall.cycle;
            stalls.longest_causes = 0;
        }
        stalls.causes[CAUSES - 1] += 1;
        number
    }

    /// Why the stall with this number was, bits of [`StallCause`]; one before the stream at hand does
    /// not count any more. Explain each only once.
    pub fn explain(&mut self, number: u64, causes: u32) {
        if number < self.before || number >= self.noted || causes == 0 {
            return;
        }
        for cause in StallCause::of(causes) {
            self.stalls.causes[cause as usize] += 1;
        }
        self.stalls.causes[CAUSES - 1] -= 1;
        if number == self.longest {
            self.stalls.longest_causes = causes;
        }
    }

    /// The account.
    pub fn stalls(&self) -> &Stalls {
        &self.stalls
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEAL: u32 = StallCause::Steal.bit();
    const LATE: u32 = StallCause::LateAnswer.bit();

    fn stall(cycle: u64, cycles: u64) -> Stall {
        let [began, length] =
            [cycle, cycles].map(|cycles| messages::time::Period::OF_SETPOINTS.of(cycles));
        Stall { cycle: Cycle(cycle), began, length, otherwise: 0 }
    }

    #[test]
    fn the_longest_keeps_its_place_and_cause() {
        let mut account = StallAccount::default();
        let numbers = [(10, 2), (50, 7), (90, 3)].map(|(at, long)| account.note(&stall(at, long)));
        assert_eq!(numbers, [0, 1, 2]);
        let unexplained = *account.stalls();
        assert_eq!((unexplained.count, unexplained.total), (3, Nanoseconds(12_000_000)));
        assert_eq!(
            (unexplained.longest, unexplained.longest_cycle),
            (Nanoseconds(7_000_000), Cycle(50))
        );
        assert_eq!((unexplained.longest_causes, unexplained.causes), (0, [0, 0, 0, 0, 0, 0, 0, 3]));
        account.explain(2, LATE);
        account.explain(1, STEAL | LATE);
        account.explain(0, 0);
        let stalls = account.stalls();
        assert_eq!(
            (stalls.longest_causes, stalls.causes),
            (STEAL | LATE, [1, 0, 0, 0, 0, 0, 2, 1])
        );
    }

    #[test]
    fn a_new_stream_starts_anew_and_the_end_of_one_does_not() {
        let mut account = StallAccount::default();
        account.play(1);
        let early = account.note(&stall(10, 2));
        account.play(0);
        account.play(1);
        assert_eq!(account.stalls().count, 1);
        account.play(2);
        let none = Stalls { stream: 2, ..Stalls::default() };
        assert_eq!(*account.stalls(), none);
        // What came in too late is not counted for the new stream.
        account.explain(early, STEAL);
        account.explain(77, STEAL);
        assert_eq!(*account.stalls(), none);
        assert_eq!(account.note(&stall(99, 1)), 1);
        account.explain(1, STEAL);
        assert_eq!(account.stalls().longest_causes, STEAL);
    }
}
