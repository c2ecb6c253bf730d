//! An instance of its own for each test, and the proof that nothing of it is left.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

use runtime::Instance;

static NUMBER: AtomicU32 = AtomicU32::new(0);

/// A fresh instance; dropping it asserts that the test left nothing behind.
pub(crate) struct Scratch {
    instance: Instance,
}

impl Scratch {
    /// An instance whose name no other test and no other process has.
    pub(crate) fn new() -> Self {
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let name = format!("test-{}-{number}", std::process::id());
        Self { instance: Instance::new(&name).unwrap() }
    }

    /// The instance.
    pub(crate) fn instance(&self) -> &Instance {
        &self.instance
    }

    /// Everything of the instance that exists in the file system.
    pub(crate) fn left(&self) -> Vec<PathBuf> {
        let prefix = self.instance.prefix();
        let shared = std::fs::read_dir("/dev/shm").unwrap().flatten();
        let mut left: Vec<PathBuf> = shared
            .filter(|entry| entry.file_name().to_string_lossy().starts_with(&prefix))
            .map(|entry| entry.path())
            .collect();
        left.extend(
            [self.instance.root(), self.instance.lock_path()]
                .into_iter()
                .filter(|path| path.exists()),
        );
        left
    }

    /// Asserts that nothing is left.
    pub(crate) fn assert_gone(&self) {
        assert_eq!(self.left(), Vec::<PathBuf>::new());
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            self.assert_gone();
        }
    }
}
