//! Where in a stream the controller is: a fixed-point count of setpoints.
//!
//! A binary fixed point makes every sum of rates exact. After a hold, a rewind and a resume the
//! stream is at full rate again bit for bit, and "exactly where the gate was closed" is an
//! equality, not a tolerance.

use messages::time::CYCLE_TIME;

/// Bits after the binary point of a [`StreamTime`].
pub const FRACTION_BITS: u32 = 30;

/// Counts of one setpoint.
pub const ONE: i64 = 1 << FRACTION_BITS;

/// A point of stream time, or a difference of two, in counts of 2⁻³⁰ setpoints. It spans 99 days.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct StreamTime(pub i64);

impl StreamTime {
    /// The instant of the setpoint with this sequence number.
    pub fn of(sequence: u64) -> Self {
        Self((sequence as i64) << FRACTION_BITS)
    }

    /// The setpoint at or before this instant; 0 before the first.
    pub fn sequence(self) -> u64 {
        (self.0 >> FRACTION_BITS).max(0) as u64
    }

    /// How far this is past that setpoint, 0..1.
    pub fn fraction(self) -> f64 {
        (self.0 & (ONE - 1)) as f64 / ONE as f64
    }

    /// In setpoints.
    pub fn setpoints(self) -> f64 {
        self.0 as f64 / ONE as f64
    }

    /// In seconds.
    pub fn seconds(self) -> f64 {
        self.setpoints() * CYCLE_TIME
    }
}

impl core::ops::Add for StreamTime {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl core::ops::Sub for StreamTime {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}
