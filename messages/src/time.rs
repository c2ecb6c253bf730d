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
/// `start + n × period`, and later where the clock may slip.
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

/// The period of the control cycle.
pub const CYCLE_PERIOD: Nanoseconds = Nanoseconds(1_000_000);

/// The period of the control cycle [s].
pub const CYCLE_TIME: f64 = 1e-3;

/// Nanoseconds in a second.
pub const NANOSECONDS_PER_SECOND: f64 = 1e9;

impl Nanoseconds {
    /// This duration in seconds.
    pub fn seconds(self) -> f64 {
        self.0 as f64 / NANOSECONDS_PER_SECOND
    }

    /// The whole cycles in this duration; 0 for a negative one.
    pub fn cycles(self) -> u64 {
        (self.0 / CYCLE_PERIOD.0).max(0).unsigned_abs()
    }

    /// The duration of this many cycles.
    pub fn of_cycles(cycles: u64) -> Self {
        Self(i64::try_from(cycles).unwrap_or(i64::MAX).saturating_mul(CYCLE_PERIOD.0))
    }

    /// `seconds` [s] rounded to the nearest nanosecond.
    pub fn from_seconds(seconds: f64) -> Self {
        Self((seconds * NANOSECONDS_PER_SECOND).round() as i64)
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
