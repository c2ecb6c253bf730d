//! Files that a command writes: never one that it reads, and no folder that somebody else fills.

use crate::exit::Failure;
use machine::offsets::Offsets;
use messages::run_folder;
use monitor::run_folder::RunFolder;
use std::fs::{self, File, TryLockError};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// What a command reads, and what it has written already.
#[derive(Debug, Clone, Default)]
pub struct Sources {
    files: Vec<(PathBuf, &'static str)>,
}

impl Sources {
    /// The machine file, if there is one, with the offsets beside it, and the files of the job.
    pub fn new(machine: Option<&Path>, job: &[PathBuf]) -> Self {
        let mut sources = Self::default();
        if let Some(path) = machine {
            sources = sources.and_machine(path);
        }
        sources.add_job(job);
        sources
    }

    /// These and the machine file at `path`.
    #[must_use]
    pub fn and_machine(mut self, path: &Path) -> Self {
        self.files.push((path.to_owned(), "the machine file"));
        self.files.push((Offsets::path(path), "the offsets of the machine"));
        self
    }

    /// Adds the files of a job.
    pub fn add_job(&mut self, files: &[PathBuf]) {
        self.files.extend(files.iter().map(|path| (path.clone(), "a file of the job")));
    }

    /// Sees that no file of a run in the folder that is asked for takes the place of one of these.
    ///
    /// # Errors
    /// One that does.
    pub fn spare(&self, folder: Option<&Path>) -> Result<(), Failure> {
        let files = folder.iter().flat_map(|folder| run_folder::ALL.map(|name| folder.join(name)));
        files.into_iter().try_for_each(|file| self.refuse("--out", &file, "another folder"))
    }

    /// Refuses to write over one of these under whatever name.
    fn refuse(&self, argument: &str, path: &Path, other: &str) -> Result<(), Failure> {
        let output = identity(path);
        let same = |(file, _): &&(PathBuf, &str)| output.is_some() && identity(file) == output;
        match self.files.iter().find(same) {
            Some((_, what)) => Err(Failure::bad_input(format!(
                "{argument} {}: this is {what}, which would be lost: name {other}",
                path.display()
            ))),
            None => Ok(()),
        }
    }

    /// The file that is exported.
    pub fn recording(path: &Path) -> Self {
        Self { files: vec![(path.to_owned(), "the recording itself")] }
    }

    /// Creates the file that `argument` names, or empties it.
    ///
    /// # Errors
    /// A file that is read or was written before, under whatever name, or that cannot be created.
    pub fn create(&mut self, argument: &str, path: &Path) -> Result<File, Failure> {
        self.refuse(argument, path, "another file")?;
        let file = File::create(path).map_err(|error| {
            Failure::bad_input(format!("{argument}: cannot write {}: {error}", path.display()))
        })?;
        self.files.push((path.to_owned(), "another output of this command"));
        Ok(file)
    }
}

/// The same for every name of one regular file; devices and pipes can be written twice.
fn identity(path: &Path) -> Option<(u64, u64)> {
    let metadata = fs::metadata(path).ok().filter(fs::Metadata::is_file)?;
    Some((metadata.dev(), metadata.ino()))
}

/// A run folder that no other run may write into. A directory can only be opened for reading, so this
/// is flock(2) and not the lock of `runtime`, which needs a file open for writing; dropping it gives the folder free, and so does
/// the end of the process.
#[derive(Debug)]
pub struct Claim {
    _folder: File,
}

impl Claim {
    /// Claims the folder for this process.
    ///
    /// # Errors
    /// Another process that writes into it.
    pub fn of(folder: &RunFolder) -> Result<Self, Failure> {
        let path = folder.path();
        let failed = |error: &dyn std::fmt::Display| {
            Failure::bad_input(format!("{}: {error}", path.display()))
        };
        let file = File::open(path).map_err(|error| failed(&error))?;
        match file.try_lock() {
            Ok(()) => Ok(Self { _folder: file }),
            Err(TryLockError::WouldBlock) => {
                let who = owner(&file).map_or_else(String::new, |pid| format!(" (pid {pid})"));
                Err(failed(&format!("another run{who} writes into this folder: name another")))
            }
            Err(TryLockError::Error(error)) => Err(failed(&error)),
        }
    }
}

/// The process that holds the lock on `file`; proc_locks(5).
fn owner(file: &File) -> Option<i32> {
    let inode = file.metadata().ok()?.ino().to_string();
    let locks = fs::read_to_string("/proc/locks").ok()?;
    locks.lines().find_map(|line| {
        let mut words = line.split_whitespace().skip_while(|word| *word != "FLOCK").skip(3);
        let pid = words.next()?.parse().ok()?;
        let place = words.next()?.rsplit(':').next()?;
        (place == inode).then_some(pid)
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn an_input_is_not_written_over_under_any_name() {
        let folder = tempfile::tempdir().unwrap();
        let job = folder.path().join("job.ngc");
        fs::write(&job, "M2\n").unwrap();
        let link = folder.path().join("link.csv");
        std::os::unix::fs::symlink(&job, &link).unwrap();
        let hard = folder.path().join("hard.csv");
        fs::hard_link(&job, &hard).unwrap();
        for path in [&job, &link, &hard, &folder.path().join("./job.ngc")] {
            let mut sources = Sources::new(None, std::slice::from_ref(&job));
            let text = sources.create("--samples", path).unwrap_err().refusal.message;
            assert!(text.contains("--samples") && text.contains("a file of the job"), "{text}");
        }
        assert_eq!(fs::read_to_string(&job).unwrap(), "M2\n");
    }

    #[test]
    fn a_run_folder_spares_the_files_of_its_job() {
        let place = tempfile::tempdir().unwrap();
        let job = place.path().join(run_folder::PICTURE);
        fs::write(&job, "<svg/>").unwrap();
        let sources = Sources::new(None, std::slice::from_ref(&job));
        let text = sources.spare(Some(place.path())).unwrap_err().refusal.message;
        assert!(text.contains("path.svg: this is a file of the job"), "{text}");
        sources.spare(None).unwrap();
        Sources::default().spare(Some(place.path())).unwrap();
    }

    #[test]
    fn two_outputs_are_two_files() {
        let folder = tempfile::tempdir().unwrap();
        let (one, other) = (folder.path().join("a.csv"), folder.path().join("b.csv"));
        let mut sources = Sources::default();
        sources.create("--samples", &one).unwrap();
        let text = sources.create("--pulses", &one).unwrap_err().refusal.message;
        assert!(text.contains("another output"), "{text}");
        sources.create("--pulses", &other).unwrap();
        for _ in 0..2 {
            sources.create("--picture", Path::new("/dev/null")).unwrap();
        }
        let missing = folder.path().join("no/such.csv");
        let text = sources.create("--samples", &missing).unwrap_err().refusal.message;
        assert!(text.contains("no/such.csv"), "{text}");
    }

    #[test]
    fn a_claimed_folder_names_who_writes_into_it() {
        let folder = tempfile::tempdir().unwrap();
        let folder = RunFolder::create_at(folder.path()).unwrap();
        let claim = Claim::of(&folder).unwrap();
        let text = Claim::of(&folder).unwrap_err().refusal.message;
        assert!(text.contains(&format!("pid {}", std::process::id())), "{text}");
        drop(claim);
        Claim::of(&folder).unwrap();
    }
}
