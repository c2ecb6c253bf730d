//! Waiting until a descriptor can be read, until an instant on the monotonic clock.

use std::io;
use std::os::fd::{AsRawFd, BorrowedFd};

use messages::Nanoseconds;

use crate::clock;

/// Waits until `descriptor` can be read or until `deadline` on the monotonic clock; `false` at the deadline,
/// or when a signal came. A deadline in the past only checks. Does not allocate.
///
/// # Errors
/// What the operating system says.
pub fn wait_readable(descriptor: BorrowedFd<'_>, deadline: Nanoseconds) -> io::Result<bool> {
    let mut entry = libc::pollfd { fd: descriptor.as_raw_fd(), events: libc::POLLIN, revents: 0 };
    let left = clock::timespec(Nanoseconds((deadline - clock::now()).0.max(0)));
    // SAFETY: one valid pollfd, whose descriptor is borrowed for as long, a valid timespec, no signal mask.
    #[allow(unsafe_code)]
    let ready = unsafe { libc::ppoll(&mut entry, 1, &left, std::ptr::null()) };
    match ready {
        0 => Ok(false),
        1.. => Ok(true),
        _ => match io::Error::last_os_error() {
            error if error.kind() == io::ErrorKind::Interrupted => Ok(false),
            error => Err(error),
        },
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use std::net::UdpSocket;
    use std::os::fd::AsFd;

    #[test]
    fn it_tells_what_can_be_read_from_what_cannot() {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        assert!(!wait_readable(socket.as_fd(), Nanoseconds(0)).unwrap());
        let until = clock::now() + Nanoseconds(2_000_000);
        assert!(!wait_readable(socket.as_fd(), until).unwrap());
        assert!(clock::now() >= until, "it came back before its time");
        socket.send_to(b"x", socket.local_addr().unwrap()).unwrap();
        let until = clock::now() + Nanoseconds(10_000_000_000);
        assert!(wait_readable(socket.as_fd(), until).unwrap());
    }
}
