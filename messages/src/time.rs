//! Time as samples carry it: monotonic nanoseconds and cycle counts.

use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// A point on the monotonic clock, or a difference of two [ns].
#[derive(
    Debug,
    Clone,
    Copy,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    FromBytes,
    IntoBytes,
    Immutable,
    KnownLayout,
)]
#[repr(transparent)]
pub struct Nanoseconds(pub i64);

/// The number of a control cycle since drives started; the deadline of cycle `n` is
/// `start + n × period`, by the clock of a bus where there is one, and later where the clock may slip.
#[derive(
    Debug,
    Clone,
    Copy,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    FromBytes,
    IntoBytes,
    Immutable,
    KnownLayout,
)]
#[repr(transparent)]
pub struct Cycle(pub u64);

/// Stream time from one setpoint to the next.
pub const SETPOINT_PERIOD: Nanoseconds = Nanoseconds(1_000_000);

/// Stream time from one setpoint to the next [s].
pub const SETPOINT_TIME: f64 = 1e-3;

/// The period of the control cycle, a machine's own: 125 µs to 4 ms, in whole steps of 125 µs.
///
/// A cycle at the planned rate then passes a whole number of eighths of a setpoint, which a binary
/// fixed point holds exactly: stream time adds up without an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Period(Nanoseconds);

/// Nanoseconds in a second.
pub const NANOSECONDS_PER_SECOND: f64 = 1e9;

impl Nanoseconds {
    /// This duration in seconds.
    pub fn seconds(self) -> f64 {
        self.0 as f64 / NANOSECONDS_PER_SECOND
    }

    /// `seconds` [s] rounded to the nearest nanosecond.
    pub fn from_seconds(seconds: f64) -> Self {
        Self((seconds * NANOSECONDS_PER_SECOND).round() as i64)
    }
}

impl Period {
    /// What every period is a multiple of.
    pub const STEP: Nanoseconds = Nanoseconds(125_000);
    /// The shortest: 8 kHz.
    pub const SHORTEST: Self = Self(Self::STEP);
    /// The longest: 250 Hz.
    pub const LONGEST: Self = Self(Nanoseconds(4_000_000));
    /// That of the setpoints, 1 kHz.
    pub const OF_SETPOINTS: Self = Self(SETPOINT_PERIOD);

    /// This long; `None` where it is no whole number of steps, or outside of [`Self::SHORTEST`] to
    /// [`Self::LONGEST`].
    pub fn new(time: Nanoseconds) -> Option<Self> {
        let fits = (Self::SHORTEST.0..=Self::LONGEST.0).contains(&time);
        (fits && time.0 % Self::STEP.0 == 0).then_some(Self(time))
    }

    /// The time.
    pub fn time(self) -> Nanoseconds {
        self.0
    }

    /// The time [s].
    pub fn seconds(self) -> f64 {
        self.0.seconds()
    }

    /// In steps of [`Self::STEP`], 1..=32.
    pub fn steps(self) -> i64 {
        self.0.0 / Self::STEP.0
    }

    /// How long so many cycles are.
    pub fn of(self, cycles: u64) -> Nanoseconds {
        Nanoseconds(i64::try_from(cycles).unwrap_or(i64::MAX).saturating_mul(self.0.0))
    }

    /// The whole cycles in `time`; 0 for a negative one.
    pub fn cycles_in(self, time: Nanoseconds) -> u64 {
        (time.0 / self.0.0).max(0).unsigned_abs()
    }

    /// The fewest cycles that last for `time`; at least 1.
    pub fn cycles_for(self, time: Nanoseconds) -> u64 {
        time.0.max(1).unsigned_abs().div_ceil(self.0.0.unsigned_abs())
    }
}

impl core::ops::Add for Nanoseconds {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl core::ops::Sub for Nanoseconds {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}

impl Cycle {
    /// The cycle after this one.
    pub fn next(self) -> Self {
        Self(self.0 + 1)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_period_is_a_whole_number_of_steps_from_8_khz_to_250_hz() {
        for (time, fits) in [
            (0, false),
            (62_500, false),
            (125_000, true),
            (200_000, false),
            (250_000, true),
            (1_000_000, true),
            (3_125_000, true),
            (4_000_000, true),
            (4_125_000, false),
            (-1_000_000, false),
        ] {
            assert_eq!(Period::new(Nanoseconds(time)).is_some(), fits, "{time} ns");
        }
    }

    #[test]
    fn times_become_cycles() {
        let period = Period::new(Nanoseconds(250_000)).unwrap();
        let whole =
            |time: i64| (period.cycles_in(Nanoseconds(time)), period.cycles_for(Nanoseconds(time)));
        assert_eq!(whole(-1), (0, 1));
        assert_eq!(whole(0), (0, 1));
        assert_eq!(whole(250_000), (1, 1));
        assert_eq!(whole(250_001), (1, 2));
        assert_eq!(whole(60_000_000_000), (240_000, 240_000));
        assert_eq!(period.of(4), SETPOINT_PERIOD);
        assert_eq!(period.of(u64::MAX), Nanoseconds(i64::MAX));
        assert_eq!(Period::OF_SETPOINTS.seconds(), SETPOINT_TIME);
    }
}
