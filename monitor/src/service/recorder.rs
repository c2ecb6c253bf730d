//! The sink that records jobs: a recording for each job that is offered, in its run folder.

use super::recording::{self, Came, Recording};
use super::store::Setup;
use crate::conclusion::RecordingState;
use crate::hub::{Batch, Sink};
use crate::recording::lead::Lead;
use crate::run_folder::{FileError, RunFolder};
use messages::{Command, ControllerReport, DrivesReport, Feedback, JobOffer, Setpoint, run_folder};
use runtime::ServiceError;
use runtime::channel::DEEP;
use runtime::message::tell;
use std::path::Path;
use std::time::Instant;

/// Records the job that is under way.
pub(super) struct JobRecorder {
    setup: Setup,
    pub(super) controller: ControllerReport,
    pub(super) drives: Option<DrivesReport>,
    pub(super) newest_command: Command,
    /// What came before the first job: a monitor that was started again gets the newest cycles
    /// before it hears of the job that they belong to.
    early: Early,
    /// What no recording has had.
    lead: Lead,
    pub(super) job: Option<Job>,
    pub(super) recording: Option<Recording>,
}

/// The newest job that was offered.
pub(super) struct Job {
    pub(super) stream: u64,
    pub(super) folder: RunFolder,
    pub(super) began: Instant,
    /// Overruns counted before it.
    pub(super) overruns_before: u64,
}

#[derive(Default)]
struct Early {
    feedbacks: Vec<Feedback>,
    commands: Vec<Command>,
    setpoints: Vec<Setpoint>,
}

impl Early {
    fn came(&self) -> Came<'_> {
        let Self { feedbacks, commands, setpoints } = self;
        Came { feedbacks, commands, setpoints }
    }

    fn take(&mut self, batch: &Batch) {
        if self.feedbacks.len().max(self.commands.len()) > DEEP {
            *self = Self::default();
        }
        self.feedbacks.extend(&batch.feedbacks);
        self.commands.extend(&batch.commands);
        self.setpoints.extend(&batch.setpoints);
    }
}

impl JobRecorder {
    /// Before the first job.
    pub(super) fn new(setup: Setup) -> Self {
        Self {
            setup,
            controller: ControllerReport::default(),
            drives: None,
            newest_command: Command::default(),
            early: Early::default(),
            lead: Lead::default(),
            job: None,
            recording: None,
        }
    }

    /// Where recordings go on when their folders take no more.
    pub(super) fn spare(&self) -> &Path {
        &self.setup.spare
    }

    /// Ends the recording when all of its job has been told, or nothing more comes.
    ///
    /// # Errors
    /// A recording that fails, when not even that can be written down.
    pub(super) fn end_when_over(&mut self, more_comes: bool) -> Result<(), ServiceError> {
        let over = |recording: &Recording| recording.is_over(&self.controller, more_comes);
        if self.recording.as_ref().is_some_and(over) { self.end_recording() } else { Ok(()) }
    }

    pub(super) fn end_recording(&mut self) -> Result<(), ServiceError> {
        let Some(mut recording) = self.recording.take() else { return Ok(()) };
        self.lead = Lead::default();
        match recording.finish() {
            Ok(()) => Ok(()),
            Err(error) => refuse(&recording.folder, recording.stream, &error),
        }
    }

    pub(super) fn drop_recording(&mut self, error: &FileError) -> Result<(), ServiceError> {
        let Some(recording) = self.recording.take() else { return Ok(()) };
        self.lead = Lead::default();
        refuse(&recording.folder, recording.stream, error)
    }

    /// A restarted monitor is offered the newest job again: one that is long over needs no
    /// recording, but one that its predecessor left open is to be ended.
    fn shall_record(&self, stream: u64, folder: &RunFolder) -> bool {
        let over = self.controller.is_final == 1 && self.controller.stream >= stream;
        match RecordingState::of(folder, stream) {
            _ if folder.file(run_folder::SUMMARY).exists() => false,
            RecordingState::Absent => !over,
            RecordingState::Open => true,
            RecordingState::Complete(_) | RecordingState::Failed(_) => false,
        }
    }

    fn hear_reports(&mut self, batch: &Batch) {
        self.controller = batch.controller_reports.last().copied().unwrap_or(self.controller);
        self.drives = batch.drives_reports.last().copied().or(self.drives);
    }

    fn begin(&mut self, stream: u64, folder: RunFolder) -> Result<(), ServiceError> {
        let goes_on = RecordingState::of(&folder, stream) == RecordingState::Open;
        let mut overruns_before = self.drives.map_or(0, |report| report.overruns);
        if self.shall_record(stream, &folder) {
            let (setup, lead) = (&self.setup, self.lead.hand_over());
            match Recording::begin(stream, folder.clone(), overruns_before, setup, lead) {
                Ok(recording) => {
                    overruns_before = recording.overruns_before;
                    self.recording = Some(recording);
                }
                Err(error) => refuse(&folder, stream, &error)?,
            }
        }
        let early = std::mem::take(&mut self.early);
        self.job = Some(Job { stream, folder, began: Instant::now(), overruns_before });
        if goes_on { self.record(&early.came()) } else { Ok(()) }
    }

    fn record(&mut self, came: &Came<'_>) -> Result<(), ServiceError> {
        let Some(recording) = &mut self.recording else { return Ok(()) };
        match recording.take(came) {
            Ok(()) => Ok(()),
            Err(error) => self.drop_recording(&error),
        }
    }
}

impl Sink for JobRecorder {
    fn offer(&mut self, offer: &JobOffer, batch: &Batch) -> Result<(), ServiceError> {
        self.hear_reports(batch);
        let Some(path) = offer.folder().filter(|folder| !folder.is_empty()) else {
            // What is being played goes on until the axes rest, and so does its recording.
            if let Some(recording) = &mut self.recording
                && recording.stream == offer.stream
            {
                recording.withdrawn = true;
                recording.closed = offer.is_over == 1;
            }
            return Ok(());
        };
        if self.job.as_ref().is_some_and(|job| job.stream == offer.stream) {
            return Ok(());
        }
        self.end_recording()?;
        self.job = None;
        match RunFolder::open(Path::new(path)) {
            Ok(folder) => self.begin(offer.stream, folder),
            Err(error) => {
                tell(&format!("monitor: this job is not recorded: {error}"));
                Ok(())
            }
        }
    }

    fn take(&mut self, batch: &Batch) -> Result<(), ServiceError> {
        self.hear_reports(batch);
        self.newest_command = batch.commands.last().copied().unwrap_or(self.newest_command);
        if self.job.is_none() {
            self.early.take(batch);
        }
        let Batch { feedbacks, commands, setpoints, .. } = batch;
        if self.recording.is_none() {
            self.lead.take(feedbacks, commands, setpoints);
        }
        self.record(&Came { feedbacks, commands, setpoints })
    }

    fn end(&mut self) -> Result<(), ServiceError> {
        self.end_recording()
    }
}

/// Says that a job cannot be recorded, or not any further, and notes it for whoever waits.
fn refuse(folder: &RunFolder, stream: u64, error: &FileError) -> Result<(), ServiceError> {
    tell(&format!("monitor: this job is not recorded any further: {error}"));
    // Where not even that can be written, the end of this process says it.
    recording::give_up(folder, stream, error)
        .map_err(|FileError { path, source }| ServiceError::io(path, source))
}
