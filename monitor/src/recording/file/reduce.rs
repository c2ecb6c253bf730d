//! What stays of a recording when its run has been judged.

use super::RecordingError;
use super::parts::{self, PartsReader};
use super::writer::RecordingWriter;
use crate::recording::level::Level;
use crate::run_folder::RunFolder;
use messages::run_folder;
use std::fs;

/// The recording while it is written anew.
const UNFINISHED: &str = ".samples.mcap.part";

/// Leaves of the recording in `folder` what the level keeps.
///
/// # Errors
/// [`RecordingError`]; then all of it is still there.
pub fn reduce(folder: &RunFolder, level: Level) -> Result<(), RecordingError> {
    let parts = parts::of(folder.path());
    if level == Level::Full || parts.is_empty() {
        return Ok(());
    }
    if level > Level::Off {
        let unfinished = folder.file(UNFINISHED);
        let written = write(folder, level, &unfinished);
        if written.is_err() {
            let _ = fs::remove_file(&unfinished);
        }
        written?;
        fs::rename(&unfinished, folder.file(run_folder::SAMPLES))?;
    }
    let kept = (level > Level::Off).then(|| folder.file(run_folder::SAMPLES));
    for path in parts.into_iter().filter(|path| Some(path) != kept.as_ref()) {
        fs::remove_file(path)?;
    }
    Ok(())
}

fn write(folder: &RunFolder, level: Level, to: &std::path::Path) -> Result<(), RecordingError> {
    let reader = PartsReader::open(folder.path())?;
    let mut writer = RecordingWriter::create(to, reader.description(), level)?;
    for record in reader {
        match record {
            Ok(record) => writer.write(&[record])?,
            Err(RecordingError::Truncated { .. }) => break,
            Err(error) => return Err(error),
        }
    }
    Ok(writer.finish()?)
}
