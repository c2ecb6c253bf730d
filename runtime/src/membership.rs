//! Being in a domain: the lock that says so, the file that names the member, and the clean-up by
//! the last one out.
//!
//! The last one out or the next start wipes by what all domains of the instance have in common;
//! the part of the names that is drawn anew for each domain stands in the file that says that the
//! domain is ready.
//!
//! Every process in a domain holds the lock file shared, each through its own open file
//! description. To own the domain alone, to wipe it, is to hold the lock exclusively; that can
//! only succeed when nobody is alive. A leaving member first lets go and then tries to be alone:
//! of two that leave at once, the later one succeeds, so what is left is always removed.
//!
//! Between spawn and join a child of the holder has no lock of its own; [`inherit_lock`] gives it
//! one, which [`drop_inherited`] closes once the child has joined.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, Write};
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd, RawFd};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::descriptors;
use crate::domain::{DomainError, Role};
use crate::instance::{Instance, Nonce, Place, create_private, inspect};
use crate::lock::{Hold, is_locked, try_lock};
use crate::room::{self, Room, need};

/// How long a lock in somebody else's hands is tried again: a process that leaves, or a child
/// between fork and exec, has it for an instant.
const PATIENCE: Duration = Duration::from_millis(300);

/// Pause between two tries.
const RETRY: Duration = Duration::from_millis(5);

/// A place in a domain; dropping it leaves.
#[derive(Debug)]
pub(crate) struct Membership {
    instance: Instance,
    nonce: Nonce,
    room: Room,
    lock: File,
    /// Locked as long as this process has its role; `None` for observers.
    role: Option<File>,
}

impl Membership {
    /// Takes the domain for this process alone and wipes what the dead left.
    pub(crate) fn found(instance: &Instance) -> Result<Self, DomainError> {
        let started = Instant::now();
        let lock_path = instance.lock_path();
        loop {
            match open_lock(instance, Hold::Exclusive)
                .map_err(|error| with_room(instance, error))?
            {
                Some(lock) => {
                    let drawn = Nonce::draw();
                    let nonce = drawn.map_err(|source| DomainError::io(&lock_path, source))?;
                    // From here on a failure leaves the domain, and with that nothing behind.
                    let mut membership = Self::new(instance, nonce, lock);
                    membership.set_up().map_err(|error| with_room(instance, error))?;
                    return Ok(membership);
                }
                None if started.elapsed() < PATIENCE => std::thread::sleep(RETRY),
                None => return Err(in_use(instance)),
            }
        }
    }

    fn new(instance: &Instance, nonce: Nonce, lock: File) -> Self {
        let room = Room::new(instance.domain_prefix(&nonce), instance.root());
        Self { instance: instance.clone(), nonce, room, lock, role: None }
    }

    /// Wipes what the dead left, and says who is here.
    fn set_up(&mut self) -> Result<(), DomainError> {
        wipe(&self.instance)?;
        let path = self.instance.lock_path();
        write_pid(&mut self.lock).map_err(|source| DomainError::io(&path, source))?;
        for directory in [self.instance.root(), members(&self.instance)] {
            create_private(&directory).map_err(|source| DomainError::io(&directory, source))?;
        }
        self.role = take_role(&self.instance, Role::Domain)?;
        Ok(())
    }

    /// Closes to others what of the domain's memory they could open; before anybody is in.
    pub(crate) fn close_to_others(&self) -> Result<(), DomainError> {
        Ok(room::close_to_others(&self.prefix())?)
    }

    /// Lets others in; the domain must be complete.
    pub(crate) fn open(&self) -> Result<(), DomainError> {
        let ready = ready(&self.instance);
        let told = private_file()
            .create_new(true)
            .open(&ready)
            .and_then(|mut file| file.write_all(self.nonce.text().as_bytes()));
        told.map_err(|source| DomainError::io(&ready, source))?;
        let path = self.instance.lock_path();
        match try_lock(&self.lock, Hold::Shared) {
            Ok(true) => Ok(()),
            Ok(false) => Err(in_use(&self.instance)),
            Err(source) => Err(DomainError::io(&path, source)),
        }
    }

    /// Joins an open domain, waiting for it at most `patience`.
    pub(crate) fn join(
        instance: &Instance,
        role: Role,
        patience: Duration,
    ) -> Result<Self, DomainError> {
        let started = Instant::now();
        loop {
            let reason = match Self::try_join(instance, role) {
                Err(reason @ (DomainError::Absent { .. } | DomainError::RoleTaken { .. })) => {
                    reason
                }
                other => return other,
            };
            if started.elapsed() >= patience {
                return Err(reason);
            }
            std::thread::sleep(RETRY);
        }
    }

