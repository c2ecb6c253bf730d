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

#[cfg(test)]
mod tests {
    use super::{Hop, latencies};
    use crate::{Command, Cycle, Feedback, Nanoseconds};

    /// Feedback 5 with deadline 5000, the command that answers it, and the feedback after.
    fn samples() -> (Feedback, Command, Feedback) {
        let answered = Feedback {
            cycle: Cycle(5),
            deadline: Nanoseconds(5_000),
            measured: Nanoseconds(5_020),
            published: Nanoseconds(5_030),
            exchange: Nanoseconds(11),
            ..Feedback::default()
        };
        let command = Command {
            cycle: Cycle(5),
            received: Nanoseconds(5_070),
            published: Nanoseconds(5_110),
            setpoint_published: Nanoseconds(4_000),
            ..Command::default()
        };
        let next = Feedback {
            cycle: Cycle(6),
            command_cycle: Cycle(5),
            command_received: Nanoseconds(5_150),
            command_applied: Nanoseconds(6_002),
            ..Feedback::default()
        };
        (answered, command, next)
    }

    fn found(samples: &(Feedback, Command, Feedback)) -> Vec<(Hop, i64)> {
        let (answered, command, next) = samples;
        latencies(answered, command, next).map(|(hop, latency)| (hop, latency.0)).collect()
    }

    #[test]
    fn every_hop_follows_from_the_stamps() {
        let expected = [
            (Hop::Wake, 70),
            (Hop::Compute, 40),
            (Hop::Command, 40),
            (Hop::Exchange, 11),
            (Hop::Feedback, 40),
            (Hop::Loop, 982),
            (Hop::Setpoint, 1_070),
        ];
        assert_eq!(found(&samples()), expected);
        assert_eq!(expected.map(|(hop, _)| hop), Hop::ALL);
    }

    #[test]
    fn a_hop_that_did_not_happen_is_left_out() {
        let mut late = samples();
        late.2.command_cycle = Cycle(4);
        let hops = |samples| found(samples).into_iter().map(|(hop, _)| hop).collect::<Vec<_>>();
        assert!(!hops(&late).contains(&Hop::Command) && !hops(&late).contains(&Hop::Loop));
        let mut idle = samples();
        idle.1.setpoint_published = Nanoseconds(0);
        assert!(!hops(&idle).contains(&Hop::Setpoint) && hops(&idle).len() == 6);
        let mut first = samples();
        first.2.command_received = Nanoseconds(0);
        assert_eq!(hops(&first).len(), 5);
    }
}
