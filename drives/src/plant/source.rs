//! The laser source: light follows the gate, later by the source's delays.

use machine::LaserSource;
use messages::time::Period;
use messages::{GateEdge, LaserCycle, MAX_EDGES, Nanoseconds, TooManyEdges};

/// A change of the light that is still to come.
#[derive(Debug, Clone, Copy, Default)]
struct Change {
    /// Time from the start of the cycle at hand.
    at: Nanoseconds,
    gate: u32,
    power: f64,
}

/// The source with what it has been told and not yet done.
#[derive(Debug, Clone, Copy)]
pub struct Source {
    /// How long a cycle is.
    period: Nanoseconds,
    on_delay: Nanoseconds,
    off_delay: Nanoseconds,
    asked: (u32, f64),
    light: (u32, f64),
    /// Of the newest light that was asked for [pulses/s].
    frequency: f64,
    pending: [Change; 2 * MAX_EDGES],
    count: usize,
}

impl Source {
    /// A dark source with the delays of the machine file, in cycles of this `period`.
    pub fn new(laser: &LaserSource, period: Period) -> Self {
        Self {
            period: period.time(),
            on_delay: Nanoseconds::from_seconds(laser.on_delay),
            off_delay: Nanoseconds::from_seconds(laser.off_delay),
            asked: (0, 0.0),
            light: (0, 0.0),
            frequency: 0.0,
            pending: [Change::default(); 2 * MAX_EDGES],
            count: 0,
        }
    }

    /// The light during one cycle in which the gate does what `asked` says.
    ///
    /// # Errors
    /// If it cannot be told; the source is dark from then on, until it is asked for light again.
    pub fn cycle(&mut self, asked: &LaserCycle) -> Result<LaserCycle, TooManyEdges> {
        if self.on_delay == Nanoseconds(0) && self.off_delay == Nanoseconds(0) {
            return Ok(*asked);
        }
        let mut light = self.follow(asked);
        if light.is_err() {
            *self = Self { asked: (0, 0.0), light: (0, 0.0), count: 0, ..*self };
        }
        if asked.is_lit() {
            self.frequency = asked.frequency;
        }
        if let Ok(light) = &mut light {
            // What still shines after the gate has closed was asked for before.
            light.frequency = if light.is_lit() { self.frequency } else { asked.frequency };
        }
        light
    }

    fn follow(&mut self, asked: &LaserCycle) -> Result<LaserCycle, TooManyEdges> {
        if (asked.gate, asked.power) != self.asked {
            self.ask(Nanoseconds(0), asked.gate, asked.power)?;
        }
        for edge in asked.edges() {
            self.ask(Nanoseconds(i64::from(edge.offset)), edge.gate, edge.power)?;
        }
        self.asked = asked.last();

        let due = self.pending[..self.count].iter().filter(|c| c.at < self.period).count();
        let mut light = LaserCycle { gate: self.light.0, power: self.light.1, ..LaserCycle::OFF };
        for change in &self.pending[..due] {
            if change.at <= Nanoseconds(0) {
                (light.gate, light.power) = (change.gate, change.power);
                continue;
            }
            let offset = u32::try_from(change.at.0).unwrap_or(u32::MAX);
            if !light.push(GateEdge { offset, gate: change.gate, power: change.power }) {
                return Err(TooManyEdges);
            }
        }
        self.light = light.last();
        self.pending.copy_within(due..self.count, 0);
        self.count -= due;
        for change in &mut self.pending[..self.count] {
            change.at = change.at - self.period;
        }
        Ok(light)
    }

    /// A change of the gate at `at`. It takes back what would only happen after it.
    fn ask(&mut self, at: Nanoseconds, gate: u32, power: f64) -> Result<(), TooManyEdges> {
        let at = at + if gate == 0 { self.off_delay } else { self.on_delay };
        while self.count > 0 && self.pending[self.count - 1].at >= at {
            self.count -= 1;
        }
        let slot = self.pending.get_mut(self.count).ok_or(TooManyEdges)?;
        *slot = Change { at, gate, power };
        self.count += 1;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(on_delay: f64, off_delay: f64) -> Source {
        let laser = LaserSource { on_delay, off_delay, ..LaserSource::IDEAL };
        Source::new(&laser, Period::OF_SETPOINTS)
    }

    fn pulse(on: u32, off: u32) -> LaserCycle {
        let mut cycle = LaserCycle::OFF;
        assert!(cycle.push(GateEdge { offset: on, gate: 3, power: 0.5 }));
        assert!(cycle.push(GateEdge { offset: off, gate: 0, power: 0.0 }));
        cycle
    }

    #[test]
    fn without_delays_light_is_the_gate() {
        let cycle = pulse(100, 900_000);
        assert_eq!(source(0.0, 0.0).cycle(&cycle), Ok(cycle));
    }

    #[test]
    fn delays_move_edges_into_the_next_cycle() {
        let mut source = source(30e-6, 50e-6);
        let light = source.cycle(&pulse(100_000, 980_000)).unwrap_or_default();
        assert_eq!(light.edges(), &[GateEdge { offset: 130_000, gate: 3, power: 0.5 }]);
        let light = source.cycle(&LaserCycle::OFF).unwrap_or_default();
        assert_eq!((light.gate, light.power), (3, 0.5));
        assert_eq!(light.edges(), &[GateEdge { offset: 30_000, gate: 0, power: 0.0 }]);
        assert_eq!(source.cycle(&LaserCycle::OFF), Ok(LaserCycle::OFF));
    }

    #[test]
    fn light_keeps_its_frequency_when_the_gate_has_closed() {
        let mut source = source(30e-6, 50e-6);
        let told = |mut cycle: LaserCycle, frequency| {
            cycle.frequency = frequency;
            cycle
        };
        let mut frequency =
            |asked: LaserCycle| source.cycle(&asked).map(|light| light.frequency).unwrap_or(-1.0);
        assert_eq!(frequency(told(pulse(100_000, 980_000), 20e3)), 20e3);
        assert_eq!(frequency(LaserCycle::OFF), 20e3, "the tail");
        assert_eq!(frequency(LaserCycle::OFF), 0.0);
        assert_eq!(frequency(told(LaserCycle::OFF, 50e3)), 50e3);
        assert_eq!(frequency(told(pulse(0, 500_000), 50e3)), 50e3);
    }

    #[test]
    fn a_pulse_shorter_than_the_delays_differ_by_gives_no_light() {
        let mut source = source(50e-6, 20e-6);
        let light = source.cycle(&pulse(100_000, 120_000)).unwrap_or_default();
        assert!(!light.is_lit(), "{light:?}");
    }

    #[test]
    fn a_delay_longer_than_a_cycle_waits() {
        let mut source = source(2.5e-3, 0.0);
        let on = LaserCycle { gate: 1, power: 1.0, ..LaserCycle::OFF };
        let lit: Vec<_> = (0..4).map(|_| source.cycle(&on).unwrap_or_default().is_lit()).collect();
        assert_eq!(lit, [false, false, true, true]);
    }
}
