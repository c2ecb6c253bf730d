//! The stalls of a run as summaries tell them.

use messages::time::Period;
use messages::{ControllerReport, StallCause, Stalls};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The name of what nothing explains.
const UNKNOWN: &str = "unknown";

/// Times in which the control cycle stood still. With strict deadlines the axes went on with their
/// last command, in the dark; a clock that may slip waited.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StallSummary {
    /// How many.
    pub count: u64,
    /// How long all of them together [s].
    pub total: f64,
    /// How long the longest [s].
    pub longest: f64,
    /// When the longest began, from the first cycle of the job [s]; null without stalls.
    pub longest_at: Option<f64>,
    /// Why the longest, as far as the kernel says.
    pub longest_causes: Vec<String>,
    /// How many by cause, `unknown` where the kernel says nothing; a stall may have several.
    pub causes: BTreeMap<String, u64>,
}

impl StallSummary {
    /// Of the stream that the controller reports of, in cycles of this `period`; drives may still speak of
    /// another one.
    pub fn of(stalls: &Stalls, stream: &ControllerReport, period: Period) -> Self {
        if stalls.count == 0 || stalls.stream != stream.stream {
            return Self::default();
        }
        let known = StallCause::ALL.map(StallCause::name).into_iter().chain([UNKNOWN]);
        let counted = known.zip(stalls.causes).filter(|(_, count)| *count > 0);
        let cycles = stalls.longest_cycle.0.saturating_sub(stream.first_cycle.0);
        Self {
            count: stalls.count,
            total: stalls.total.seconds(),
            longest: stalls.longest.seconds(),
            longest_at: Some(period.of(cycles).seconds()),
            longest_causes: StallCause::of(stalls.longest_causes)
                .map(|cause| cause.name().to_owned())
                .collect(),
            causes: counted.map(|(name, count)| (name.to_owned(), count)).collect(),
        }
    }

    /// How long the longest was and why, in words.
    pub fn longest_text(&self) -> String {
        let milliseconds = self.longest * 1e3;
        let causes: Vec<&str> = StallCause::ALL
            .into_iter()
            .filter(|cause| self.longest_causes.iter().any(|name| name == cause.name()))
            .map(StallCause::text)
            .collect();
        match causes[..] {
            [] => format!("{milliseconds:.1} ms, the kernel does not say why"),
            _ => format!("{milliseconds:.1} ms: {}", causes.join("; ")),
        }
    }

    /// What a person should know of a run with strict deadlines; `None` without stalls.
    pub fn warning(&self) -> Option<String> {
        let times = match self.count {
            0 => return None,
            1 => "once".to_owned(),
            count => format!("{count} times"),
        };
        Some(format!(
            "the axes went on without a fresh command {times}, in the dark; the longest stall was {}",
            self.longest_text()
        ))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use messages::{Cycle, Nanoseconds};

    fn stalls() -> Stalls {
        Stalls {
            stream: 3,
            count: 4,
            total: Nanoseconds(12_000_000),
            longest: Nanoseconds(8_000_000),
            longest_cycle: Cycle(1600),
            longest_causes: StallCause::Steal.bit() | StallCause::PageFault.bit(),
            causes: [2, 1, 0, 0, 0, 0, 0, 2],
            ..Stalls::default()
        }
    }

    fn stream(stream: u64) -> ControllerReport {
        ControllerReport { stream, first_cycle: Cycle(600), ..ControllerReport::default() }
    }

    #[test]
    fn the_longest_is_told_with_its_time_and_causes() {
        let summary = StallSummary::of(&stalls(), &stream(3), Period::OF_SETPOINTS);
        assert_eq!((summary.count, summary.total, summary.longest), (4, 12e-3, 8e-3));
        assert_eq!(summary.longest_at, Some(1.0));
        assert_eq!(summary.longest_causes, ["steal", "page_fault"]);
        let causes: Vec<_> =
            summary.causes.iter().map(|(name, count)| (&name[..], *count)).collect();
        assert_eq!(causes, [("page_fault", 1), ("steal", 2), ("unknown", 2)]);
        assert_eq!(
            summary.warning().unwrap(),
            "the axes went on without a fresh command 4 times, in the dark; the longest stall was \
             8.0 ms: the hypervisor took the CPU (steal time); memory was not there (page faults)"
        );
    }

    #[test]
    fn what_the_kernel_does_not_say_is_not_made_up() {
        let unknown = Stalls { count: 1, longest_causes: 0, ..stalls() };
        assert_eq!(
            StallSummary::of(&unknown, &stream(3), Period::OF_SETPOINTS).warning().unwrap(),
            "the axes went on without a fresh command once, in the dark; the longest stall was 8.0 \
             ms, the kernel does not say why"
        );
    }

    #[test]
    fn another_streams_stalls_are_not_this_ones() {
        let summary = StallSummary::of(&stalls(), &stream(4), Period::OF_SETPOINTS);
        assert_eq!((summary.warning(), summary), (None, StallSummary::default()));
    }
}
