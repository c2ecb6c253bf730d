//! Where the records of a run go: into its folder, and where that takes no more, into a spare place.
//!
//! A full disk costs the recording and not the marks: what cannot stand in the run folder is kept, as far as there
//! is memory, until the run has been judged.

use crate::recording::CycleRecord;
use crate::recording::file::parts::{Extent, PartsWriter, Resumed};
use crate::recording::file::{Description, RecordingError};
use crate::recording::lead::Messages;
use crate::run_folder::{FileError, RunFolder};
use messages::Setpoint;
use std::io;
use std::path::PathBuf;

/// Which part of the memory that is free the spare place may take.
const SPARE_PART: u64 = 4;

/// What every recording of this pipeline has in common.
#[derive(Debug, Clone)]
pub(super) struct Setup {
    /// What a recording says of itself, but for its stream.
    pub(super) description: Description,
    /// How large it may grow in its folder [bytes].
    pub(super) quota: Option<u64>,
    /// A directory elsewhere than on the disks of run folders.
    pub(super) spare: PathBuf,
}

/// The records of a run.
#[derive(Debug)]
pub(super) struct Store {
    description: Description,
    spare: PathBuf,
    writer: PartsWriter,
    /// Why it goes to the spare place.
    reason: Option<FileError>,
    /// How large it may grow there [bytes].
    room: u64,
}

impl Store {
    /// Begins a recording in place of what may be there.
    ///
    /// # Errors
    /// Where neither the folder nor the spare place can be written.
    pub(super) fn create(
        stream: u64,
        folder: &RunFolder,
        setup: &Setup,
    ) -> Result<Self, FileError> {
        let description = Description { stream, ..setup.description.clone() };
        let extent = extent(setup);
        // What an earlier run left there.
        let _ = std::fs::remove_dir_all(&setup.spare);
        let samples = folder.file(messages::run_folder::SAMPLES);
        match PartsWriter::create(folder, &description, extent) {
            Ok(writer) => Ok(Self::new(description, setup, writer)),
            Err(error) => {
                let reason = FileError { path: samples, source: error };
                let (writer, room) =
                    spare(&setup.spare, &description).map_err(|_| reason.again())?;
                Ok(Self { reason: Some(reason), room, ..Self::new(description, setup, writer) })
            }
        }
    }

    /// Goes on with a recording that another process left; with its last record, and how many it has.
    ///
    /// # Errors
    /// Where it is no recording, or can neither be read nor written.
    pub(super) fn resume(
        stream: u64,
        folder: &RunFolder,
        setup: &Setup,
    ) -> Result<(Self, Option<CycleRecord>, u64), FileError> {
        let description = Description { stream, ..setup.description.clone() };
        let at = |folder: &RunFolder, error: RecordingError| FileError {
            path: folder.file(messages::run_folder::SAMPLES),
            source: match error {
                RecordingError::Io(error) => error,
                other => io::Error::other(other),
            },
        };
        let place = RunFolder::open(&setup.spare).ok();
        let spared = place.map(|place| {
            let resumed = PartsWriter::resume(&place, &description, Extent::default());
            resumed.map_err(|error| at(&place, error))
        });
        if let Some(resumed) = spared {
            let Resumed { writer, last, records } = resumed?;
            let path = folder.file(messages::run_folder::SAMPLES);
            let source = io::ErrorKind::StorageFull.into();
            let reason = Some(FileError { path, source });
            let store = Self { reason, room: room(), ..Self::new(description, setup, writer) };
            return Ok((store, last, records));
        }
        let Resumed { writer, last, records } =
            PartsWriter::resume(folder, &description, extent(setup))
                .map_err(|error| at(folder, error))?;
        Ok((Self::new(description, setup, writer), last, records))
    }

    fn new(description: Description, setup: &Setup, writer: PartsWriter) -> Self {
        Self { description, spare: setup.spare.clone(), writer, reason: None, room: u64::MAX }
    }

    /// Writes what was before the job. Where that does not succeed, the recording goes on without.
    ///
    /// # Errors
    /// Where there is no place left for the recording.
    pub(super) fn begin(&mut self, lead: &Messages) -> Result<(), FileError> {
        let mut messages = lead.iter();
        let written =
            messages.try_for_each(|(time, message)| self.writer.write_lead(*time, message));
        written.and_then(|()| self.writer.flush()).or_else(|source| self.move_out(source))
    }

    /// Appends records, each with the setpoints that the controller took in it, so that nothing of them is lost when this
    /// process dies.
    ///
    /// # Errors
    /// Where there is no place left for them.
    pub(super) fn write(
        &mut self,
        records: &[CycleRecord],
        given: &[Vec<Setpoint>],
    ) -> Result<(), FileError> {
        let Err(source) = append(&mut self.writer, records, given) else {
            return if self.writer.size() > self.room { Err(self.full()) } else { Ok(()) };
        };
        self.move_out(source)?;
        append(&mut self.writer, records, given).map_err(|_| self.full())
    }

    /// Closes it.
    ///
    /// # Errors
    /// Where not all of it could be written.
    pub(super) fn finish(&mut self) -> Result<(), FileError> {
        match self.writer.finish() {
            Ok(()) => Ok(()),
            Err(_) if self.reason.is_some() => Err(self.full()),
            // All records are there; only what readers find their way with is not.
            Err(source) => {
                self.reason = Some(FileError { path: self.writer.path(), source });
                Ok(())
            }
        }
    }

    /// Why not all of it is in the run folder; empty when it is.
    pub(super) fn reason(&self) -> String {
        self.reason.as_ref().map(ToString::to_string).unwrap_or_default()
    }

    /// Goes on in the spare place.
    pub(super) fn move_out(&mut self, source: io::Error) -> Result<(), FileError> {
        let reason = FileError { path: self.writer.path(), source };
        if self.reason.is_some() {
            return Err(self.full());
        }
        match spare(&self.spare, &self.description) {
            Ok((writer, room)) => {
                (self.writer, self.room) = (writer, room);
                self.reason = Some(reason);
                Ok(())
            }
            Err(_) => Err(reason),
        }
    }

    /// The reason for which it left the run folder: the spare place is full too.
    fn full(&self) -> FileError {
        match &self.reason {
            Some(reason) => reason.again(),
            None => {
                FileError { path: self.writer.path(), source: io::ErrorKind::StorageFull.into() }
            }
        }
    }
}

fn append(
    writer: &mut PartsWriter,
    records: &[CycleRecord],
    given: &[Vec<Setpoint>],
) -> io::Result<()> {
    for (record, setpoints) in records.iter().zip(given) {
        writer.write_cycle(record, setpoints)?;
    }
    writer.flush()
}

impl FileError {
    /// The same once more.
    fn again(&self) -> Self {
        let Self { path, source } = self;
        let source = match source.raw_os_error() {
            Some(number) => io::Error::from_raw_os_error(number),
            None => io::Error::new(source.kind(), source.to_string()),
        };
        Self { path: path.clone(), source }
    }
}

fn extent(setup: &Setup) -> Extent {
    Extent { quota: setup.quota, ..Extent::default() }
}

/// A recording in the spare place, and how large it may grow.
fn spare(
    place: &std::path::Path,
    description: &Description,
) -> Result<(PartsWriter, u64), FileError> {
    let folder = RunFolder::create_at(place)?;
    let writer = PartsWriter::create(&folder, description, Extent::default());
    Ok((writer.map_err(FileError::at(place))?, room()))
}

/// How much of the memory may be taken [bytes]; proc_meminfo(5).
fn room() -> u64 {
    let text = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024 / SPARE_PART
}
