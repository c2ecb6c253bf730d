//! The files of a job: whatever a job reads is opened here.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Which files a job may read. Names of files in a job are relative to its own folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct JobFiles {
    folder: PathBuf,
    is_confined: bool,
}

impl JobFiles {
    /// Those of the job at `path`: any, or with `is_confined` only those below its own folder; see
    /// [`runtime::beneath`].
    pub(crate) fn of(path: &Path, is_confined: bool) -> Self {
        let folder = path.parent().unwrap_or_else(|| Path::new("")).to_owned();
        Self { folder, is_confined }
    }

    /// Of a job that is no file.
    pub(super) fn of_text() -> Self {
        Self { folder: PathBuf::new(), is_confined: false }
    }

    /// The name that the job at `path` itself has here.
    pub(super) fn own_name(path: &Path) -> &Path {
        path.file_name().map_or(path, Path::new)
    }

    /// Where the file that the job calls `name` is.
    pub(super) fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.folder.join(name)
    }

    /// Opens the file that the job calls `name`.
    ///
    /// # Errors
    /// Where it cannot be opened, or not by a job that is confined.
    pub(super) fn open(&self, name: impl AsRef<Path>) -> io::Result<File> {
        if self.is_confined {
            runtime::beneath::open(&self.folder, name.as_ref())
        } else {
            File::open(self.path(name))
        }
    }

    /// What is in the file that the job calls `name`.
    ///
    /// # Errors
    /// As of [`Self::open`], and where it cannot be read.
    pub(super) fn read(&self, name: impl AsRef<Path>) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.open(name)?.read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}
