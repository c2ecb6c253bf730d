//! What goes wrong with frames on a bad line, by seed.

use messages::Nanoseconds;
use messages::random::SplitMix64;

/// How often a frame suffers what, each 0..=1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rates {
    /// It is lost, on the way out or back.
    pub lost: f64,
    /// It comes back late.
    pub late: f64,
    /// By how much.
    pub delay: Nanoseconds,
    /// It comes back twice.
    pub duplicated: f64,
    /// Its bits are changed: the slaves count it and do not take it, or it comes back wrong.
    pub corrupted: f64,
}

/// What happens to one frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    /// It comes back.
    Whole,
    /// It does not reach the slaves.
    LostOut,
    /// It reaches the slaves and does not come back.
    LostBack,
    /// It comes back late.
    Late(Nanoseconds),
    /// It comes back twice.
    Twice,
    /// It reaches the slaves with a wrong checksum, and does not come back.
    CorruptedOut,
    /// It comes back with a byte of its headers changed, this many from its beginning.
    CorruptedBack(usize),
}

/// How often each of it happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Frames that came from the master.
    pub frames: u64,
    /// Frames lost.
    pub lost: u64,
    /// Frames that came back late.
    pub late: u64,
    /// Frames that came back twice.
    pub duplicated: u64,
    /// Frames with changed bits.
    pub corrupted: u64,
}

/// A bad line.
#[derive(Debug, Clone)]
pub struct Line {
    rates: Rates,
    random: SplitMix64,
    counts: Counts,
}

impl Line {
    /// Other `rates` from now on.
    pub fn set_rates(&mut self, rates: Rates) {
        self.rates = rates;
    }

    /// A line of these `rates`, the same for the same `seed`.
    pub fn new(rates: Rates, seed: u64) -> Self {
        Self { rates, random: SplitMix64::new(seed), counts: Counts::default() }
    }

    /// What has happened so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// What happens to the next frame: one thing at most.
    pub fn fate(&mut self) -> Fate {
        let Rates { lost, late, delay, duplicated, corrupted } = self.rates;
        self.counts.frames += 1;
        let drawn = self.random.fraction();
        let back = self.random.below(2) == 0;
        let mut limit = lost;
        if drawn < limit {
            self.counts.lost += 1;
            return if back { Fate::LostBack } else { Fate::LostOut };
        }
        limit += late;
        if drawn < limit {
            self.counts.late += 1;
            return Fate::Late(delay);
        }
        limit += duplicated;
        if drawn < limit {
            self.counts.duplicated += 1;
            return Fate::Twice;
        }
        if drawn < limit + corrupted {
            self.counts.corrupted += 1;
            // The EtherCAT header and the first datagram's.
            let byte = self.random.below(12) as usize;
            return if back { Fate::CorruptedBack(byte) } else { Fate::CorruptedOut };
        }
        Fate::Whole
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_loses_as_many_frames_as_it_shall() {
        let rates = Rates { lost: 0.01, corrupted: 0.02, ..Rates::default() };
        let mut line = Line::new(rates, 7);
        let fates: Vec<_> = (0..100_000).map(|_| line.fate()).collect();
        let counts = line.counts();
        assert!((800..1200).contains(&counts.lost), "{counts:?}");
        assert!((1700..2300).contains(&counts.corrupted), "{counts:?}");
        assert_eq!((counts.late, counts.duplicated), (0, 0));
        let mut again = Line::new(rates, 7);
        assert!(fates.iter().all(|fate| *fate == again.fate()));
    }
}
