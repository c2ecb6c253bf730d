//! LBP16: requests of several commands in one datagram, and the one reply to all that they read.
//!
//! A command is a 16-bit word, little endian like everything: bit 15 write, 14 an address follows, 12–10 the
//! space, 9–8 the width of an item, 7 the address counts on, 6–0 how many items. A board answers with the
//! bytes that were read, in order, and nothing else: neither an address nor a number tells whose reply it is,
//! so each request writes a number into the scratch of the timer space and reads it back.

/// The UDP port of a board.
pub const PORT: u16 = 27181;

/// The longest datagram that a board takes or sends [bytes].
pub const LONGEST: usize = 1472;

/// The most items of one command.
pub const MOST_ITEMS: u16 = 0x7f;

/// A memory space of a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Space {
    /// The modules, by words of 32 bits.
    Modules = 0,
    /// Timer and scratch, by words of 16 bits.
    Timer = 4,
    /// Counters of the communication, by words of 16 bits.
    Communication = 6,
    /// What the board is, by words of 16 bits.
    Board = 7,
}

/// Where the number of a request is written and read, in [`Space::Timer`]: 32 bits.
pub const NUMBER: u16 = 0x10;

/// Where what a session is known by stands in the same space: 32 bits, 0 after power-on.
pub const SESSION: u16 = 0x14;

const WRITE: u16 = 1 << 15;
const ADDRESS: u16 = 1 << 14;
const WORDS: u16 = 1 << 8;
const LONG_WORDS: u16 = 2 << 8;
const INCREMENT: u16 = 1 << 7;

/// A request under construction, and how long its reply will be.
#[derive(Debug, Clone)]
pub struct Request {
    bytes: [u8; LONGEST],
    length: usize,
    reply: usize,
    /// Whether everything that was asked for has found room.
    complete: bool,
}

impl Default for Request {
    fn default() -> Self {
        Self { bytes: [0; LONGEST], length: 0, reply: 0, complete: true }
    }
}

impl Request {
    /// Empties it.
    pub fn clear(&mut self) {
        (self.length, self.reply, self.complete) = (0, 0, true);
    }

    /// Its bytes; `None` where it is longer than a datagram, or its reply would be.
    pub fn datagram(&self) -> Option<&[u8]> {
        if self.complete && self.reply <= LONGEST { self.bytes.get(..self.length) } else { None }
    }

    /// How long its reply is [bytes].
    pub fn reply_length(&self) -> usize {
        self.reply
    }

    /// Writes a register of a module.
    pub fn write(&mut self, address: u16, value: u32) {
        self.command(WRITE | ADDRESS | LONG_WORDS | INCREMENT | 1, address);
        self.put(&value.to_le_bytes());
    }

    /// Reads `count` registers of modules, from `address` on; at most [`MOST_ITEMS`].
    pub fn read(&mut self, address: u16, count: u16) {
        let count = count.min(MOST_ITEMS);
        self.command(ADDRESS | LONG_WORDS | INCREMENT | count, address);
        self.reply += 4 * usize::from(count);
    }

    /// Reads `count` 16-bit words of another space; at most [`MOST_ITEMS`].
    pub fn read_words(&mut self, space: Space, address: u16, count: u16) {
        let count = count.min(MOST_ITEMS);
        self.command(ADDRESS | (space as u16) << 10 | WORDS | INCREMENT | count, address);
        self.reply += 2 * usize::from(count);
    }

    /// Writes the number by which the reply is known, which is read back by [`Self::read_number`].
    pub fn write_number(&mut self, number: u32) {
        self.scratch(NUMBER, number);
    }

    /// Reads the number back.
    pub fn read_number(&mut self) {
        self.read_words(Space::Timer, NUMBER, 2);
    }

    /// Writes what the session is known by.
    pub fn write_session(&mut self, session: u32) {
        self.scratch(SESSION, session);
    }

    /// Reads it back.
    pub fn read_session(&mut self) {
        self.read_words(Space::Timer, SESSION, 2);
    }

    fn scratch(&mut self, address: u16, value: u32) {
        let space = (Space::Timer as u16) << 10;
        self.command(WRITE | ADDRESS | space | WORDS | INCREMENT | 2, address);
        self.put(&value.to_le_bytes());
    }

    fn command(&mut self, word: u16, address: u16) {
        self.put(&word.to_le_bytes());
        self.put(&address.to_le_bytes());
    }

    fn put(&mut self, bytes: &[u8]) {
        let end = self.length + bytes.len();
        match self.bytes.get_mut(self.length..end) {
            Some(place) => {
                place.copy_from_slice(bytes);
                self.length = end;
            }
            None => self.complete = false,
        }
    }
}

/// What is left to read of a reply.
#[derive(Debug, Clone, Copy)]
pub struct Reply<'a>(pub &'a [u8]);

impl Reply<'_> {
    /// The next register or number; 0 behind the end, which whoever compared the length does not reach.
    pub fn word(&mut self) -> u32 {
        let Some((bytes, rest)) = self.0.split_first_chunk::<4>() else { return 0 };
        self.0 = rest;
        u32::from_le_bytes(*bytes)
    }

    /// The next 16-bit word; 0 behind the end.
    pub fn short(&mut self) -> u16 {
        let Some((bytes, rest)) = self.0.split_first_chunk::<2>() else { return 0 };
        self.0 = rest;
        u16::from_le_bytes(*bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_has_the_words_of_the_protocol() {
        let mut request = Request::default();
        request.write(0x0e00, 0x5a00_0000);
        request.read(0x2100, 3);
        request.write_number(0x0102_0304);
        request.read_number();
        let expected = [
            0x81, 0xc2, 0x00, 0x0e, 0x00, 0x00, 0x00,
            0x5a, // One word of the modules is written,
            0x83, 0x42, 0x00, 0x21, // three are read,
            0x82, 0xd1, 0x10, 0x00, 0x04, 0x03, 0x02,
            0x01, // two short ones of the timer written
            0x82, 0x51, 0x10, 0x00, // and read.
        ];
        assert_eq!(request.datagram(), Some(&expected[..]));
        assert_eq!(request.reply_length(), 16);
    }

    #[test]
    fn what_does_not_fit_is_no_datagram() {
        let mut request = Request::default();
        for _ in 0..LONGEST / 8 {
            request.write(0, 0);
        }
        assert!(request.datagram().is_some());
        request.write(0, 0);
        assert_eq!(request.datagram(), None);
        request.clear();
        for _ in 0..3 {
            request.read(0, 127);
        }
        assert_eq!(request.datagram(), None, "a reply of 1,524 bytes");
    }

    #[test]
    fn a_short_reply_reads_as_zero() {
        let mut reply = Reply(&[1, 0, 0, 0, 2, 0, 3]);
        assert_eq!((reply.word(), reply.short(), reply.short(), reply.word()), (1, 2, 0, 0));
    }
}
