//! The recording of a run: each feedback with the command that answered it, in order.
//!
//! The monitor is best effort, so samples can be lost on the way, and cycles pass while no monitor
//! lives. [`Recorder`] tells a loss from a command that was never given and from cycles that drives
//! skipped, and counts it.

pub mod continuity;
mod cycle;
pub mod events;
pub mod file;
pub mod info;
pub mod lead;
pub mod level;
pub mod message;
pub mod old_file;
pub mod supply;
pub mod table;
pub mod wire;

use continuity::{Continuity, Stamp, Succession};
use messages::{Command, Feedback, Sample};
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
    /// The newest record.
    newest: Option<Stamp>,
    started: bool,
    continuity: Continuity,
    lost_commands: u64,
}

impl Recorder {
    /// Feedback waits for its command until this many newer ones have arrived: longer than the
    /// two channels can be apart when they are emptied one after the other.
    pub const PATIENCE: usize = 256;

    /// A recorder that has seen nothing.
    pub fn new() -> Self {
        Self::default()
    }

    /// A recorder that goes on after `last`, which another process recorded, with what that counted.
    pub fn resume(last: &CycleRecord, continuity: Continuity, lost_commands: u64) -> Self {
        let newest = Some(Stamp::of(&last.feedback));
        Self { newest, started: true, continuity, lost_commands, ..Self::default() }
    }

    /// A recorder that has what waits in this one, and has counted nothing.
    pub fn begun_anew(&self) -> Self {
        let (feedbacks, commands) = (self.feedbacks.clone(), self.commands.clone());
        Self { feedbacks, commands, started: self.started, ..Self::default() }
    }

    /// Takes a feedback; feedback comes in order, possibly with gaps. One that was recorded before
    /// is left out: a monitor that was started again gets some of what its predecessor had.
    pub fn feedback(&mut self, feedback: &Feedback) {
        if self.newest.is_some_and(|newest| newest.has_come_to(Stamp::of(feedback))) {
            return;
        }
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

    /// What was recorded since the first record, and what was not.
    pub fn continuity(&self) -> &Continuity {
        &self.continuity
    }

    /// Commands that were in force in recorded cycles and never arrived here.
    pub fn lost_commands(&self) -> u64 {
        self.lost_commands
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
                self.lost_commands += 1;
            }
            // Before the first answer nothing is lit, and nothing can be known to be lost.
            if self.started {
                self.push(record);
            }
        }
    }

    fn push(&mut self, record: CycleRecord) {
        let stamp = Stamp::of(&record.feedback);
        let succession = |newest| Succession::between(newest, stamp);
        self.continuity.push(self.newest.map_or(Succession::Next, succession));
        self.newest = Some(stamp);
        self.records.push(record);
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
    use messages::{Cycle, Nanoseconds};

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
        let lost = recorder.continuity().missing + recorder.lost_commands();
        (recorder.take(), lost)
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
        assert_eq!((recorder.take().len(), recorder.continuity().missing), (483, 3));
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
        assert_eq!((recorder.take().len(), recorder.lost_commands()), (600, 0));
        assert_eq!(recorder.continuity().gaps, 0);
    }

    #[test]
    fn a_successor_counts_the_gap_that_its_predecessor_left() {
        let mut first = Recorder::new();
        let mut second = None;
        for cycle in 0..500 {
            let recorder = match (&mut second, cycle) {
                (None, 0..200) => &mut first,
                (None, 300..) => {
                    first.finish();
                    let records = first.take();
                    assert_eq!(records.len(), 200);
                    let counted = (first.continuity().clone(), first.lost_commands());
                    second.insert(Recorder::resume(&records[199], counted.0, counted.1))
                }
                (Some(second), _) => second,
                _ => continue,
            };
            recorder.feedback(&feedback(cycle));
            // The command for the first feedback came before the successor listened.
            if cycle != 300 {
                recorder.command(&command(cycle));
            }
        }
        let mut second = second.unwrap();
        second.finish();
        let records = second.take();
        assert_eq!((records.len(), records[0].feedback.cycle.0), (200, 300));
        assert!(!records[0].is_answered() && records[1].is_answered());
        let Continuity { records, gaps, missing, longest, list } = second.continuity().clone();
        assert_eq!((records, gaps, missing, longest), (400, 1, 100, 100));
        assert_eq!(list, [continuity::Gap { first: 200, last: 299 }]);
        assert_eq!(second.lost_commands(), 1);
    }

    #[test]
    fn joining_in_the_middle_is_not_a_loss() {
        let (records, lost) = record(1000, |cycle| cycle >= 100, |cycle| cycle >= 117);
        assert_eq!((records.len(), lost), (883, 0));
        assert_eq!(records[0].feedback.cycle.0, 117);
    }
}
