//! The monitor service: records every cycle of a job into its run folder.
//!
//! The machine does not wait for it. It reads feedback and commands from deep buffers, counts what
//! it missed, and writes what it has. When the supervisor is lost it also writes the summary,
//! because nobody else is left to.

use crate::conclusion::{self, Ending, LIGHT_LAG, WatchNote};
use crate::latency::IntervalLog;
use crate::recording::file::RecordingWriter;
use crate::run_folder::RunFolder;
use crate::stage::{Inputs, MonitorStage, Outputs};
use crate::summary::{ErrorSummary, Outcome};
use machine::Machine;
use runtime::peer::{PeerState, Peers};
use runtime::{Domain, Reading, Role, ServiceError, Subscriber, signal};
use signals::{Command, ControllerReport, DrivesReport, Feedback, JobOffer, run_folder};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::{Duration, Instant, SystemTime};

/// How often the service looks at its channels.
const LOOK: Duration = Duration::from_millis(5);

/// Length of an interval in the latency log.
const INTERVAL: Duration = Duration::from_secs(1);

/// How long the axes may take to rest after the supervisor was lost.
const REST_PATIENCE: Duration = Duration::from_secs(5);

/// Runs until it is told to end (SIGTERM) or the supervisor dies.
///
/// # Errors
/// When a channel or a file fails.
pub fn run(domain: &Domain, machine: &Machine) -> Result<(), ServiceError> {
    let mut service = Service::open(domain)?;
    while signal::termination().is_none() {
        service.look()?;
        if service.peers.state(Role::Domain) == PeerState::Dead {
            return service.conclude_alone(machine);
        }
        std::thread::sleep(LOOK);
    }
    service.look()?;
    service.end_recording()
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
    recording: Option<Recording>,
}

/// A recording under way.
struct Recording {
    stream: u64,
    folder: RunFolder,
    stage: MonitorStage,
    outputs: Outputs,
    writer: RecordingWriter<BufWriter<File>>,
    log: IntervalLog<BufWriter<File>>,
    began: Instant,
    logged: Duration,
    records: u64,
    newest: u64,
    /// Whether the job was taken back.
    withdrawn: bool,
    /// Whether any of the stream was played.
    played: bool,
    /// Overruns counted before this recording.
    overruns_before: u64,
}

impl Service {
    fn open(domain: &Domain) -> Result<Self, ServiceError> {
        Ok(Self {
            feedbacks: domain.subscriber(Reading::Every)?,
            commands: domain.subscriber(Reading::Every)?,
            controller_reports: domain.subscriber(Reading::Newest)?,
            drives_reports: domain.subscriber(Reading::Newest)?,
            offers: domain.subscriber(Reading::Newest)?,
            peers: Peers::watch(domain, &[Role::Domain, Role::Controller, Role::Drives])?,
            controller: ControllerReport::default(),
            drives: None,
            feedback_batch: Vec::new(),
            command_batch: Vec::new(),
            recording: None,
        })
    }

    fn look(&mut self) -> Result<(), ServiceError> {
        if let Some(report) = self.controller_reports.newest()? {
            self.controller = report;
        }
        self.drives = self.drives_reports.newest()?.or(self.drives);
        self.take_offer()?;
        self.feedback_batch.clear();
        self.command_batch.clear();
        while let Some(feedback) = self.feedbacks.receive()? {
            self.feedback_batch.push(feedback);
        }
        while let Some(command) = self.commands.receive()? {
            self.command_batch.push(command);
        }
        let Some(recording) = &mut self.recording else { return Ok(()) };
        recording
            .take(&Inputs { feedbacks: &self.feedback_batch, commands: &self.command_batch })?;
        let more_comes = [Role::Controller, Role::Drives]
            .iter()
            .all(|role| self.peers.state(*role) != PeerState::Dead);
        if recording.is_over(&self.controller, more_comes) { self.end_recording() } else { Ok(()) }
    }

    fn take_offer(&mut self) -> Result<(), ServiceError> {
        let Some(offer) = self.offers.newest()? else { return Ok(()) };
        let Some(folder) = offer.folder().filter(|folder| !folder.is_empty()) else {
            // What is being played goes on until the axes rest, and so does its recording.
            if let Some(recording) = &mut self.recording
                && recording.stream == offer.stream
            {
                recording.withdrawn = true;
            }
            return Ok(());
        };
        let folder = RunFolder::create_at(Path::new(folder))
            .map_err(|source| ServiceError::io(folder, source))?;
        // A restarted monitor is offered the newest job again, even one that is long over.
        let finished = self.controller.is_final == 1 && self.controller.stream >= offer.stream;
        if finished || WatchNote::read(&folder).is_some_and(|note| note.stream == offer.stream) {
            return Ok(());
        }
        self.end_recording()?;
        let overruns = self.drives.map_or(0, |report| report.overruns);
        self.recording = Some(Recording::begin(offer.stream, folder, overruns)?);
        Ok(())
    }

