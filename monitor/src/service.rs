//! The monitor service: records every cycle of a job into its run folder.
//!
//! The machine does not wait for it. It reads feedback and commands from deep buffers, counts what
//! it missed, and writes what it has. A monitor that was started again goes on with the recording
//! that its predecessor left. One that cannot write says so, gives the recording up, and watches
//! on. When the supervisor is lost it also writes the summary, because nobody else is left to.

mod alone;
mod recording;

use crate::conclusion::RecordingState;
use crate::run_folder::{FileError, RunFolder};
use crate::stage::Inputs;
use machine::Machine;
use messages::time::Period;
use messages::{Command, ControllerReport, DrivesReport, Feedback, JobOffer, run_folder};
use recording::Recording;
use runtime::channel::DEEP;
use runtime::message::tell;
use runtime::peer::{PeerState, Peers};
use runtime::{Domain, Role, Samples, ServiceError, Subscriber, signal};
use std::path::Path;
use std::time::{Duration, Instant};

/// How often the service polls its channels.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// How long feedback or commands may stay away before nothing more is waited for: three times what
/// the clock of simulated drives may slip.
const SILENCE: Duration = Duration::from_millis(300);

/// Runs until it is told to end (SIGTERM) or the supervisor dies.
///
/// # Errors
/// When a channel fails, or when a recording fails and not even that can be written down.
pub fn run(domain: &Domain, machine: &Machine) -> Result<(), ServiceError> {
    let mut service = Service::open(domain, machine.realtime.period)?;
    while signal::termination().is_none() && service.has_supervisor() {
        service.poll()?;
        std::thread::sleep(POLL_INTERVAL);
    }
    let polled = service.poll();
    let ended = if service.has_supervisor() {
        service.end_recording()
    } else {
        service.conclude_alone(machine)
    };
    polled.and(ended)
}

struct Service {
    peers: Peers,
    offers: Subscriber<JobOffer>,
    feedbacks: Subscriber<Feedback>,
    commands: Subscriber<Command>,
    controller_reports: Subscriber<ControllerReport>,
    drives_reports: Subscriber<DrivesReport>,
    controller: ControllerReport,
    drives: Option<DrivesReport>,
    feedback_batch: Vec<Feedback>,
    command_batch: Vec<Command>,
    /// When feedback and commands came last.
    heard: [Instant; 2],
    newest_command: Command,
    /// Whether what was received stands before the first job.
    early: bool,
    job: Option<Job>,
    recording: Option<Recording>,
    /// The period of the cycle.
    period: Period,
}

/// The newest job that was offered.
struct Job {
    stream: u64,
    folder: RunFolder,
    began: Instant,
    /// Overruns counted before it.
    overruns_before: u64,
}

impl Service {
    fn open(domain: &Domain, period: Period) -> Result<Self, ServiceError> {
        Ok(Self {
            feedbacks: domain.subscriber(Samples::All)?,
            commands: domain.subscriber(Samples::All)?,
            controller_reports: domain.subscriber(Samples::Latest)?,
            drives_reports: domain.subscriber(Samples::Latest)?,
            offers: domain.subscriber(Samples::Latest)?,
            peers: Peers::watch(domain, &[Role::Domain, Role::Controller, Role::Drives])?,
            controller: ControllerReport::default(),
            drives: None,
            feedback_batch: Vec::new(),
            command_batch: Vec::new(),
            heard: [Instant::now(); 2],
            newest_command: Command::default(),
            early: true,
            job: None,
            recording: None,
            period,
        })
    }

    fn has_supervisor(&mut self) -> bool {
        self.peers.state(Role::Domain) != PeerState::Dead
    }

