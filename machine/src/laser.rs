//! The laser source at the tool.

/// The laser source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaserSource {
    /// From the gate's opening to light [s], compensated by the planner; 0 to
    /// [`Self::LONGEST_DELAY`].
    pub on_delay: f64,
    /// From the gate's closing to darkness [s], compensated by the planner; 0 to
    /// [`Self::LONGEST_DELAY`].
    pub off_delay: f64,
}

impl LaserSource {
    /// The longest delay that a machine file may give a source [s]. Real ones switch within
    /// milliseconds; a longer one is a wrong unit.
    pub const LONGEST_DELAY: f64 = 1.0;
}
