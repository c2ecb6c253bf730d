//! The name of a pipeline, and every place in the file system that follows from it.
//!
//! Two instances never meet: the prefix of all shared-memory names is a hash of fixed length over
//! the instance's name, its user and its directory, so no prefix begins another's.

use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use signals::sample::fnv1a;

/// Longest name of an instance [bytes].
pub const MAX_NAME: usize = 32;

/// Longest path of a Unix socket, its terminating zero included [bytes]; unix(7).
const MAX_SOCKET_PATH: usize = 108;

/// Room that sockets need below the root directory: iceoryx2 0.10 puts its event sockets at
/// `events/PREFIX` (24 bytes), 40 digits and `.event_connection`.
const SOCKET_ROOM: usize = 90 - 58;

/// Where the shared memory of every process on this computer shows as files.
pub(crate) const SHARED_MEMORY: &str = "/dev/shm";

/// Why a name cannot be an instance's.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum InstanceError {
    /// The name has other characters or another length than allowed.
    #[error(
        "instance name {name:?} is not usable: 1 to {MAX_NAME} of a-z, 0-9, '_' and '-', for \
         example \"default\""
    )]
    Name {
        /// The name as given.
        name: String,
    },
    /// The directory is too deep for the sockets below it.
    #[error(
        "the run directory {directory:?} is too long: sockets below it would take {length} bytes \
         of at most {limit}; set XDG_RUNTIME_DIR to a shorter path, or unset it"
    )]
    TooLong {
        /// The directory that would hold the instance.
        directory: PathBuf,
        /// Bytes that the longest socket path would take.
        length: usize,
        /// Bytes that it may take.
        limit: usize,
    },
}

/// One pipeline's name and places.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Instance {
    name: String,
    base: PathBuf,
    hash: String,
}

impl Instance {
    /// The instance of this name, below `$XDG_RUNTIME_DIR/graver` if that directory exists, else
    /// below `/dev/shm/graver-UID`.
    pub fn new(name: &str) -> Result<Self, InstanceError> {
        let base = match std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from) {
            Some(directory) if directory.is_absolute() && directory.is_dir() => {
                directory.join("graver")
            }
            _ => Path::new(SHARED_MEMORY).join(format!("graver-{}", user())),
        };
        Self::below(&base, name)
    }

    /// The instance of this name below `base`; processes meet only with the same `base`.
    pub fn below(base: &Path, name: &str) -> Result<Self, InstanceError> {
        let allowed = |byte: u8| matches!(byte, b'a'..=b'z' | b'0'..=b'9' | b'_' | b'-');
        if name.is_empty() || name.len() > MAX_NAME || !name.bytes().all(allowed) {
            return Err(InstanceError::Name { name: name.into() });
        }
        let mut identity = Vec::from(base.as_os_str().as_bytes());
        identity.extend_from_slice(format!("\0{}\0{name}", user()).as_bytes());
        let hash = format!("{:016x}", fnv1a(&identity));
        let instance = Self { name: name.into(), base: base.into(), hash };
        let length = instance.root().as_os_str().len() + SOCKET_ROOM;
        if length >= MAX_SOCKET_PATH {
            return Err(InstanceError::TooLong {
                directory: base.into(),
                length,
                limit: MAX_SOCKET_PATH - 1,
            });
        }
        Ok(instance)
    }

    /// The name, as users give it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The directory that holds this user's instances.
    pub(crate) fn base(&self) -> &Path {
        &self.base
    }

    /// The directory of this instance; exists while anybody is in its domain.
    pub fn root(&self) -> PathBuf {
        self.base.join(&self.hash)
    }

    /// The file whose lock says that somebody is in the domain.
    pub fn lock_path(&self) -> PathBuf {
        self.base.join(format!("{}.lock", self.hash))
    }

    /// The operators' socket.
    pub fn socket_path(&self) -> PathBuf {
        self.root().join("operator.sock")
    }

    /// What the names of all its shared memory begin with.
    pub fn prefix(&self) -> String {
        format!("graver_{}_", self.hash)
    }
}

impl std::fmt::Display for Instance {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(&self.name)
    }
}

/// The user on whose behalf this process acts.
pub(crate) fn user() -> u32 {
    // SAFETY: geteuid has no preconditions and cannot fail.
    #[allow(unsafe_code)]
    unsafe {
        libc::geteuid()
    }
}
