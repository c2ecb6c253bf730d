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
    /// The least power at which the source gives steady light [fraction of full scale], 0 to 1: the
    /// planner asks for no less while it is lit.
    pub min_power: f64,
    /// The least fraction of the power asked for that power in proportion to the speed goes down to,
    /// 0 to 1.
    pub proportional_floor: f64,
}

impl LaserSource {
    /// Switches at once, at any power.
    pub const IDEAL: Self =
        Self { on_delay: 0.0, off_delay: 0.0, min_power: 0.0, proportional_floor: 0.0 };

    /// The longest delay that a machine file may give a source [s]. Real ones switch within
    /// milliseconds; a longer one is a wrong unit.
    pub const LONGEST_DELAY: f64 = 1.0;
}
