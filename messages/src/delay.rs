//! Times that are no whole number of cycles, and the newest values to look back on by them.

use crate::Nanoseconds;
use crate::time::Period;

/// A time in cycles: whole ones, and a part of one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Delay {
    /// Whole cycles.
    pub cycles: usize,
    /// What is left of the time, below a period.
    pub rest: Nanoseconds,
    /// The same as a part of a cycle, 0..1.
    pub part: f64,
}

impl Delay {
    /// `time` in cycles of `period`; none where it is negative.
    pub fn of(time: Nanoseconds, period: Period) -> Self {
        let (time, length) = (time.0.max(0), period.time().0);
        let rest = time % length;
        Self {
            cycles: (time / length) as usize,
            rest: Nanoseconds(rest),
            part: rest as f64 / length as f64,
        }
    }

    /// The cycles that it takes, the part of one counted as a whole.
    pub fn whole_cycles(self) -> usize {
        self.cycles + usize::from(self.rest > Nanoseconds(0))
    }
}

/// The newest values of what changes once a cycle. Everything is allocated when it is made.
#[derive(Debug, Clone, PartialEq)]
pub struct Recent<T> {
    values: Vec<T>,
    newest: usize,
}

impl<T: Copy> Recent<T> {
    /// `count` values, 1 at least, all of them `value`.
    pub fn of(value: T, count: usize) -> Self {
        Self { values: vec![value; count.max(1)], newest: 0 }
    }

    /// Takes `value` for the newest, and forgets the oldest.
    pub fn push(&mut self, value: T) {
        self.newest = if self.newest == 0 { self.values.len() - 1 } else { self.newest - 1 };
        self.values[self.newest] = value;
    }

    /// The value `cycles` before the newest; the oldest known where that is longer ago.
    pub fn back(&self, cycles: usize) -> &T {
        &self.values[self.slot(cycles)]
    }

    /// The same, to be changed.
    pub fn back_mut(&mut self, cycles: usize) -> &mut T {
        let slot = self.slot(cycles);
        &mut self.values[slot]
    }

    /// Has been `value` always.
    pub fn fill(&mut self, value: T) {
        self.values.fill(value);
    }

    /// All values, in no order, to be changed.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut T> {
        self.values.iter_mut()
    }

    /// How many values there are.
    pub fn count(&self) -> usize {
        self.values.len()
    }

    fn slot(&self, cycles: usize) -> usize {
        let count = self.values.len();
        (self.newest + cycles.min(count - 1)) % count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_whole_cycles_and_a_part() {
        let of = |time: i64| Delay::of(Nanoseconds(time), Period::OF_SETPOINTS);
        assert_eq!(of(0), Delay::default());
        assert_eq!(of(2_250_000), Delay { cycles: 2, rest: Nanoseconds(250_000), part: 0.25 });
        assert_eq!(of(-5), Delay::default());
        assert_eq!(
            [of(0), of(1), of(1_000_000), of(1_000_001)].map(Delay::whole_cycles),
            [0, 1, 1, 2]
        );
    }

    #[test]
    fn looking_back_ends_at_the_oldest() {
        let mut recent = Recent::of(0, 3);
        for value in 1..=4 {
            recent.push(value);
        }
        assert_eq!([0, 1, 2, 3, 9].map(|cycles| *recent.back(cycles)), [4, 3, 2, 2, 2]);
        *recent.back_mut(1) = 7;
        recent.push(5);
        assert_eq!([0, 1, 2].map(|cycles| *recent.back(cycles)), [5, 4, 7]);
        recent.fill(1);
        assert_eq!([0, 2].map(|cycles| *recent.back(cycles)), [1, 1]);
    }
}
