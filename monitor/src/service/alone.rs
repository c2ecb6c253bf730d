//! What the monitor does when the supervisor is lost: it waits for the machine to rest, and writes
//! the summary that nobody else will.

use super::recorder::Job;
use super::{POLL_INTERVAL, Service};
use crate::conclusion::{self, RunOutcome};
use crate::run_folder::RunFolder;
use crate::summary::{ErrorSummary, Outcome};
use machine::Machine;
use messages::run_folder;
use runtime::ServiceError;
use runtime::message::tell;
use serde::Deserialize;
use std::time::{Duration, Instant};

/// How long the axes may take to rest after the supervisor was lost.
const REST_PATIENCE: Duration = Duration::from_secs(5);

/// What `refused.json` says of a job that was refused.
#[derive(Debug, Deserialize)]
struct Refused {
    #[serde(flatten)]
    first: ErrorSummary,
    #[serde(default)]
    others: Vec<ErrorSummary>,
}

impl Service {
    /// The supervisor is lost. Writes the summary of the newest job, unless the supervisor wrote it.
    pub(super) fn conclude_alone(&mut self, machine: &Machine) -> Result<(), ServiceError> {
        let told = |job: &Job| job.folder.file(run_folder::SUMMARY).exists();
        let Some(job) = self.recorder.job.take().filter(|job| !told(job)) else {
            return self.end();
        };
        if let Some(recording) = &mut self.recorder.recording {
            // Nobody will start what is not being played yet.
            recording.withdrawn = true;
        }
        // Whatever fails here, the summary is still to be written.
        let rested = self.await_rest(job.stream);
        let ended = self.end();
        let run_outcome = self.run_outcome(&job);
        let summary = conclusion::conclude(&job.folder, machine, &run_outcome, job.began);
        if !told(&job) {
            // Nobody else is left to say it.
            summary.warnings.iter().for_each(|warning| tell(&format!("monitor: {warning}")));
        }
        rested.and(ended)
    }

    fn await_rest(&mut self, stream: u64) -> Result<(), ServiceError> {
        let lost = Instant::now();
        while !self.rests(stream) && lost.elapsed() < REST_PATIENCE {
            self.poll(&mut [])?;
            std::thread::sleep(POLL_INTERVAL);
        }
        Ok(())
    }

    /// Whether the job's stream is over, and its recording complete.
    fn rests(&mut self, stream: u64) -> bool {
        if self.recorder.recording.is_some() {
            return false;
        }
        let ended =
            self.recorder.controller.is_final == 1 && self.recorder.controller.stream == stream;
        ended || self.recorder.newest_command.stream != stream || !self.more_comes()
    }

    /// How a job ended whose supervisor is lost. A stream that the controller ended without a fault
    /// had ended before that.
    fn run_outcome(&self, job: &Job) -> RunOutcome {
        let is_final =
            self.recorder.controller.is_final == 1 && self.recorder.controller.stream == job.stream;
        let controller = is_final.then_some(self.recorder.controller);
        let mut run_outcome = RunOutcome {
            overruns_before: job.overruns_before,
            controller,
            latched: self.recorder.newest_command.fault,
            drives: self.recorder.drives,
            spare: Some(self.recorder.spare().to_owned()),
            level: self.level,
            ..RunOutcome::default()
        };
        if let Some(refusal) = refusal(&job.folder) {
            run_outcome.outcome = Some(Outcome::Refused);
            (run_outcome.error, run_outcome.others) = (Some(refusal.first), refusal.others);
            run_outcome.warnings.push("the supervisor died after the job was refused".to_owned());
        } else if controller.is_some_and(|report| !report.fault.is_some()) {
            run_outcome.warnings.push("the supervisor died after the job had ended".to_owned());
        } else {
            let message = "the supervisor died: laser off, axes brought to rest".to_owned();
            run_outcome.outcome = Some(Outcome::Aborted);
            run_outcome.error =
                Some(ErrorSummary { file: None, line: None, column: None, message });
        }
        run_outcome
    }
}

/// Why the planner refused the job, if it did.
fn refusal(folder: &RunFolder) -> Option<Refused> {
    let text = std::fs::read(folder.file(run_folder::REFUSAL)).ok()?;
    serde_json::from_slice(&text).ok()
}
