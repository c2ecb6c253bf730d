//! What the laser did, for the feedback: what a port was shown to have done, later by the latency of its gate.

use machine::LaserSource;
use messages::time::Period;
use messages::{GateEdge, LaserCycle, Nanoseconds};

use crate::plant::source::Source;

/// The light since the newest measurement.
#[derive(Debug, Clone, Copy)]
pub struct Fired {
    source: Source,
    period: Period,
    light: LaserCycle,
    cycles: u32,
}

impl Fired {
    /// A dark gate whose offsets count from `latency` after the deadline of its cycle, before `source`.
    pub fn new(source: &LaserSource, latency: Nanoseconds, period: Period) -> Self {
        let later = |delay: f64| delay + latency.seconds();
        let (on_delay, off_delay) = (later(source.on_delay), later(source.off_delay));
        let source = Source::new(&LaserSource { on_delay, off_delay, ..*source }, period);
        Self { source, period, light: LaserCycle::OFF, cycles: 0 }
    }

    /// A cycle has passed in which the gate did as `laser` says. Changes beyond what a sample holds are left
    /// out, the last ones first.
    pub fn pass(&mut self, laser: &LaserCycle) {
        let light = self.source.cycle(laser).unwrap_or(LaserCycle::OFF);
        let start = self.cycles.saturating_mul(self.period.time().0 as u32);
        self.cycles += 1;
        if start == 0 {
            self.light = light;
            return;
        }
        let first = GateEdge { offset: 0, gate: light.gate, power: light.power };
        let changes = (self.light.last() != (light.gate, light.power)).then_some(&first);
        for edge in changes.into_iter().chain(light.edges()) {
            let _ =
                self.light.push(GateEdge { offset: edge.offset.saturating_add(start), ..*edge });
        }
    }

    /// The light since it was taken before.
    pub fn take(&mut self) -> LaserCycle {
        self.cycles = 0;
        core::mem::replace(&mut self.light, LaserCycle::OFF)
    }
}
