//! What every service can fail with.

use std::io;
use std::path::PathBuf;

use crate::channel::ChannelError;
use crate::core_lock::CoreError;
use crate::domain::DomainError;

/// Why a service ended early.
#[derive(Debug, thiserror::Error)]
pub enum ServiceError {
    /// The domain could not be joined, or a port in it not be made.
    #[error(transparent)]
    Domain(#[from] DomainError),
    /// A channel failed.
    #[error(transparent)]
    Channel(#[from] ChannelError),
    /// The real-time core could not be claimed.
    #[error(transparent)]
    Core(#[from] CoreError),
    /// A file or directory failed.
    #[error("{path:?}: {source}")]
    Io {
        /// The file or directory.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A thread of the service could not be started.
    #[error("the thread {name:?} could not be started: {source}")]
    Thread {
        /// The thread's name.
        name: String,
        /// Why.
        source: io::Error,
    },
    /// The service's own work broke off.
    #[error("{0}")]
    Work(String),
}

impl ServiceError {
    /// The operating system refused something about `path`.
    pub fn io(path: impl Into<PathBuf>, source: io::Error) -> Self {
        Self::Io { path: path.into(), source }
    }

    /// The operating system refused to start the thread `name`.
    pub fn thread(name: impl Into<String>, source: io::Error) -> Self {
        Self::Thread { name: name.into(), source }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_of_the_operating_system_names_what_was_asked() {
        let full = || io::Error::from_raw_os_error(libc::ENOSPC);
        let said = ServiceError::io("runs/a/samples.bin", full()).to_string();
        assert!(said.starts_with("\"runs/a/samples.bin\": No space left on device"), "{said}");
        let said = ServiceError::thread("plan", full()).to_string();
        assert!(said.starts_with("the thread \"plan\" could not be started: No space"), "{said}");
    }
}
