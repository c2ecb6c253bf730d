//! The name of a pipeline, and every place in the file system that follows from it.
//!
//! Two instances never meet: what the names of all its shared memory begin with is a hash of fixed
//! length over the instance's name, its user and its directory, so none begins another's. After
//! it comes a part that is drawn anew for each domain, its nonce, so that nobody can take a name
//! before we do.

mod directory;

use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use messages::sample::fnv1a;

use directory::PassedOver;
pub(crate) use directory::{Place, create_private, inspect};

/// Longest name of an instance, in bytes.
pub const MAX_NAME: usize = 32;

/// Longest path of a Unix socket, its terminating zero included, in bytes; unix(7).
const MAX_SOCKET_PATH: usize = 108;

/// What digits of hashes and nonces are written with: five bits each.
const DIGITS: &[u8; 32] = b"abcdefghijklmnopqrstuvwxyz234567";

/// Digits of the hash in all names: 40 bits.
const HASH_DIGITS: usize = 8;

/// Digits of a domain's nonce: 30 bits, a thousand times more names than a tmpfs has room for.
const NONCE_DIGITS: usize = 6;

/// Room that the longest socket needs below the root directory, in bytes: iceoryx2 0.10 puts its
/// event sockets at `/PREFIX`, up to 39 digits of a port's 128-bit number, `.event`.
const SOCKET_ROOM: usize = 1 + "graver___".len() + HASH_DIGITS + NONCE_DIGITS + 39 + ".event".len();

/// Where the shared memory of every process on this computer shows as files.
pub(crate) const SHARED_MEMORY: &str = "/dev/shm";

/// How many names of a base directory are tried.
const BASES: usize = 9;

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
    /// Every name that the run directory can have is taken.
    #[error(
        "no run directory is left: {taken}; have them removed, or set XDG_RUNTIME_DIR to a \
         directory of your own"
    )]
    Taken {
        /// The names, and what stands there.
        taken: String,
    },
    /// A directory could not be inspected.
    #[error("{directory:?}: {reason}")]
    Hidden {
        /// The directory.
        directory: PathBuf,
        /// What the operating system said.
        reason: String,
    },
}

/// One pipeline's name and places.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Instance {
    name: String,
    base: PathBuf,
    hash: String,
    passed_over: Vec<PassedOver>,
}

impl Instance {
    /// The instance of this name, below `$XDG_RUNTIME_DIR/graver` if that variable names a
    /// directory, else below `/dev/shm/graver-UID`; where that name is another user's, below the
    /// same with `-2`, and so on to `-9`. A directory in which the instance is running goes before
    /// one that has become free since.
    pub fn new(name: &str) -> Result<Self, InstanceError> {
        match std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from) {
            Some(directory) if directory.is_absolute() && directory.is_dir() => {
                Self::in_directory(&directory, "graver", name)
            }
            _ => Self::in_directory(Path::new(SHARED_MEMORY), &format!("graver-{}", user()), name),
        }
    }

    /// The instance below the first usable of `stem`, `stem-2`, … in `directory`.
    fn in_directory(directory: &Path, stem: &str, name: &str) -> Result<Self, InstanceError> {
        let mut passed_over = Vec::new();
        let mut usable: Option<Self> = None;
        for number in 1..=BASES {
            let stem = if number == 1 { stem.to_owned() } else { format!("{stem}-{number}") };
            let base = directory.join(stem);
            let place = inspect(&base).map_err(|error| InstanceError::Hidden {
                directory: base.clone(),
                reason: error.to_string(),
            })?;
            let found = match place {
                Place::Taken(what) => {
                    passed_over.push(PassedOver { path: base, what });
                    continue;
                }
                Place::Free | Place::Ours => Self::below(&base, name)?,
            };
            let found = Self { passed_over: passed_over.clone(), ..found };
            if place == Place::Ours && found.lock_path().exists() {
                return Ok(found);
            }
            usable.get_or_insert(found);
        }
        usable.ok_or_else(|| InstanceError::Taken { taken: list(&passed_over) })
    }

    /// The instance of this name below `base`; processes meet only with the same `base`.
    pub fn below(base: &Path, name: &str) -> Result<Self, InstanceError> {
        let allowed = |byte: u8| matches!(byte, b'a'..=b'z' | b'0'..=b'9' | b'_' | b'-');
        if name.is_empty() || name.len() > MAX_NAME || !name.bytes().all(allowed) {
            return Err(InstanceError::Name { name: name.into() });
        }
        let mut identity = Vec::from(base.as_os_str().as_bytes());
        identity.extend_from_slice(format!("\0{}\0{name}", user()).as_bytes());
        let hash = digits(fnv1a(&identity), HASH_DIGITS);
        let instance = Self { name: name.into(), base: base.into(), hash, passed_over: Vec::new() };
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

    /// What a person should know who starts a pipeline in this instance: the names of a run
    /// directory that others have taken, and whose they are.
    pub fn warnings(&self) -> Vec<String> {
        if self.passed_over.is_empty() {
            return Vec::new();
        }
        let (taken, base) = (list(&self.passed_over), &self.base);
        vec![format!("{taken}: the run directory is {base:?} instead")]
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

    /// What the names of all its shared memory begin with, whenever it was created.
    pub fn prefix(&self) -> String {
        format!("graver_{}_", self.hash)
    }

    /// What the names of the shared memory of one domain of this instance begin with.
    pub(crate) fn domain_prefix(&self, nonce: &Nonce) -> String {
        format!("{}{}_", self.prefix(), nonce.0)
    }
}

impl std::fmt::Display for Instance {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(&self.name)
    }
}

