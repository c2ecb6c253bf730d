//! The light that the player has come to, until it is due at the gate.
//!
//! The gate has a latency of its own ([`crate::latency`]). Where that is shorter than how far the player is
//! ahead, what the player gives is sent so much later. A cycle of it that drives kept dark is lost, and the
//! player is to go back for it; what waits behind it is then given with it, once.

use crate::latency::Latencies;
use crate::stream_time::StreamTime;
use messages::delay::{Delay, Recent};
use messages::time::Period;
use messages::{LaserCycle, TooManyEdges};

/// The light of one cycle of the player.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Given {
    /// It, or that it cannot be told.
    pub laser: Result<LaserCycle, TooManyEdges>,
    /// Stream time at the start of the cycle.
    pub from: StreamTime,
    /// Stream time at its end.
    pub to: StreamTime,
    /// Up to where the stream was dark.
    pub dark_until: StreamTime,
}

impl Given {
    /// Dark, before the first setpoint.
    const NOTHING: Self = Self {
        laser: Ok(LaserCycle::OFF),
        from: StreamTime(0),
        to: StreamTime(0),
        dark_until: StreamTime(0),
    };
}

/// The light on its way from the player to the gate.
#[derive(Debug, Clone)]
pub struct Light {
    period: Period,
    /// How much later than the player comes to it the light is sent.
    behind: Delay,
    given: Recent<Given>,
    /// What is sent now.
    due: Result<LaserCycle, TooManyEdges>,
}

impl Light {
    /// Dark.
    pub fn new(latencies: &Latencies, period: Period) -> Self {
        let behind = latencies.gate.behind;
        let given = Recent::of(Given::NOTHING, behind.whole_cycles() + 1);
        Self { period, behind, given, due: Ok(LaserCycle::OFF) }
    }

    /// Goes on by one cycle, in which the player gives this.
    pub fn advance(&mut self, given: Given) {
        self.given.push(given);
        self.due = self.across();
    }

    /// Forgets all light that is on its way.
    pub fn put_out(&mut self) {
        self.given.iter_mut().for_each(|given| given.laser = Ok(LaserCycle::OFF));
        self.due = Ok(LaserCycle::OFF);
    }

    /// Dark, before the first setpoint of a stream.
    pub fn rewind(&mut self) {
        self.given.fill(Given::NOTHING);
        self.due = Ok(LaserCycle::OFF);
    }

    /// What the gate shall do in the cycle in which the command acts.
    ///
    /// # Errors
    /// More changes than a cycle can hold.
    pub fn due(&self) -> Result<LaserCycle, TooManyEdges> {
        self.due
    }

    /// Whether light is sent in this cycle. More of it than can be told is light too.
    pub fn is_due(&self) -> bool {
        self.due.map_or(true, |laser| laser.is_lit())
    }

    /// Whether any light is on its way, the one that is sent in this cycle included.
    pub fn is_coming(&self) -> bool {
        // What is left of the next one is in what is sent now.
        let mut given = (0..=self.behind.cycles).map(|back| self.given.back(back));
        self.is_due() || given.any(|given| given.laser.map_or(true, |laser| laser.is_lit()))
    }

    /// Where in the stream the light that is sent in this cycle begins.
    pub fn from(&self) -> StreamTime {
        let later = self.given.back(self.behind.cycles);
        if self.behind.part == 0.0 {
            return later.from.max(later.dark_until);
        }
        let earlier = self.given.back(self.behind.cycles + 1);
        let length = (earlier.to - earlier.from).0 as f64;
        let passed = StreamTime((length * (1.0 - self.behind.part)).round() as i64);
        (earlier.from + passed).max(earlier.dark_until)
    }

    fn across(&self) -> Result<LaserCycle, TooManyEdges> {
        let later = self.given.back(self.behind.cycles).laser?;
        if self.behind.part == 0.0 {
            return Ok(later);
        }
        let earlier = self.given.back(self.behind.cycles + 1).laser?;
        LaserCycle::across(&earlier, &later, self.behind, self.period)
    }
}
