//! A slave's distributed clock: local time with a drift, system time kept to that of the reference, and the
//! sync signals made from it.

use messages::Nanoseconds;

/// The most that one comparison with the reference moves the clock [ns].
const STEP: i64 = 500;

/// Part of a difference to the reference that is taken back at each comparison.
const PART: i64 = 4;

/// The clock, and the sync signals.
#[derive(Debug, Clone)]
pub struct Clock {
    /// Local time at the emulator's time 0 [ns].
    start: i64,
    /// How much faster than the emulator's time it runs [1e-9].
    drift: i64,
    /// System time minus local time, as the master has set it [ns].
    pub offset: i64,
    /// What the comparisons with the reference have added [ns].
    slew: i64,
    /// System time of the next cycle of the sync signals.
    next: Option<i64>,
    /// Period of the cycle of the sync signals, and of SYNC0 [ns].
    periods: Sync,
}

/// The sync signals that a master has asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Sync {
    /// Period of SYNC0 [ns].
    pub sync0: u32,
    /// How many times SYNC0 comes in a cycle: 1 without SYNC1, which comes once in a cycle.
    pub count: u32,
}

impl Sync {
    /// Signals by their registers: SYNC1 of a period longer than SYNC0's comes with every so manieth SYNC0.
    pub fn of(activation: u8, sync0: u32, sync1: u32) -> Option<Self> {
        let wanted = activation & 0x03 == 0x03 && sync0 > 0;
        let count = if activation & 0x04 == 0 { 1 } else { sync1.checked_div(sync0)? + 1 };
        wanted.then_some(Self { sync0, count })
    }

    /// Period of the cycle.
    pub fn cycle(&self) -> Nanoseconds {
        Nanoseconds(i64::from(self.sync0) * i64::from(self.count))
    }
}

impl Clock {
    /// A clock that shows `start` [ns] at time 0 and runs `drift` [1e-9] too fast.
    pub fn new(start: i64, drift: i64) -> Self {
        Self { start, drift, offset: 0, slew: 0, next: None, periods: Sync::default() }
    }

    /// Local time at `now`.
    pub fn local(&self, now: Nanoseconds) -> i64 {
        let drift = i128::from(now.0) * i128::from(self.drift) / 1_000_000_000;
        self.start.wrapping_add(now.0).wrapping_add(drift as i64)
    }

    /// System time at `now`.
    pub fn system(&self, now: Nanoseconds) -> i64 {
        self.local(now).wrapping_add(self.offset).wrapping_add(self.slew)
    }

    /// Compares the clock at `now` with the `reference`, and moves it towards that; the difference before [ns].
    pub fn compare(&mut self, now: Nanoseconds, reference: i64) -> i64 {
        let difference = self.system(now).wrapping_sub(reference);
        self.slew = self.slew.wrapping_sub((difference / PART).clamp(-STEP, STEP));
        difference
    }

    /// Takes the sync signals up at system time `first`, or stops them. Signals that would have begun in the past
    /// never come.
    pub fn arm(&mut self, now: Nanoseconds, sync: Option<Sync>, first: i64) {
        self.periods = sync.unwrap_or_default();
        self.next = (sync.is_some() && first > self.system(now)).then_some(first);
    }

    /// The signals that are being made.
    pub fn sync(&self) -> Option<Sync> {
        self.next.map(|_| self.periods)
    }

    /// When the next cycle of the sync signals begins, in the emulator's time, seen at `now`.
    pub fn next(&self, now: Nanoseconds) -> Option<Nanoseconds> {
        let left = self.next?.wrapping_sub(self.system(now));
        let drift = i128::from(left) * i128::from(self.drift) / 1_000_000_000;
        Some(Nanoseconds(now.0.saturating_add(left.saturating_sub(drift as i64))))
    }

    /// Goes on to the cycle after.
    pub fn passed(&mut self) {
        let cycle = self.periods.cycle().0.max(1);
        self.next = self.next.map(|next| next.wrapping_add(cycle));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_is_compared_each_cycle_stays_with_the_reference() {
        let reference = Clock::new(5_000_000, 20_000);
        let mut clock = Clock::new(77, -20_000);
        clock.offset = reference.local(Nanoseconds(0)) - clock.local(Nanoseconds(0)) + 3000;
        let difference = (1..200).map(|cycle| {
            let now = Nanoseconds(1_000_000 * cycle);
            clock.compare(now, reference.system(now))
        });
        let last = difference.last().unwrap_or(i64::MAX);
        assert!(last.abs() < 200, "{last} ns");
    }

    #[test]
    fn signals_come_when_they_are_due_and_never_from_the_past() {
        let mut clock = Clock::new(1000, 0);
        let sync = Sync::of(7, 10_000, 990_000);
        assert_eq!(sync, Some(Sync { sync0: 10_000, count: 100 }));
        clock.arm(Nanoseconds(0), sync, 500);
        assert_eq!(clock.next(Nanoseconds(0)), None);
        clock.arm(Nanoseconds(0), sync, 5000);
        assert_eq!(clock.next(Nanoseconds(0)), Some(Nanoseconds(4000)));
        clock.passed();
        assert_eq!(clock.next(Nanoseconds(4000)), Some(Nanoseconds(1_004_000)));
    }
}
