//! How much is recorded.

use super::CycleRecord;
use messages::Nanoseconds;
use messages::time::Period;
use serde::{Deserialize, Serialize};

/// Time between two cycles of a decimated recording.
const DECIMATED: Nanoseconds = Nanoseconds(10_000_000);

/// How much of a run stays on the disk.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// Nothing.
    Off,
    /// What happens: states, faults, strokes, inputs and outputs, gaps.
    Events,
    /// That, and a hundred cycles a second.
    Decimated,
    /// Every cycle.
    #[default]
    Full,
}

impl Level {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Events => "events",
            Self::Decimated => "decimated",
            Self::Full => "full",
        }
    }

    /// Whether this record stays, of cycles of `period`.
    pub fn keeps(self, record: &CycleRecord, period: Period) -> bool {
        match self {
            Self::Off | Self::Events => false,
            Self::Decimated => {
                record.feedback.cycle.0.is_multiple_of(period.cycles_for(DECIMATED).max(1))
            }
            Self::Full => true,
        }
    }
}
