//! Room for the summary on a full disk: what the recording has taken of it is given back, from its end.

use crate::recording::file::parts;
use crate::run_folder::{FileError, RunFolder};
use messages::run_folder;
use serde::Serialize;
use std::fs::OpenOptions;
use std::io::{self, ErrorKind};

/// Bytes that a summary needs: many times what it has.
const NEEDED: u64 = 256 << 10;

/// Writes `summary`. Where the disk is full the recording is cut short for it, which stays readable; whether it was.
///
/// # Errors
/// What the operating system reports, with the path.
pub(super) fn write(folder: &RunFolder, summary: &impl Serialize) -> Result<bool, FileError> {
    match folder.write_json(run_folder::SUMMARY, summary) {
        Ok(()) => Ok(false),
        Err(error) if is_full(&error.source) && cut(folder).is_ok() => {
            folder.write_json(run_folder::SUMMARY, summary).map(|()| true)
        }
        Err(error) => Err(error),
    }
}

fn is_full(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded)
}

/// Cuts the newest parts of the recording short, until there is room.
fn cut(folder: &RunFolder) -> io::Result<()> {
    let mut needed = NEEDED;
    for part in parts::of(folder.path()).into_iter().rev() {
        let file = OpenOptions::new().write(true).open(part)?;
        let length = file.metadata()?.len();
        file.set_len(length.saturating_sub(needed))?;
        needed = needed.saturating_sub(length);
        if needed == 0 {
            return Ok(());
        }
    }
    // A short recording is all that there is.
    if needed < NEEDED { Ok(()) } else { Err(ErrorKind::StorageFull.into()) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn room_is_made_from_the_end_of_the_recording() {
        let below = tempfile::tempdir().unwrap();
        let folder = RunFolder::create_at(below.path()).unwrap();
        assert!(cut(&folder).is_err(), "there is nothing to give back");
        let size = |name: &str| folder.file(name).metadata().unwrap().len();
        for (name, size) in [("samples.mcap", NEEDED + 7000), ("samples.1.mcap", 3000)] {
            folder.write(name, vec![1; size as usize]).unwrap();
        }
        cut(&folder).unwrap();
        assert_eq!((size("samples.mcap"), size("samples.1.mcap")), (10_000, 0));
        cut(&folder).unwrap();
        assert_eq!(size("samples.mcap"), 0);
        assert!(cut(&folder).is_err());
        assert!(!write(&folder, &"told").unwrap(), "nothing is cut where there is room");
    }
}
