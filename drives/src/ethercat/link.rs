//! How Ethernet frames reach the bus and come back.

use std::io::ErrorKind;
use std::net::{SocketAddr, UdpSocket};
use std::os::fd::AsFd;

use messages::Nanoseconds;
use runtime::raw_frames::RawFrames;
use runtime::{clock, ready};

/// Bytes of an Ethernet header.
pub const HEADER: usize = 14;

/// The header that a frame out of a datagram gets: to all, from a station that a first slave has marked.
const FROM_DATAGRAM: [u8; HEADER] =
    [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x12, 0x10, 0x10, 0x10, 0x10, 0x10, 0x88, 0xa4];

/// A way to the bus, by which frames may be lost, late, doubled or damaged.
pub trait FrameLink: Send {
    /// Sends `frame`, Ethernet header and all, or loses it; does not wait.
    fn send(&mut self, frame: &[u8]);

    /// The length of the next frame from the bus, put into `buffer`, if one is there or comes before `until`
    /// on the clock of [`Self::now`].
    fn receive(&mut self, buffer: &mut [u8], until: Nanoseconds) -> Option<usize>;

    /// The time by which it waits.
    fn now(&self) -> Nanoseconds;
}

/// EtherCAT in UDP: a datagram carries what an Ethernet frame would.
#[derive(Debug)]
pub struct UdpFrames {
    socket: UdpSocket,
}

impl UdpFrames {
    /// A socket that hears the bus at `address` only.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn open(address: SocketAddr) -> std::io::Result<Self> {
        let any: SocketAddr = match address {
            SocketAddr::V4(_) => (std::net::Ipv4Addr::UNSPECIFIED, 0).into(),
            SocketAddr::V6(_) => (std::net::Ipv6Addr::UNSPECIFIED, 0).into(),
        };
        let socket = UdpSocket::bind(any)?;
        socket.connect(address)?;
        socket.set_nonblocking(true)?;
        Ok(Self { socket })
    }
}

impl FrameLink for UdpFrames {
    fn send(&mut self, frame: &[u8]) {
        // What is not sent is not answered, and counted as lost.
        let _ = frame.get(HEADER..).map(|payload| self.socket.send(payload));
    }

    fn receive(&mut self, buffer: &mut [u8], until: Nanoseconds) -> Option<usize> {
        let (header, payload) = buffer.split_at_mut_checked(HEADER)?;
        header.copy_from_slice(&FROM_DATAGRAM);
        loop {
            match self.socket.recv(payload) {
                Ok(length) => return Some(HEADER + length),
                Err(error) if is_nothing_yet(&error) => {}
                Err(_) => return None,
            }
            if !ready::wait_readable(self.socket.as_fd(), until).ok()? && clock::now() >= until {
                return None;
            }
        }
    }

    fn now(&self) -> Nanoseconds {
        clock::now()
    }
}

impl FrameLink for RawFrames {
    fn send(&mut self, frame: &[u8]) {
        let _ = RawFrames::send(self, frame);
    }

    fn receive(&mut self, buffer: &mut [u8], until: Nanoseconds) -> Option<usize> {
        loop {
            match RawFrames::receive(self, buffer) {
                Ok(length) => return Some(length),
                Err(error) if is_nothing_yet(&error) => {}
                Err(_) => return None,
            }
            if !ready::wait_readable(self.as_fd(), until).ok()? && clock::now() >= until {
                return None;
            }
        }
    }

    fn now(&self) -> Nanoseconds {
        clock::now()
    }
}

/// Nothing is there, or the other computer says that nobody listens: as silent as a cut cable.
fn is_nothing_yet(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::ConnectionRefused)
}