    fn end_recording(&mut self) -> Result<(), ServiceError> {
        if let Some(recording) = self.recording.take() {
            recording.finish()?;
        }
        Ok(())
    }

    /// The supervisor is lost: waits until the machine is at rest, then writes its summary.
    fn conclude_alone(&mut self, machine: &Machine) -> Result<(), ServiceError> {
        let Some(recording) = &mut self.recording else { return Ok(()) };
        let (folder, stream, began) = (recording.folder.clone(), recording.stream, recording.began);
        let message = "the supervisor died: laser off, axes brought to rest".to_owned();
        let mut ending = Ending {
            outcome: Some(Outcome::Aborted),
            error: Some(ErrorSummary { file: None, line: None, column: None, message }),
            overruns_before: recording.overruns_before,
            ..Ending::default()
        };
        // Nobody will start what is not being played yet.
        recording.withdrawn = true;
        let lost = Instant::now();
        while self.recording.is_some() && lost.elapsed() < REST_PATIENCE {
            self.look()?;
            std::thread::sleep(LOOK);
        }
        self.end_recording()?;
        let is_final = self.controller.is_final == 1 && self.controller.stream == stream;
        ending.controller = is_final.then_some(self.controller);
        ending.drives = self.drives;
        conclusion::conclude(&folder, machine, &ending, began)
            .map(drop)
            .map_err(|source| ServiceError::io(folder.path(), source))
    }
}

impl Recording {
    fn begin(stream: u64, folder: RunFolder, overruns_before: u64) -> Result<Self, ServiceError> {
        let create = |name: &str| {
            File::create(folder.file(name)).map(BufWriter::new).map_err(failed(&folder, name))
        };
        let samples = create(run_folder::SAMPLES)?;
        let log = create(run_folder::LATENCY)?;
        Ok(Self {
            stream,
            stage: MonitorStage::new(),
            outputs: Outputs::default(),
            writer: RecordingWriter::new(samples).map_err(failed(&folder, run_folder::SAMPLES))?,
            log: IntervalLog::new(log, SystemTime::now())
                .map_err(failed(&folder, run_folder::LATENCY))?,
            began: Instant::now(),
            logged: Duration::ZERO,
            records: 0,
            newest: 0,
            withdrawn: false,
            played: false,
            overruns_before,
            folder,
        })
    }

    fn take(&mut self, inputs: &Inputs<'_>) -> Result<(), ServiceError> {
        self.played |= inputs.commands.iter().any(|command| command.stream == self.stream);
        self.stage.step(inputs, &mut self.outputs);
        self.write()?;
        if self.began.elapsed() >= self.logged + INTERVAL {
            self.log_interval()?;
        }
        Ok(())
    }

    fn write(&mut self) -> Result<(), ServiceError> {
        self.records += self.outputs.records.len() as u64;
        if let Some(record) = self.outputs.records.last() {
            self.newest = record.feedback.cycle.0;
        }
        let written = self.writer.write(&self.outputs.records);
        written.map_err(failed(&self.folder, run_folder::SAMPLES))
    }

    fn log_interval(&mut self) -> Result<(), ServiceError> {
        let now = self.began.elapsed();
        let duration = now - self.logged;
        let written =
            self.stage.histograms_mut().write_interval(&mut self.log, self.logged, duration);
        written.map_err(failed(&self.folder, run_folder::LATENCY))?;
        self.logged = now;
        Ok(())
    }

    /// Whether the stream has ended and all its light has been told, or will not be: nothing was
    /// played of a job that was taken back, or controller or drives are gone.
    fn is_over(&self, report: &ControllerReport, more_comes: bool) -> bool {
        let ended = report.is_final == 1 && report.stream == self.stream;
        let told = self.newest >= report.last_cycle.0.saturating_add(LIGHT_LAG);
        (ended && told)
            || (self.withdrawn && !self.played)
            || ((ended || self.withdrawn) && !more_comes)
    }

