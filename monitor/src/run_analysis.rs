//! What a whole recording tells: the marks, the latencies, the curves of the report. Record by
//! record, in bounded memory, whether they come from a simulation or from a file.

use crate::conclusion::LIGHT_LAG;
use crate::latency::HopHistograms;
use crate::marks::{MarkEvaluation, MarkEvaluator, Source, StreamEnd, Unevaluated};
use crate::recording::CycleRecord;
use crate::recording::continuity::{Continuity, Gap, Stamp, Succession};
use crate::tool::ToolFinder;
use crate::trace::Trace;
use machine::Machine;
use messages::ControllerReport;
use messages::artwork::{Artwork, ArtworkLine};
use messages::time::Period;

/// Whether the stamps in the samples are those of a real clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// They are: latencies are measured.
    Real,
    /// They are made up: there are no latencies.
    Virtual,
}

/// An analysis under way.
#[derive(Debug)]
pub struct RunAnalysis<'a> {
    clock: Clock,
    finder: Option<ToolFinder>,
    /// How the tool was known that the marks are judged by.
    source: Source,
    evaluator: MarkEvaluator<'a>,
    histograms: HopHistograms,
    trace: Trace,
    first: Option<u64>,
    newest: Option<Stamp>,
    continuity: Continuity,
}

/// What it found.
#[derive(Debug)]
pub struct RunResults {
    /// The marks, or why they are not judged.
    pub marks: Result<MarkEvaluation, Unevaluated>,
    /// The latencies; empty in virtual time.
    pub histograms: HopHistograms,
    /// What the report draws.
    pub trace: Trace,
    /// How complete the recording is.
    pub continuity: Continuity,
}

impl<'a> RunAnalysis<'a> {
    /// An analysis of nothing yet, against what was to be marked, of cycles of this `period`; in virtual
    /// time there are no latencies.
    pub fn new(artwork: &'a Artwork, clock: Clock, period: Period) -> Self {
        Self { evaluator: MarkEvaluator::new(artwork, period), ..Self::growing(clock, period) }
    }

    /// The same, against what [`RunAnalysis::draw`] will tell.
    pub fn growing(clock: Clock, period: Period) -> Self {
        Self {
            clock,
            finder: None,
            source: Source::Plant,
            evaluator: MarkEvaluator::growing(period),
            histograms: HopHistograms::new(),
            trace: Trace::new(clock == Clock::Real, period),
            first: None,
            newest: None,
            continuity: Continuity::default(),
        }
    }

    /// The same, knowing that the plan never marks faster than `speed` [m/s]; 0 says nothing.
    #[must_use]
    pub fn with_fastest(self, speed: f64) -> Self {
        Self { evaluator: self.evaluator.with_fastest(speed), ..self }
    }

    /// The same, of `machine`: where drives does not see the tool, it is found by the motors.
    #[must_use]
    pub fn with_machine(self, machine: &Machine) -> Self {
        let finder = Some(ToolFinder::new(machine));
        Self { finder, ..self.with_actuators(machine.actuators.len()) }
    }

    /// The same, of a machine with so many actuators: there are no curves of more.
    #[must_use]
    pub fn with_actuators(self, actuators: usize) -> Self {
        Self { trace: self.trace.with_actuators(actuators), ..self }
    }

    /// Takes what was to be marked next: before the records in which that is marked, and those just before them.
    pub fn draw(&mut self, line: ArtworkLine) {
        self.evaluator.draw(line);
    }

    /// Takes the next record.
    pub fn push(&mut self, record: &CycleRecord) {
        let found = self.finder.as_mut().and_then(|finder| finder.find(record));
        if found.is_some() {
            self.source = Source::Encoders;
        }
        let record = found.as_ref().unwrap_or(record);
        let stamp = Stamp::of(&record.feedback);
        let succession = |newest| Succession::between(newest, stamp);
        self.continuity.push(self.newest.map_or(Succession::Next, succession));
        self.first.get_or_insert(stamp.cycle);
        self.newest = Some(stamp);
        self.evaluator.push(record);
        self.trace.push(record);
        if self.clock == Clock::Real {
            self.histograms.push(record);
        }
    }

    /// Ends it, with what is known of the end of the stream.
    pub fn finish(mut self, end: StreamEnd<'_>) -> RunResults {
        self.trace.finish();
        if let StreamEnd::Reported(report) = end {
            self.count_ends(report);
        }
        let mut marks = self.evaluator.finish(end);
        if let Ok(evaluation) = &mut marks {
            evaluation.marks.source = self.source;
        }
        RunResults {
            marks,
            histograms: self.histograms,
            trace: self.trace,
            continuity: self.continuity,
        }
    }

    /// Counts what the recording lacks of the stream before its first record and after its last.
    fn count_ends(&mut self, report: &ControllerReport) {
        let (begin, end) = (report.first_cycle.0, report.last_cycle.0.saturating_add(LIGHT_LAG));
        let (first, last) = match (self.first, self.newest) {
            (Some(first), Some(newest)) => (first, newest.cycle),
            // Nothing at all was recorded: all of it is one gap.
            _ => (end + 1, end),
        };
        let before = Gap { first: begin, last: first.saturating_sub(1).min(end) };
        let after = Gap { first: (last + 1).max(begin), last: end };
        for gap in [before, after] {
            if gap.cycles() > 0 {
                self.continuity.lack(gap);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use messages::{Cycle, Feedback};

    #[test]
    fn what_the_stream_has_before_and_after_the_records_is_missing() {
        let artwork = Artwork::default();
        let check = |cycles: &[u64], expect: (u64, u64, u64)| {
            let mut analysis = RunAnalysis::new(&artwork, Clock::Virtual, Period::OF_SETPOINTS);
            for &cycle in cycles {
                let feedback = Feedback { cycle: Cycle(cycle), ..Feedback::default() };
                analysis.push(&CycleRecord::unanswered(feedback));
            }
            let report = ControllerReport {
                first_cycle: Cycle(100),
                last_cycle: Cycle(200 - LIGHT_LAG),
                ..ControllerReport::default()
            };
            let continuity = analysis.finish(StreamEnd::Reported(&report)).continuity;
            let found = (continuity.gaps, continuity.missing, continuity.longest);
            assert_eq!(found, expect, "{cycles:?}");
        };
        let all: Vec<u64> = (90..=210).collect();
        check(&all, (0, 0, 0));
        check(&all[10..=110], (0, 0, 0));
        check(&all[11..=110], (1, 1, 1));
        check(&all[10..=109], (1, 1, 1));
        check(&all[20..=100], (2, 20, 10));
        check(&[99, 100, 150, 199], (3, 49 + 48 + 1, 49));
        check(&[], (1, 101, 101));
    }
}
