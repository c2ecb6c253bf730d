//! The laser's part of a cycle: gate, power, and when inside the cycle they change.

use crate::sample;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// The most gate edges one cycle can hold; the planner refuses a job that needs more.
pub const MAX_EDGES: usize = 16;

/// One change of the laser inside a cycle.
#[derive(Debug, Clone, Copy, Default, PartialEq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct GateEdge {
    /// Time from the start of the cycle [ns], below the period.
    pub offset: u32,
    /// The gate from here on: 0 closed, otherwise open and marking the stroke with this number.
    pub gate: u32,
    /// Power from here on, as a fraction of full scale, 0..=1.
    pub power: f64,
}

sample! {
    /// What the laser does in one cycle.
    LaserCycle = "graver.LaserCycle.v1" {
        /// The gate when the cycle starts: 0 closed, otherwise open and marking the stroke with
        /// this number (from 1, in the order of the artwork). Light always belongs to a stroke.
        gate: u32,
        /// How many of `edges` count, in order of their offset.
        edge_count: u32,
        /// Power when the cycle starts, as a fraction of full scale, 0..=1.
        power: f64,
        /// The changes inside the cycle; unused entries are zero.
        edges: [GateEdge; MAX_EDGES],
    }
}

impl LaserCycle {
    /// A cycle in the dark.
    pub const OFF: Self = Self {
        gate: 0,
        edge_count: 0,
        power: 0.0,
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

    /// Whether it makes sense: edges in order inside the cycle, power a fraction, count in range.
    /// Drives keeps a cycle dark that does not.
    pub fn is_valid(&self) -> bool {
        let fraction = |power: f64| (0.0..=1.0).contains(&power);
        self.edge_count as usize <= MAX_EDGES
            && fraction(self.power)
            && self.edges().iter().all(|edge| {
                fraction(edge.power) && i64::from(edge.offset) < crate::time::CYCLE_PERIOD.0
            })
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
}
