//! Whose process is at the other end of a TCP connection, as the kernel's tables of sockets say; proc_net(5).
//!
//! Anybody on a computer may connect to a loopback port. A socket that is open has its owner in the table; one that its
//! process has closed already is shown as root's, so those count as nobody's.

use std::io::{self, BufRead, BufReader};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpStream, UdpSocket};
use std::path::Path;
use std::time::Duration;

use crate::instance::user;

/// The tables of this network namespace.
const TABLES: [&str; 2] = ["/proc/net/tcp", "/proc/net/tcp6"];

/// A table that changes while it is read may leave a socket out: it is read again so often.
const READINGS: u32 = 3;

/// Pause between two readings.
const PAUSE: Duration = Duration::from_millis(5);

/// Whose process is at the other end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PeerUser {
    /// Ours, or root's.
    Own,
    /// That of another user of this computer, by its number.
    Other(u32),
    /// One on another computer.
    Elsewhere,
    /// One on this computer that has closed its socket, or is hidden.
    Unknown,
}

impl PeerUser {
    /// Who is at the other end of `stream`.
    ///
    /// # Errors
    /// A stream that is not connected, tables that cannot be read.
    pub fn of(stream: &TcpStream) -> io::Result<Self> {
        Self::between(stream.local_addr()?, stream.peer_addr()?)
    }

    /// Who is at `peer` of the connection with our own end at `local`.
    ///
    /// # Errors
    /// Tables that cannot be read.
    pub fn between(local: SocketAddr, peer: SocketAddr) -> io::Result<Self> {
        let address = canonical(peer).ip();
        // Only an address of this computer can be bound; of one that is in doubt we take it to be here.
        let is_ours = || match UdpSocket::bind((address, 0)) {
            Ok(_) => true,
            Err(error) => error.kind() != io::ErrorKind::AddrNotAvailable,
        };
        let is_here = address.is_loopback() || address == canonical(local).ip() || is_ours();
        let mut found = None;
        for reading in 0..READINGS {
            if reading > 0 {
                std::thread::sleep(PAUSE);
            }
            found = owner(local, peer)?;
            // A socket elsewhere is in no table of ours, however often they are read.
            if found.is_some() || !is_here {
                break;
            }
        }
        Ok(match found {
            Some(Owner::User(number)) if number == user() || number == 0 => Self::Own,
            Some(Owner::User(number)) => Self::Other(number),
            Some(Owner::Nobody) => Self::Unknown,
            None if is_here => Self::Unknown,
            None => Self::Elsewhere,
        })
    }
}

/// Whose a socket is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Owner {
    User(u32),
    /// Its process has closed it.
    Nobody,
}

/// Whose the socket at `peer` is; `None` of one that is not on this computer.
fn owner(local: SocketAddr, peer: SocketAddr) -> io::Result<Option<Owner>> {
    let mut is_readable = false;
    for table in TABLES {
        match std::fs::File::open(Path::new(table)) {
            Ok(file) => {
                is_readable = true;
                if let Some(owner) = find(BufReader::new(file), local, peer)? {
                    return Ok(Some(owner));
                }
            }
            // A kernel without IPv6 has one table.
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(error),
        }
    }
    if is_readable {
        Ok(None)
    } else {
        Err(io::Error::new(io::ErrorKind::NotFound, format!("{} is not there", TABLES[0])))
    }
}

/// Whose the socket is in a `table` whose own end is `peer`, and whose other end is `local`.
fn find(table: impl BufRead, local: SocketAddr, peer: SocketAddr) -> io::Result<Option<Owner>> {
    let ends = (canonical(peer), canonical(local));
    for line in table.lines() {
        let line = line?;
        if let Some(row) = Row::parse(&line)
            && (row.own, row.other) == ends
        {
            return Ok(Some(row.owner));
        }
    }
    Ok(None)
}

/// A line of a table.
struct Row {
    own: SocketAddr,
    other: SocketAddr,
    owner: Owner,
}

impl Row {
    /// `None` of the heading, and of what is not understood.
    fn parse(line: &str) -> Option<Self> {
        let mut words = line.split_ascii_whitespace().skip(1);
        let own = address(words.next()?)?;
        let other = address(words.next()?)?;
        // State, queues, timer, retransmissions.
        let user = words.nth(4)?.parse().ok()?;
        // Timeout.
        let inode: u64 = words.nth(1)?.parse().ok()?;
        let owner = if inode == 0 { Owner::Nobody } else { Owner::User(user) };
        Some(Self { own, other, owner })
    }
}

