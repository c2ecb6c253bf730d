//! The laser's part of a cycle: gate, power, and when inside the cycle they change.

use crate::delay::Delay;
use crate::time::Period;
use crate::{Nanoseconds, sample};

/// The most gate edges one cycle can hold, of the setpoints or of control; the planner refuses a job
/// that needs more.
pub const MAX_EDGES: usize = 16;

sample! {
    /// One change of the laser inside a cycle.
    GateEdge = "graver.GateEdge.v1" {
        /// Time from the start of the cycle [ns]; below the period in a command, and in a feedback
        /// that skipped no cycle.
        offset: u32,
        /// The gate from here on: 0 closed, otherwise open and marking the stroke with this number.
        gate: u32,
        /// Power from here on, as a fraction of full scale, 0..=1.
        power: f64,
    }
}

sample! {
    /// What the laser does in one cycle.
    LaserCycle = "graver.LaserCycle.v2" {
        /// The gate when the cycle starts: 0 closed, otherwise open and marking the stroke with
        /// this number (from 1, in the order of the artwork). Light always belongs to a stroke.
        gate: u32,
        /// How many of `edges` count, in order of their offset.
        edge_count: u32,
        /// Power when the cycle starts, as a fraction of full scale, 0..=1.
        power: f64,
        /// Pulse repetition rate of the source from the start of the cycle on [pulses/s]; 0 leaves it as
        /// the source is set. It changes in the dark only.
        frequency: f64,
        /// The changes inside the cycle; unused entries are zero.
        edges: [GateEdge; MAX_EDGES],
    }
}

/// More changes of the laser fall into one cycle than a [`LaserCycle`] can tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooManyEdges;

impl LaserCycle {
    /// A cycle in the dark.
    pub const OFF: Self = Self {
        gate: 0,
        edge_count: 0,
        power: 0.0,
        frequency: 0.0,
        edges: [GateEdge { offset: 0, gate: 0, power: 0.0 }; MAX_EDGES],
    };

    /// The edges that count.
    pub fn edges(&self) -> &[GateEdge] {
        &self.edges[..(self.edge_count as usize).min(MAX_EDGES)]
    }

    /// Whether any part of the cycle is lit.
    pub fn is_lit(&self) -> bool {
        self.gate != 0 || self.edges().iter().any(|edge| edge.gate != 0)
    }

    /// Gate and power at the end of the cycle.
    pub fn last(&self) -> (u32, f64) {
        self.edges().last().map_or((self.gate, self.power), |edge| (edge.gate, edge.power))
    }

    /// Whether it makes sense in a cycle of this `period`: edges in order inside it, power a fraction,
    /// count in range, a finite frequency of 0 or more. Drives keeps a cycle dark that does not.
    pub fn is_valid(&self, period: Nanoseconds) -> bool {
        let fraction = |power: f64| (0.0..=1.0).contains(&power);
        self.edge_count as usize <= MAX_EDGES
            && fraction(self.power)
            && (0.0..=f64::MAX).contains(&self.frequency)
            && self
                .edges()
                .iter()
                .all(|edge| fraction(edge.power) && i64::from(edge.offset) < period.0)
            && self.edges().windows(2).all(|pair| pair[0].offset <= pair[1].offset)
    }

    /// Adds a change; `false` when the cycle is full.
    #[must_use]
    pub fn push(&mut self, edge: GateEdge) -> bool {
        let index = self.edge_count as usize;
        if index >= MAX_EDGES {
            return false;
        }
        self.edges[index] = edge;
        self.edge_count += 1;
        true
    }

    /// The cycle that is the end of `before`, as much as the part of `delay` says, and then the beginning of
    /// `after`: what two cycles of this `period` in a row do later by that part.
    ///
    /// # Errors
    /// More changes than a cycle can hold.
    pub fn across(
        before: &Self,
        after: &Self,
        delay: Delay,
        period: Period,
    ) -> Result<Self, TooManyEdges> {
        if delay.rest == Nanoseconds(0) {
            return Ok(*after);
        }
        let shift = i64::min(delay.rest.0, period.time().0) as u32;
        let start = period.time().0 as u32 - shift;
        let passed = before.edges().iter().take_while(|edge| edge.offset <= start).last();
        let (gate, power) =
            passed.map_or((before.gate, before.power), |edge| (edge.gate, edge.power));
        let mut cycle = Self { gate, power, ..Self::OFF };
        // It changes in the dark only.
        cycle.frequency = if after.is_lit() { after.frequency } else { before.frequency };
        let first = GateEdge { offset: 0, gate: after.gate, power: after.power };
        let late = before.edges().iter().filter(|edge| edge.offset > start);
        let late = late.map(|edge| GateEdge { offset: edge.offset - start, ..*edge });
        let changes = (before.last() != (after.gate, after.power)).then_some(first);
        let early = changes.into_iter().chain(after.edges().iter().copied());
        let early = early.filter(|edge| edge.offset < start);
        let early = early.map(|edge| GateEdge { offset: edge.offset + shift, ..edge });
        for edge in late.chain(early) {
            if !cycle.push(edge) {
                return Err(TooManyEdges);
            }
        }
        Ok(cycle)
    }
}

