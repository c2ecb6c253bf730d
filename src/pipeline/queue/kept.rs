//! The file that the jobs of an instance are kept in.

use super::Entry;
use crate::pipeline::state_file;
use operator::QueuedJob;
use runtime::message;
use serde::{Deserialize, Serialize};
use std::fs::{self, File};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// All jobs of an instance.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Contents {
    /// The number of the newest job.
    pub newest: u64,
    /// The job under way.
    pub running: Option<Entry>,
    /// Those that wait, the next one first.
    pub waiting: Vec<Entry>,
    /// Those that have ended, the last one last.
    pub ended: Vec<QueuedJob>,
    /// Why those that wait do not begin.
    pub held: Option<String>,
}

/// Where they are kept; nowhere where there is no folder, or it cannot be written.
#[derive(Debug, Default)]
pub(super) struct Kept {
    path: Option<PathBuf>,
}

/// The file in which the jobs of the instance called `name` are kept; `None` where there is no home.
pub fn path(name: &str) -> Option<PathBuf> {
    state_file(name, "queue.json")
}

impl Kept {
    /// Goes on with the file at `path`. One that cannot be understood is put aside, and told.
    pub(super) fn open(path: Option<PathBuf>) -> (Self, Contents) {
        let mut kept = Self { path };
        let contents = match kept.path.as_deref().map(fs::read) {
            Some(Ok(bytes)) => match serde_json::from_slice(&bytes) {
                Ok(contents) => contents,
                Err(error) => {
                    kept.put_aside(&error);
                    Contents::default()
                }
            },
            Some(Err(error)) if error.kind() != io::ErrorKind::NotFound => {
                kept.give_up(&error);
                Contents::default()
            }
            Some(Err(_)) | None => Contents::default(),
        };
        (kept, contents)
    }

    /// Where they are kept, if they are.
    pub(super) fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Writes the jobs; a reader, and who comes after a loss of power, finds the old file or the new one.
    pub(super) fn write(&mut self, contents: &Contents) {
        let Some(path) = &self.path else { return };
        let unfinished = path.with_extension("json.new");
        let write = || -> io::Result<()> {
            if let Some(folder) = path.parent() {
                fs::DirBuilder::new().recursive(true).mode(0o700).create(folder)?;
            }
            let mut options = File::options();
            let mut file =
                options.write(true).create(true).truncate(true).mode(0o600).open(&unfinished)?;
            file.write_all(&serde_json::to_vec_pretty(contents)?)?;
            file.sync_data()?;
            fs::rename(&unfinished, path)
        };
        if let Err(error) = write() {
            // Half a file on a full disk would only make it fuller.
            let _ = fs::remove_file(&unfinished);
            self.give_up(&error);
        }
    }

    fn put_aside(&mut self, error: &serde_json::Error) {
        let Some(path) = self.path.clone() else { return };
        let aside = path.with_extension("json.damaged");
        match fs::rename(&path, &aside) {
            Ok(()) => message::tell(&format!(
                "{}:{}: the jobs that were kept cannot be read: {error}; the file is now {}",
                path.display(),
                error.line(),
                aside.display()
            )),
            Err(error) => self.give_up(&error),
        }
    }

    fn give_up(&mut self, error: &io::Error) {
        let path = self.path.take().unwrap_or_default();
        message::tell(&format!("{}: jobs are not kept there: {error}", path.display()));
    }
}
