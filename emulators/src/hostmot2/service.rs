//! The emulator in real time: a UDP socket, and the clock.

use std::io::{self, ErrorKind};
use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

use messages::Nanoseconds;

use super::emulator::Emulator;

/// How long the service sleeps at most without a datagram: the board's own time goes on meanwhile.
const NAP: Duration = Duration::from_millis(1);

/// An emulator at a socket.
#[derive(Debug)]
pub struct Service {
    emulator: Emulator,
    socket: UdpSocket,
    start: Instant,
    master: Option<SocketAddr>,
    buffer: [u8; 2048],
}

impl Service {
    /// `emulator`, powered now, at `socket`.
    ///
    /// # Errors
    /// If the socket takes no time-out.
    pub fn new(emulator: Emulator, socket: UdpSocket) -> io::Result<Self> {
        socket.set_read_timeout(Some(NAP))?;
        Ok(Self { emulator, socket, start: Instant::now(), master: None, buffer: [0; 2048] })
    }

    /// Serves until `stop` says so, which is asked at least every 2 ms or so.
    ///
    /// # Errors
    /// If the socket fails; a master that is gone is no error.
    pub fn run(&mut self, mut stop: impl FnMut() -> bool) -> io::Result<()> {
        while !stop() {
            self.turn()?;
        }
        Ok(())
    }

    /// The emulator.
    pub fn emulator(&self) -> &Emulator {
        &self.emulator
    }

    /// What has passed since it was powered.
    pub fn now(&self) -> Nanoseconds {
        Nanoseconds(i64::try_from(self.start.elapsed().as_nanos()).unwrap_or(i64::MAX))
    }

    /// Takes a datagram, if one comes, and sends what is due.
    fn turn(&mut self) -> io::Result<()> {
        // A frame that is held back wakes it earlier than the nap ends.
        let nap = self.emulator.next().map_or(NAP, |next| {
            let left = u64::try_from((next - self.now()).0).unwrap_or(0);
            Duration::from_nanos(left).clamp(Duration::from_micros(50), NAP)
        });
        if nap != NAP {
            self.socket.set_read_timeout(Some(nap))?;
        }
        let received = self.socket.recv_from(&mut self.buffer);
        if nap != NAP {
            self.socket.set_read_timeout(Some(NAP))?;
        }
        let now = self.now();
        match received {
            Ok((length, from)) => {
                self.master = Some(from);
                self.emulator.send(now, self.buffer.get(..length).unwrap_or(&[]));
            }
            Err(error) if is_silence(&error) => self.emulator.advance(now),
            Err(error) => return Err(error),
        }
        while let Some(reply) = self.emulator.receive(now) {
            if let Some(master) = self.master {
                match self.socket.send_to(&reply, master) {
                    Err(error) if !is_silence(&error) => return Err(error),
                    _ => {}
                }
            }
        }
        Ok(())
    }
}

/// Whether `error` only says that nobody is there.
fn is_silence(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::WouldBlock
            | ErrorKind::TimedOut
            | ErrorKind::Interrupted
            | ErrorKind::ConnectionRefused
            | ErrorKind::ConnectionReset
            | ErrorKind::HostUnreachable
            | ErrorKind::NetworkUnreachable
    )
}
