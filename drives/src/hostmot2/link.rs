//! How datagrams reach a board and come back.

use std::io::ErrorKind;
use std::net::{SocketAddr, UdpSocket};
use std::os::fd::AsFd;

use messages::Nanoseconds;
use runtime::{clock, ready};

/// A way to a board, by which datagrams may be lost, late or doubled.
pub trait Link: Send {
    /// Sends `datagram`, or loses it; does not wait.
    fn send(&mut self, datagram: &[u8]);

    /// The length of the next datagram from the board, put into `buffer`, if one is there or comes before
    /// `until` on the clock of [`Self::now`].
    fn receive(&mut self, buffer: &mut [u8], until: Nanoseconds) -> Option<usize>;

    /// The time by which it waits.
    fn now(&self) -> Nanoseconds;
}

/// A UDP socket.
#[derive(Debug)]
pub struct UdpLink {
    socket: UdpSocket,
}

impl UdpLink {
    /// A socket that hears the board at `address` only.
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

impl Link for UdpLink {
    fn send(&mut self, datagram: &[u8]) {
        // What is not sent is not answered, and counted as lost.
        let _ = self.socket.send(datagram);
    }

    fn receive(&mut self, buffer: &mut [u8], until: Nanoseconds) -> Option<usize> {
        loop {
            match self.socket.recv(buffer) {
                Ok(length) => return Some(length),
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                // The board's computer says that nobody listens there: as silent as a cut cable.
                Err(error) if error.kind() == ErrorKind::ConnectionRefused => {}
                Err(_) => return None,
            }
            if !ready::wait_readable(self.socket.as_fd(), until).ok()? && self.now() >= until {
                return None;
            }
        }
    }

    fn now(&self) -> Nanoseconds {
        clock::now()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_datagram_goes_there_and_back_and_silence_ends_in_time() {
        let board = UdpSocket::bind("127.0.0.1:0").unwrap();
        let mut link = UdpLink::open(board.local_addr().unwrap()).unwrap();
        link.send(&[1, 2, 3]);
        let mut buffer = [0; 16];
        let (length, from) = board.recv_from(&mut buffer).unwrap();
        board.send_to(&buffer[..length], from).unwrap();
        let until = link.now() + Nanoseconds(10_000_000_000);
        assert_eq!(link.receive(&mut buffer, until), Some(3));
        assert_eq!(link.receive(&mut buffer, link.now() + Nanoseconds(1_000_000)), None);
    }

    #[test]
    fn nobody_is_silence() {
        let address = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let mut link = UdpLink::open(address).unwrap();
        link.send(&[1]);
        assert_eq!(link.receive(&mut [0; 16], link.now() + Nanoseconds(1_000_000)), None);
        link.send(&[1]);
    }
}
