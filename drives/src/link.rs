//! How datagrams and frames reach hardware and come back.

use std::io::ErrorKind;
use std::net::{SocketAddr, UdpSocket};
use std::os::fd::AsFd;

use messages::Nanoseconds;
use runtime::{clock, ready};

/// A way to hardware, by which what is sent, datagrams or Ethernet frames, may be lost, late, doubled or damaged.
pub trait Link: Send {
    /// Sends `datagram`, or loses it; does not wait.
    fn send(&mut self, datagram: &[u8]);

    /// The length of the next datagram from the hardware, put into `buffer`, if one is there or comes before
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
    /// A socket that hears `address` only.
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
        let socket = &self.socket;
        receive(socket, until, || socket.recv(buffer))
    }

    fn now(&self) -> Nanoseconds {
        clock::now()
    }
}

/// The length of what `read` gives of `socket`, at once or when it comes before `until`.
pub(crate) fn receive(
    socket: &impl AsFd,
    until: Nanoseconds,
    mut read: impl FnMut() -> std::io::Result<usize>,
) -> Option<usize> {
    loop {
        match read() {
            Ok(length) => return Some(length),
            Err(error) if error.kind() == ErrorKind::WouldBlock => {}
            // The other computer says that nobody listens there: as silent as a cut cable.
            Err(error) if error.kind() == ErrorKind::ConnectionRefused => {}
            Err(_) => return None,
        }
        if !ready::wait_readable(socket.as_fd(), until).ok()? && clock::now() >= until {
            return None;
        }
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
