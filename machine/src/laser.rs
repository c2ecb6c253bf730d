//! The laser source at the tool.

use messages::math;

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
    /// The lowest and the highest pulse repetition rate that a job may ask for [pulses/s]; `None` where
    /// the source has none, or keeps its own.
    pub frequency: Option<[f64; 2]>,
}

impl LaserSource {
    /// Switches at once, at any power.
    pub const IDEAL: Self = Self {
        on_delay: 0.0,
        off_delay: 0.0,
        min_power: 0.0,
        proportional_floor: 0.0,
        frequency: None,
    };

    /// The longest delay that a machine file may give a source [s]. Real ones switch within
    /// milliseconds; a longer one is a wrong unit.
    pub const LONGEST_DELAY: f64 = 1.0;

    /// The pulses a second of a `rate` that is told in turns [rad/s], to a thousandth of a pulse.
    pub fn pulses(rate: f64) -> f64 {
        (rate / math::TURN * 1e3).round() / 1e3
    }

    /// Whether it can pulse at `frequency` [pulses/s]; 0 leaves it as it is set.
    pub fn pulses_at(&self, frequency: f64) -> bool {
        let within = |[least, most]: [f64; 2]| (least..=most).contains(&frequency);
        frequency == 0.0 || self.frequency.is_some_and(within)
    }
}