/// An end of a socket, `0100007F:1F90`: words of the address as this computer has them in memory.
fn address(text: &str) -> Option<SocketAddr> {
    let (address, port) = text.split_once(':')?;
    let port = u16::from_str_radix(port, 16).ok()?;
    let word = |at: usize| u32::from_str_radix(address.get(at..at + 8)?, 16).ok();
    let address = match address.len() {
        8 => IpAddr::V4(Ipv4Addr::from(word(0)?.to_ne_bytes())),
        32 => {
            let mut bytes = [0; 16];
            for (index, chunk) in bytes.chunks_exact_mut(4).enumerate() {
                chunk.copy_from_slice(&word(8 * index)?.to_ne_bytes());
            }
            IpAddr::V6(Ipv6Addr::from(bytes))
        }
        _ => return None,
    };
    Some(canonical(SocketAddr::new(address, port)))
}

/// An IPv4 address that is written as an IPv6 one, as what it is; without scope and flow.
fn canonical(address: SocketAddr) -> SocketAddr {
    SocketAddr::new(address.ip().to_canonical(), address.port())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use std::net::TcpListener;

    const TABLE: &str = "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode
   0: 0100007F:1BD3 00000000:0000 0A 00000000:00000000 00:00000000 00000000  1000        0 21533 1 0000000000000000 100 0 0 10 0
   1: 0100007F:1BD3 0100007F:C350 01 00000000:00000000 00:00000000 00000000  1000        0 21534 1 0000000000000000 20 4 30 10 -1
   2: 0100007F:C350 0100007F:1BD3 01 00000000:00000000 00:00000000 00000000  1001        0 21535 1 0000000000000000 20 4 30 10 -1
   3: 0100007F:C351 0100007F:1BD3 04 00000000:00000000 00:00000000 00000000     0        0 0 1 0000000000000000 20 4 30 10 -1
";

    const TABLE_6: &str = "   0: 0000000000000000FFFF00000100007F:C352 0000000000000000FFFF00000100007F:1BD3 01 00000000:00000000 00:00000000 00000000  1002        0 21540 1 0 20 4 30 10 -1
   1: 00000000000000000000000001000000:C353 00000000000000000000000001000000:1BD3 01 00000000:00000000 00:00000000 00000000     7        0 21541 1 0 20 4 30 10 -1
";

    fn at(text: &str) -> SocketAddr {
        text.parse().unwrap()
    }

    #[cfg(target_endian = "little")]
    #[test]
    fn the_owner_is_that_of_the_other_end() {
        let local = at("127.0.0.1:7123");
        let owner =
            |table: &str, peer: &str, local| find(table.as_bytes(), local, at(peer)).unwrap();
        assert_eq!(owner(TABLE, "127.0.0.1:50000", local), Some(Owner::User(1001)));
        assert_eq!(owner(TABLE, "127.0.0.1:50001", local), Some(Owner::Nobody), "a closed one");
        assert_eq!(owner(TABLE, "127.0.0.1:50009", local), None);
        assert_eq!(owner(TABLE_6, "127.0.0.1:50002", local), Some(Owner::User(1002)), "mapped");
        assert_eq!(owner(TABLE_6, "[::ffff:127.0.0.1]:50002", local), Some(Owner::User(1002)));
        assert_eq!(owner(TABLE_6, "[::1]:50003", at("[::1]:7123")), Some(Owner::User(7)));
    }

    #[test]
    fn lines_that_are_no_sockets_are_passed_over() {
        for line in [
            "",
            "0:",
            "  sl  local_address rem_address",
            "0: 01:1 02:2 01",
            "0: zz:0 zz:0 1 1 1 1 1 1 1",
        ] {
            assert!(Row::parse(line).is_none(), "{line:?}");
        }
    }

    #[test]
    fn a_connection_of_this_user_is_its_own_and_one_that_is_closed_nobodys() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (stream, _) = listener.accept().unwrap();
        assert_eq!(PeerUser::of(&stream).unwrap(), PeerUser::Own);
        assert_eq!(PeerUser::of(&client).unwrap(), PeerUser::Own);
        let (local, peer) = (stream.local_addr().unwrap(), stream.peer_addr().unwrap());
        drop(client);
        assert_eq!(PeerUser::between(local, peer).unwrap(), PeerUser::Unknown);
        assert_eq!(PeerUser::between(local, at("192.0.2.1:5000")).unwrap(), PeerUser::Elsewhere);
    }
}
