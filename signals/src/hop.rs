//! The hops whose latency Graver measures, and how each follows from the samples' own stamps.

use crate::{Command, Feedback, Nanoseconds};

/// One leg of a sample's way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Hop {
    /// Deadline to controller running.
    Wake,
    /// The controller's step.
    Compute,
    /// Controller publish to drives received.
    Command,
    /// Drives with hardware or plant.
    Exchange,
    /// Drives publish to controller read.
    Feedback,
    /// Measurement taken to the command that uses it applied.
    Loop,
    /// Planner publish to controller use.
    Setpoint,
}

impl Hop {
    /// All hops in the order of reports.
    pub const ALL: [Self; 7] = [
        Self::Wake,
        Self::Compute,
        Self::Command,
        Self::Exchange,
        Self::Feedback,
        Self::Loop,
        Self::Setpoint,
    ];

    /// The name in summaries.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wake => "wake",
            Self::Compute => "compute",
            Self::Command => "command",
            Self::Exchange => "exchange",
            Self::Feedback => "feedback",
            Self::Loop => "loop",
            Self::Setpoint => "setpoint",
        }
    }
}

/// The latencies that one command tells together with the feedback it answers, and the feedback
/// that follows it: `(hop, latency)`, hops that did not happen left out.
///
/// `answered` has the cycle of `command`; `next` is the feedback in which drives reports that
/// this command is in force (`next.command_cycle == command.cycle`).
pub fn latencies<'a>(
    answered: &'a Feedback,
    command: &'a Command,
    next: &'a Feedback,
) -> impl Iterator<Item = (Hop, Nanoseconds)> + 'a {
    let fresh = next.command_cycle == command.cycle && next.command_received.0 != 0;
    let setpoint = command.setpoint_published.0 != 0;
    [
        Some((Hop::Wake, command.received - answered.deadline)),
        Some((Hop::Compute, command.published - command.received)),
        fresh.then(|| (Hop::Command, next.command_received - command.published)),
        Some((Hop::Exchange, answered.exchange)),
        Some((Hop::Feedback, command.received - answered.published)),
        fresh.then(|| (Hop::Loop, next.command_applied - answered.measured)),
        setpoint.then(|| (Hop::Setpoint, command.received - command.setpoint_published)),
    ]
    .into_iter()
    .flatten()
}
