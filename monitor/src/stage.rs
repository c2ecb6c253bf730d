//! The monitor as a stage: takes the samples of all channels, keeps what the run folder needs.
//! Pure; the service around it moves samples and writes files.

use crate::latency::HopHistograms;
use crate::recording::{CycleRecord, Recorder};
use crate::trace::Trace;
use signals::{Command, Feedback};

/// Whether the stamps in the samples are those of a real clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// They are: latencies are measured.
    Real,
    /// They are made up: there are no latencies.
    Virtual,
}

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
    /// Records in order of their cycle, for the recording and the judge.
    pub records: Vec<CycleRecord>,
}

/// Everything that the monitor keeps of one run.
#[derive(Debug)]
pub struct MonitorStage {
    clock: Clock,
    recorder: Recorder,
    histograms: HopHistograms,
    trace: Trace,
}

impl MonitorStage {
    /// A stage that has seen nothing.
    pub fn new(clock: Clock) -> Self {
        Self {
            clock,
            recorder: Recorder::new(),
            histograms: HopHistograms::new(),
            trace: Trace::new(clock == Clock::Real),
        }
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
        self.trace.finish();
    }

    fn pass_on(&mut self, outputs: &mut Outputs) {
        outputs.records = self.recorder.take();
        for record in &outputs.records {
            if self.clock == Clock::Real {
                self.histograms.push(record);
            }
            self.trace.push(record);
        }
    }

    /// Samples known to be lost: with any, the marks must not be judged.
    pub fn lost(&self) -> u64 {
        self.recorder.lost()
    }

    /// Latencies so far.
    pub fn histograms(&self) -> &HopHistograms {
        &self.histograms
    }

    /// Latencies so far, to write an interval of them.
    pub fn histograms_mut(&mut self) -> &mut HopHistograms {
        &mut self.histograms
    }

    /// What the report draws.
    pub fn trace(&self) -> &Trace {
        &self.trace
    }
}
