//! `graver export`: the recording of a run as comma-separated values.

use crate::arguments::ExportArguments;
use crate::exit::{Exit, Failure};
use crate::files::Sources;
use messages::{MAX_ACTUATORS, run_folder};
use monitor::recording::file::{RecordingError, RecordingReader};
use monitor::recording::table::TableWriter;
use monitor::summary::Summary;
use runtime::message;
use std::fs::File;
use std::io::{self, BufReader, BufWriter, ErrorKind, Write};
use std::path::Path;

/// Writes the recording to a file, or to standard output.
///
/// # Errors
/// A recording that is not there or is none, or a file that cannot be written.
pub fn run(arguments: &ExportArguments) -> Result<Exit, Failure> {
    let recording = match &arguments.recording {
        folder if folder.is_dir() => folder.join(run_folder::SAMPLES),
        file => file.clone(),
    };
    let file = File::open(&recording).map_err(|error| at(&recording, error))?;
    let reader =
        RecordingReader::new(BufReader::new(file)).map_err(|error| at(&recording, error))?;
    let actuators = actuators(&recording.with_file_name(run_folder::SUMMARY));
    match &arguments.out {
        Some(path) => {
            let file = Sources::recording(&recording).create("--out", path)?;
            export(&recording, reader, &actuators, BufWriter::new(file), |error| {
                Err(Failure::output(format!("{}: {error}", path.display())))
            })
        }
        None => {
            let output = BufWriter::new(io::stdout().lock());
            export(&recording, reader, &actuators, output, |error| match error.kind() {
                // Whoever read has read enough, as `head` does.
                ErrorKind::BrokenPipe => Ok(Exit::Done),
                _ => Err(Failure::output(format!("standard output: {error}"))),
            })
        }
    }
}

/// Copies record by record; `written` judges what the writer reports.
fn export(
    recording: &Path,
    reader: RecordingReader<impl io::Read>,
    actuators: &[String],
    writer: impl Write,
    written: impl Fn(io::Error) -> Result<Exit, Failure>,
) -> Result<Exit, Failure> {
    let mut table = match TableWriter::new(writer, actuators, reader.period()) {
        Ok(table) => table,
        Err(error) => return written(error),
    };
    for record in reader {
        match record {
            Ok(record) => {
                if let Err(error) = table.write(&record) {
                    return written(error);
                }
            }
            // All records before the torn one are whole.
            Err(error @ RecordingError::Truncated { .. }) => {
                message::tell(&format!("warning: {}: {error}", recording.display()));
            }
            Err(error) => return Err(at(recording, error)),
        }
    }
    table.finish().map_or_else(written, |()| Ok(Exit::Done))
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
