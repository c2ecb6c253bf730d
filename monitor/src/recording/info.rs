//! `monitor.json`: how the recording of a job stands, for whoever waits for its end.

use super::continuity::Gap;
use crate::run_folder::{FileError, RunFolder};
use messages::run_folder;
use serde::{Deserialize, Serialize};
use std::fs;
use std::io::{self, Write};

/// How far a recording has come.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Progress {
    /// It is being written.
    Open,
    /// It is complete, but for the gaps that are told.
    #[default]
    Complete,
    /// It was broken off, because it could not be written.
    Failed,
}

/// What the monitor notes of a recording: when it begins, when it finds a gap, when it ends.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordingInfo {
    /// The stream it records.
    pub stream: u64,
    /// How far it has come.
    pub progress: Progress,
    /// Records in the recording; while it is open, those when this was written.
    pub records: u64,
    /// Samples known to be lost: cycles without a record, and commands that were in force.
    pub lost: u64,
    /// Commands among them.
    pub lost_commands: u64,
    /// How many gaps there are between its records.
    pub gap_count: u64,
    /// The first hundred of them, by the first and the last cycle that is missing.
    pub gaps: Vec<Gap>,
    /// Overruns that drives had counted before the job.
    pub overruns_before: u64,
    /// Why it was broken off; empty unless it was.
    pub message: String,
}

impl RecordingInfo {
    /// The note in a run folder; `None` while there is none that can be read.
    pub fn read(folder: &RunFolder) -> Option<Self> {
        serde_json::from_slice(&fs::read(folder.file(run_folder::WATCH)).ok()?).ok()
    }

    /// The note in a run folder, if it speaks of `stream`.
    pub fn of(folder: &RunFolder, stream: u64) -> Option<Self> {
        Self::read(folder).filter(|info| info.stream == stream)
    }

    /// Writes it into the run folder.
    ///
    /// # Errors
    /// What the operating system reports, with the file.
    pub fn write(&self, folder: &RunFolder) -> Result<(), FileError> {
        folder.write_json(run_folder::WATCH, self)
    }

    /// Writes it over the note that is there: it needs neither a new file nor more room than that
    /// had, so it succeeds on a full disk and in a folder that takes no new file. A reader may see
    /// half of it.
    ///
    /// # Errors
    /// What the operating system reports, with the file; also where there is no note yet.
    pub fn overwrite(&self, folder: &RunFolder) -> Result<(), FileError> {
        let path = folder.file(run_folder::WATCH);
        let write = || {
            let text = serde_json::to_vec(self)?;
            let mut file = fs::OpenOptions::new().write(true).open(&path)?;
            file.write_all(&text)?;
            file.set_len(text.len() as u64)
        };
        write().map_err(|source: io::Error| FileError { path: path.clone(), source })
    }
}

/// How the recording of a stream stands, as anybody can tell from its run folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RecordingState {
    /// Nobody has begun one, or the folder is gone: there is nothing to wait for.
    Absent,
    /// It is being written, or its writer has died: wait for it only while a monitor lives.
    Open,
    /// It is complete, but for the gaps that the note tells.
    Complete(RecordingInfo),
    /// It was broken off, and this is why.
    Failed(String),
}

impl RecordingState {
    /// The state of the recording of `stream` in its run folder.
    pub fn of(folder: &RunFolder, stream: u64) -> Self {
        match RecordingInfo::of(folder, stream) {
            Some(info) => match info.progress {
                Progress::Open => Self::Open,
                Progress::Complete => Self::Complete(info),
                Progress::Failed => Self::Failed(info.message),
            },
            None => Self::Absent,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_note_is_read_as_it_was_written() {
        let below = tempfile::tempdir().unwrap();
        let folder = RunFolder::create_at(below.path()).unwrap();
        assert_eq!(RecordingInfo::read(&folder), None);
        let gaps = vec![Gap { first: 7, last: 8 }];
        let info = RecordingInfo {
            stream: 3,
            records: 4711,
            lost: 2,
            gap_count: 1,
            gaps,
            ..Default::default()
        };
        info.write(&folder).unwrap();
        assert_eq!(RecordingInfo::read(&folder), Some(info));
        folder.write(run_folder::WATCH, "{\"stream\": 3").unwrap();
        assert_eq!(RecordingInfo::read(&folder), None);
    }

    #[test]
    fn whoever_waits_can_tell_how_a_recording_stands() {
        let below = tempfile::tempdir().unwrap();
        let folder = RunFolder::create_at(&below.path().join("run")).unwrap();
        let state = || RecordingState::of(&folder, 3);
        assert_eq!(state(), RecordingState::Absent);
        let open =
            RecordingInfo { stream: 3, progress: Progress::Open, ..RecordingInfo::default() };
        RecordingInfo { stream: 2, ..open.clone() }.write(&folder).unwrap();
        assert_eq!(state(), RecordingState::Absent, "a note of another stream");
        open.write(&folder).unwrap();
        assert_eq!(state(), RecordingState::Open);
        let complete = RecordingInfo { progress: Progress::Complete, records: 5, ..open.clone() };
        complete.write(&folder).unwrap();
        assert_eq!(state(), RecordingState::Complete(complete.clone()));
        let failed = RecordingInfo { progress: Progress::Failed, message: "full".into(), ..open };
        failed.overwrite(&folder).unwrap();
        assert_eq!(state(), RecordingState::Failed("full".into()));
        fs::remove_dir_all(folder.path()).unwrap();
        assert_eq!(state(), RecordingState::Absent);
        let error = complete.write(&folder).unwrap_err().to_string();
        assert!(error.contains("monitor.json") && error.contains("No such file"), "{error}");
        let error = complete.overwrite(&folder).unwrap_err().to_string();
        assert!(error.contains("monitor.json") && error.contains("No such file"), "{error}");
    }
}
