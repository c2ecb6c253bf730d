//! The artwork in a run folder: a line of JSON for each stroke, as the planner hands it on.

use crate::run_folder::{FileError, RunFolder};
use messages::artwork::{Artwork, ArtworkLine};
use messages::run_folder;
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::Path;

/// Reads what has been written of it, in the run folder and then in the file `spare`, if there is one; `None` when
/// it was never begun, or cannot be read: then with a warning. A last line that was torn when its
/// writer was killed is left out.
pub(super) fn read(
    folder: &RunFolder,
    spare: Option<&Path>,
    warnings: &mut Vec<String>,
) -> Option<Artwork> {
    let path = folder.file(run_folder::ARTWORK);
    let mut artwork = Artwork::default();
    let mut read = || {
        add(&path, &mut artwork)?;
        match spare.map(|spare| add(spare, &mut artwork)) {
            Some(Err(error)) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        }
    };
    match read() {
        Ok(()) => Some(artwork),
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        Err(error) => {
            warnings.push(format!("cannot read {}: {error}", path.display()));
            None
        }
    }
}

fn add(path: &Path, artwork: &mut Artwork) -> io::Result<()> {
    let mut file = BufReader::new(File::open(path)?);
    let mut text = String::new();
    while file.read_line(&mut text)? > 0 && text.ends_with('\n') {
        artwork.add(serde_json::from_str::<ArtworkLine>(&text)?);
        text.clear();
    }
    Ok(())
}

/// Writes all of it.
///
/// # Errors
/// What the operating system reports, with the path.
pub fn write(folder: &RunFolder, artwork: &Artwork) -> Result<(), FileError> {
    let mut text = Vec::new();
    for stroke in &artwork.strokes {
        let line = ArtworkLine { goes_on: false, stroke: stroke.clone() };
        if let Ok(line) = serde_json::to_vec(&line) {
            text.extend(line);
            text.push(b'\n');
        }
    }
    folder.write(run_folder::ARTWORK, text)
}
