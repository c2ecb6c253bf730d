//! Ethernet frames on a network interface, for a fieldbus: one EtherType, no protocol below it.

use std::ffi::CString;
use std::io::{Error, ErrorKind, Result};
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, FromRawFd, OwnedFd};

/// The EtherType of EtherCAT.
pub const ETHERCAT: u16 = 0x88a4;

/// A socket that sends and receives frames of one EtherType on one interface; never waits.
#[derive(Debug)]
pub struct RawFrames {
    socket: OwnedFd,
}

impl RawFrames {
    /// Frames of `kind` on `interface`.
    ///
    /// # Errors
    /// An interface that does not exist, or a process without CAP_NET_RAW.
    pub fn open(interface: &str, kind: u16) -> Result<Self> {
        let name = CString::new(interface).map_err(|_| Error::from(ErrorKind::InvalidInput))?;
        // SAFETY: `name` is a string with its end.
        #[allow(unsafe_code)]
        let index = unsafe { libc::if_nametoindex(name.as_ptr()) };
        if index == 0 {
            return Err(Error::last_os_error());
        }
        let flags = libc::SOCK_RAW | libc::SOCK_NONBLOCK | libc::SOCK_CLOEXEC;
        let protocol = kind.to_be();
        // SAFETY: no pointers; what is returned is ours if it is not negative.
        #[allow(unsafe_code)]
        let descriptor = unsafe { libc::socket(libc::AF_PACKET, flags, i32::from(protocol)) };
        if descriptor < 0 {
            return Err(Error::last_os_error());
        }
        // SAFETY: the descriptor is open, and nobody else has it.
        #[allow(unsafe_code)]
        let socket = unsafe { OwnedFd::from_raw_fd(descriptor) };
        let address = libc::sockaddr_ll {
            sll_family: libc::AF_PACKET as u16,
            sll_protocol: protocol,
            sll_ifindex: i32::try_from(index).map_err(|_| Error::from(ErrorKind::InvalidInput))?,
            sll_hatype: 0,
            sll_pkttype: 0,
            sll_halen: 0,
            sll_addr: [0; 8],
        };
        let length = size_of::<libc::sockaddr_ll>() as libc::socklen_t;
        // SAFETY: `address` is a link-layer address of the length given.
        #[allow(unsafe_code)]
        let bound = unsafe {
            libc::bind(socket.as_raw_fd(), (&raw const address).cast::<libc::sockaddr>(), length)
        };
        if bound != 0 {
            return Err(Error::last_os_error());
        }
        Ok(Self { socket })
    }

    /// Sends `frame`.
    ///
    /// # Errors
    /// What the operating system says; a full queue among it.
    pub fn send(&self, frame: &[u8]) -> Result<usize> {
        // SAFETY: the buffer is as long as is said.
        #[allow(unsafe_code)]
        let sent =
            unsafe { libc::send(self.socket.as_raw_fd(), frame.as_ptr().cast(), frame.len(), 0) };
        usize::try_from(sent).map_err(|_| Error::last_os_error())
    }

    /// The length of the next frame, put into `buffer`.
    ///
    /// # Errors
    /// `WouldBlock` where none is there.
    pub fn receive(&self, buffer: &mut [u8]) -> Result<usize> {
        // SAFETY: the buffer is as long as is said.
        #[allow(unsafe_code)]
        let length = unsafe {
            libc::recv(self.socket.as_raw_fd(), buffer.as_mut_ptr().cast(), buffer.len(), 0)
        };
        usize::try_from(length).map_err(|_| Error::last_os_error())
    }
}

impl AsFd for RawFrames {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}