    fn try_join(instance: &Instance, role: Role) -> Result<Self, DomainError> {
        let absent = || DomainError::Absent { instance: instance.name().into() };
        if !instance.lock_path().exists() {
            return Err(absent());
        }
        let Some(lock) = open_existing_lock(instance)? else { return Err(absent()) };
        // From here on nobody can wipe the domain.
        let told = fs::read_to_string(ready(instance)).ok();
        let Some(nonce) = told.as_deref().and_then(Nonce::told) else {
            leave(instance, &lock);
            return Err(absent());
        };
        // Dropping this leaves the domain properly.
        let mut membership = Self::new(instance, nonce, lock);
        if member_pid(instance, Role::Domain).is_none() {
            return Err(absent());
        }
        membership.role = take_role(instance, role)?;
        drop_inherited(&membership.lock);
        Ok(membership)
    }

    /// The instance whose domain this is.
    pub(crate) fn instance(&self) -> &Instance {
        &self.instance
    }

    /// What the names of the domain's shared memory begin with.
    pub(crate) fn prefix(&self) -> String {
        self.instance.domain_prefix(&self.nonce)
    }

    /// The domain's room in shared memory.
    pub(crate) fn room(&self) -> &Room {
        &self.room
    }
}

impl Drop for Membership {
    fn drop(&mut self) {
        self.role = None;
        leave(&self.instance, &self.lock);
    }
}

/// Lets the lock go; the last one out removes what is left.
fn leave(instance: &Instance, lock: &File) {
    // Explicitly, not by closing: a child between fork and exec may share the description.
    let released = try_lock(lock, Hold::Released);
    if released.is_ok() && is_last(instance, lock) {
        if is_current(lock, instance) {
            // Whatever cannot be removed now is removed by the next start.
            let _ = wipe(instance);
            let _ = fs::remove_file(instance.lock_path());
            let _ = fs::remove_dir(instance.base());
        }
        let _ = try_lock(lock, Hold::Released);
    }
}

/// Whether nobody else is in the domain; the lock is exclusive then. Where no member is to be seen,
/// it may be a child between fork and exec that holds the lock for an instant.
fn is_last(instance: &Instance, lock: &File) -> bool {
    let started = Instant::now();
    loop {
        match try_lock(lock, Hold::Exclusive) {
            Ok(true) => return true,
            Err(_) => return false,
            Ok(false) => {}
        }
        let member = Role::NAMED.iter().any(|role| member_pid(instance, *role).is_some());
        if member || started.elapsed() >= PATIENCE {
            return false;
        }
        std::thread::sleep(RETRY);
    }
}

/// The pid of the living member with this role.
pub(crate) fn member_pid(instance: &Instance, role: Role) -> Option<i32> {
    let mut file =
        OpenOptions::new().read(true).write(true).open(role_path(instance, role)?).ok()?;
    if !is_locked(&file).ok()? {
        return None;
    }
    let mut text = String::new();
    file.read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}

/// Gives `command`'s process a hold on the domain from its first instruction on, and nothing else.
pub(crate) fn inherit_lock(instance: &Instance, command: &mut Command) -> Result<(), DomainError> {
    let lock = open_existing_lock(instance)?
        .ok_or_else(|| DomainError::Absent { instance: instance.name().into() })?;
    let inherit = move || {
        descriptors::close_on_exec();
        // SAFETY: fcntl is async-signal-safe, and `lock` is open as long as this closure lives.
        #[allow(unsafe_code)]
        match unsafe { libc::fcntl(lock.as_raw_fd(), libc::F_SETFD, 0) } {
            0 => Ok(()),
            _ => Err(io::Error::last_os_error()),
        }
    };
    // SAFETY: the closure makes two async-signal-safe system calls and touches no shared state.
    #[allow(unsafe_code)]
    unsafe {
        command.pre_exec(inherit)
    };
    Ok(())
}

/// Closes the hold that [`inherit_lock`] gave this process: descriptors of the lock file that survive
/// an exec; our own never do.
fn drop_inherited(lock: &File) {
    let (Ok(own), Ok(entries)) = (lock.metadata(), fs::read_dir("/proc/self/fd")) else { return };
    let descriptors: Vec<RawFd> =
        entries.flatten().filter_map(|entry| entry.file_name().to_str()?.parse().ok()).collect();
    for descriptor in descriptors {
        let same = fs::metadata(format!("/proc/self/fd/{descriptor}"))
            .is_ok_and(|other| (other.dev(), other.ino()) == (own.dev(), own.ino()));
        // SAFETY: F_GETFD only reads the flags of a descriptor number; a closed one gives −1.
        #[allow(unsafe_code)]
        let flags = unsafe { libc::fcntl(descriptor, libc::F_GETFD) };
        if same && flags >= 0 && flags & libc::FD_CLOEXEC == 0 {
            // SAFETY: the descriptor came through exec, so no value in this process owns it; every
            // lock file that this process opens itself is close-on-exec.
            #[allow(unsafe_code)]
            drop(unsafe { OwnedFd::from_raw_fd(descriptor) });
        }
    }
}

