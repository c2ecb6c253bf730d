//! Encoder counters: 16 bits of count, the time of the last one, and the count at the index pulse.

use messages::Nanoseconds;

use super::clock::{Bank, Clock};
use super::layout::ENCODERS;

/// Bits of the control register.
mod control {
    pub(super) const LATCH_ON_INDEX: u32 = 1 << 4;
    pub(super) const CLEAR_ON_INDEX: u32 = 1 << 5;
    pub(super) const JUST_ONCE: u32 = 1 << 6;
    /// What a write keeps: the lower bits show the inputs.
    pub(super) const KEPT: u32 = 0xfff8;
}

#[derive(Debug, Clone, Copy, Default)]
struct Counter {
    /// Counts since power-on.
    count: i64,
    /// What is taken off them, after a clear by the index.
    origin: i64,
    /// Time stamp of the last count.
    stamp: u16,
    latch: u16,
    /// Count and stamp where the DPLL samples them.
    sample: u32,
}

impl Counter {
    fn word(&self) -> u32 {
        u32::from((self.count - self.origin) as u16) | u32::from(self.stamp) << 16
    }
}

/// All of them.
#[derive(Debug, Clone, Default)]
pub struct Encoders {
    counters: [Counter; ENCODERS],
    control: Bank<ENCODERS>,
    /// Ticks of the clock for one of the time stamps, less 2.
    divider: u32,
    filter: u32,
    sampled: u32,
}

impl Encoders {
    /// The register `index` of `instance` at `now`.
    pub fn read(&self, index: u16, instance: usize, now: Nanoseconds) -> u32 {
        let counter = self.counters.get(instance).copied().unwrap_or_default();
        match index {
            0 if self.timer().is_some() => counter.sample,
            0 => counter.word(),
            1 => {
                // A and B of the Gray code of the count.
                let quadrature = match (counter.count & 3) as u32 {
                    0 => 0,
                    1 => 0b01,
                    2 => 0b11,
                    _ => 0b10,
                };
                u32::from(counter.latch) << 16 | self.control.get(instance) | quadrature
            }
            2 => self.divider,
            3 => u32::from(self.stamp(now)),
            4 => self.filter,
            5 => self.sampled,
            _ => 0,
        }
    }

    /// Writes the register `index` of `instance`.
    pub fn write(&mut self, index: u16, instance: usize, value: u32) {
        match index {
            1 => self.control.set(instance, value & control::KEPT),
            2 => self.divider = value,
            4 => self.filter = value,
            5 => self.sampled = value,
            _ => {}
        }
    }

    /// `instance` stands at `count` counts from power-on at `now`, with an index every `per_turn` counts
    /// where the encoder has one.
    pub fn set(&mut self, instance: usize, count: i64, per_turn: Option<i64>, now: Nanoseconds) {
        let stamp = self.stamp(now);
        let Some(counter) = self.counters.get_mut(instance) else { return };
        if count == counter.count {
            return;
        }
        let before = counter.count;
        (counter.count, counter.stamp) = (count, stamp);
        let Some(index) = per_turn.and_then(|turn| index_between(before, count, turn)) else {
            return;
        };
        let control = self.control.get(instance);
        if control & control::LATCH_ON_INDEX != 0 {
            counter.latch = (index - counter.origin) as u16;
        }
        if control & control::CLEAR_ON_INDEX != 0 {
            counter.origin = index;
        }
        if control & control::JUST_ONCE != 0 {
            let done = control::LATCH_ON_INDEX | control::CLEAR_ON_INDEX;
            self.control.set(instance, control & !done);
        }
    }

    /// The timer of the DPLL that samples the counts, 0..=4; `None` if they are read as they are.
    pub fn timer(&self) -> Option<u8> {
        (self.sampled & 1 << 15 != 0).then_some((self.sampled >> 12 & 7) as u8)
    }

    /// Takes the sample that is read from now on.
    pub fn sample(&mut self) {
        for counter in &mut self.counters {
            counter.sample = counter.word();
        }
    }

    fn stamp(&self, now: Nanoseconds) -> u16 {
        (Clock::Low.ticks(now) / (i64::from(self.divider) + 2)) as u16
    }
}

/// The index that is passed on the way from `before` to `count`, every `turn` counts, at half a count.
fn index_between(before: i64, count: i64, turn: i64) -> Option<i64> {
    if turn < 1 {
        return None;
    }
    let (from, to) = (before.min(count), before.max(count));
    let index = to.div_euclid(turn) * turn;
    (index > from).then_some(index)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: Nanoseconds = Nanoseconds(12_340_000);

    #[test]
    fn counts_come_with_their_time() {
        let mut encoders = Encoders::default();
        encoders.write(2, 0, 98); // A stamp a microsecond.
        encoders.set(2, -5, None, NOW);
        assert_eq!(encoders.read(0, 2, NOW), 12_340 << 16 | 0xfffb);
        assert_eq!(encoders.read(3, 0, Nanoseconds(12_345_999)), 12_345);
        encoders.set(2, -5, None, Nanoseconds(13_000_000));
        assert_eq!(encoders.read(0, 2, NOW) >> 16, 12_340, "it stood still");
    }

    #[test]
    fn the_index_is_latched_once() {
        let mut encoders = Encoders::default();
        encoders.write(1, 0, control::LATCH_ON_INDEX | control::JUST_ONCE);
        encoders.set(0, 399, Some(400), NOW);
        assert_eq!(encoders.read(1, 0, NOW) & control::LATCH_ON_INDEX, control::LATCH_ON_INDEX);
        encoders.set(0, 404, Some(400), NOW);
        assert_eq!(encoders.read(1, 0, NOW) >> 16, 400);
        assert_eq!(encoders.read(1, 0, NOW) & control::LATCH_ON_INDEX, 0);
        encoders.set(0, 805, Some(400), NOW);
        assert_eq!(encoders.read(1, 0, NOW) >> 16, 400, "once");
    }
}
