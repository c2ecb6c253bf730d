//! UTF-16, in which some senders save programs, as the UTF-8 that everything else is read in.

use std::io::{self, ErrorKind, Read};

/// What is read of UTF-16 at a time [bytes].
const PIECE: usize = 1 << 13;

/// The text of a file: its bytes, or, where it begins with the byte order mark of UTF-16, UTF-8 made of
/// them. Half a surrogate pair becomes U+FFFD, which is no character of a program.
#[derive(Debug)]
pub(super) struct Text<R> {
    source: R,
    form: Form,
}

#[derive(Debug)]
enum Form {
    /// Not yet known.
    Unread,
    /// Bytes as they are, after those that were read to find out.
    Bytes {
        head: [u8; 2],
        from: usize,
        to: usize,
    },
    Wide(Wide),
}

/// Half-read UTF-16.
#[derive(Debug)]
struct Wide {
    is_big: bool,
    raw: Vec<u8>,
    /// How much of `raw` has been read and not yet taken.
    filled: usize,
    /// UTF-8 that was made and not yet handed out.
    ready: Vec<u8>,
    taken: usize,
    ended: bool,
}

impl<R: Read> Text<R> {
    pub(super) fn new(source: R) -> Self {
        Self { source, form: Form::Unread }
    }

    /// Finds out what the file is written in.
    fn begin(&mut self) -> io::Result<Form> {
        let mut head = [0; 2];
        let mut to = 0;
        while to < 2 {
            match read(&mut self.source, &mut head[to..])? {
                0 => break,
                length => to += length,
            }
        }
        let is_big = match head {
            [0xff, 0xfe] if to == 2 => false,
            [0xfe, 0xff] if to == 2 => true,
            _ => return Ok(Form::Bytes { head, from: 0, to }),
        };
        let (raw, ready) = (vec![0; PIECE], Vec::with_capacity(2 * PIECE));
        Ok(Form::Wide(Wide { is_big, raw, filled: 0, ready, taken: 0, ended: false }))
    }
}

impl<R: Read> Read for Text<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if let Form::Unread = self.form {
            self.form = self.begin()?;
        }
        match &mut self.form {
            Form::Bytes { head, from, to } if *from < *to => {
                let length = (*to - *from).min(into.len());
                into[..length].copy_from_slice(&head[*from..*from + length]);
                *from += length;
                Ok(length)
            }
            Form::Wide(wide) => wide.read(&mut self.source, into),
            Form::Bytes { .. } | Form::Unread => self.source.read(into),
        }
    }
}

impl Wide {
    fn read(&mut self, source: &mut impl Read, into: &mut [u8]) -> io::Result<usize> {
        while self.taken == self.ready.len() && !self.ended {
            self.fill(source)?;
        }
        let length = (self.ready.len() - self.taken).min(into.len());
        into[..length].copy_from_slice(&self.ready[self.taken..self.taken + length]);
        self.taken += length;
        Ok(length)
    }

    fn fill(&mut self, source: &mut impl Read) -> io::Result<()> {
        self.ready.clear();
        self.taken = 0;
        let length = read(source, &mut self.raw[self.filled..])?;
        self.ended = length == 0;
        self.filled += length;
        // The first half of a pair waits for the second, and so does half a unit.
        let mut whole = self.filled / 2;
        let unit = |index: usize| {
            let bytes = [self.raw[2 * index], self.raw[2 * index + 1]];
            if self.is_big { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) }
        };
        if !self.ended && whole > 0 && (0xd800..0xdc00).contains(&unit(whole - 1)) {
            whole -= 1;
        }
        for character in char::decode_utf16((0..whole).map(unit)) {
            let character = character.unwrap_or(char::REPLACEMENT_CHARACTER);
            let mut bytes = [0; 4];
            self.ready.extend_from_slice(character.encode_utf8(&mut bytes).as_bytes());
        }
        if self.ended && self.filled % 2 == 1 {
            self.ready.extend_from_slice("\u{fffd}".as_bytes());
        }
        self.raw.copy_within(2 * whole..self.filled, 0);
        self.filled -= 2 * whole;
        Ok(())
    }
}

/// Reads, whatever interrupts.
fn read(source: &mut impl Read, into: &mut [u8]) -> io::Result<usize> {
    loop {
        match source.read(into) {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            result => return result,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::job::gcode::pieces::Pieces;

    fn decoded(bytes: &[u8], piece: usize) -> String {
        let mut text = String::new();
        Text::new(Pieces(bytes, piece)).read_to_string(&mut text).unwrap();
        text
    }

    #[test]
    fn utf16_of_either_order_is_read_however_it_arrives() {
        let text = format!("G21 ; Größe \u{1f600}\r\n{}", "G1 X1\n".repeat(3000));
        let little = text.encode_utf16().flat_map(u16::to_le_bytes);
        let little: Vec<u8> = [0xff, 0xfe].into_iter().chain(little).collect();
        let big = text.encode_utf16().flat_map(u16::to_be_bytes);
        let big: Vec<u8> = [0xfe, 0xff].into_iter().chain(big).collect();
        for piece in [1, 2, 3, 1000, usize::MAX] {
            for bytes in [&little, &big] {
                assert!(decoded(bytes, piece) == text, "{piece}");
            }
            assert!(decoded(text.as_bytes(), piece) == text, "{piece}");
        }
        for short in ["", "G", "G1"] {
            assert_eq!(decoded(short.as_bytes(), 1), short);
        }
    }

    #[test]
    fn what_is_no_utf16_is_not_passed_over() {
        assert_eq!(decoded(&[0xff, 0xfe, b'G', 0, b'1'], 9), "G\u{fffd}");
        assert_eq!(decoded(&[0xff, 0xfe, 0x00, 0xd8, b'1', 0], 9), "\u{fffd}1");
    }
}
