//! The sockets that frames come through.

use core::fmt;
use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::os::fd::{AsFd as _, AsRawFd as _, OwnedFd};
use std::time::Duration;

use nix::errno::Errno;
use nix::ifaddrs::getifaddrs;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::socket::{
    AddressFamily, LinkAddr, MsgFlags, SockFlag, SockProtocol, SockType, bind, recvfrom, send,
    socket,
};
use nix::sys::time::TimeSpec;

use super::frame::ETHERTYPE;
use super::link::Framing;

/// Frames that this side has sent itself are shown to a raw socket as well.
const OUTGOING: u8 = 4;

/// Where frames come from and go to.
#[derive(Debug)]
pub enum Bus {
    /// A network interface.
    Interface(String, OwnedFd),
    /// A UDP port, with who sent last.
    Udp(UdpSocket, Option<SocketAddr>),
}

impl fmt::Display for Bus {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Interface(name, _) => write!(formatter, "interface {name}"),
            Self::Udp(socket, _) => match socket.local_addr() {
                Ok(address) => write!(formatter, "udp {address}"),
                Err(_) => write!(formatter, "udp"),
            },
        }
    }
}

impl Bus {
    /// The interface `name`.
    ///
    /// # Errors
    /// If there is none, or raw sockets are not allowed.
    pub fn interface(name: &str) -> io::Result<Self> {
        let address = getifaddrs()?
            .filter(|interface| interface.interface_name == name)
            .find_map(|interface| interface.address?.as_link_addr().copied());
        let missing = || io::Error::new(io::ErrorKind::NotFound, format!("no interface {name}"));
        let address: LinkAddr = address.ok_or_else(missing)?;
        let flags = SockFlag::SOCK_CLOEXEC | SockFlag::SOCK_NONBLOCK;
        // Bound to the interface, it keeps the protocol that it has been made for.
        let socket = socket(AddressFamily::Packet, SockType::Raw, flags, SockProtocol::EthAll)?;
        bind(socket.as_raw_fd(), &address)?;
        Ok(Self::Interface(name.to_owned(), socket))
    }

    /// The UDP port at `address`.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn udp(address: SocketAddr) -> io::Result<Self> {
        let socket = UdpSocket::bind(address)?;
        socket.set_nonblocking(true)?;
        Ok(Self::Udp(socket, None))
    }

    /// What the frames that come here begin with.
    pub fn framing(&self) -> Framing {
        match self {
            Self::Interface(..) => Framing::Ethernet,
            Self::Udp(..) => Framing::Payload,
        }
    }

    /// Waits for a frame for `time` at most; its length, `None` if none has come.
    ///
    /// # Errors
    /// If the socket fails.
    pub fn receive(&mut self, frame: &mut [u8], time: Duration) -> io::Result<Option<usize>> {
        if let Some(length) = self.take(frame)? {
            return Ok(Some(length));
        }
        let file = match &*self {
            Self::Interface(_, socket) => socket.as_fd(),
            Self::Udp(socket, _) => socket.as_fd(),
        };
        let mut files = [PollFd::new(file, PollFlags::POLLIN)];
        match ppoll(&mut files, Some(TimeSpec::from_duration(time)), None) {
            Ok(_) | Err(Errno::EINTR) => {}
            Err(error) => return Err(error.into()),
        }
        self.take(frame)
    }

    fn take(&mut self, frame: &mut [u8]) -> io::Result<Option<usize>> {
        match self {
            Self::Interface(_, socket) => match recvfrom::<LinkAddr>(socket.as_raw_fd(), frame) {
                Ok((length, from)) => {
                    let incoming = from.is_none_or(|from| from.pkttype() != OUTGOING);
                    let kind = frame.get(12..14) == Some(&ETHERTYPE.to_be_bytes());
                    Ok((incoming && kind).then_some(length))
                }
                Err(Errno::EAGAIN | Errno::EINTR) => Ok(None),
                Err(error) => Err(error.into()),
            },
            Self::Udp(socket, master) => match socket.recv_from(frame) {
                Ok((length, from)) => {
                    *master = Some(from);
                    Ok(Some(length))
                }
                Err(error) if is_passing(&error) => Ok(None),
                Err(error) => Err(error),
            },
        }
    }

    /// Sends a frame to the master.
    ///
    /// # Errors
    /// If the socket fails.
    pub fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        let sent = match self {
            Self::Interface(_, socket) => {
                send(socket.as_raw_fd(), frame, MsgFlags::empty()).map_err(io::Error::from)
            }
            Self::Udp(socket, Some(master)) => socket.send_to(frame, *master),
            Self::Udp(_, None) => Ok(0),
        };
        match sent {
            Ok(_) => Ok(()),
            // The frame is lost, as on any line.
            Err(error) if is_passing(&error) => Ok(()),
            Err(error) => Err(error),
        }
    }
}

/// Whether the next attempt may go well.
fn is_passing(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionRefused, Interrupted, WouldBlock};
    matches!(error.kind(), ConnectionRefused | Interrupted | WouldBlock)
}
