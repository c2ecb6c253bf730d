//! The faults of an instance, kept on disk: who comes after a night can read what happened in it.
//!
//! One JSON object a line, the newest last, in `graver/NAME.faults.jsonl` below `$XDG_STATE_HOME`, or
//! `~/.local/state` without it. Where that cannot be written the faults since the start are known, and
//! whoever starts the pipeline is told.

use super::state_file;
use operator::PastFault;
use runtime::message;
use std::collections::VecDeque;
use std::fs::{self, File};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// How many faults are kept at least.
pub const KEPT: usize = 1000;

/// The faults of one instance.
#[derive(Debug, Default)]
pub struct FaultHistory {
    /// `None` where there is no folder, or it cannot be written.
    path: Option<PathBuf>,
    faults: VecDeque<PastFault>,
    /// Lines in the file.
    lines: usize,
}

/// The file in which the faults of the instance called `name` are kept; `None` where there is no home.
pub fn path(name: &str) -> Option<PathBuf> {
    state_file(name, "faults.jsonl")
}

/// The faults in the file at `path`, the oldest first; none where there is no such file. Lines that are none, such as
/// the last one of a computer that lost its power, are left out.
///
/// # Errors
/// A file that cannot be read.
pub fn read(path: &Path) -> io::Result<Vec<PastFault>> {
    match fs::read(path) {
        Ok(bytes) => {
            let lines = bytes.split(|byte| *byte == b'\n');
            Ok(lines.filter_map(|line| serde_json::from_slice(line).ok()).collect())
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(error) => Err(error),
    }
}

impl FaultHistory {
    /// Goes on with the file at `path`.
    pub fn open(path: Option<PathBuf>) -> Self {
        let mut history = Self { path, ..Self::default() };
        match history.path.as_deref().map(read) {
            Some(Ok(faults)) => {
                history.lines = faults.len();
                let newest = faults.len().saturating_sub(KEPT);
                history.faults = faults.into_iter().skip(newest).collect();
            }
            Some(Err(error)) => history.give_up(&error),
            None => {}
        }
        history
    }

    /// Where they are kept, if they are.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// The newest `most`, the oldest of them first.
    pub fn newest(&self, most: usize) -> Vec<PastFault> {
        self.faults.iter().skip(self.faults.len().saturating_sub(most)).cloned().collect()
    }

    /// Adds a fault.
    pub fn add(&mut self, fault: PastFault) {
        if self.faults.len() >= KEPT {
            self.faults.pop_front();
        }
        self.faults.push_back(fault);
        self.lines += 1;
        // Written anew at twice the length, so that it is seldom done.
        let written = match &self.path {
            Some(path) if self.lines > 2 * KEPT => self.write_anew(path),
            Some(path) => append(path, self.faults.back()),
            None => return,
        };
        match written {
            Ok(()) if self.lines > 2 * KEPT => self.lines = self.faults.len(),
            Ok(()) => {}
            Err(error) => self.give_up(&error),
        }
    }

    fn write_anew(&self, path: &Path) -> io::Result<()> {
        let unfinished = path.with_extension("jsonl.new");
        let mut text = Vec::new();
        for fault in &self.faults {
            line(fault, &mut text)?;
        }
        fs::write(&unfinished, text)?;
        fs::rename(&unfinished, path)
    }

    fn give_up(&mut self, error: &io::Error) {
        let path = self.path.take().unwrap_or_default();
        message::tell(&format!("{}: faults are not kept there: {error}", path.display()));
    }
}

fn append(path: &Path, fault: Option<&PastFault>) -> io::Result<()> {
    let mut text = Vec::new();
    // What was cut off before stays on a line of its own.
    if fs::read(path).is_ok_and(|bytes| bytes.last().is_some_and(|byte| *byte != b'\n')) {
        text.push(b'\n');
    }
    fault.map_or(Ok(()), |fault| line(fault, &mut text))?;
    if let Some(folder) = path.parent() {
        fs::DirBuilder::new().recursive(true).mode(0o700).create(folder)?;
    }
    let mut file = File::options().append(true).create(true).mode(0o600).open(path)?;
    file.write_all(&text)
}

fn line(fault: &PastFault, text: &mut Vec<u8>) -> io::Result<()> {
    serde_json::to_writer(&mut *text, fault)?;
    text.push(b'\n');
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn fault(time: u64) -> PastFault {
        PastFault { time, code: "hard_limit".into(), detail: "of axis x".into(), job: None }
    }

    fn times(faults: &[PastFault]) -> Vec<u64> {
        faults.iter().map(|fault| fault.time).collect()
    }

    #[test]
    fn faults_outlive_their_pipeline_and_a_torn_line_costs_only_itself() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("state/cell.faults.jsonl");
        let mut history = FaultHistory::open(Some(path.clone()));
        history.add(fault(1));
        history.add(fault(2));
        assert_eq!(times(&read(&path).unwrap()), [1, 2]);
        let mut torn = File::options().append(true).open(&path).unwrap();
        torn.write_all(b"{\"time\":3,\"co").unwrap();
        let mut history = FaultHistory::open(Some(path.clone()));
        history.add(fault(4));
        assert_eq!(times(&history.newest(2)), [2, 4]);
        assert_eq!(times(&read(&path).unwrap()), [1, 2, 4]);
        assert_eq!(read(&folder.path().join("other")).unwrap(), []);
    }

    #[test]
    fn the_file_does_not_grow_without_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cell.faults.jsonl");
        let mut history = FaultHistory::open(Some(path.clone()));
        let most = 2 * KEPT as u64 + 1;
        (1..=most).for_each(|time| history.add(fault(time)));
        let kept = times(&read(&path).unwrap());
        assert_eq!((kept.len(), kept[KEPT - 1]), (KEPT, most));
        history.add(fault(most + 1));
        assert_eq!(times(&FaultHistory::open(Some(path)).newest(2)), [most, most + 1]);
    }

    #[test]
    fn without_a_place_the_faults_since_the_start_are_known() {
        let folder = tempfile::tempdir().unwrap();
        let blocked = folder.path().join("file");
        fs::write(&blocked, "").unwrap();
        for path in [None, Some(blocked.join("cell.faults.jsonl"))] {
            let mut history = FaultHistory::open(path);
            history.add(fault(1));
            assert_eq!((times(&history.newest(9)), history.path()), (vec![1], None));
        }
    }
}
