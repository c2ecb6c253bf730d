//! Where in a stream the controller is: a fixed-point count of setpoints.
//!
//! A binary fixed point makes every sum of rates exact. After a hold, a rewind and a resume the
//! stream is at full rate again bit for bit, and "exactly where the gate was closed" is an
//! equality, not a tolerance.

use messages::time::{Period, SETPOINT_PERIOD, SETPOINT_TIME};

/// Bits after the binary point of a [`StreamTime`].
pub const FRACTION_BITS: u32 = 30;

/// Counts of one setpoint.
pub const ONE: i64 = 1 << FRACTION_BITS;

/// Steps of a period in one setpoint.
pub const SETPOINT_STEPS: i64 = SETPOINT_PERIOD.0 / Period::STEP.0;

/// A point of stream time, or a difference of two, in counts of 2⁻³⁰ setpoints. It spans 99 days.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct StreamTime(pub i64);

impl StreamTime {
    /// The instant of the setpoint with this sequence number.
    pub fn of(sequence: u64) -> Self {
        Self((sequence as i64) << FRACTION_BITS)
    }

    /// What passes in `cycles` of this period at the planned rate.
    pub fn in_cycles(cycles: u64, period: Period) -> Self {
        Self((cycles as i64).saturating_mul(period.steps() * (ONE / SETPOINT_STEPS)))
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
        self.setpoints() * SETPOINT_TIME
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
