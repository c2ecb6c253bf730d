//! What the operating system allows this process, tried without a trace.

use std::ffi::CString;
use std::io;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

use crate::room;
use crate::thread::set_fifo;

/// Whether a thread of this process gets SCHED_FIFO with this priority: tried on one that ends at once.
///
/// # Errors
/// What the operating system says against it.
pub fn try_priority(priority: i32) -> io::Result<()> {
    let thread = std::thread::Builder::new().spawn(move || set_fifo(priority))?;
    thread.join().unwrap_or_else(|_| Err(io::Error::other("the thread panicked")))
}

/// Whether a process can lock itself and `bytes` more in memory: tried in a child that ends at once, so that this one
/// stays as it is.
///
/// # Errors
/// What the operating system says against it.
pub fn try_locking_memory(bytes: u64) -> io::Result<()> {
    let length = usize::try_from(bytes).map_err(io::Error::other)?;
    // SAFETY: the child calls nothing but system calls that are safe after a fork of a process with threads, and
    // leaves by _exit.
    #[allow(unsafe_code)]
    let child = unsafe { libc::fork() };
    match child {
        -1 => Err(io::Error::last_os_error()),
        0 => {
            let number = lock(length);
            // SAFETY: _exit has no preconditions.
            #[allow(unsafe_code)]
            unsafe {
                libc::_exit(number)
            }
        }
        child => match exit_status(child)? {
            0 => Ok(()),
            number => Err(io::Error::from_raw_os_error(number)),
        },
    }
}

/// Takes and locks memory; the number of the error, 0 without.
fn lock(length: usize) -> i32 {
    let error = || io::Error::last_os_error().raw_os_error().unwrap_or(libc::EIO);
    // SAFETY: an anonymous mapping at a place that the kernel chooses.
    #[allow(unsafe_code)]
    let memory = unsafe {
        libc::mmap(
            std::ptr::null_mut(),
            length,
            libc::PROT_READ | libc::PROT_WRITE,
            libc::MAP_PRIVATE | libc::MAP_ANONYMOUS,
            -1,
            0,
        )
    };
    if memory == libc::MAP_FAILED {
        return error();
    }
    // SAFETY: mlockall takes only flags.
    #[allow(unsafe_code)]
    match unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) } {
        0 => 0,
        _ => error(),
    }
}

/// Waits for a child and tells its exit code.
fn exit_status(child: libc::pid_t) -> io::Result<i32> {
    let mut status = 0;
    loop {
        // SAFETY: `status` is a valid number for the kernel to fill, and the child is ours.
        #[allow(unsafe_code)]
        let result = unsafe { libc::waitpid(child, &mut status, 0) };
        if result == child {
            break;
        }
        let error = io::Error::last_os_error();
        if error.kind() != io::ErrorKind::Interrupted {
            return Err(error);
        }
    }
    if libc::WIFEXITED(status) {
        Ok(libc::WEXITSTATUS(status))
    } else {
        // By a signal: the kernel had no memory for it.
        Ok(libc::ENOMEM)
    }
}

/// Whether this user may write the file, as it is now; nothing is opened.
pub fn may_write(path: &Path) -> bool {
    let Ok(path) = CString::new(path.as_os_str().as_bytes()) else { return false };
    // SAFETY: a path that ends in zero.
    #[allow(unsafe_code)]
    let result =
        unsafe { libc::faccessat(libc::AT_FDCWD, path.as_ptr(), libc::W_OK, libc::AT_EACCESS) };
    result == 0
}

/// What is free in the file system of a directory for this user, in bytes.
pub fn free(directory: &Path) -> Option<u64> {
    room::free(directory)
}

/// What a pipeline needs of shared memory, in bytes.
pub fn pipeline_room() -> u64 {
    room::need::pipeline()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn a_priority_is_given_or_refused_and_this_thread_keeps_its_own() {
        // SAFETY: pid 0 is the calling thread.
        #[allow(unsafe_code)]
        let policy = || unsafe { libc::sched_getscheduler(0) };
        let before = policy();
        if let Err(error) = try_priority(85) {
            assert_eq!(error.raw_os_error(), Some(libc::EPERM));
        }
        assert_eq!(policy(), before);
        assert_eq!(try_priority(1000).unwrap_err().raw_os_error(), Some(libc::EINVAL));
    }

    #[test]
    fn memory_is_locked_in_another_process() {
        let locked = || {
            let status = std::fs::read_to_string("/proc/self/status").unwrap();
            status.lines().find(|line| line.starts_with("VmLck")).unwrap().to_owned()
        };
        let before = locked();
        if let Err(error) = try_locking_memory(1 << 20) {
            let number = error.raw_os_error().unwrap();
            assert!([libc::ENOMEM, libc::EPERM, libc::EAGAIN].contains(&number), "{error}");
        }
        assert_eq!(locked(), before);
        // More than an address space has.
        assert_eq!(try_locking_memory(1 << 60).unwrap_err().raw_os_error(), Some(libc::ENOMEM));
    }

    #[test]
    fn a_file_that_is_not_there_may_not_be_written() {
        let folder = tempfile::tempdir().unwrap();
        assert!(may_write(folder.path()));
        assert!(!may_write(&folder.path().join("none")));
        assert!(free(folder.path()).unwrap() > 0);
        assert!(pipeline_room() > 1 << 20);
    }
}
