//! The end of a job: its refusal, or its recording and its summary.

use std::time::{Duration, Instant};

use messages::{DrivesReport, Fault, FaultCode, run_folder};
use monitor::conclusion;
use monitor::conclusion::RecordingState;
use monitor::summary::{Outcome, Summary};
use planner::request::Refusal;
use runtime::domain::Role;
use runtime::{heartbeat, message, signal};

use super::JobRun;
use crate::exit::{error_summary, other_errors};
use crate::pipeline::POLL_INTERVAL;

/// How long the monitor may take to complete its recording, on a loaded computer or a slow disk.
const WRITING_PATIENCE: Duration = Duration::from_secs(5);

/// How long a monitor that somebody has stopped is waited for.
const STOPPED_PATIENCE: Duration = Duration::from_millis(250);

impl JobRun<'_> {
    /// Takes over why the planner refused. Where the run folder could not be written, the planner
    /// has left its reasons in the domain's directory.
    pub(super) fn refuse(&mut self) {
        let places =
            [self.folder.file(run_folder::REFUSAL), self.pipeline.root().join(run_folder::REFUSAL)];
        let read = |path: &std::path::PathBuf| {
            serde_json::from_slice::<Refusal>(&std::fs::read(path).ok()?).ok()
        };
        let refusal = places.iter().find_map(read).unwrap_or_else(|| {
            Refusal::internal(format!(
                "the planner refused the job, and {} cannot be read",
                places[0].display()
            ))
        });
        message::tell(refusal.text.trim());
        self.run_outcome.outcome = Some(Outcome::Refused);
        self.run_outcome.error = Some(error_summary(&refusal));
        self.note_refused_place();
        self.run_outcome.others = other_errors(&refusal).collect();
    }

    pub(super) fn conclude(mut self) -> Summary {
        if self.stream.is_some() {
            if self.run_outcome.controller.is_none() {
                // The planner rests, and the monitor ends its recording. Without channels neither
                // can be told; they end with the domain.
                let _ = self.pipeline.close();
            }
            self.await_recording();
        }
        self.run_outcome.drives = Some(self.drives_with_cause());
        let is_completed = self.run_outcome.controller.is_some_and(|it| it.completed == 1);
        if !is_completed && self.played {
            self.run_outcome.time_left = self.time_left;
        }
        if !self.run_outcome.latched.is_some() {
            self.run_outcome.latched = self.pipeline.latest.progress.fault;
        }
        let (level, spare) = self.pipeline.recording();
        (self.run_outcome.level, self.run_outcome.spare) = (level, Some(spare));
        self.tell_holds();
        let machine = &self.pipeline.machine;
        self.run_outcome.warnings.splice(0..0, machine.job_warnings());
        // Its report takes its time.
        let busy = heartbeat::busy();
        let summary = conclusion::conclude(&self.folder, machine, &self.run_outcome, self.started);
        drop(busy);
        self.pipeline.board.end_job();
        self.control.end();
        self.pipeline.queue.end(&summary);
        summary
    }

    /// Waits until the monitor has written all of it, as long as it can be expected to.
    pub(super) fn await_recording(&mut self) {
        let stream = self.stream.unwrap_or_default();
        let since = Instant::now();
        while RecordingState::of(&self.folder, stream) == RecordingState::Open && !self.in_a_hurry()
        {
            let patience = match self.pipeline.peer(Role::Monitor) {
                Some(monitor) if monitor.is_stopped() => STOPPED_PATIENCE,
                Some(_) => WRITING_PATIENCE,
                None => return,
            };
            if since.elapsed() > patience || self.pipeline.poll().is_err() {
                return;
            }
            std::thread::sleep(POLL_INTERVAL);
        }
    }

    /// Whether a person has asked twice for the end.
    pub(super) fn in_a_hurry(&self) -> bool {
        signal::termination().is_some_and(|termination| termination.count > 1)
    }

    /// What drives reported, with the cause of a death that the dead cannot tell: a controller
    /// without feedback says nothing, and drives without commands may name those first.
    pub(super) fn drives_with_cause(&self) -> DrivesReport {
        let mut drives = self.pipeline.latest.drives;
        if self.run_outcome.controller.is_some() || self.run_outcome.error.is_none() {
            return drives;
        }
        let vague = matches!(drives.fault.code(), FaultCode::None | FaultCode::StaleCommand);
        if vague && !self.pipeline.has(Role::Drives) {
            drives.fault = Fault::new(FaultCode::DrivesLost).at(drives.fault.at);
        } else if vague && !self.pipeline.has(Role::Controller) {
            drives.fault = Fault::new(FaultCode::ControllerLost).at(drives.fault.at);
        }
        drives
    }
}
