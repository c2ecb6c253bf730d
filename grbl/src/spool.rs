//! The program that a client sends, line by line, until it is handed over as a job.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// The most bytes of one program.
const MOST: u64 = 1 << 30;

/// Programs that are kept for who looks at what was marked, and for jobs that wait.
const KEPT: usize = 256;

/// A folder of programs, `grbl-N.nc`.
#[derive(Debug, Clone)]
pub struct SpoolFolder {
    path: PathBuf,
    next: u64,
}

impl SpoolFolder {
    /// In the folder at `path`, which is made for this user alone when it is needed.
    pub fn new(path: PathBuf) -> Self {
        Self { path, next: 0 }
    }

    /// The files by number.
    fn files(&self) -> Vec<(u64, PathBuf)> {
        let entries = fs::read_dir(&self.path).into_iter().flatten().flatten();
        let mut files: Vec<_> =
            entries.filter_map(|entry| Some((number(&entry.path())?, entry.path()))).collect();
        files.sort_unstable();
        files
    }

    /// Begins a program; removes the oldest where there are many.
    ///
    /// # Errors
    /// A file that cannot be made.
    pub fn begin(&mut self, preamble: &str) -> io::Result<Spool> {
        if self.next == 0 {
            fs::DirBuilder::new().recursive(true).mode(0o700).create(&self.path)?;
            self.next = self.files().last().map_or(1, |(number, _)| number + 1);
        }
        let files = self.files();
        for (_, path) in files.iter().take(files.len().saturating_sub(KEPT - 1)) {
            // One that cannot be removed takes room and does no harm.
            let _ = fs::remove_file(path);
        }
        let path = self.path.join(format!("grbl-{}.nc", self.next));
        self.next += 1;
        let file = File::options().write(true).create_new(true).mode(0o600).open(&path)?;
        let mut file = BufWriter::new(file);
        file.write_all(preamble.as_bytes())?;
        let before = preamble.lines().count() as u64;
        Ok(Spool { path, file, before, lines: 0, bytes: preamble.len() as u64 })
    }
}

fn number(path: &Path) -> Option<u64> {
    path.file_name()?.to_str()?.strip_prefix("grbl-")?.strip_suffix(".nc")?.parse().ok()
}

/// A program that is being written.
#[derive(Debug)]
pub struct Spool {
    path: PathBuf,
    file: BufWriter<File>,
    /// Lines of the preamble.
    pub before: u64,
    /// Lines of the client.
    pub lines: u64,
    bytes: u64,
}

impl Spool {
    /// Adds a line.
    ///
    /// # Errors
    /// A file that cannot be written, or is too long.
    pub fn add(&mut self, line: &[u8]) -> io::Result<()> {
        self.bytes += line.len() as u64 + 1;
        if self.bytes > MOST {
            return Err(io::Error::other(format!("the program is longer than {} MiB", MOST >> 20)));
        }
        self.file.write_all(line)?;
        self.file.write_all(b"\n")?;
        self.lines += 1;
        Ok(())
    }

    /// Ends it.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn finish(mut self) -> io::Result<PathBuf> {
        self.file.flush()?;
        Ok(self.path)
    }

    /// Throws it away.
    pub fn discard(self) {
        // What is left takes room and does no harm.
        let _ = fs::remove_file(&self.path);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn programs_are_numbered_on_and_the_oldest_go() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("spool");
        for round in 0..2 {
            let mut spools = SpoolFolder::new(path.clone());
            for _ in 0..KEPT {
                let mut spool = spools.begin("G21\n").unwrap();
                spool.add(b"G0 X1").unwrap();
                assert_eq!((spool.before, spool.lines), (1, 1));
                spool.finish().unwrap();
            }
            let files = spools.files();
            let first = 1 + round * KEPT as u64;
            assert_eq!(files.len(), KEPT);
            assert_eq!((files[0].0, files[KEPT - 1].0), (first, first + KEPT as u64 - 1));
        }
        let newest = path.join(format!("grbl-{}.nc", 2 * KEPT));
        assert_eq!(fs::read_to_string(newest).unwrap(), "G21\nG0 X1\n");
    }

    #[test]
    fn a_program_that_is_thrown_away_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let mut spools = SpoolFolder::new(folder.path().to_owned());
        spools.begin("").unwrap().discard();
        assert!(spools.files().is_empty());
    }
}
