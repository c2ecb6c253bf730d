//! The name of a pipeline, and every place in the file system that follows from it.
//!
//! Two instances never meet: the prefix of all shared-memory names is a hash of fixed length over
//! the instance's name, its user and its directory, so no prefix begins another's.

use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use signals::sample::fnv1a;

/// Longest name of an instance, in bytes.
pub const MAX_NAME: usize = 32;

/// Longest path of a Unix socket, its terminating zero included, in bytes; unix(7).
const MAX_SOCKET_PATH: usize = 108;

/// Hexadecimal digits of the hash in all names: 48 bits.
const HASH_DIGITS: usize = 12;

/// Room that the longest socket needs below the root directory, in bytes: iceoryx2 0.10 puts its
/// event sockets at `/PREFIX`, up to 39 digits of a port's 128-bit number, `.event`.
const SOCKET_ROOM: usize = 1 + "graver__".len() + HASH_DIGITS + 39 + ".event".len();

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
        let hash = format!("{:016x}", fnv1a(&identity))[..HASH_DIGITS].to_owned();
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn names_are_checked() {
        for name in ["default", "a", "cell-1_b", &"x".repeat(MAX_NAME)] {
            assert_eq!(Instance::new(name).unwrap().name(), name);
        }
        for name in ["", "Cell", "a b", "../a", "ä", "a/b", "a.b", &"x".repeat(MAX_NAME + 1)] {
            let error = Instance::new(name).unwrap_err();
            assert_eq!(error, InstanceError::Name { name: name.into() });
        }
    }

    #[test]
    fn no_prefix_begins_another() {
        let base = Path::new("/dev/shm/graver-1000");
        let names = ["a", "aa", "default", "default1", "default-1"];
        let prefixes: Vec<_> =
            names.iter().map(|name| Instance::below(base, name).unwrap().prefix()).collect();
        for (index, prefix) in prefixes.iter().enumerate() {
            assert_eq!(prefix.len(), "graver_".len() + HASH_DIGITS + 1);
            for other in &prefixes[index + 1..] {
                assert!(!other.starts_with(prefix.as_str()) && !prefix.starts_with(other.as_str()));
            }
        }
        let elsewhere = Instance::below(Path::new("/run/user/1000/graver"), "a").unwrap();
        assert_ne!(elsewhere.prefix(), prefixes[0]);
    }

    #[test]
    fn the_longest_user_number_fits_and_a_deep_directory_is_refused() {
        // unix(7): 108 bytes with the terminating zero.
        let widest = format!("/run/user/{}/graver", u32::MAX);
        let instance = Instance::below(Path::new(&widest), "default").unwrap();
        assert!(instance.root().as_os_str().len() + SOCKET_ROOM < MAX_SOCKET_PATH);

        let deep = PathBuf::from(format!("/{}", "d".repeat(40)));
        match Instance::below(&deep, "default").unwrap_err() {
            InstanceError::TooLong { directory, length, limit } => {
                assert_eq!((directory, length, limit), (deep, 41 + 13 + SOCKET_ROOM, 107));
            }
            error => panic!("{error}"),
        }
    }
}
