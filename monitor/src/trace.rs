//! What the report draws of a run.

use crate::marks::tool_path::LitSpans;
use signals::LaserCycle;

/// Share of a cycle in which the laser marked, 0..=1.
pub fn lit_share(laser: &LaserCycle) -> f64 {
    LitSpans::of(laser).share()
}
