//! The recording of a run: each feedback with the command that answered it, in order.
//!
//! The monitor is best effort, so samples can be lost on the way. [`Recorder`] tells a loss from a
//! command that was never given and from cycles that drives skipped, and counts it: a judgement over
//! a gap would be wrong.

pub mod file;
pub mod table;

use signals::{Command, Feedback, Sample};
use std::collections::VecDeque;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// One control cycle: the measurement at its deadline and the controller's answer to it.
#[derive(Debug, Clone, Copy, PartialEq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct CycleRecord {
    /// What drives measured at `t[k]`.
    pub feedback: Feedback,
    /// What the controller answered, or zeros when it gave no answer to this feedback.
    pub command: Command,
}

impl CycleRecord {
    /// A cycle that the controller did not answer.
    pub fn unanswered(feedback: Feedback) -> Self {
        Self { feedback, command: Command::zeroed() }
    }

    /// Whether the controller answered; otherwise `command` is zeros.
    pub fn is_answered(&self) -> bool {
        self.command.cycle == self.feedback.cycle && self.command != Command::zeroed()
    }
}

/// Pairs feedback and commands as they arrive on two channels, and counts what did not.
#[derive(Debug, Default)]
pub struct Recorder {
    feedbacks: VecDeque<Feedback>,
    commands: VecDeque<Command>,
    records: Vec<CycleRecord>,
    newest: Option<u64>,
    started: bool,
    lost: u64,
}

impl Recorder {
    /// Feedback waits for its command until this many newer ones have arrived: longer than the
    /// two channels can be apart when they are emptied one after the other.
    pub const PATIENCE: usize = 256;

    /// A recorder that has seen nothing.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes a feedback; feedback comes in order, possibly with gaps.
    pub fn feedback(&mut self, feedback: &Feedback) {
        let cycle = feedback.cycle.0;
        if let Some(newest) = self.newest
            && self.started
        {
            // A cycle number that falls back is another drives process: nothing joins up there.
            self.lost += cycle.checked_sub(newest.saturating_add(feedback.elapsed())).unwrap_or(1);
        }
        self.newest = Some(cycle);
        self.feedbacks.push_back(*feedback);
        self.pair(Self::PATIENCE);
    }

    /// Takes a command; commands come in order, possibly with gaps.
    pub fn command(&mut self, command: &Command) {
        self.commands.push_back(*command);
        self.pair(Self::PATIENCE);
    }

    /// Ends the recording: what still waits for its command stays unanswered.
    pub fn finish(&mut self) {
        self.pair(0);
        self.commands.clear();
    }

    /// The records completed since the last call, in order of their cycle.
    pub fn take(&mut self) -> Vec<CycleRecord> {
        std::mem::take(&mut self.records)
    }

    /// Samples known to be lost since the first record.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    fn pair(&mut self, patience: usize) {
        while let Some(feedback) = self.feedbacks.front().copied() {
            while self.commands.front().is_some_and(|command| command.cycle < feedback.cycle) {
                self.commands.pop_front();
            }
            let record = match self.commands.front().copied() {
                Some(command) if command.cycle == feedback.cycle => {
                    self.commands.pop_front();
                    CycleRecord { feedback, command }
                }
                None if self.feedbacks.len() <= patience => return,
                // A newer command is here, or none will come.
                _ => CycleRecord::unanswered(feedback),
            };
            self.feedbacks.pop_front();
            if record.is_answered() {
                self.started = true;
            } else if self.started && self.was_in_force(&feedback) {
                self.lost += 1;
            }
            // Before the first answer nothing is lit, and nothing can be known to be lost.
            if self.started {
                self.records.push(record);
            }
        }
    }

    /// Whether drives reports a command for `feedback` that never arrived here.
    fn was_in_force(&self, feedback: &Feedback) -> bool {
        self.feedbacks.front().is_some_and(|next| {
            next.cycle.0 == feedback.cycle.0 + next.elapsed()
                && next.command_cycle == feedback.cycle
                && next.command_published.0 != 0
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use signals::{Cycle, Nanoseconds};

    fn feedback(cycle: u64) -> Feedback {
        Feedback {
            cycle: Cycle(cycle),
            command_cycle: Cycle(cycle.saturating_sub(1)),
            command_published: Nanoseconds(1),
            ..Feedback::default()
        }
    }

    fn command(cycle: u64) -> Command {
        Command { cycle: Cycle(cycle), mode: 4, ..Command::default() }
    }

    /// Feeds cycles `0..count` without those that a predicate drops; gives records and losses.
    fn record(
        count: u64,
        keep_feedback: impl Fn(u64) -> bool,
        keep_command: impl Fn(u64) -> bool,
    ) -> (Vec<CycleRecord>, u64) {
        let mut recorder = Recorder::new();
        // In batches, all feedback before all commands, as a service empties its channels.
        for batch in (0..count).collect::<Vec<_>>().chunks(40) {
            for &cycle in batch.iter().filter(|&&cycle| keep_feedback(cycle)) {
                recorder.feedback(&feedback(cycle));
            }
            for &cycle in batch.iter().filter(|&&cycle| keep_command(cycle)) {
                recorder.command(&command(cycle));
            }
        }
        recorder.finish();
        (recorder.take(), recorder.lost())
    }

    #[test]
    fn pairs_every_cycle_across_batches() {
        let (records, lost) = record(1000, |_| true, |_| true);
        assert_eq!((records.len(), lost), (1000, 0));
        for (cycle, record) in records.iter().enumerate() {
            assert_eq!(record.feedback.cycle.0, cycle as u64);
            assert!(record.is_answered(), "cycle {cycle}");
        }
    }

    #[test]
    fn counts_lost_feedback() {
        let (records, lost) = record(1000, |cycle| !(300..307).contains(&cycle), |_| true);
        assert_eq!((records.len(), lost), (993, 7));
    }

    #[test]
    fn cycles_that_drives_skipped_are_no_loss() {
        let mut recorder = Recorder::new();
        for cycle in (0..300).chain(307..400).chain(410..500) {
            // Before 410, three feedbacks were lost as well.
            let skipped = match cycle {
                307 => 7,
                410 => 7,
                _ => 0,
            };
            recorder.feedback(&Feedback { skipped, ..feedback(cycle) });
            recorder.command(&command(cycle));
        }
        recorder.finish();
        assert_eq!((recorder.take().len(), recorder.lost()), (483, 3));
    }

    #[test]
    fn counts_lost_commands_that_were_in_force() {
        let (records, lost) = record(1000, |_| true, |cycle| cycle != 500);
        assert_eq!((records.len(), lost), (1000, 1));
        assert!(!records[500].is_answered());
    }

    #[test]
    fn a_command_never_given_is_not_a_loss() {
        let mut recorder = Recorder::new();
        for cycle in 0..600 {
            let mut feedback = feedback(cycle);
            // The controller dies after cycle 9: its last command stays the newest known.
            feedback.command_cycle = Cycle(cycle.saturating_sub(1).min(9));
            recorder.feedback(&feedback);
            if cycle < 10 {
                recorder.command(&command(cycle));
            }
        }
        recorder.finish();
        assert_eq!((recorder.take().len(), recorder.lost()), (600, 0));
    }

    #[test]
    fn joining_in_the_middle_is_not_a_loss() {
        let (records, lost) = record(1000, |cycle| cycle >= 100, |cycle| cycle >= 117);
        assert_eq!((records.len(), lost), (883, 0));
        assert_eq!(records[0].feedback.cycle.0, 117);
    }
}