/// The part of a domain's shared-memory names that nobody can know before the domain is there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Nonce(String);

impl Nonce {
    /// A new one, drawn from the kernel.
    pub(crate) fn draw() -> std::io::Result<Self> {
        let mut bytes = [0; size_of::<u64>()];
        // SAFETY: the kernel fills the buffer, whose length is given.
        #[allow(unsafe_code)]
        let got = unsafe { libc::getrandom(bytes.as_mut_ptr().cast(), bytes.len(), 0) };
        if got != bytes.len() as isize {
            return Err(std::io::Error::last_os_error());
        }
        Ok(Self(digits(u64::from_ne_bytes(bytes), NONCE_DIGITS)))
    }

    /// The one that a holder told; `None` if it is none.
    pub(crate) fn told(text: &str) -> Option<Self> {
        let valid = text.len() == NONCE_DIGITS && text.bytes().all(|byte| DIGITS.contains(&byte));
        valid.then(|| Self(text.to_owned()))
    }

    /// As a holder tells it.
    pub(crate) fn text(&self) -> &str {
        &self.0
    }
}

/// The lowest bits of a number, five a digit.
fn digits(number: u64, count: usize) -> String {
    (0..count).map(|place| char::from(DIGITS[(number >> (5 * place) & 31) as usize])).collect()
}

