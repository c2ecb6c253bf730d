//! A recording under way: its three files in the run folder, and what is known of it.

use super::store::{Setup, Store};
use crate::conclusion::LIGHT_LAG;
use crate::latency::IntervalLog;
use crate::recording::Recorder;
use crate::recording::continuity::Continuity;
use crate::recording::file::parts;
use crate::recording::info::{Progress, RecordingInfo};
use crate::recording::lead::Beginning;
use crate::recording::supply::Supply;
use crate::run_folder::{FileError, RunFolder};
use crate::stage::{Inputs, MonitorStage, Outputs};
use messages::{Command, ControllerReport, Feedback, Setpoint, run_folder};
use std::fs::File;
use std::io::BufWriter;
use std::time::{Duration, Instant};

/// Length of an interval in the latency log.
const INTERVAL: Duration = Duration::from_secs(1);

/// The samples that a recording is made of, each kind in order.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Came<'a> {
    pub(super) feedbacks: &'a [Feedback],
    pub(super) commands: &'a [Command],
    /// Those that the planner sent.
    pub(super) setpoints: &'a [Setpoint],
}

/// A recording under way.
pub(super) struct Recording {
    pub(super) stream: u64,
    pub(super) folder: RunFolder,
    stage: MonitorStage,
    outputs: Outputs,
    supply: Supply,
    store: Store,
    /// `None` when it could not be written any further.
    log: Option<IntervalLog<BufWriter<File>>>,
    log_refused: Option<FileError>,
    /// Time since the log began, when this process took it up.
    log_began: Duration,
    began: Instant,
    logged: Duration,
    newest: u64,
    /// Whether the job was taken back.
    pub(super) withdrawn: bool,
    /// Whether nothing more of it will be played.
    pub(super) closed: bool,
    /// Whether any of the stream was played.
    played: bool,
    /// Overruns counted before this job.
    pub(super) overruns_before: u64,
    /// Gaps that the note tells.
    gaps_noted: u64,
}

impl Recording {
    /// Begins the recording of a job, or goes on with the one that a dead monitor has left.
    ///
    /// # Errors
    /// A file that cannot be opened or written, with its path.
    pub(super) fn begin(
        stream: u64,
        folder: RunFolder,
        overruns_before: u64,
        setup: &Setup,
        lead: Beginning,
    ) -> Result<Self, FileError> {
        let left =
            RecordingInfo::of(&folder, stream).filter(|info| info.progress == Progress::Open);
        match left {
            Some(info) if !parts::of(folder.path()).is_empty() => Self::resume(folder, info, setup),
            _ => Self::create(stream, folder, overruns_before, setup, lead),
        }
    }

    fn create(
        stream: u64,
        folder: RunFolder,
        overruns_before: u64,
        setup: &Setup,
        lead: Beginning,
    ) -> Result<Self, FileError> {
        // The note first: a recording without one is nobody's.
        RecordingInfo {
            stream,
            progress: Progress::Open,
            overruns_before,
            ..RecordingInfo::default()
        }
        .write(&folder)?;
        let mut store = Store::create(stream, &folder, setup)?;
        store.begin(&lead.messages)?;
        let latency = folder.file(run_folder::LATENCY);
        let log = IntervalLog::create(&latency).map_err(FileError::at(&latency))?;
        let stage = MonitorStage::with(lead.recorder);
        let began = (log, Duration::ZERO);
        let recording = Self::new(stream, folder, stage, store, began, overruns_before);
        Ok(Self { supply: lead.supply, ..recording })
    }

    fn resume(folder: RunFolder, info: RecordingInfo, setup: &Setup) -> Result<Self, FileError> {
        let (store, last, records) = Store::resume(info.stream, &folder, setup)?;
        let latency = folder.file(run_folder::LATENCY);
        let log = IntervalLog::resume(&latency).map_err(FileError::at(&latency))?;
        let recorder = match &last {
            Some(last) => {
                let missing = info.lost.saturating_sub(info.lost_commands);
                let longest = info.gaps.iter().map(|gap| gap.cycles()).max().unwrap_or(0);
                let (gaps, list) = (info.gap_count, info.gaps);
                let continuity = Continuity { records, gaps, missing, longest, list };
                Recorder::resume(last, continuity, info.lost_commands)
            }
            None => Recorder::new(),
        };
        let stage = MonitorStage::with(recorder);
        let mut recording = Self::new(info.stream, folder, stage, store, log, info.overruns_before);
        if let Some(last) = last {
            recording.newest = last.feedback.cycle.0;
            recording.played = last.command.stream == info.stream;
        }
        recording.gaps_noted = info.gap_count;
        Ok(recording)
    }

