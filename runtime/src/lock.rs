//! A file lock that belongs to an open file description, whole file, never waited for.
//!
//! `F_OFD_SETLK` instead of flock: changing exclusive to shared is atomic, so nobody can slip in
//! while a new domain opens its doors. The kernel drops the lock with the last descriptor of the
//! description, however its holder died.

use std::fs::File;
use std::io;
use std::os::fd::AsRawFd;

/// What is asked of the lock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Hold {
    /// Together with others.
    Shared,
    /// Alone.
    Exclusive,
    /// Not at all.
    Released,
}

/// Changes the lock that `file` has on itself; `false` when others are in the way, and then
/// nothing has changed.
pub(crate) fn try_lock(file: &File, hold: Hold) -> io::Result<bool> {
    let kind = match hold {
        Hold::Shared => libc::F_RDLCK,
        Hold::Exclusive => libc::F_WRLCK,
        Hold::Released => libc::F_UNLCK,
    };
    let range = whole_file(kind);
    // SAFETY: the descriptor is open for the whole call and `range` is a valid flock structure
    // that the kernel only reads.
    #[allow(unsafe_code)]
    let result = unsafe { libc::fcntl(file.as_raw_fd(), libc::F_OFD_SETLK, &range) };
    if result == 0 {
        return Ok(true);
    }
    let error = io::Error::last_os_error();
    match error.raw_os_error() {
        Some(libc::EAGAIN | libc::EACCES) => Ok(false),
        _ => Err(error),
    }
}

/// Whether somebody's lock would keep `file` from being locked exclusively now.
pub(crate) fn is_locked(file: &File) -> io::Result<bool> {
    let mut range = whole_file(libc::F_WRLCK);
    // SAFETY: the descriptor is open for the whole call and `range` is a valid flock structure
    // that the kernel overwrites with the lock it found.
    #[allow(unsafe_code)]
    let result = unsafe { libc::fcntl(file.as_raw_fd(), libc::F_OFD_GETLK, &mut range) };
    match result {
        0 => Ok(range.l_type != libc::F_UNLCK as libc::c_short),
        _ => Err(io::Error::last_os_error()),
    }
}

fn whole_file(kind: libc::c_int) -> libc::flock {
    libc::flock {
        l_type: kind as libc::c_short,
        l_whence: libc::SEEK_SET as libc::c_short,
        l_start: 0,
        l_len: 0,
        l_pid: 0,
    }
}
