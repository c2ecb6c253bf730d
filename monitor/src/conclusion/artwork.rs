//! The artwork in a run folder: a line of JSON for each stroke, as the planner hands it on.

use crate::run_folder::{FileError, RunFolder};
use messages::artwork::{Artwork, ArtworkLine};
use messages::run_folder;
use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Reads what has been written of it, in the run folder and then in the file `spare`, if there is one; `None` when
/// it was never begun, or cannot be read: then with a warning. A last line that was torn when its
/// writer was killed is left out.
pub fn read(
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

/// Writes it line by line, as it becomes known. After an error nothing more is written.
#[derive(Debug)]
pub struct ArtworkWriter {
    path: PathBuf,
    file: io::Result<BufWriter<File>>,
}

impl ArtworkWriter {
    /// Begins the artwork of a run folder.
    pub fn create(folder: &RunFolder) -> Self {
        let path = folder.file(run_folder::ARTWORK);
        Self { file: File::create(&path).map(BufWriter::new), path }
    }

    /// Writes the next stroke, or a part of one.
    pub fn add(&mut self, line: &ArtworkLine) {
        let Ok(file) = &mut self.file else { return };
        let written = serde_json::to_writer(&mut *file, line).map_err(io::Error::from);
        if let Err(error) = written.and_then(|()| file.write_all(b"\n")) {
            self.file = Err(error);
        }
    }

    /// Ends it.
    ///
    /// # Errors
    /// What the operating system has reported, with the path.
    pub fn finish(self) -> Result<(), FileError> {
        let written = self.file.and_then(|mut file| file.flush());
        written.map_err(FileError::at(&self.path))
    }
}
