//! Descriptors that a child must not inherit.

/// In a child between fork and exec: marks all but the standard ones to be closed by the exec. iceoryx2 0.10 opens
/// descriptors that would survive it, and with them the sockets and the memory of a dead holder. A kernel before 5.11
/// refuses, and then they leak as they would without. Async-signal-safe.
pub(crate) fn close_on_exec() {
    // SAFETY: a system call on numbers; it only marks descriptors to be closed by the exec.
    #[allow(unsafe_code)]
    unsafe {
        libc::syscall(
            libc::SYS_close_range,
            libc::STDERR_FILENO + 1,
            libc::c_uint::MAX,
            libc::CLOSE_RANGE_CLOEXEC,
        )
    };
}
