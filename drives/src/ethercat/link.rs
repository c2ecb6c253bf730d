//! Ethernet frames of a bus on the links that there are: raw on an interface, or in UDP.

use std::net::SocketAddr;

use messages::Nanoseconds;
use runtime::clock;
use runtime::raw_frames::RawFrames;

use crate::link::{self, Link, UdpLink};

/// Bytes of an Ethernet header.
pub const HEADER: usize = 14;

/// The header that a frame out of a datagram gets: to all, from a station that a first slave has marked.
const FROM_DATAGRAM: [u8; HEADER] =
    [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x12, 0x10, 0x10, 0x10, 0x10, 0x10, 0x88, 0xa4];

/// EtherCAT in UDP: a datagram carries what an Ethernet frame would.
#[derive(Debug)]
pub struct UdpFrames {
    link: UdpLink,
}

impl UdpFrames {
    /// A socket that hears the bus at `address` only.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn open(address: SocketAddr) -> std::io::Result<Self> {
        Ok(Self { link: UdpLink::open(address)? })
    }
}

impl Link for UdpFrames {
    fn send(&mut self, frame: &[u8]) {
        if let Some(payload) = frame.get(HEADER..) {
            self.link.send(payload);
        }
    }

    fn receive(&mut self, buffer: &mut [u8], until: Nanoseconds) -> Option<usize> {
        let (header, payload) = buffer.split_at_mut_checked(HEADER)?;
        header.copy_from_slice(&FROM_DATAGRAM);
        self.link.receive(payload, until).map(|length| HEADER + length)
    }

    fn now(&self) -> Nanoseconds {
        self.link.now()
    }
}

impl Link for RawFrames {
    fn send(&mut self, frame: &[u8]) {
        // What is not sent is not answered, and counted as lost.
        let _ = RawFrames::send(self, frame);
    }

    fn receive(&mut self, buffer: &mut [u8], until: Nanoseconds) -> Option<usize> {
        let frames = &*self;
        link::receive(frames, until, || RawFrames::receive(frames, buffer))
    }

    fn now(&self) -> Nanoseconds {
        clock::now()
    }
}