    fn new(
        stream: u64,
        folder: RunFolder,
        stage: MonitorStage,
        store: Store,
        (log, log_began): (IntervalLog<BufWriter<File>>, Duration),
        overruns_before: u64,
    ) -> Self {
        Self {
            stream,
            folder,
            stage,
            outputs: Outputs::default(),
            supply: Supply::default(),
            store,
            log: Some(log),
            log_began,
            log_refused: None,
            began: Instant::now(),
            logged: Duration::ZERO,
            newest: 0,
            withdrawn: false,
            closed: false,
            played: false,
            overruns_before,
            gaps_noted: 0,
        }
    }

    /// Takes what arrived.
    ///
    /// # Errors
    /// A file that cannot be written, with its path.
    pub(super) fn take(&mut self, came: &Came<'_>) -> Result<(), FileError> {
        let Came { feedbacks, commands, setpoints } = *came;
        self.played |= commands.iter().any(|command| command.stream == self.stream);
        setpoints.iter().for_each(|setpoint| self.supply.push(setpoint));
        self.stage.step(&Inputs { feedbacks, commands }, &mut self.outputs);
        self.write()?;
        if self.began.elapsed() >= self.logged + INTERVAL {
            self.log_interval();
        }
        if self.stage.continuity().gaps > self.gaps_noted {
            // A successor must know of it.
            self.gaps_noted = self.stage.continuity().gaps;
            self.note_down(Progress::Open)?;
        }
        Ok(())
    }

    fn write(&mut self) -> Result<(), FileError> {
        if let Some(record) = self.outputs.records.last() {
            self.newest = record.feedback.cycle.0;
        }
        let supply = &mut self.supply;
        let given = self.outputs.records.iter().map(|record| supply.take(&record.command.given));
        let given: Vec<Vec<Setpoint>> = given.collect();
        self.store.write(&self.outputs.records, &given)
    }

    /// Logs the latencies since the last time. Where that fails the recording goes on without.
    fn log_interval(&mut self) {
        let Some(log) = &mut self.log else { return };
        let now = self.began.elapsed();
        let (start, duration) = (self.log_began + self.logged, now - self.logged);
        let written = self.stage.histograms_mut().write_interval(log, start, duration);
        self.logged = now;
        if let Err(source) = written.and_then(|()| log.flush()) {
            let path = self.folder.file(run_folder::LATENCY);
            (self.log, self.log_refused) = (None, Some(FileError { path, source }));
        }
    }

    /// Notes how the recording stands; over the old note where there is no room for a new one.
    fn note_down(&self, progress: Progress) -> Result<(), FileError> {
        let info = self.note(progress, &self.reason());
        info.write(&self.folder).or_else(|error| info.overwrite(&self.folder).map_err(|_| error))
    }

    /// Why not all of it is in the run folder; empty when it is.
    fn reason(&self) -> String {
        match (self.store.reason(), &self.log_refused) {
            (reason, Some(refused)) if reason.is_empty() => refused.to_string(),
            (reason, _) => reason,
        }
    }

    fn note(&self, progress: Progress, message: &str) -> RecordingInfo {
        let (continuity, lost_commands) = (self.stage.continuity(), self.stage.lost_commands());
        RecordingInfo {
            stream: self.stream,
            progress,
            records: continuity.records,
            lost: continuity.missing + lost_commands,
            lost_commands,
            gap_count: continuity.gaps,
            gaps: continuity.list.clone(),
            overruns_before: self.overruns_before,
            message: message.to_owned(),
        }
    }

    /// Whether the stream has ended and all its light has been told, or will not be: nothing was
    /// played of a job that was taken back, or nothing more comes from controller or drives.
    pub(super) fn is_over(&self, report: &ControllerReport, more_comes: bool) -> bool {
        let ended = report.is_final == 1 && report.stream == self.stream;
        let told = self.newest >= report.last_cycle.0.saturating_add(LIGHT_LAG);
        self.closed
            || (ended && told)
            || (self.withdrawn && !self.played)
            || ((ended || self.withdrawn) && !more_comes)
    }

    /// Ends it, and notes that it is complete.
    ///
    /// # Errors
    /// A file that cannot be written, with its path; [`give_up`] must note it then.
    pub(super) fn finish(&mut self) -> Result<(), FileError> {
        self.stage.finish(&mut self.outputs);
        self.write()?;
        self.log_interval();
        self.store.finish()?;
        self.note_down(Progress::Complete)
    }
}

/// Notes that a recording could not be written; what there is of it stays. Where the folder is gone
/// nobody waits for it.
///
/// # Errors
/// When `monitor.json` cannot be written: the old one then still says that the recording goes on.
pub(super) fn give_up(
    folder: &RunFolder,
    stream: u64,
    reason: &FileError,
) -> Result<(), FileError> {
    let info = RecordingInfo {
        stream,
        progress: Progress::Failed,
        message: reason.to_string(),
        ..RecordingInfo::default()
    };
    let written = info.write(folder).or_else(|_| info.overwrite(folder));
    written.or_else(|error| match RecordingInfo::of(folder, stream) {
        Some(left) if left.progress == Progress::Open => Err(error),
        _ => Ok(()),
    })
}

#[cfg(test)]
mod tests;