#[cfg(test)]
mod tests {
    use super::{GateEdge, LaserCycle, MAX_EDGES, TooManyEdges};
    use crate::Nanoseconds;
    use crate::delay::Delay;
    use crate::time::Period;
    use crate::time::SETPOINT_PERIOD as PERIOD;

    fn edge(offset: u32, gate: u32, power: f64) -> GateEdge {
        GateEdge { offset, gate, power }
    }

    fn cycle(gate: u32, power: f64, edges: &[GateEdge]) -> LaserCycle {
        let mut cycle = LaserCycle { gate, power, ..LaserCycle::OFF };
        assert!(edges.iter().all(|edge| cycle.push(*edge)));
        cycle
    }

    #[test]
    fn a_cycle_in_order_is_valid() {
        assert!(LaserCycle::OFF.is_valid(PERIOD));
        assert!(cycle(3, 1.0, &[]).is_valid(PERIOD));
        assert!(
            cycle(0, 0.0, &[edge(0, 1, 0.5), edge(0, 0, 0.0), edge(999_999, 2, 1.0)])
                .is_valid(PERIOD)
        );
        assert!(cycle(0, 0.0, &[edge(7, 1, 0.5); MAX_EDGES]).is_valid(PERIOD));
    }

    #[test]
    fn a_cycle_that_makes_no_sense_is_not() {
        for power in [-0.1, 1.000_001, f64::NAN, f64::INFINITY] {
            assert!(!cycle(1, power, &[]).is_valid(PERIOD), "{power} at the start");
            assert!(!cycle(0, 0.0, &[edge(0, 1, power)]).is_valid(PERIOD), "{power} at an edge");
        }
        assert!(!cycle(0, 0.0, &[edge(1_000_000, 1, 0.5)]).is_valid(PERIOD), "beyond the cycle");
        assert!(
            !cycle(0, 0.0, &[edge(5, 1, 0.5), edge(4, 0, 0.0)]).is_valid(PERIOD),
            "back in time"
        );
        for frequency in [-1.0, f64::NAN, f64::INFINITY] {
            assert!(!LaserCycle { frequency, ..LaserCycle::OFF }.is_valid(PERIOD), "{frequency}");
        }
        let count = MAX_EDGES as u32 + 1;
        for edge_count in [count, u32::MAX] {
            assert!(!LaserCycle { edge_count, ..LaserCycle::OFF }.is_valid(PERIOD), "{edge_count}");
        }
    }

    #[test]
    fn a_later_cycle_is_the_end_of_one_and_the_beginning_of_the_next() {
        let before = cycle(0, 0.0, &[edge(100_000, 3, 0.5), edge(800_000, 0, 0.0)]);
        let after = cycle(4, 0.25, &[edge(300_000, 0, 0.0), edge(700_000, 5, 1.0)]);
        let delay = |time: i64| Delay::of(Nanoseconds(time), Period::OF_SETPOINTS);
        let across =
            |time: i64| LaserCycle::across(&before, &after, delay(time), Period::OF_SETPOINTS);
        assert_eq!(across(0), Ok(after));
        let quarter = [
            edge(50_000, 0, 0.0),
            edge(250_000, 4, 0.25),
            edge(550_000, 0, 0.0),
            edge(950_000, 5, 1.0),
        ];
        assert_eq!(across(250_000), Ok(cycle(3, 0.5, &quarter)));
        let most = [edge(100_000, 3, 0.5), edge(800_000, 0, 0.0)]
            .map(|it| edge(it.offset - 1000, it.gate, it.power));
        let most = [most[0], most[1], edge(999_000, 4, 0.25)];
        assert_eq!(across(999_000), Ok(cycle(0, 0.0, &most)));
        // No change where one goes on as the other ended.
        let lit = cycle(2, 0.5, &[]);
        assert_eq!(LaserCycle::across(&lit, &lit, delay(500_000), Period::OF_SETPOINTS), Ok(lit));
        let full = cycle(0, 0.0, &[edge(400_000, 1, 0.5); MAX_EDGES]);
        let beyond = LaserCycle::across(&full, &full, delay(700_000), Period::OF_SETPOINTS);
        assert_eq!(beyond, Err(TooManyEdges));
    }

    #[test]
    fn edges_that_do_not_count_are_not_looked_at() {
        let mut cycle = cycle(0, 0.0, &[edge(3, 1, 0.5)]);
        cycle.edges[1] = edge(u32::MAX, 9, f64::NAN);
        assert!(cycle.is_valid(PERIOD));
        assert_eq!(cycle.last(), (1, 0.5));
    }

    #[test]
    fn light_anywhere_in_the_cycle_is_light() {
        assert!(!LaserCycle::OFF.is_lit());
        assert!(cycle(1, 0.5, &[edge(0, 0, 0.0)]).is_lit());
        assert!(cycle(0, 0.0, &[edge(9, 1, 0.5), edge(10, 0, 0.0)]).is_lit());
        assert_eq!(cycle(4, 0.25, &[]).last(), (4, 0.25));
    }

    #[test]
    fn a_full_cycle_takes_no_more() {
        let mut cycle = cycle(0, 0.0, &[edge(0, 1, 1.0); MAX_EDGES]);
        let before = cycle;
        assert!(!cycle.push(edge(1, 0, 0.0)));
        assert_eq!(cycle, before);
    }
}
