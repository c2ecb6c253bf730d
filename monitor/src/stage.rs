//! The monitor as a stage beside a running pipeline: pairs the samples of two channels into records
//! and measures their latencies. Pure; the service around it moves samples and writes files.
//!
//! What a run's records tell beyond that is an [`RunAnalysis`](crate::run_analysis::RunAnalysis),
//! made of the whole recording when the run has ended.

use crate::latency::HopHistograms;
use crate::recording::continuity::Continuity;
use crate::recording::{CycleRecord, Recorder};
use messages::{Command, Feedback};

/// The samples that arrived since the last step, each kind in order.
#[derive(Debug, Clone, Copy, Default)]
pub struct Inputs<'a> {
    /// From drives.
    pub feedbacks: &'a [Feedback],
    /// From the controller.
    pub commands: &'a [Command],
}

/// What a step completed.
#[derive(Debug, Default)]
pub struct Outputs {
    /// Records in order of their cycle, for the recording.
    pub records: Vec<CycleRecord>,
}

/// What the monitor keeps while it watches a run.
#[derive(Debug)]
pub struct MonitorStage {
    recorder: Recorder,
    histograms: HopHistograms,
}

impl MonitorStage {
    /// A stage that has seen nothing.
    pub fn new() -> Self {
        Self::with(Recorder::new())
    }

    /// A stage that pairs samples with `recorder`, which may go on where another process ended.
    pub fn with(recorder: Recorder) -> Self {
        Self { recorder, histograms: HopHistograms::new() }
    }

    /// Takes samples; `outputs` is overwritten.
    pub fn step(&mut self, inputs: &Inputs<'_>, outputs: &mut Outputs) {
        // Commands first: however many samples waited, each feedback then finds its answer, where
        // there is one.
        inputs.commands.iter().for_each(|command| self.recorder.command(command));
        inputs.feedbacks.iter().for_each(|feedback| self.recorder.feedback(feedback));
        self.pass_on(outputs);
    }

    /// Ends the run: gives the records that waited for a command which never came.
    pub fn finish(&mut self, outputs: &mut Outputs) {
        self.recorder.finish();
        self.pass_on(outputs);
    }

    fn pass_on(&mut self, outputs: &mut Outputs) {
        outputs.records = self.recorder.take();
        outputs.records.iter().for_each(|record| self.histograms.push(record));
    }

    /// What was recorded so far, and what is missing.
    pub fn continuity(&self) -> &Continuity {
        self.recorder.continuity()
    }

    /// Commands that were in force in recorded cycles and never arrived here.
    pub fn lost_commands(&self) -> u64 {
        self.recorder.lost_commands()
    }

    /// Latencies so far.
    pub fn histograms(&self) -> &HopHistograms {
        &self.histograms
    }

    /// Latencies so far, to write an interval of them.
    pub fn histograms_mut(&mut self) -> &mut HopHistograms {
        &mut self.histograms
    }
}

impl Default for MonitorStage {
    fn default() -> Self {
        Self::new()
    }
}
