//! What a program comes to, and a program in a file that is read once for that and then again, step by
//! step, as it is marked.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use machine::Machine;
use machine::gcode_settings::WordMeanings;
use nalgebra::Vector3;

use super::settings::ReaderSettings;
use super::steps::Steps;
use crate::drawing::{Note, Step};
use crate::job::JobError;
use crate::job::files::JobFiles;

/// Extent of a program in all three axes, before an ignored Z is left out.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, schemars::JsonSchema)]
pub struct ProgramFacts {
    /// Lines with at least one word that were read up to the end of the program.
    pub blocks: u64,
    /// Length of all G1, G2 and G3 moves [m].
    pub feed_length: f64,
    /// Length of all G0 and G28 moves [m].
    pub rapid_length: f64,
    /// The part of `feed_length` with the laser on [m].
    pub mark_length: f64,
    /// Least and largest power of marks and of dwells with the laser on, fractions of full power; null
    /// where nothing is lit.
    pub power: Option<[f64; 2]>,
    /// The last point, in the work coordinates in force at the end [m].
    pub end: [f64; 3],
    /// Lower corner of the box around start and all moves, machine frame [m].
    pub lower: [f64; 3],
    /// Upper corner of that box [m].
    pub upper: [f64; 3],
}

impl ProgramFacts {
    /// Of a program that has not moved from `place` yet.
    pub(super) fn at(place: Vector3<f64>) -> Self {
        Self {
            blocks: 0,
            feed_length: 0.0,
            rapid_length: 0.0,
            mark_length: 0.0,
            power: None,
            end: [0.0; 3],
            lower: place.into(),
            upper: place.into(),
        }
    }
}

/// What the first reading of a program finds.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// Its extent.
    pub facts: ProgramFacts,
    /// Where X0 Y0 Z0 of its moves is, machine frame [m]; `None` where that changes on the way, or nothing
    /// moves in a work coordinate system.
    pub zero: Option<[f64; 3]>,
    /// Things a person should know, each said once.
    pub notes: Vec<Note>,
    /// Lines that were read, up to the end of the program.
    pub lines: u64,
    /// Steps of its drawing.
    pub steps: u64,
    /// A rough estimate of its time [s]: each move at its speed or the machine's largest, and the
    /// dwells, as if the tool started, stopped and turned in no time. Pauses are not counted.
    pub time: f64,
    /// The largest distance from the drawn line that it allows at corners [m], 0 if it says none.
    pub tolerance: f64,
}

/// Reads the program at `path` once, whole, without keeping it.
///
/// # Errors
/// Where it cannot be read; the first thing that is not G-code, not supported here, or contradicts
/// itself, and with it what else is wrong further down.
pub fn survey(path: &Path, machine: &Machine) -> Result<Survey, JobError> {
    let (files, name) = (JobFiles::of(path, false), JobFiles::own_name(path));
    let (program, _) = ProgramFile::open(&files, name, machine.gcode.words, None, machine, 0)?;
    Ok(program.survey)
}

/// A program in a file that was read through, and can be read again as a stream of steps.
#[derive(Debug, Clone, PartialEq)]
pub struct ProgramFile {
    files: JobFiles,
    name: PathBuf,
    settings: ReaderSettings,
    stamp: Stamp,
    /// What the first reading found.
    pub survey: Survey,
}

/// The steps of a program in a file.
pub type FileSteps = Steps<Watched>;

impl ProgramFile {
    /// Reads the program that is called `name` among `files` through, whose words mean what `words` say and of which no line is done
    /// before `from_line`. Gives back its steps too if it has no more than `most` lines, and always if it is
    /// no regular file, which can be read only once.
    ///
    /// # Errors
    /// As of [`survey`].
    pub(in crate::job) fn open(
        files: &JobFiles,
        name: &Path,
        words: WordMeanings,
        from_line: Option<u64>,
        machine: &Machine,
        most: u64,
    ) -> Result<(Self, Option<Vec<Step>>), JobError> {
        let settings =
            ReaderSettings { from_line, ..ReaderSettings::of(machine).with_words(words) };
        let watched = Watched::open(files, name)?;
        let stamp = watched.stamp;
        let most = if stamp.is_some() { most } else { u64::MAX };
        let steps = Steps::new(&files.path(name).display().to_string(), watched, &settings);
        let (survey, steps) = steps.read_through(most)?;
        let stamp = stamp.unwrap_or_default();
        let (files, name) = (files.clone(), name.to_owned());
        Ok((Self { files, name, settings, stamp, survey }, steps))
    }

    /// Its steps from the first on, read as they are asked for: memory does not depend on how many
    /// there are.
    ///
    /// The file must be as it was when it was read through. Where it is not, the next reading of it
    /// (64 KiB) ends the steps with an error.
    ///
    /// # Errors
    /// Where the file cannot be opened.
    pub fn steps(&self) -> Result<FileSteps, JobError> {
        let opened = Watched::open(&self.files, &self.name)?;
        let watched = Watched { stamp: Some(self.stamp), ..opened };
        let path = self.files.path(&self.name);
        Ok(Steps::new(&path.display().to_string(), watched, &self.settings))
    }
}

/// By what a file is seen to have changed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Stamp {
    length: u64,
    modified: Option<SystemTime>,
}

impl Stamp {
    /// `None` of what is no regular file.
    fn of(file: &File) -> io::Result<Option<Self>> {
        let data = file.metadata()?;
        Ok(data.is_file().then(|| Self { length: data.len(), modified: data.modified().ok() }))
    }
}

/// A file that must not change while it is read.
#[derive(Debug)]
pub struct Watched {
    file: File,
    stamp: Option<Stamp>,
}

impl Watched {
    fn open(files: &JobFiles, name: &Path) -> Result<Self, JobError> {
        let open = || {
            let file = files.open(name)?;
            if file.metadata()?.is_dir() {
                return Err(io::ErrorKind::IsADirectory.into());
            }
            let stamp = Stamp::of(&file)?;
            Ok(Self { file, stamp })
        };
        open().map_err(|cause| JobError::Unreadable { path: files.path(name), cause })
    }
}

impl Read for Watched {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let length = self.file.read(into)?;
        if self.stamp.is_some() && Stamp::of(&self.file)? != self.stamp {
            return Err(io::Error::other("the file was changed after it was read first"));
        }
        Ok(length)
    }
}