fn list(passed_over: &[PassedOver]) -> String {
    passed_over.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
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
    use std::fs;

    #[test]
    fn names_are_checked() {
        let base = Path::new("/dev/shm/graver-1000");
        for name in ["default", "a", "cell-1_b", &"x".repeat(MAX_NAME)] {
            assert_eq!(Instance::below(base, name).unwrap().name(), name);
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
        let instances: Vec<_> =
            names.iter().map(|name| Instance::below(base, name).unwrap()).collect();
        let nonce = Nonce::draw().unwrap();
        let mut prefixes: Vec<_> = instances.iter().map(Instance::prefix).collect();
        for (prefix, instance) in prefixes.iter().zip(&instances) {
            assert_eq!(prefix.len(), "graver__".len() + HASH_DIGITS);
            assert!(instance.domain_prefix(&nonce).starts_with(prefix));
        }
        let elsewhere = Instance::below(Path::new("/run/user/1000/graver"), "a").unwrap();
        prefixes.push(elsewhere.prefix());
        for (index, prefix) in prefixes.iter().enumerate() {
            for other in &prefixes[index + 1..] {
                assert!(!other.starts_with(prefix.as_str()) && !prefix.starts_with(other.as_str()));
            }
        }
    }

    #[test]
    fn a_nonce_is_never_the_same_and_survives_being_told() {
        let drawn = Nonce::draw().unwrap();
        assert_ne!(drawn, Nonce::draw().unwrap());
        assert_eq!(Nonce::told(drawn.text()), Some(drawn));
        for text in ["", "abcde", "abcdefg", "abcd/f", "ABCDEF", "abcde1"] {
            assert_eq!(Nonce::told(text), None, "{text}");
        }
    }

    #[test]
    fn the_longest_user_number_fits_and_a_deep_directory_is_refused() {
        // unix(7): 108 bytes with the terminating zero.
        for widest in ["/run/user/4294967295/graver-9", "/dev/shm/graver-4294967295-9"] {
            let instance = Instance::below(Path::new(widest), "default").unwrap();
            assert!(instance.root().as_os_str().len() + SOCKET_ROOM < MAX_SOCKET_PATH);
            let event = format!("{}.event", u128::MAX);
            let prefix = instance.domain_prefix(&Nonce::draw().unwrap());
            assert_eq!(format!("/{prefix}{event}").len(), SOCKET_ROOM);
        }

        let deep = PathBuf::from(format!("/{}", "d".repeat(40)));
        match Instance::below(&deep, "default").unwrap_err() {
            InstanceError::TooLong { directory, length, limit } => {
                let expected = 41 + 1 + HASH_DIGITS + SOCKET_ROOM;
                assert_eq!((directory, length, limit), (deep, expected, 107));
            }
            error => panic!("{error}"),
        }
    }

    /// A short path for run directories, removed at the end of a test.
    struct Scratch(PathBuf);

    impl Scratch {
        fn new(name: &str) -> Self {
            let path = Path::new("/tmp").join(format!("gr-{name}-{}", std::process::id()));
            fs::create_dir(&path).unwrap();
            Self(path)
        }

        fn instance(&self) -> Result<Instance, InstanceError> {
            Instance::in_directory(&self.0, "g", "a")
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn a_name_that_is_taken_is_passed_over_and_told() {
        let scratch = Scratch::new("over");
        let plain = scratch.instance().unwrap();
        assert_eq!((plain.base(), plain.warnings()), (scratch.0.join("g").as_path(), vec![]));

        fs::write(scratch.0.join("g"), "").unwrap();
        std::os::unix::fs::symlink("/", scratch.0.join("g-2")).unwrap();
        let beside = scratch.instance().unwrap();
        assert_eq!(beside.base(), scratch.0.join("g-3"));
        let (at, uid) = (scratch.0.display(), user());
        let expected = format!(
            "\"{at}/g\" is no directory, made by user {uid}, \"{at}/g-2\" is a symbolic link, made \
             by user {uid}: the run directory is \"{at}/g-3\" instead"
        );
        assert_eq!(beside.warnings(), [expected]);
    }

    #[test]
    fn a_running_instance_is_found_where_it_runs() {
        let scratch = Scratch::new("found");
        fs::write(scratch.0.join("g"), "").unwrap();
        let started = scratch.instance().unwrap();
        create_private(started.base()).unwrap();
        fs::write(started.lock_path(), "1\n").unwrap();
        fs::remove_file(scratch.0.join("g")).unwrap();
        assert_eq!(scratch.instance().unwrap().root(), started.root());
        fs::remove_file(started.lock_path()).unwrap();
        assert_eq!(scratch.instance().unwrap().base(), scratch.0.join("g"));
    }

    #[test]
    fn who_takes_every_name_is_told_of() {
        let scratch = Scratch::new("all");
        fs::write(scratch.0.join("g"), "").unwrap();
        (2..=BASES)
            .for_each(|number| fs::write(scratch.0.join(format!("g-{number}")), "").unwrap());
        let error = scratch.instance().unwrap_err().to_string();
        assert!(error.starts_with("no run directory is left: "), "{error}");
        for number in 2..=BASES {
            assert!(error.contains(&format!("/g-{number}\" is no directory")), "{error}");
        }
    }
}
