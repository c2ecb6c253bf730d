//! LBP16: the commands that a datagram consists of.
//!
//! A command is a 16-bit word, little endian like everything: bit 15 write, 14 an address follows, 13 the
//! information area of the space, 12–10 the space, 9–8 the size of an item (8 to 64 bits), 7 the address
//! counts on, 6–0 how many items. A write is followed by its data; what a datagram reads comes back in one.

/// The UDP port of such a board.
pub const PORT: u16 = 27181;

/// The longest reply [bytes]: what a frame on Ethernet carries.
pub const LONGEST_REPLY: usize = 1472;

/// One command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Command {
    /// Whether it writes.
    pub write: bool,
    /// Where; `None` goes on where the space's last command ended.
    pub address: Option<u16>,
    /// Whether it reads about the space instead of the space.
    pub information: bool,
    /// The space, 0..8.
    pub space: u8,
    /// Bytes of an item: 1, 2, 4 or 8.
    pub width: u16,
    /// Whether the address counts on from item to item.
    pub increment: bool,
    /// How many items.
    pub count: u16,
}

impl Command {
    /// The command that `bytes` begin with, and what follows it; `None` where it is cut off.
    pub fn parse(bytes: &[u8]) -> Option<(Self, &[u8])> {
        let (word, rest) = bytes.split_first_chunk::<2>()?;
        let word = u16::from_le_bytes(*word);
        let (address, rest) = if word & 0x4000 == 0 {
            (None, rest)
        } else {
            let (address, rest) = rest.split_first_chunk::<2>()?;
            (Some(u16::from_le_bytes(*address)), rest)
        };
        let command = Self {
            write: word & 0x8000 != 0,
            address,
            information: word & 0x2000 != 0,
            space: (word >> 10 & 7) as u8,
            width: 1 << (word >> 8 & 3),
            increment: word & 0x80 != 0,
            count: word & 0x7f,
        };
        Some((command, rest))
    }

    /// Bytes of its data.
    pub fn length(&self) -> usize {
        usize::from(self.count) * usize::from(self.width)
    }
}
