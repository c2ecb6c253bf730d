//! The run folder: `runs/DATE-TIME-JOB`; [`signals::run_folder`] names the files in it.
//!
//! A folder made here is its user's alone. One that was there before keeps its mode.

use signals::run_folder;
use std::fs;
use std::io;
use std::os::unix::fs::{DirBuilderExt, PermissionsExt};
use std::path::{Path, PathBuf};

/// The longest part of a job's name that goes into the folder's name [characters].
const LONGEST_NAME: usize = 40;

/// Files of which every run leaves one at least, however it ends.
const OF_EVERY_RUN: [&str; 3] = [run_folder::REQUEST, run_folder::SAMPLES, run_folder::SUMMARY];

/// A folder that exists.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunFolder {
    path: PathBuf,
}

impl RunFolder {
    /// Creates `runs/DATE-TIME-JOB` below `below`, with the local time now. A second run of the
    /// job in the same second gets `-2` and so on.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn create_below(below: &Path, job: &str) -> io::Result<Self> {
        let now = jiff::Zoned::now().strftime("%Y%m%d-%H%M%S").to_string();
        Self::create_named(&below.join("runs"), &format!("{now}-{}", file_name(job)))
    }

    /// Uses the folder that the user named; it is created where it does not exist.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn create_at(path: &Path) -> io::Result<Self> {
        if !path.is_dir() {
            path.parent().map_or(Ok(()), fs::create_dir_all)?;
            match create_private(path) {
                // Somebody else made it just now.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists && path.is_dir() => {}
                other => other?,
            }
        }
        Ok(Self { path: path.to_owned() })
    }

    fn create_named(runs: &Path, name: &str) -> io::Result<Self> {
        fs::create_dir_all(runs)?;
        let mut path = runs.join(name);
        let mut number = 1;
        loop {
            match create_private(&path) {
                Ok(()) => return Ok(Self { path }),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                    number += 1;
                    path = runs.join(format!("{name}-{number}"));
                }
                Err(error) => return Err(error),
            }
        }
    }

    /// Removes what an earlier run left in it.
    ///
    /// # Errors
    /// A file of such a name in a folder that no run has left, or whatever the operating system
    /// reports.
    pub fn clear(&self) -> io::Result<()> {
        let has = |name: &str| self.file(name).exists();
        let left_by_a_run = OF_EVERY_RUN.into_iter().any(has);
        let any = run_folder::ALL.into_iter().find(|name| has(name));
        if let (false, Some(name)) = (left_by_a_run, any) {
            let place = self.path.display();
            return Err(io::Error::new(
                io::ErrorKind::AlreadyExists,
                format!("{place} has a {name} that no run has left: name another folder"),
            ));
        }
        for name in run_folder::ALL {
            match fs::remove_file(self.file(name)) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        Ok(())
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Where one of its files is.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Writes one of its files whole: a reader sees the old content or the new.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> io::Result<()> {
        let unfinished = self.file(&format!(".{name}.part"));
        fs::write(&unfinished, content)?;
        fs::rename(&unfinished, self.file(name))
    }
}

/// Creates a directory that is its user's alone, whatever the process's mask takes away.
fn create_private(path: &Path) -> io::Result<()> {
    fs::DirBuilder::new().mode(0o700).create(path)?;
    fs::set_permissions(path, fs::Permissions::from_mode(0o700))
}

/// A job's name as part of a file name: letters, digits, points, dashes.
fn file_name(job: &str) -> String {
    let mut name = String::new();
    for character in job.chars().take(LONGEST_NAME) {
        if character.is_alphanumeric() || character == '.' || character == '_' {
            name.push(character);
        } else if !name.is_empty() && !name.ends_with('-') {
            name.push('-');
        }
    }
    let name = name.trim_matches(['-', '.']);
    if name.is_empty() { "job".to_owned() } else { name.to_owned() }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn names_are_safe_for_files() {
        for (job, expect) in [
            ("letters NASO 20 mm", "letters-NASO-20-mm"),
            ("../../etc/passwd", "etc-passwd"),
            ("a//b", "a-b"),
            ("Prüfteil_1.ngc", "Prüfteil_1.ngc"),
            ("…", "job"),
        ] {
            assert_eq!(file_name(job), expect, "{job}");
        }
    }

    #[test]
    fn two_runs_in_one_second_get_two_folders() {
        let below = tempfile::tempdir().unwrap();
        let first = RunFolder::create_named(below.path(), "20260101-120000-N").unwrap();
        let second = RunFolder::create_named(below.path(), "20260101-120000-N").unwrap();
        assert_ne!(first, second);
        assert!(second.path().ends_with("20260101-120000-N-2"));
        second.write(run_folder::SUMMARY, "{}").unwrap();
        assert_eq!(fs::read_to_string(second.file(run_folder::SUMMARY)).unwrap(), "{}");
        assert_eq!(fs::read_dir(second.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_new_folder_is_its_users_alone_and_one_that_was_there_keeps_its_mode() {
        let below = tempfile::tempdir().unwrap();
        let mode = |folder: &Path| fs::metadata(folder).unwrap().permissions().mode() & 0o777;
        let dated = RunFolder::create_below(below.path(), "letters").unwrap();
        assert_eq!(mode(dated.path()), 0o700);
        let named = below.path().join("archive/one");
        assert_eq!(mode(RunFolder::create_at(&named).unwrap().path()), 0o700);

        fs::set_permissions(&named, fs::Permissions::from_mode(0o755)).unwrap();
        assert_eq!(mode(RunFolder::create_at(&named).unwrap().path()), 0o755);
    }

    #[test]
    fn a_file_in_the_place_of_a_folder_is_an_error() {
        let below = tempfile::tempdir().unwrap();
        let place = below.path().join("notes.txt");
        fs::write(&place, "mine").unwrap();
        let error = RunFolder::create_at(&place).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read_to_string(&place).unwrap(), "mine");
    }

    #[test]
    fn a_folder_of_somebody_else_is_left_alone() {
        let below = tempfile::tempdir().unwrap();
        let folder = RunFolder::create_at(below.path()).unwrap();
        folder.clear().unwrap();
        folder.write(run_folder::PLAN, "mine").unwrap();
        let error = folder.clear().unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::AlreadyExists);
        assert!(error.to_string().contains("plan.json"), "{error}");
        assert_eq!(fs::read_to_string(folder.file(run_folder::PLAN)).unwrap(), "mine");
    }

    #[test]
    fn a_cleared_folder_keeps_only_what_is_not_of_a_run() {
        let below = tempfile::tempdir().unwrap();
        let folder = RunFolder::create_at(below.path()).unwrap();
        for name in run_folder::ALL.into_iter().chain(["notes.txt"]) {
            folder.write(name, "old").unwrap();
        }
        folder.clear().unwrap();
        let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|file| file.unwrap()).collect();
        assert_eq!(left.len(), 1);
        assert_eq!(left[0].file_name(), "notes.txt");
        folder.clear().unwrap();
    }

    #[test]
    fn the_name_has_date_time_and_job() {
        let below = tempfile::tempdir().unwrap();
        let folder = RunFolder::create_below(below.path(), "letters").unwrap();
        let name = folder.path().file_name().unwrap().to_str().unwrap();
        let (stamp, job) = name.split_at(15);
        assert!(stamp.chars().all(|c| c.is_ascii_digit() || c == '-'), "{name}");
        assert_eq!(job, "-letters");
    }
}
