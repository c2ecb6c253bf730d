//! The run folder: `runs/DATE-TIME-JOB`; [`messages::run_folder`] names the files in it.
//!
//! A folder made here is its user's alone. One that was there before keeps its mode.

use messages::run_folder;
use serde::Serialize;
use std::fs;
use std::io;
use std::os::unix::fs::{DirBuilderExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// The longest part of a job's name that goes into the folder's name [characters].
const LONGEST_NAME: usize = 40;

/// Files of which every run leaves one at least, however it ends.
const OF_EVERY_RUN: [&str; 4] =
    [run_folder::REQUEST, run_folder::SAMPLES, run_folder::OLD_SAMPLES, run_folder::SUMMARY];

/// How the name of a file ends that is being written.
const UNFINISHED: &str = ".part";

/// A file or folder that the operating system refuses.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {source}", path = path.display())]
pub struct FileError {
    /// The file or folder.
    pub path: PathBuf,
    /// What the operating system says.
    pub source: io::Error,
}

impl FileError {
    /// A refusal of `path`.
    pub fn at(path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self { path: path.to_owned(), source }
    }
}

impl From<FileError> for io::Error {
    /// The same kind of error, with the path in its words.
    fn from(error: FileError) -> Self {
        Self::new(error.source.kind(), error.to_string())
    }
}

/// The local time of `seconds` since 1970, as people write it: `2026-11-28 09:12:03`.
pub fn local_time(seconds: u64) -> String {
    let time = i64::try_from(seconds).ok().and_then(|it| jiff::Timestamp::from_second(it).ok());
    let local = time.unwrap_or_default().to_zoned(jiff::tz::TimeZone::system());
    local.strftime("%Y-%m-%d %H:%M:%S").to_string()
}

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
    /// What the operating system reports, with the path.
    pub fn create_below(below: &Path, job: &str) -> Result<Self, FileError> {
        let now = jiff::Zoned::now().strftime("%Y%m%d-%H%M%S").to_string();
        Self::create_named(&below.join("runs"), &format!("{now}-{}", file_name(job)))
    }

    /// Uses the folder that the user named; it is created where it does not exist.
    ///
    /// # Errors
    /// What the operating system reports, with the path.
    pub fn create_at(path: &Path) -> Result<Self, FileError> {
        let create = || {
            if path.is_dir() {
                return Ok(());
            }
            path.parent().map_or(Ok(()), fs::create_dir_all)?;
            match create_private(path) {
                // Somebody else made it just now.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists && path.is_dir() => {
                    Ok(())
                }
                other => other,
            }
        };
        create().map_err(FileError::at(path))?;
        Ok(Self { path: path.to_owned() })
    }

    /// The folder at a path, which must be there.
    ///
    /// # Errors
    /// What the operating system reports, with the path.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        let found = fs::metadata(path).map_err(FileError::at(path))?;
        if !found.is_dir() {
            return Err(FileError::at(path)(io::ErrorKind::NotADirectory.into()));
        }
        Ok(Self { path: path.to_owned() })
    }

    fn create_named(runs: &Path, name: &str) -> Result<Self, FileError> {
        fs::create_dir_all(runs).map_err(FileError::at(runs))?;
        let mut path = runs.join(name);
        let mut number = 1;
        loop {
            match create_private(&path) {
                Ok(()) => return Ok(Self { path }),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                    number += 1;
                    path = runs.join(format!("{name}-{number}"));
                }
                Err(source) => return Err(FileError { path, source }),
            }
        }
    }

    /// Removes what an earlier run left in it.
    ///
    /// # Errors
    /// A file of such a name in a folder that no run has left, or what the operating system
    /// reports, with the path.
    pub fn clear(&self) -> Result<(), FileError> {
        let has = |name: &str| self.file(name).exists();
        let left_by_a_run = OF_EVERY_RUN.into_iter().any(has);
        let any = run_folder::ALL.into_iter().find(|name| has(name));
        if let (false, Some(name)) = (left_by_a_run, any) {
            let message = format!("has a {name} that no run has left: name another folder");
            let source = io::Error::new(io::ErrorKind::AlreadyExists, message);
            return Err(FileError { path: self.path.clone(), source });
        }
        let files = run_folder::ALL.map(|name| self.file(name)).into_iter();
        let parts = crate::recording::file::parts::of(&self.path);
        for path in files.chain(parts).chain(self.unfinished()) {
            match fs::remove_file(&path) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => {
                    return Err(FileError { path, source });
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Files that a process was killed in the middle of writing.
    fn unfinished(&self) -> Vec<PathBuf> {
        let of_a_run = |name: &str| {
            let begins = |file: &str| name.strip_prefix('.').is_some_and(|it| it.starts_with(file));
            name.ends_with(UNFINISHED) && run_folder::ALL.into_iter().any(begins)
        };
        let entries = fs::read_dir(&self.path).into_iter().flatten().flatten();
        let files = entries.filter(|entry| entry.file_name().to_str().is_some_and(of_a_run));
        files.map(|entry| entry.path()).collect()
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Where one of its files is.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Writes one of its files whole: a reader sees the old content or the new, also where two
    /// processes write it at once.
    ///
    /// # Errors
    /// What the operating system reports, with the path.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> Result<(), FileError> {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let (process, count) = (std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let unfinished = self.file(&format!(".{name}.{process}-{count}{UNFINISHED}"));
        let path = self.file(name);
        fs::write(&unfinished, content).and_then(|()| fs::rename(&unfinished, &path)).map_err(
            |source| {
                // Half a file on a full disk would only make it fuller.
                let _ = fs::remove_file(&unfinished);
                FileError { path, source }
            },
        )
    }

    /// Writes one of its files as JSON, as [`Self::write`] does.
    ///
    /// # Errors
    /// What the operating system reports, with the path.
    pub fn write_json(&self, name: &str, value: &impl Serialize) -> Result<(), FileError> {
        match serde_json::to_vec_pretty(value) {
            Ok(text) => self.write(name, text),
            Err(error) => Err(FileError { path: self.file(name), source: error.into() }),
        }
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
        assert_eq!(error.source.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read_to_string(&place).unwrap(), "mine");
    }

    #[test]
    fn a_folder_of_somebody_else_is_left_alone() {
        let below = tempfile::tempdir().unwrap();
        let folder = RunFolder::create_at(below.path()).unwrap();
        folder.clear().unwrap();
        folder.write(run_folder::PLAN, "mine").unwrap();
        let error = folder.clear().unwrap_err();
        assert_eq!(error.source.kind(), io::ErrorKind::AlreadyExists);
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
        // A writer that was killed in the middle.
        fs::write(folder.file(".summary.json.4711-0.part"), "{").unwrap();
        folder.clear().unwrap();
        let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|file| file.unwrap()).collect();
        assert_eq!(left.len(), 1);
        assert_eq!(left[0].file_name(), "notes.txt");
        folder.clear().unwrap();
    }

    #[test]
    fn every_refusal_names_its_path() {
        let below = tempfile::tempdir().unwrap();
        let file = below.path().join("file");
        fs::write(&file, "").unwrap();
        let inside = file.join("run");
        for refused in [RunFolder::create_at(&inside), RunFolder::open(&inside)] {
            assert!(refused.unwrap_err().to_string().contains("file/run: "));
        }
        assert!(RunFolder::open(&file).unwrap_err().to_string().contains("file: "));
        let error = RunFolder::create_below(&file, "letters").unwrap_err().to_string();
        assert!(error.contains("file/runs: "), "{error}");
        let folder = RunFolder::open(below.path()).unwrap();
        // A folder stands where the file should.
        fs::create_dir(folder.file(run_folder::SUMMARY)).unwrap();
        let error = folder.write(run_folder::SUMMARY, "{}").unwrap_err().to_string();
        assert!(error.contains("summary.json: "), "{error}");
        let left = fs::read_dir(below.path()).unwrap().count();
        assert_eq!(left, 2, "the file and the folder, and nothing unfinished");
        let error = folder.clear().unwrap_err().to_string();
        assert!(error.contains("summary.json: "), "{error}");
        let error = io::Error::from(folder.clear().unwrap_err()).to_string();
        assert!(error.contains("summary.json: "), "{error}");
    }

    #[test]
    fn two_who_write_at_once_leave_one_whole_file() {
        let below = tempfile::tempdir().unwrap();
        let folder = RunFolder::create_at(below.path()).unwrap();
        let texts = ["a".repeat(100_000), "b".repeat(100_000)];
        std::thread::scope(|scope| {
            for text in &texts {
                let folder = &folder;
                scope.spawn(move || {
                    for _ in 0..50 {
                        folder.write(run_folder::SUMMARY, text).unwrap();
                    }
                });
            }
        });
        let left = fs::read_to_string(folder.file(run_folder::SUMMARY)).unwrap();
        assert!(texts.contains(&left));
        assert_eq!(fs::read_dir(below.path()).unwrap().count(), 1);
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
