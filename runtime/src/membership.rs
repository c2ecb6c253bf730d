//! Being in a domain: the lock that says so, the file that names the member, and the clean-up by
//! the last one out.
//!
//! Every process in a domain holds the lock file shared, each through its own open file
//! description. To own the domain alone, to wipe it, is to hold the lock exclusively; that can
//! only succeed when nobody is alive. A leaving member first lets go and then tries to be alone:
//! of two that leave at once, the later one succeeds, so what is left is always removed.
//!
//! Between spawn and join a child of the holder has no lock of its own; [`bequeath`] gives it
//! one, which [`drop_inherited`] closes once the child has joined.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, Write};
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd, RawFd};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use crate::domain::{DomainError, Role};
use crate::instance::{Instance, SHARED_MEMORY, user};
use crate::lock::{Hold, is_locked, try_lock};

/// How long a lock in somebody else's hands is tried again: a process that leaves, or a child
/// between fork and exec, has it for an instant.
const PATIENCE: Duration = Duration::from_millis(300);

/// Pause between two tries.
const RETRY: Duration = Duration::from_millis(5);

/// A place in a domain; dropping it leaves.
#[derive(Debug)]
pub(crate) struct Membership {
    instance: Instance,
    lock: File,
    /// Locked as long as this process has its role; `None` for observers.
    role: Option<File>,
}

impl Membership {
    /// Takes the domain for this process alone and wipes what the dead left.
    pub(crate) fn found(instance: &Instance) -> Result<Self, DomainError> {
        let started = Instant::now();
        loop {
            match open_lock(instance, Hold::Exclusive)? {
                Some(mut lock) => {
                    wipe(instance)?;
                    let path = instance.lock_path();
                    write_pid(&mut lock).map_err(|source| DomainError::io(&path, source))?;
                    let members = members(instance);
                    create_private(&members).map_err(|source| DomainError::io(&members, source))?;
                    let role = take_role(instance, Role::Domain)?;
                    return Ok(Self { instance: instance.clone(), lock, role });
                }
                None if started.elapsed() < PATIENCE => std::thread::sleep(RETRY),
                None => return Err(in_use(instance)),
            }
        }
    }

    /// Lets others in; the domain must be complete.
    pub(crate) fn open(&self) -> Result<(), DomainError> {
        let ready = ready(&self.instance);
        File::create(&ready).map_err(|source| DomainError::io(&ready, source))?;
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
        // From here on nobody can wipe the domain; dropping this leaves it properly.
        let mut membership = Self { instance: instance.clone(), lock, role: None };
        if !ready(instance).exists() || member_pid(instance, Role::Domain).is_none() {
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
}

impl Drop for Membership {
    fn drop(&mut self) {
        self.role = None;
        // Explicitly, not by closing: a child between fork and exec may share the description.
        let released = try_lock(&self.lock, Hold::Released);
        if released.is_ok() && matches!(try_lock(&self.lock, Hold::Exclusive), Ok(true)) {
            if is_current(&self.lock, &self.instance) {
                // Whatever cannot be removed now is removed by the next start.
                let _ = wipe(&self.instance);
                let _ = fs::remove_file(self.instance.lock_path());
                let _ = fs::remove_dir(self.instance.base());
            }
            let _ = try_lock(&self.lock, Hold::Released);
        }
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

/// Gives `command`'s process a hold on the domain from its first instruction on, and nothing else:
/// the descriptors that iceoryx2 0.10 opens would survive the exec, and with them the sockets and
/// the memory of a dead holder.
pub(crate) fn bequeath(instance: &Instance, command: &mut Command) -> Result<(), DomainError> {
    let lock = open_existing_lock(instance)?
        .ok_or_else(|| DomainError::Absent { instance: instance.name().into() })?;
    let inherit = move || {
        // SAFETY: a system call on numbers; it only marks descriptors to be closed by the exec. A
        // kernel before 5.11 refuses, and then they leak as they would without.
        #[allow(unsafe_code)]
        unsafe {
            libc::syscall(
                libc::SYS_close_range,
                libc::STDERR_FILENO + 1,
                libc::c_uint::MAX,
                libc::CLOSE_RANGE_CLOEXEC,
            )
        };
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

/// Closes the hold that [`bequeath`] gave this process: descriptors of the lock file that survive
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
        let owner = fs::metadata(base).map(|metadata| metadata.uid());
        if owner.as_ref().is_ok_and(|owner| *owner != user()) {
            return Err(DomainError::Foreign { directory: base.into() });
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
    let prefix = instance.prefix();
    let directory = Path::new(SHARED_MEMORY);
    let entries = fs::read_dir(directory).map_err(|source| DomainError::io(directory, source))?;
    for entry in entries.flatten() {
        if entry.file_name().to_string_lossy().starts_with(&prefix) {
            match fs::remove_file(entry.path()) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => {
                    return Err(DomainError::io(&entry.path(), source));
                }
                _ => {}
            }
        }
    }
    Ok(())
}

fn private_file() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.read(true).write(true).mode(0o600);
    options
}

fn create_private(directory: &Path) -> io::Result<()> {
    fs::DirBuilder::new().recursive(true).mode(0o700).create(directory)
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
