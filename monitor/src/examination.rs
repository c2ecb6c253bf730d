//! What a whole recording tells: the marks, the latencies, the curves of the report. Record by
//! record, in bounded memory, whether they come from a simulation or from a file.

use crate::latency::HopHistograms;
use crate::marks::{Judge, Marks, Unjudged};
use crate::recording::CycleRecord;
use crate::trace::Trace;
use signals::artwork::Artwork;

/// Whether the stamps in the samples are those of a real clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// They are: latencies are measured.
    Real,
    /// They are made up: there are no latencies.
    Virtual,
}

/// An examination under way.
#[derive(Debug)]
pub struct Examination<'a> {
    clock: Clock,
    judge: Judge<'a>,
    histograms: HopHistograms,
    trace: Trace,
    first: Option<u64>,
    last: u64,
}

/// What it found.
#[derive(Debug)]
pub struct Findings {
    /// The marks, or why they are not judged.
    pub marks: Result<Marks, Unjudged>,
    /// The latencies; empty in virtual time.
    pub histograms: HopHistograms,
    /// What the report draws.
    pub trace: Trace,
    /// First and last feedback cycle seen.
    pub cycles: Option<(u64, u64)>,
}

impl<'a> Examination<'a> {
    /// An examination of nothing yet, against what was to be marked; in virtual time there are
    /// no latencies.
    pub fn new(artwork: &'a Artwork, clock: Clock) -> Self {
        Self {
            clock,
            judge: Judge::new(artwork),
            histograms: HopHistograms::new(),
            trace: Trace::new(clock == Clock::Real),
            first: None,
            last: 0,
        }
    }

    /// Takes the next record.
    pub fn push(&mut self, record: &CycleRecord) {
        self.first.get_or_insert(record.feedback.cycle.0);
        self.last = record.feedback.cycle.0;
        self.judge.push(record);
        self.trace.push(record);
        if self.clock == Clock::Real {
            self.histograms.push(record);
        }
    }

    /// Ends it.
    pub fn finish(mut self) -> Findings {
        self.trace.finish();
        Findings {
            marks: self.judge.finish(),
            histograms: self.histograms,
            trace: self.trace,
            cycles: self.first.map(|first| (first, self.last)),
        }
    }
}
