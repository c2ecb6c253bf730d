//! The override of rapids: where the stream flies from mark to mark, the rate may be lower, and is back before the next
//! mark begins.

use crate::lookahead::Lookahead;
use crate::ramp::{Pace, Ramp, Rate};
use crate::stream_time::StreamTime;
use messages::setpoint::flags;

/// The overrides that can be asked for.
const OVERRIDES: core::ops::RangeInclusive<f64> = 0.1..=1.0;

/// Setpoints that are looked at in one cycle at most.
const LOOKS: u64 = 64;

/// Where rapids are, and the rate that they are played at.
#[derive(Debug, Clone)]
pub struct Rapids {
    rate: f64,
    /// How far a rapid must go on for it to be slow: the way from rest to the planned rate, and a little more.
    way: StreamTime,
    /// Setpoints that are known to be of one rapid: from the first to before the second.
    known: (u64, u64),
}

impl Rapids {
    /// As planned; the rate is steady again `steady` before the end of a rapid.
    pub fn new(pace: &Pace, steady: StreamTime) -> Self {
        let way = Ramp::starting_distance(Rate::ONE, pace) + steady;
        Self { rate: 1.0, way, known: (0, 0) }
    }

    /// Asks for rapids at `rate` at most; `false` and no change when it is not within 0.1..=1.
    #[must_use]
    pub fn ask(&mut self, rate: f64) -> bool {
        let allowed = OVERRIDES.contains(&rate);
        if allowed {
            self.rate = rate;
        }
        allowed
    }

    /// The rate asked for.
    pub fn asked(&self) -> f64 {
        self.rate
    }

    /// Nothing is known of the stream any more.
    pub fn forget(&mut self) {
        self.known = (0, 0);
    }

    /// The most that the rate may be at `time`, 1 outside rapids. Once in a cycle: a rapid is looked through bit by bit.
    pub fn rate_at(&mut self, time: StreamTime, lookahead: &Lookahead) -> f64 {
        if self.rate >= 1.0 {
            return 1.0;
        }
        let (now, end) = (time.sequence(), (time + self.way).sequence());
        let (first, mut next) = self.known;
        // Elsewhere in the stream, or gone back in it.
        if now < first || now > next {
            self.known.0 = now;
            next = now;
        }
        let last = lookahead.accepted().min(end + 1).min(next + LOOKS);
        while next < last && lookahead.setpoint(next).has(flags::RAPID) {
            next += 1;
        }
        self.known.1 = next;
        if next > end { self.rate } else { 1.0 }
    }
}
