//! Room in shared memory, taken before it is needed.
//!
//! What iceoryx2 0.10 creates has a size but no pages: they come as they are first touched, and
//! where /dev/shm is full by then, touching one is a SIGBUS in the middle of a cycle. Therefore
//!
//! - a domain takes what the whole pipeline needs when it is created, as one file, the
//!   reserve; where that does not fit, nothing is created;
//! - who opens a port lets go of as much of the reserve as the port needs, and has all pages of
//!   the port's segments before it uses them;
//! - the reserve keeps what no port has taken yet: it is for those who join later, such as a
//!   monitor that is started again, while somebody else fills the memory.
//!
//! Ports are opened one at a time in a domain, under a lock on the reserve. A port connects to
//! those that were there before while it is opened; so the memory of a connection is never made
//! later, by a send or a receive.

pub(crate) mod need;

use std::fs::{self, File, OpenOptions};
use std::io;
use std::os::fd::AsRawFd;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::instance::{SHARED_MEMORY, user};
use crate::lock::{Hold, try_lock};

/// How long others may open a port before this one gives up.
const PATIENCE: Duration = Duration::from_secs(10);

/// Pause between two tries to lock the reserve.
const RETRY: Duration = Duration::from_millis(1);

/// What a block of stat(2) is, in bytes.
const BLOCK: u64 = 512;

