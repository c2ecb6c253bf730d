//! The computer that is examined: what its kernel tells in `/proc` and `/sys`, or copies of these below another
//! folder.

use std::fs;
use std::path::{Path, PathBuf};

/// CPUs that Linux can have; a list that names more is none.
const MAX_CPUS: usize = 8192;

/// A computer.
#[derive(Debug, Clone)]
pub(super) struct Host {
    root: PathBuf,
}

impl Host {
    /// The computer whose files lie below `root`.
    pub(super) fn new(root: &Path) -> Self {
        Self { root: root.to_owned() }
    }

    /// Whether this process runs on it, and may try things.
    pub(super) fn is_this_one(&self) -> bool {
        self.root == Path::new("/")
    }

    /// Where a file of the computer, named from its root, is.
    pub(super) fn path(&self, path: &str) -> PathBuf {
        self.root.join(path.trim_start_matches('/'))
    }

    /// A file as text without the blanks at its ends; `None` where there is none, or it cannot be read.
    pub(super) fn text(&self, path: &str) -> Option<String> {
        let bytes = fs::read(self.path(path)).ok()?;
        Some(String::from_utf8_lossy(&bytes).trim().to_owned())
    }

    /// A file that has one number.
    pub(super) fn number<T: std::str::FromStr>(&self, path: &str) -> Option<T> {
        self.text(path)?.parse().ok()
    }

    /// A file that has a list of CPUs.
    pub(super) fn cpus(&self, path: &str) -> Option<Vec<usize>> {
        cpu_list(&self.text(path)?)
    }

    /// What a folder has, by name; nothing where there is none.
    pub(super) fn names(&self, path: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(path)).into_iter().flatten().flatten();
        let mut names: Vec<_> =
            entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// The last part of what a link leads to.
    pub(super) fn link(&self, path: &str) -> Option<String> {
        let target = fs::read_link(self.path(path)).ok()?;
        Some(target.file_name()?.to_string_lossy().into_owned())
    }

    /// A parameter that the kernel was booted with; empty where it is there without a value.
    pub(super) fn boot_parameter(&self, name: &str) -> Option<String> {
        let line = self.text("/proc/cmdline")?;
        line.split_whitespace().find_map(|word| match word.split_once('=') {
            Some((key, value)) => (key == name).then(|| value.to_owned()),
            None => (word == name).then(String::new),
        })
    }
}

/// Reads a list of CPUs such as `0-3,7`; empty text is no CPU.
pub(super) fn cpu_list(text: &str) -> Option<Vec<usize>> {
    let mut cpus = Vec::new();
    for range in text.trim().split(',').filter(|range| !range.is_empty()) {
        let (first, last) = range.split_once('-').unwrap_or((range, range));
        let (first, last): (usize, usize) = (first.parse().ok()?, last.parse().ok()?);
        if first > last || last >= MAX_CPUS {
            return None;
        }
        cpus.extend(first..=last);
    }
    Some(cpus)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn lists_of_cpus_are_read_as_the_kernel_writes_them() {
        assert_eq!(cpu_list("0-3,7"), Some(vec![0, 1, 2, 3, 7]));
        assert_eq!(cpu_list(""), Some(vec![]));
        assert_eq!(cpu_list("5"), Some(vec![5]));
        for wrong in ["3-1", "a", "0-", "0-99999999999", "nohz,3"] {
            assert_eq!(cpu_list(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn files_and_boot_parameters_are_those_below_the_root() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("proc")).unwrap();
        fs::write(folder.path().join("proc/cmdline"), "quiet isolcpus=2-3 threadirqs\n").unwrap();
        let host = Host::new(folder.path());
        assert!(!host.is_this_one() && Host::new(Path::new("/")).is_this_one());
        assert_eq!(host.boot_parameter("isolcpus"), Some("2-3".to_owned()));
        assert_eq!(host.boot_parameter("threadirqs"), Some(String::new()));
        assert_eq!(host.boot_parameter("nohz_full"), None);
        assert_eq!(host.text("/proc/none"), None);
        assert_eq!(host.names("/proc"), ["cmdline"]);
    }
}
