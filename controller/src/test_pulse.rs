//! A test pulse of the laser: bounded in power and time, at rest, and never without being asked for.

use messages::{GateEdge, LaserCycle, Nanoseconds};

/// The stroke that a test pulse is told as: there is no artwork that it could belong to.
const STROKE: u32 = 1;

/// What is left of a pulse.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TestPulse {
    power: f64,
    left: Nanoseconds,
}

impl TestPulse {
    /// Of this power, 0..=1, for `time`.
    pub fn new(power: f64, time: Nanoseconds) -> Self {
        Self { power, left: time }
    }

    /// Whether it is over.
    pub fn is_over(&self) -> bool {
        self.left.0 <= 0
    }

    /// Its light in the next cycle of `period`.
    pub fn cycle(&mut self, period: Nanoseconds) -> LaserCycle {
        if self.is_over() {
            return LaserCycle::OFF;
        }
        let mut laser = LaserCycle { gate: STROKE, power: self.power, ..LaserCycle::OFF };
        if self.left < period {
            let offset = u32::try_from(self.left.0).unwrap_or_default();
            // A cycle has room for one edge.
            let _ = laser.push(GateEdge { offset, ..GateEdge::default() });
        }
        self.left = self.left - period;
        laser
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pulse_is_lit_for_its_time_and_not_longer() {
        let period = Nanoseconds(1_000_000);
        let mut pulse = TestPulse::new(0.05, Nanoseconds(2_300_000));
        let cycles: Vec<LaserCycle> = (0..5).map(|_| pulse.cycle(period)).collect();
        let lit = [(1, 0), (1, 0), (1, 1), (0, 0), (0, 0)];
        for (cycle, (gate, edges)) in cycles.iter().zip(lit) {
            assert_eq!((cycle.gate, cycle.edge_count), (gate, edges));
            assert!(cycle.is_valid(period));
        }
        assert_eq!(cycles[2].edges()[0], GateEdge { offset: 300_000, gate: 0, power: 0.0 });
        assert!(pulse.is_over());
        let mut whole = TestPulse::new(0.05, Nanoseconds(1_000_000));
        assert_eq!(whole.cycle(period).last(), (1, 0.05));
        assert!(whole.is_over() && !whole.cycle(period).is_lit());
    }
}