    fn poll(&mut self) -> Result<(), ServiceError> {
        if let Some(report) = self.controller_reports.newest()? {
            self.controller = report;
        }
        self.drives = self.drives_reports.newest()?.or(self.drives);
        self.take_offer()?;
        self.receive()?;
        let Some(recording) = &mut self.recording else { return Ok(()) };
        let inputs = Inputs { feedbacks: &self.feedback_batch, commands: &self.command_batch };
        if let Err(error) = recording.take(&inputs) {
            return self.drop_recording(&error);
        }
        let more_comes = self.more_comes();
        let over = |recording: &Recording| recording.is_over(&self.controller, more_comes);
        if self.recording.as_ref().is_some_and(over) { self.end_recording() } else { Ok(()) }
    }

    /// Empties the channels of the cycle. What was received before is forgotten, unless no job was
    /// offered yet: a monitor that was started again gets the newest cycles before it hears of the
    /// job that they belong to.
    fn receive(&mut self) -> Result<(), ServiceError> {
        let waiting = self.feedback_batch.len().max(self.command_batch.len());
        if !self.early || waiting > DEEP {
            self.forget();
        }
        self.early = self.job.is_none();
        while let Some(feedback) = self.feedbacks.receive()? {
            self.feedback_batch.push(feedback);
        }
        while let Some(command) = self.commands.receive()? {
            self.command_batch.push(command);
        }
        let [feedback_heard, command_heard] = &mut self.heard;
        if !self.feedback_batch.is_empty() {
            *feedback_heard = Instant::now();
        }
        if let Some(command) = self.command_batch.last() {
            *command_heard = Instant::now();
            self.newest_command = *command;
        }
        Ok(())
    }

    fn forget(&mut self) {
        self.feedback_batch.clear();
        self.command_batch.clear();
    }

    /// Whether controller and drives live and speak. A monitor that was started after their death
    /// never sees them alive; then their silence tells.
    fn more_comes(&mut self) -> bool {
        let dead = |role| self.peers.state(role) == PeerState::Dead;
        let dead = [Role::Controller, Role::Drives].into_iter().any(dead);
        !dead && self.heard.iter().all(|heard| heard.elapsed() < SILENCE)
    }

    fn take_offer(&mut self) -> Result<(), ServiceError> {
        let Some(offer) = self.offers.newest()? else { return Ok(()) };
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
        let folder = match RunFolder::open(Path::new(path)) {
            Ok(folder) => folder,
            Err(error) => {
                tell(&format!("monitor: this job is not recorded: {error}"));
                return Ok(());
            }
        };
        let (stream, began) = (offer.stream, Instant::now());
        let goes_on = RecordingState::of(&folder, stream) == RecordingState::Open;
        let overruns_before = self.drives.map_or(0, |report| report.overruns);
        if self.shall_record(stream, &folder) {
            if !goes_on {
                self.forget();
            }
            match Recording::begin(stream, folder.clone(), overruns_before, self.period) {
                Ok(recording) => self.recording = Some(recording),
                Err(error) => refuse(&folder, stream, &error)?,
            }
        }
        let kept = self.recording.as_ref().map(|recording| recording.overruns_before);
        let overruns_before = kept.unwrap_or(overruns_before);
        self.job = Some(Job { stream, folder, began, overruns_before });
        Ok(())
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

    fn end_recording(&mut self) -> Result<(), ServiceError> {
        let Some(mut recording) = self.recording.take() else { return Ok(()) };
        match recording.finish() {
            Ok(()) => Ok(()),
            Err(error) => refuse(&recording.folder, recording.stream, &error),
        }
    }

    fn drop_recording(&mut self, error: &FileError) -> Result<(), ServiceError> {
        let Some(recording) = self.recording.take() else { return Ok(()) };
        refuse(&recording.folder, recording.stream, error)
    }
}

/// Says that a job cannot be recorded, or not any further, and notes it for whoever waits.
fn refuse(folder: &RunFolder, stream: u64, error: &FileError) -> Result<(), ServiceError> {
    tell(&format!("monitor: this job is not recorded any further: {error}"));
    // Where not even that can be written, the end of this process says it.
    recording::give_up(folder, stream, error)
        .map_err(|FileError { path, source }| ServiceError::io(path, source))
}

#[cfg(test)]
mod tests;