/// Who is in the domain; the holder first.
fn in_use(instance: &Instance) -> DomainError {
    let living = |role: &Role| member_pid(instance, *role).map(|pid| (pid, *role));
    let (pid, role) = match Role::NAMED.iter().find_map(living) {
        Some((pid, role)) => (Some(pid), role),
        // Still being created: the lock file has the creator's pid before any member is named.
        None => {
            let text = fs::read_to_string(instance.lock_path()).unwrap_or_default();
            (text.trim().parse().ok(), Role::Domain)
        }
    };
    DomainError::InUse { instance: instance.name().into(), pid: pid.unwrap_or(0), role }
}

/// Takes the file of `role` for this process; observers have none.
fn take_role(instance: &Instance, role: Role) -> Result<Option<File>, DomainError> {
    let Some(path) = role_path(instance, role) else { return Ok(None) };
    let failed = |source| DomainError::io(&path, source);
    let mut file = private_file().create(true).open(&path).map_err(failed)?;
    if !try_lock(&file, Hold::Exclusive).map_err(failed)? {
        let pid = member_pid(instance, role).unwrap_or(0);
        return Err(DomainError::RoleTaken { instance: instance.name().into(), role, pid });
    }
    write_pid(&mut file).map_err(failed)?;
    Ok(Some(file))
}

fn write_pid(file: &mut File) -> io::Result<()> {
    file.set_len(0)?;
    file.rewind()?;
    writeln!(file, "{}", std::process::id())
}

/// The lock file, created if need be, locked; `None` when others are in the way.
fn open_lock(instance: &Instance, hold: Hold) -> Result<Option<File>, DomainError> {
    let path = instance.lock_path();
    for _ in 0..100 {
        let base = instance.base();
        create_private(base).map_err(|source| DomainError::io(base, source))?;
        if let Place::Taken(what) = inspect(base).map_err(|source| DomainError::io(base, source))? {
            return Err(DomainError::Foreign { directory: base.into(), what });
        }
        match private_file().create(true).open(&path) {
            Ok(file) => match lock_current(instance, file, hold)? {
                Locked::Yes(file) => return Ok(Some(file)),
                Locked::Busy => return Ok(None),
                Locked::Outdated => {}
            },
            // The last one out of another instance removed the directory just now.
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(source) => return Err(DomainError::io(&path, source)),
        }
    }
    Ok(None)
}

/// The lock file if there is one, locked shared; `None` when it is gone or others are in the way.
fn open_existing_lock(instance: &Instance) -> Result<Option<File>, DomainError> {
    let path = instance.lock_path();
    match private_file().open(&path) {
        Ok(file) => Ok(match lock_current(instance, file, Hold::Shared)? {
            Locked::Yes(file) => Some(file),
            Locked::Busy | Locked::Outdated => None,
        }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(DomainError::io(&path, source)),
    }
}

enum Locked {
    Yes(File),
    Busy,
    /// The file was removed while it was being locked.
    Outdated,
}

fn lock_current(instance: &Instance, file: File, hold: Hold) -> Result<Locked, DomainError> {
    match try_lock(&file, hold) {
        Ok(true) if is_current(&file, instance) => Ok(Locked::Yes(file)),
        Ok(true) => Ok(Locked::Outdated),
        Ok(false) => Ok(Locked::Busy),
        Err(source) => Err(DomainError::io(&instance.lock_path(), source)),
    }
}

/// Whether `lock` is still the file that the next one will find at the path.
fn is_current(lock: &File, instance: &Instance) -> bool {
    match (lock.metadata(), fs::metadata(instance.lock_path())) {
        (Ok(held), Ok(found)) => (held.dev(), held.ino()) == (found.dev(), found.ino()),
        _ => false,
    }
}

/// Removes the root directory and all shared memory of the instance; only for who is alone.
fn wipe(instance: &Instance) -> Result<(), DomainError> {
    let root = instance.root();
    match fs::remove_dir_all(&root) {
        Err(source) if source.kind() != io::ErrorKind::NotFound => {
            return Err(DomainError::io(&root, source));
        }
        _ => {}
    }
    Ok(room::wipe(&instance.prefix())?)
}

/// What a domain that finds no room for its first small files needs in all.
fn with_room(instance: &Instance, error: DomainError) -> DomainError {
    match error {
        DomainError::Io { source, .. } if room::is_full(&source) => {
            room::failed(instance.base(), &source, need::pipeline()).into()
        }
        other => other,
    }
}

fn private_file() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.read(true).write(true).mode(0o600).custom_flags(libc::O_NOFOLLOW);
    options
}

fn members(instance: &Instance) -> PathBuf {
    instance.root().join("members")
}

fn ready(instance: &Instance) -> PathBuf {
    instance.root().join("ready")
}

fn role_path(instance: &Instance, role: Role) -> Option<PathBuf> {
    (role != Role::Observer).then(|| members(instance).join(role.name()))
}