/// Why there is no room for something in shared memory.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RoomError {
    /// It does not fit.
    #[error(
        "no room in {directory:?}: {} KiB are needed, {} KiB are free ({reason}); make room there, \
         or give it a larger size", .needed.div_ceil(1024), .free / 1024
    )]
    Full {
        /// The directory of shared memory.
        directory: PathBuf,
        /// What is needed, in bytes.
        needed: u64,
        /// What is free, in bytes.
        free: u64,
        /// What the operating system said.
        reason: String,
    },
    /// Another process does not finish opening a port.
    #[error(
        "{path:?} is locked: another process of the instance has been opening a channel for {} s; \
         is one of them stopped?", .waited.as_secs()
    )]
    Busy {
        /// The reserve.
        path: PathBuf,
        /// How long was waited.
        waited: Duration,
    },
    /// The operating system refused something else.
    #[error("{path:?}: {reason}")]
    Io {
        /// The file or directory.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

/// The room of one domain.
#[derive(Debug)]
pub(crate) struct Room {
    /// What the names of its shared memory begin with.
    prefix: String,
    /// Where iceoryx2 keeps the small files of the domain.
    root: PathBuf,
    /// What the domain has in all, in bytes.
    total: u64,
}

impl Room {
    /// The room of the domain whose names begin with `prefix`, with small files below `root`.
    pub(crate) fn new(prefix: String, root: PathBuf) -> Self {
        Self { prefix, root, total: need::pipeline() }
    }

    /// Takes the whole need of a new domain.
    pub(crate) fn found(&self) -> Result<(), RoomError> {
        let path = self.reserve_path();
        let failed = |error| failed(&path, &error, self.total);
        let reserve = private().create_new(true).open(&path).map_err(failed)?;
        extend(&reserve, self.total).map_err(failed)
    }

    /// Opens something that takes `bytes` of the room, alone in the domain, with every page there
    /// at the end. Not in a cycle: it waits for others who do the same.
    pub(crate) fn open<T, E: From<RoomError>>(
        &self,
        bytes: u64,
        open: impl FnOnce() -> Result<T, E>,
    ) -> Result<T, E> {
        let reserve = self.lock()?;
        let path = self.reserve_path();
        let failed = |error| failed(&path, &error, bytes);
        let length = reserve.metadata().map_err(failed)?.len();
        reserve.set_len(length.saturating_sub(bytes)).map_err(failed)?;
        let opened = open();
        let allocated = self.allocate_locked(&reserve);
        let opened = opened?;
        allocated?;
        Ok(opened)
    }

    /// Gives every segment of the domain all its pages, and the reserve what is left.
    pub(crate) fn allocate(&self) -> Result<(), RoomError> {
        let reserve = self.lock()?;
        self.allocate_locked(&reserve)
    }

    fn allocate_locked(&self, reserve: &File) -> Result<(), RoomError> {
        let page = page();
        let mut used = self.small_files();
        let segments = self.segments().map_err(|error| io_error(SHARED_MEMORY.as_ref(), &error))?;
        for segment in segments {
            let size = segment.size.next_multiple_of(page);
            if segment.allocated < size {
                segment.allocate().map_err(|error| {
                    failed(SHARED_MEMORY.as_ref(), &error, size - segment.allocated)
                })?;
            }
            used += size;
        }
        let path = self.reserve_path();
        let rest = self.total.saturating_sub(used);
        let length = reserve.metadata().map_err(|error| io_error(&path, &error))?.len();
        if rest < length {
            reserve.set_len(rest).map_err(|error| io_error(&path, &error))
        } else {
            // Somebody else has taken it: what is open is whole, only a late joiner may not fit.
            let _ = extend(reserve, rest);
            Ok(())
        }
    }

    /// The reserve, locked. One that somebody removed is made again, empty.
    fn lock(&self) -> Result<File, RoomError> {
        let path = self.reserve_path();
        let failed = |error: io::Error| io_error(&path, &error);
        let reserve = private().create(true).open(&path).map_err(failed)?;
        let started = Instant::now();
        while !try_lock(&reserve, Hold::Exclusive).map_err(failed)? {
            if started.elapsed() >= PATIENCE {
                return Err(RoomError::Busy { path, waited: PATIENCE });
            }
            std::thread::sleep(RETRY);
        }
        Ok(reserve)
    }

    fn reserve_path(&self) -> PathBuf {
        Path::new(SHARED_MEMORY).join(format!("{}reserve", self.prefix))
    }

    /// The domain's shared memory, without the reserve.
    fn segments(&self) -> io::Result<Vec<Segment>> {
        let reserve = self.reserve_path();
        let ours = own_files(&self.prefix)?.into_iter();
        Ok(ours.filter(|segment| segment.path != reserve).collect())
    }

    /// What is in use of the room, in bytes.
    #[cfg(test)]
    pub(crate) fn used(&self) -> io::Result<u64> {
        let taken = |segment: &Segment| segment.allocated.max(segment.size);
        Ok(self.segments()?.iter().map(taken).sum::<u64>() + self.small_files())
    }

    /// What iceoryx2's small files take of the same memory, in bytes; 0 where they lie elsewhere.
    fn small_files(&self) -> u64 {
        let device = |path: &Path| fs::metadata(path).map(|found| found.dev()).ok();
        if device(&self.root) != device(SHARED_MEMORY.as_ref()) {
            return 0;
        }
        ["nodes", "services"].iter().map(|name| allocated_below(&self.root.join(name))).sum()
    }
}

/// Removes the shared memory of this user whose names begin with `prefix`; another user's is none
/// of ours, whatever its name.
pub(crate) fn wipe(prefix: &str) -> Result<(), RoomError> {
    let directory = Path::new(SHARED_MEMORY);
    for segment in own_files(prefix).map_err(|error| io_error(directory, &error))? {
        match fs::remove_file(&segment.path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                return Err(io_error(&segment.path, &error));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Closes to others what iceoryx2 0.10 opens to everybody, the segment that counts nodes: for the
/// holder, before anybody else is in the domain. It is replaced by a copy, because another
/// process may have opened the old one already.
pub(crate) fn close_to_others(prefix: &str) -> Result<(), RoomError> {
    let directory = Path::new(SHARED_MEMORY);
    for segment in own_files(prefix).map_err(|error| io_error(directory, &error))? {
        if segment.mode & 0o077 == 0 {
            continue;
        }
        let copy = directory.join(format!("{prefix}copy"));
        let failed = |error: io::Error| failed(&copy, &error, segment.size);
        let content = fs::read(&segment.path).map_err(failed)?;
        let mut file = private().create_new(true).open(&copy).map_err(failed)?;
        io::Write::write_all(&mut file, &content).map_err(failed)?;
        fs::rename(&copy, &segment.path).map_err(failed)?;
    }
    Ok(())
}

/// What is free in a directory for this user, in bytes; `None` if it cannot be told.
pub(crate) fn free(directory: &Path) -> Option<u64> {
    let path = std::ffi::CString::new(directory.as_os_str().as_bytes()).ok()?;
    // SAFETY: all zeros is a valid statvfs, which the kernel overwrites.
    #[allow(unsafe_code)]
    let mut found: libc::statvfs = unsafe { std::mem::zeroed() };
    // SAFETY: a path that ends in zero, and a valid statvfs for the kernel to fill.
    #[allow(unsafe_code)]
    let result = unsafe { libc::statvfs(path.as_ptr(), &mut found) };
    (result == 0).then(|| found.f_bavail * found.f_frsize)
}

/// What may be behind an unexplained failure, in words that follow it: a directory that is full.
pub(crate) fn hint(directories: &[&Path]) -> String {
    let full = |directory: &&Path| {
        let free = free(directory)?;
        (free < need::NODE).then(|| format!(" ({directory:?} has {free} bytes free)"))
    };
    directories.iter().find_map(full).unwrap_or_default()
}

/// Whether an error means that there is no room: of the memory, of a quota, or of this process's
/// limit on files.
pub(crate) fn is_full(error: &io::Error) -> bool {
    matches!(error.raw_os_error(), Some(libc::ENOSPC | libc::EDQUOT | libc::EFBIG | libc::ENOMEM))
}

/// The error of something that needs `needed` bytes in the directory of `path`.
pub(crate) fn failed(path: &Path, error: &io::Error, needed: u64) -> RoomError {
    if !is_full(error) {
        return io_error(path, error);
    }
    let directory = if path.is_dir() { path } else { path.parent().unwrap_or(path) };
    RoomError::Full {
        directory: directory.into(),
        needed,
        free: free(directory).unwrap_or(0),
        reason: error.to_string(),
    }
}

fn io_error(path: &Path, error: &io::Error) -> RoomError {
    RoomError::Io { path: path.into(), reason: error.to_string() }
}

/// The size of a page of memory, in bytes.
pub(crate) fn page() -> u64 {
    // SAFETY: sysconf takes a constant and has no other preconditions.
    #[allow(unsafe_code)]
    let page = unsafe { libc::sysconf(libc::_SC_PAGESIZE) };
    page.max(4096) as u64
}

/// A file in shared memory.
struct Segment {
    path: PathBuf,
    size: u64,
    allocated: u64,
    mode: u32,
}

impl Segment {
    /// Takes every page that it has not touched yet, and changes nothing else.
    fn allocate(&self) -> io::Result<()> {
        // One that is being created can only be written, and may be gone by now.
        let file =
            match OpenOptions::new().write(true).custom_flags(libc::O_NOFOLLOW).open(&self.path) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
                other => other?,
            };
        take_pages(&file, libc::FALLOC_FL_KEEP_SIZE, self.size)
    }
}

/// The files of this user in shared memory whose names begin with `prefix`.
fn own_files(prefix: &str) -> io::Result<Vec<Segment>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(SHARED_MEMORY)?.flatten() {
        if !entry.file_name().as_bytes().starts_with(prefix.as_bytes()) {
            continue;
        }
        // Of the entry itself, not of what a link points to; it may be gone by now.
        let Ok(metadata) = entry.metadata() else { continue };
        if metadata.uid() == user() && metadata.is_file() {
            found.push(Segment {
                path: entry.path(),
                size: metadata.len(),
                allocated: metadata.blocks() * BLOCK,
                mode: metadata.mode(),
            });
        }
    }
    Ok(found)
}

/// What the files below a directory take, in bytes.
fn allocated_below(directory: &Path) -> u64 {
    let Ok(entries) = fs::read_dir(directory) else { return 0 };
    let of = |entry: fs::DirEntry| match entry.metadata() {
        Ok(metadata) if metadata.is_dir() => allocated_below(&entry.path()),
        Ok(metadata) => metadata.blocks() * BLOCK,
        Err(_) => 0,
    };
    entries.flatten().map(of).sum()
}

/// How a file of this user alone is opened where others may have put a link.
fn private() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.read(true).write(true).mode(0o600).custom_flags(libc::O_NOFOLLOW);
    options
}

/// Makes a file at least `size` bytes long, with every page there.
fn extend(file: &File, size: u64) -> io::Result<()> {
    if size == 0 { Ok(()) } else { take_pages(file, 0, size) }
}

fn take_pages(file: &File, mode: libc::c_int, size: u64) -> io::Result<()> {
    let size = libc::off_t::try_from(size).unwrap_or(libc::off_t::MAX);
    loop {
        // SAFETY: a system call on an open descriptor and numbers.
        #[allow(unsafe_code)]
        if unsafe { libc::fallocate(file.as_raw_fd(), mode, 0, size) } == 0 {
            return Ok(());
        }
        let error = io::Error::last_os_error();
        match error.raw_os_error() {
            Some(libc::EINTR) => {}
            // Not a tmpfs, as in some sandboxes: nothing can be taken ahead there.
            Some(libc::EOPNOTSUPP) => return Ok(()),
            _ => return Err(error),
        }
    }
}