    fn finish(mut self) -> Result<(), ServiceError> {
        self.stage.finish(&mut self.outputs);
        self.write()?;
        self.log_interval()?;
        let written = self.writer.finish().and_then(|mut file| file.flush());
        written.map_err(failed(&self.folder, run_folder::SAMPLES))?;
        let written = self.log.finish().and_then(|mut file| file.flush());
        written.map_err(failed(&self.folder, run_folder::LATENCY))?;
        let note =
            WatchNote { stream: self.stream, records: self.records, lost: self.stage.lost() };
        note.write(&self.folder).map_err(|source| ServiceError::io(self.folder.path(), source))
    }
}

/// What failed about one of the run folder's files.
fn failed(folder: &RunFolder, name: &str) -> impl FnOnce(std::io::Error) -> ServiceError {
    let path = folder.file(name);
    |source| ServiceError::io(path, source)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::recording::file::RecordingReader;
    use signals::{Cycle, Nanoseconds};
    use std::io::BufReader;

    const STREAM: u64 = 5;

    /// Cycles `from..to`, answered for `stream`.
    fn take(recording: &mut Recording, from: u64, to: u64, stream: u64) {
        let feedback = |cycle: u64| Feedback {
            cycle: Cycle(cycle),
            command_cycle: Cycle(cycle.saturating_sub(1)),
            command_published: Nanoseconds(1),
            ..Feedback::default()
        };
        let command =
            |cycle: u64| Command { cycle: Cycle(cycle), stream, mode: 4, ..Command::default() };
        let feedbacks: Vec<_> = (from..to).map(feedback).collect();
        let commands: Vec<_> = (from..to).map(command).collect();
        recording.take(&Inputs { feedbacks: &feedbacks, commands: &commands }).unwrap();
    }

    fn final_report(stream: u64, last: u64) -> ControllerReport {
        let last_cycle = Cycle(last);
        ControllerReport { stream, is_final: 1, last_cycle, ..ControllerReport::default() }
    }

    fn begin(below: &tempfile::TempDir) -> Recording {
        Recording::begin(STREAM, RunFolder::create_at(below.path()).unwrap(), 0).unwrap()
    }

    #[test]
    fn a_recording_is_over_when_its_last_light_is_told() {
        let below = tempfile::tempdir().unwrap();
        let mut recording = begin(&below);
        take(&mut recording, 100, 202, STREAM);
        // The newest cycle is 201.
        assert!(!recording.is_over(&ControllerReport::default(), true));
        assert!(!recording.is_over(&final_report(STREAM - 1, 150), true));
        assert!(!recording.is_over(&final_report(STREAM, 200), true));
        assert!(recording.is_over(&final_report(STREAM, 199), true));
        // With drives dead, the cycles that are missing will not come.
        assert!(recording.is_over(&final_report(STREAM, 200), false));
        assert!(!recording.is_over(&ControllerReport::default(), false));
    }

    #[test]
    fn a_job_taken_back_is_recorded_until_its_axes_rest() {
        let below = tempfile::tempdir().unwrap();
        let mut recording = begin(&below);
        take(&mut recording, 0, 10, 0);
        recording.withdrawn = true;
        // Nothing of it was played.
        assert!(recording.is_over(&ControllerReport::default(), true));
        take(&mut recording, 10, 20, STREAM);
        assert!(!recording.is_over(&ControllerReport::default(), true));
        assert!(!recording.is_over(&final_report(STREAM, 18), true));
        take(&mut recording, 20, 21, 0);
        assert!(recording.is_over(&final_report(STREAM, 18), true));
        assert!(recording.is_over(&ControllerReport::default(), false));
    }

    #[test]
    fn the_note_comes_last_and_counts_what_is_in_the_file() {
        let below = tempfile::tempdir().unwrap();
        let mut recording = begin(&below);
        let folder = recording.folder.clone();
        let samples = folder.file(run_folder::SAMPLES);
        let read = || RecordingReader::new(BufReader::new(File::open(&samples).unwrap())).unwrap();
        assert_eq!(read().count(), 0, "the empty recording is one already");
        // One look after a second away, and one that comes too late for three samples.
        take(&mut recording, 0, 1000, STREAM);
        take(&mut recording, 1003, 1500, STREAM);
        assert!(!folder.file(run_folder::WATCH).exists());
        recording.finish().unwrap();
        let note = WatchNote { stream: STREAM, records: 1497, lost: 3 };
        assert_eq!(WatchNote::read(&folder), Some(note));
        assert_eq!(read().filter(Result::is_ok).count(), 1497);
    }
}
