//! EtherCAT frames: what stands where, in a buffer that the slaves change as it passes through them.
//!
//! ETG.1000.4: a header of two bytes (length, type 1), then datagrams of a header of ten bytes, their
//! data, and the working counter.

use core::ops::Range;

/// EtherType of EtherCAT.
pub const ETHERTYPE: u16 = 0x88A4;

/// Bytes of an Ethernet header.
pub const ETHERNET_HEADER: usize = 14;

/// Bytes of a datagram beside its data: header and working counter.
const DATAGRAM_OVERHEAD: usize = 12;

/// What a datagram asks of the slaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// Nothing.
    Nop,
    /// Read or write registers of slaves chosen by `by`.
    Register {
        /// How the slave is chosen.
        by: Addressing,
        /// What is done at the slave.
        access: Access,
    },
    /// Read or write the logical memory.
    Logical(Access),
    /// Read at the slave that is addressed, write at all others.
    ReadMultipleWrite(Addressing),
}

/// How a slave is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Addressing {
    /// By its position: each slave counts the address up, and the one that finds 0 is meant.
    Position,
    /// By its station address.
    Station,
    /// All slaves, which count the address up.
    Broadcast,
}

/// What is done with the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// The slave gives.
    Read,
    /// The slave takes.
    Write,
    /// Both, the old contents being given.
    ReadWrite,
}

impl Access {
    /// Whether the slave gives.
    pub fn reads(self) -> bool {
        self != Self::Write
    }

    /// Whether the slave takes.
    pub fn writes(self) -> bool {
        self != Self::Read
    }
}

impl Command {
    /// The command of this number, if there is one.
    pub fn of(number: u8) -> Option<Self> {
        use Access::{Read, ReadWrite, Write};
        use Addressing::{Broadcast, Position, Station};
        let register = |by, access| Some(Self::Register { by, access });
        match number {
            0 => Some(Self::Nop),
            1 => register(Position, Read),
            2 => register(Position, Write),
            3 => register(Position, ReadWrite),
            4 => register(Station, Read),
            5 => register(Station, Write),
            6 => register(Station, ReadWrite),
            7 => register(Broadcast, Read),
            8 => register(Broadcast, Write),
            9 => register(Broadcast, ReadWrite),
            10 => Some(Self::Logical(Read)),
            11 => Some(Self::Logical(Write)),
            12 => Some(Self::Logical(ReadWrite)),
            13 => Some(Self::ReadMultipleWrite(Position)),
            14 => Some(Self::ReadMultipleWrite(Station)),
            _ => None,
        }
    }
}

/// A datagram in its frame.
#[derive(Debug)]
pub struct Datagram<'a> {
    /// What it asks for.
    pub command: Command,
    /// Upper half of a logical address, or the offset of a register.
    header: &'a mut [u8],
    /// What is read and written.
    pub data: &'a mut [u8],
    counter: &'a mut [u8],
}

impl Datagram<'_> {
    /// The slave's address, a position or a station.
    pub fn slave(&self) -> u16 {
        word(self.header, 2)
    }

    /// Counts the position up, as each slave does.
    pub fn count_up(&mut self) {
        let next = self.slave().wrapping_add(1);
        put(self.header, 2, &next.to_le_bytes());
    }

    /// The offset in the slave's memory.
    pub fn offset(&self) -> u16 {
        word(self.header, 4)
    }

    /// The address in the logical memory.
    pub fn logical(&self) -> u32 {
        u32::from(self.slave()) | u32::from(self.offset()) << 16
    }

    /// Adds to the working counter.
    pub fn worked(&mut self, by: u16) {
        let sum = word(self.counter, 0).wrapping_add(by);
        put(self.counter, 0, &sum.to_le_bytes());
    }

    /// Raises events of the slave in the datagram.
    pub fn raise(&mut self, events: u16) {
        let all = word(self.header, 8) | events;
        put(self.header, 8, &all.to_le_bytes());
    }
}

/// Where the datagrams of an EtherCAT `payload` are, header and counter included; `None` if it is not one
/// whole frame of commands.
pub fn datagrams(payload: &[u8]) -> Option<Vec<Range<usize>>> {
    let header = payload.get(..2).map(|header| word(header, 0))?;
    let length = usize::from(header & 0x07FF);
    if header >> 12 != 1 || payload.len() < 2 + length {
        return None;
    }
    let mut found = Vec::new();
    let mut start = 2;
    loop {
        let sizes = payload.get(start + 6..start + 8).map(|bytes| word(bytes, 0))?;
        let end = start + DATAGRAM_OVERHEAD + usize::from(sizes & 0x07FF);
        if end > 2 + length {
            return None;
        }
        found.push(start..end);
        if sizes & 0x8000 == 0 {
            return Some(found);
        }
        start = end;
    }
}

/// The datagram at `range` of `payload`; `None` if its command is unknown, and it passes unchanged.
pub fn datagram(payload: &mut [u8], range: Range<usize>) -> Option<Datagram<'_>> {
    let bytes = payload.get_mut(range)?;
    let command = Command::of(*bytes.first()?)?;
    let (header, rest) = bytes.split_at_mut_checked(10)?;
    let (data, counter) = rest.split_at_mut_checked(rest.len().checked_sub(2)?)?;
    Some(Datagram { command, header, data, counter })
}

/// The word at `offset`, 0 beyond the end.
pub(super) fn word(bytes: &[u8], offset: usize) -> u16 {
    u16::from_le_bytes(array(bytes, offset))
}

/// The double word at `offset`, with 0 for what is beyond the end.
pub(super) fn double_word(bytes: &[u8], offset: usize) -> u32 {
    u32::from_le_bytes(array(bytes, offset))
}

/// The bytes at `offset`, with 0 for what is beyond the end.
pub(super) fn array<const N: usize>(bytes: &[u8], offset: usize) -> [u8; N] {
    let mut found = [0; N];
    for (to, from) in found.iter_mut().zip(bytes.iter().skip(offset)) {
        *to = *from;
    }
    found
}

/// Puts `value` at `offset`, what is beyond the end left out.
pub(super) fn put(bytes: &mut [u8], offset: usize, value: &[u8]) {
    for (to, from) in bytes.iter_mut().skip(offset).zip(value) {
        *to = *from;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn datagrams_are_found_and_broken_frames_are_not() {
        let mut payload = vec![0x1A, 0x10];
        payload.extend([7, 1, 0, 0, 0x30, 1, 2, 0x80, 0, 0, 0, 0, 0, 0]);
        payload.extend([8, 2, 0, 0, 0x20, 1, 0, 0, 0, 0, 0, 0]);
        assert_eq!(datagrams(&payload), Some(vec![2..16, 16..28]));
        assert_eq!(datagrams(&payload[..27]), None);
        let mut long = payload.clone();
        long[22] = 9;
        assert_eq!(datagrams(&long), None);
        let mut found = datagram(&mut payload, 2..16);
        if let Some(found) = &mut found {
            assert_eq!((found.slave(), found.offset(), found.data.len()), (0, 0x0130, 2));
            found.count_up();
            found.worked(3);
            found.raise(4);
        }
        assert!(found.is_some());
        assert_eq!(payload[4..6], [1, 0]);
        assert_eq!(payload[10..16], [4, 0, 0, 0, 3, 0]);
    }
}
