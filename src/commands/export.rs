//! `graver export`: the recording of a run as comma-separated values, or as one MCAP file.

use crate::arguments::{ExportArguments, ExportFormat};
use crate::exit::{Exit, Failure};
use crate::files::Sources;
use messages::{MAX_ACTUATORS, run_folder};
use monitor::recording::CycleRecord;
use monitor::recording::file::parts::{self, PartsReader};
use monitor::recording::file::reader::Entry;
use monitor::recording::file::writer::RecordingWriter;
use monitor::recording::file::{Description, RecordingError};
use monitor::recording::level::Level;
use monitor::recording::old_file::OldReader;
use monitor::recording::table::TableWriter;
use monitor::summary::Summary;
use runtime::message;
use std::fs::File;
use std::io::{self, BufReader, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

type Entries = Box<dyn Iterator<Item = Result<Entry, RecordingError>>>;

/// A recording of this version or an earlier one.
struct Recording {
    /// Its file, the first one where it has several.
    path: PathBuf,
    description: Description,
    entries: Entries,
}

/// Writes the recording to a file, or to standard output.
///
/// # Errors
/// A recording that is not there or is none, or a file that cannot be written.
pub fn run(arguments: &ExportArguments) -> Result<Exit, Failure> {
    let recording = open(&arguments.recording)?;
    let sources = || Sources::recording(&recording.path);
    match (arguments.format, &arguments.out) {
        (ExportFormat::Mcap, None) => Err(Failure::bad_input(
            "--format mcap: the file is completed at its beginning: name it with --out",
        )),
        (ExportFormat::Mcap, Some(path)) => {
            drop(sources().create("--out", path)?);
            let written = |error| Failure::output(format!("{}: {error}", path.display()));
            let mut writer = RecordingWriter::create(path, &recording.description, Level::Full)
                .map_err(written)?;
            for entry in recording.entries {
                match entry {
                    Ok(entry) => rewrite(&mut writer, entry).map_err(written)?,
                    Err(error @ RecordingError::Truncated { .. }) => warn(&recording.path, &error),
                    Err(error) => return Err(at(&recording.path, error)),
                }
            }
            writer.finish().map_err(written)?;
            Ok(Exit::Done)
        }
        (ExportFormat::Csv, Some(path)) => {
            let file = sources().create("--out", path)?;
            table(recording, BufWriter::new(file), |error| {
                Err(Failure::output(format!("{}: {error}", path.display())))
            })
        }
        (ExportFormat::Csv, None) => {
            let output = BufWriter::new(io::stdout().lock());
            table(recording, output, |error| match error.kind() {
                // Whoever read has read enough, as `head` does.
                ErrorKind::BrokenPipe => Ok(Exit::Done),
                _ => Err(Failure::output(format!("standard output: {error}"))),
            })
        }
    }
}

/// Opens what is in a run folder, or a file by itself.
fn open(place: &Path) -> Result<Recording, Failure> {
    let old = place.join(run_folder::OLD_SAMPLES);
    if place.is_dir() && (!parts::of(place).is_empty() || !old.exists()) {
        let path = place.join(run_folder::SAMPLES);
        let reader = PartsReader::open(place).map_err(|error| at(&path, error))?;
        let description = reader.description().clone();
        return Ok(Recording { path, description, entries: Box::new(reader.entries()) });
    }
    let path = if place.is_dir() { old } else { place.to_owned() };
    match PartsReader::of_file(&path) {
        Ok(reader) => {
            let description = reader.description().clone();
            Ok(Recording { path, description, entries: Box::new(reader.entries()) })
        }
        Err(RecordingError::NotARecording) => {
            let file = File::open(&path).map_err(|error| at(&path, error))?;
            let reader = OldReader::new(BufReader::new(file)).map_err(|error| at(&path, error))?;
            let description = Description::of(reader.period());
            let entry = |record| Entry::Cycle(Box::new(record), Vec::new());
            let entries = Box::new(reader.map(move |record| record.map(entry)));
            Ok(Recording { path, description, entries })
        }
        Err(error) => Err(at(&path, error)),
    }
}

/// Writes the records as a table; `written` judges what the writer reports.
fn table(
    recording: Recording,
    writer: impl Write,
    written: impl Fn(io::Error) -> Result<Exit, Failure>,
) -> Result<Exit, Failure> {
    let named = &recording.description.actuators;
    let actuators = if named.is_empty() {
        actuators(&recording.path.with_file_name(run_folder::SUMMARY))
    } else {
        named.clone()
    };
    let mut table = match TableWriter::new(writer, &actuators, recording.description.period) {
        Ok(table) => table,
        Err(error) => return written(error),
    };
    let mut refused = None;
    copy(recording, |record| {
        table.write(record).map_err(|error| {
            refused = Some(error);
            Failure::output("")
        })
    })
    .or_else(|failure| if refused.is_some() { Ok(()) } else { Err(failure) })?;
    match refused {
        Some(error) => written(error),
        None => table.finish().map_or_else(written, |()| Ok(Exit::Done)),
    }
}

/// Writes what stands in a recording, so that it can be played again. What happens in it the writer finds anew.
fn rewrite(writer: &mut RecordingWriter, entry: Entry) -> io::Result<()> {
    match entry {
        Entry::Cycle(record, setpoints) => writer.write_cycle(&record, &setpoints),
        Entry::Lead(record, setpoints) => {
            let mut message = Vec::new();
            record.put(&setpoints, &mut message);
            writer.write_lead(record.origin().deadline, &message)
        }
        Entry::Event(_) => Ok(()),
    }
}

/// All records before the torn one are whole.
fn warn(path: &Path, error: &RecordingError) {
    message::tell(&format!("warning: {}: {error}", path.display()));
}

/// Hands on record by record.
fn copy(
    recording: Recording,
    mut write: impl FnMut(&CycleRecord) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let Recording { path, entries, .. } = recording;
    for entry in entries {
        match entry {
            Ok(Entry::Cycle(record, _)) => write(&record)?,
            Ok(_) => {}
            Err(error @ RecordingError::Truncated { .. }) => warn(&path, &error),
            Err(error) => return Err(at(&path, error)),
        }
    }
    Ok(())
}

/// The actuators' names by the summary beside the recording; numbers where it tells none.
fn actuators(summary: &Path) -> Vec<String> {
    let told = match std::fs::read(summary) {
        Err(error) if error.kind() == ErrorKind::NotFound => None,
        text => text
            .and_then(|text| Ok(serde_json::from_slice::<Summary>(&text)?))
            .inspect_err(|error| {
                let path = summary.display();
                message::tell(&format!("warning: {path}: {error}: the actuators are numbered"));
            })
            .ok(),
    };
    told.map(|summary| summary.machine.actuators)
        .filter(|actuators| !actuators.is_empty())
        .unwrap_or_else(|| (1..=MAX_ACTUATORS).map(|number| format!("actuator_{number}")).collect())
}

fn at(path: &Path, error: impl std::fmt::Display) -> Failure {
    Failure::bad_input(format!("{}: {error}", path.display()))
}
