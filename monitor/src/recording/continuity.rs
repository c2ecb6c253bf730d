//! What a recording has and what it lacks, by the numbers of its cycles.
//!
//! Everybody who walks along a recording asks [`Succession::between`] whether two records follow
//! each other: what counts as a gap is said here alone.

use messages::Feedback;
use messages::time::Period;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Gaps that are told one by one; more are only counted.
const LISTED: usize = 100;

/// Where in the life of drives a feedback stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stamp {
    /// The run of drives.
    epoch: u64,
    /// Its cycle.
    pub cycle: u64,
    /// Cycles since the feedback before: 1, unless drives skipped some, which nobody could record.
    pub elapsed: u64,
}

impl Stamp {
    /// Of a feedback.
    pub fn of(feedback: &Feedback) -> Self {
        Self { epoch: feedback.epoch, cycle: feedback.cycle.0, elapsed: feedback.elapsed().max(1) }
    }

    /// Whether `other`, of the same run of drives, is this cycle or one before it.
    pub fn has_come_to(self, other: Self) -> bool {
        self.epoch == other.epoch && other.cycle <= self.cycle
    }
}

/// How one record follows another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Succession {
    /// With no cycle between them.
    Next,
    /// With cycles between them that nobody recorded.
    After(Gap),
    /// Not at all: they are of two runs of drives, and nothing joins up.
    Apart,
}

impl Succession {
    /// How `after` follows `before`.
    pub fn between(before: Stamp, after: Stamp) -> Self {
        if before.epoch != after.epoch || after.cycle <= before.cycle {
            Self::Apart
        } else if after.cycle <= before.cycle.saturating_add(after.elapsed) {
            Self::Next
        } else {
            Self::After(Gap { first: before.cycle + 1, last: after.cycle - after.elapsed })
        }
    }
}

/// Cycles that nobody recorded, the first and the last of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Gap {
    /// The first.
    pub first: u64,
    /// The last, not before the first.
    pub last: u64,
}

impl Gap {
    /// How many.
    pub fn cycles(self) -> u64 {
        (self.last + 1).saturating_sub(self.first)
    }
}

/// What a recording has and what it lacks.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Continuity {
    /// Records.
    pub records: u64,
    /// Gaps between them, before them and after them.
    pub gaps: u64,
    /// Cycles in those gaps, as far as their number is known.
    pub missing: u64,
    /// Cycles of the longest.
    pub longest: u64,
    /// The first hundred of them.
    pub list: Vec<Gap>,
}

impl Continuity {
    /// Counts the next record, and how it follows the one before.
    pub fn push(&mut self, succession: Succession) {
        self.records += 1;
        match succession {
            Succession::Next => {}
            Succession::After(gap) => self.lack(gap),
            Succession::Apart => self.gaps += 1,
        }
    }

    /// Counts cycles that are not there.
    pub fn lack(&mut self, gap: Gap) {
        self.gaps += 1;
        self.missing += gap.cycles();
        self.longest = self.longest.max(gap.cycles());
        if self.list.len() < LISTED {
            self.list.push(gap);
        }
    }

    /// As a summary tells it, of cycles of this `period`.
    pub fn summary(&self, period: Period) -> RecordingSummary {
        RecordingSummary {
            cycles: self.records,
            gaps: self.gaps,
            missing: self.missing,
            longest: period.of(self.longest).seconds(),
        }
    }
}

/// How complete the recording of a run is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecordingSummary {
    /// Cycles recorded.
    pub cycles: u64,
    /// Stretches of cycles that nobody recorded.
    pub gaps: u64,
    /// Cycles in them.
    pub missing: u64,
    /// The longest of them [s].
    pub longest: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::Cycle;

    fn stamp(epoch: u64, cycle: u64) -> Stamp {
        Stamp::of(&Feedback { epoch, cycle: Cycle(cycle), ..Feedback::default() })
    }

    #[test]
    fn records_follow_each_other_by_number_within_one_run_of_drives() {
        use Succession::{After, Apart, Next};
        for (before, after, expect) in [
            (stamp(1, 4), stamp(1, 5), Next),
            (stamp(1, 4), stamp(1, 6), After(Gap { first: 5, last: 5 })),
            (stamp(1, 4), stamp(1, 9), After(Gap { first: 5, last: 8 })),
            (stamp(1, 4), stamp(1, 4), Apart),
            (stamp(1, 4), stamp(1, 2), Apart),
            (stamp(1, 4), stamp(2, 5), Apart),
            (stamp(1, u64::MAX - 1), stamp(1, u64::MAX), Next),
            // Drives skipped three cycles before 8, which it says.
            (stamp(1, 4), Stamp { elapsed: 4, ..stamp(1, 8) }, Next),
            (stamp(1, 3), Stamp { elapsed: 4, ..stamp(1, 8) }, After(Gap { first: 4, last: 4 })),
        ] {
            assert_eq!(Succession::between(before, after), expect, "{before:?} {after:?}");
        }
    }

    #[test]
    fn gaps_are_counted_and_the_first_hundred_listed() {
        let mut continuity = Continuity::default();
        for index in 0..250 {
            continuity.push(Succession::Next);
            let first = 10 * index;
            continuity.push(Succession::After(Gap { first, last: first + index % 3 }));
        }
        continuity.push(Succession::Apart);
        assert_eq!((continuity.records, continuity.gaps, continuity.longest), (501, 251, 3));
        assert_eq!((continuity.missing, continuity.list.len()), (84 + 2 * 83 + 3 * 83, LISTED));
        let told = RecordingSummary { cycles: 501, gaps: 251, missing: 499, longest: 0.003 };
        assert_eq!(continuity.summary(Period::OF_SETPOINTS), told);
    }
}
