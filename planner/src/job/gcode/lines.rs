//! A program line by line, through a buffer whose size does not depend on the program's length.

use std::borrow::Cow;
use std::io::{self, ErrorKind, Read};
use std::ops::Range;

use super::encoding::Text;

/// What is read of a file at a time [bytes].
const CHUNK: usize = 1 << 16;

/// The longest line [bytes]. No program that a machine can follow has one; a file without line feeds
/// is something else, and is not worth the memory.
pub(super) const LONGEST_LINE: usize = 1 << 20;

/// What is held of a program that goes back to earlier lines [bytes].
pub(super) const MOST_HELD: usize = 64 << 20;

/// Why there is no next line.
#[derive(Debug)]
pub(super) enum NoLine {
    /// The source cannot be read on.
    Unreadable(io::Error),
    /// It is longer than [`LONGEST_LINE`].
    TooLong,
    /// More than [`MOST_HELD`] would have to be held.
    TooMuchHeld,
}

/// A place in a program to come back to: that of the line after the present one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    /// Bytes of text before it.
    offset: u64,
    /// Lines before it.
    number: u64,
}

/// The present line for a message, with those around it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Around {
    /// The line before, the present one and the one after, as far as there are any.
    pub(super) lines: Vec<String>,
    /// Whether the first of them is the line before.
    pub(super) has_before: bool,
}

/// The lines of a program, with the one before at hand for messages. A line ends with a line feed, a
/// carriage return, or both.
#[derive(Debug)]
pub(super) struct Lines<R> {
    source: Text<R>,
    buffer: Vec<u8>,
    /// Bytes of text before the buffer.
    dropped: u64,
    /// Whether all text from here on is held, so that [`Self::go_to`] finds it.
    holds: bool,
    /// Number of the present line, from 1; 0 before the first.
    number: u64,
    /// How much of the buffer holds text.
    filled: usize,
    /// Where the line before the present one is, `None` at the first.
    before: Option<Range<usize>>,
    /// Where the present line is, without its end.
    line: Range<usize>,
    /// Where the next line begins.
    next: usize,
    /// Whether the source has no more.
    ended: bool,
}

impl<R: Read> Lines<R> {
    pub(super) fn new(source: R) -> Self {
        Self {
            source: Text::new(source),
            buffer: vec![0; CHUNK],
            dropped: 0,
            holds: false,
            number: 0,
            filled: 0,
            before: None,
            line: 0..0,
            next: 0,
            ended: false,
        }
    }

    /// Goes to the next line. Gives back whether there is one.
    pub(super) fn advance(&mut self) -> Result<bool, NoLine> {
        let Some((end, next)) = self.end_of_next()? else { return Ok(false) };
        let line = std::mem::replace(&mut self.line, self.next..end);
        self.before = (self.number > 0).then_some(line);
        self.next = next;
        self.number += 1;
        Ok(true)
    }

    /// The present line, without its end.
    pub(super) fn line(&self) -> &[u8] {
        &self.buffer[self.line.clone()]
    }

    /// Number of the present line, from 1; 0 before the first.
    pub(super) fn number(&self) -> u64 {
        self.number
    }

    /// Holds all text from the present line on.
    pub(super) fn hold(&mut self) {
        self.holds = true;
    }

    /// The place after the present line.
    pub(super) fn place(&self) -> Place {
        Place { offset: self.dropped + self.next as u64, number: self.number }
    }

    /// The place of the present line: after [`Self::go_to`] it comes again.
    pub(super) fn start(&self) -> Place {
        let offset = self.dropped + self.line.start as u64;
        Place { offset, number: self.number.saturating_sub(1) }
    }

    /// Goes to `place`: the next line is the one there. Its text must be held since it was passed.
    pub(super) fn go_to(&mut self, place: Place) {
        self.next = (place.offset.saturating_sub(self.dropped) as usize).min(self.filled);
        self.number = place.number;
        // The line before it, as far as it is held.
        let text = &self.buffer[..self.next];
        let text = text.strip_suffix(b"\n").unwrap_or(text);
        let text = text.strip_suffix(b"\r").unwrap_or(text);
        let start = text.iter().rposition(|&byte| is_end(byte)).map_or(0, |at| at + 1);
        self.line = start..text.len();
    }

    /// The present line as text, with those before and after it, for a message.
    pub(super) fn around(&mut self) -> Around {
        // What cannot be read any more is left out of the message, which is about another line.
        let after = self.end_of_next().ok().flatten().map(|(end, _)| self.next..end);
        let lines = [self.before.clone(), Some(self.line.clone()), after]
            .into_iter()
            .flatten()
            .map(|range| decode(&self.buffer[range]).into_owned())
            .collect();
        Around { lines, has_before: self.before.is_some() }
    }

    /// Where the next line ends, and where the one after it begins; `None` after the last.
    fn end_of_next(&mut self) -> Result<Option<(usize, usize)>, NoLine> {
        let mut searched = self.next;
        loop {
            let fresh = &self.buffer[searched..self.filled];
            if let Some(length) = fresh.iter().position(|&byte| is_end(byte)) {
                let end = searched + length;
                if self.buffer[end] == b'\n' {
                    return Ok(Some((end, end + 1)));
                }
                // A carriage return may have its line feed in what is read next.
                if end + 1 < self.filled || self.ended {
                    let has_feed = end + 1 < self.filled && self.buffer[end + 1] == b'\n';
                    return Ok(Some((end, end + 1 + usize::from(has_feed))));
                }
                searched = end;
            } else {
                if self.ended {
                    return Ok((self.next < self.filled).then_some((self.filled, self.filled)));
                }
                searched = self.filled;
            }
            let begun = self.filled - self.next;
            if begun > LONGEST_LINE {
                return Err(NoLine::TooLong);
            }
            let offset = searched - self.next;
            self.fill()?;
            searched = self.next + offset;
        }
    }

    /// Reads on, and lets go of all text before the two lines that are still wanted, unless it is held.
    fn fill(&mut self) -> Result<(), NoLine> {
        if self.holds {
            if self.filled > MOST_HELD {
                return Err(NoLine::TooMuchHeld);
            }
        } else {
            let kept = self.before.as_ref().map_or(self.line.start, |before| before.start);
            self.buffer.copy_within(kept..self.filled, 0);
            self.line = self.line.start - kept..self.line.end - kept;
            self.before = self.before.take().map(|line| line.start - kept..line.end - kept);
            self.filled -= kept;
            self.next -= kept;
            self.dropped += kept as u64;
        }
        if self.buffer.len() < self.filled + CHUNK {
            // Held text doubles its room, so that it is seldom moved.
            let room = if self.holds { 2 * self.filled } else { self.filled };
            self.buffer.resize(room + CHUNK, 0);
        }
        self.read().map_err(NoLine::Unreadable)
    }

    fn read(&mut self) -> io::Result<()> {
        loop {
            match self.source.read(&mut self.buffer[self.filled..]) {
                Ok(length) => {
                    self.filled += length;
                    self.ended = length == 0;
                    return Ok(());
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }
}

/// Whether a line ends with `byte`.
fn is_end(byte: u8) -> bool {
    byte == b'\n' || byte == b'\r'
}

/// A line as text. Many editors of G-code write comments in Latin-1: a line that is not UTF-8 is taken
/// for that, in which every byte is the character with its number, so that columns stay right.
pub(super) fn decode(line: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(line) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(line.iter().copied().map(char::from).collect()),
    }
}

/// The character at byte `at` of a line, and how many bytes it takes.
pub(super) fn character(line: &[u8], at: usize) -> (char, usize) {
    let rest = std::str::from_utf8(line).ok().and_then(|text| text.get(at..));
    match rest.and_then(|rest| rest.chars().next()) {
        Some(character) => (character, character.len_utf8()),
        None => (line.get(at).copied().map_or('\u{fffd}', char::from), 1),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::job::gcode::pieces::Pieces;

    fn read(text: &str, piece: usize) -> Vec<String> {
        let mut lines = Lines::new(Pieces(text.as_bytes(), piece));
        let mut read = Vec::new();
        while lines.advance().unwrap() {
            read.push(decode(lines.line()).into_owned());
        }
        read
    }

    #[test]
    fn lines_are_the_same_however_the_text_arrives() {
        let long = "x".repeat(3 * CHUNK);
        for text in ["", "\n", "a", "a\n", "a\nb", "\n\na\n\n", &format!("a\n{long}\nb\n{long}")] {
            let expected: Vec<&str> = text.split_terminator('\n').collect();
            for piece in [1, 2, 3, 1000, usize::MAX] {
                assert_eq!(read(text, piece), expected, "{piece}");
            }
        }
    }

    #[test]
    fn a_carriage_return_ends_a_line_alone_and_before_a_line_feed() {
        for (text, expected) in [
            ("a\rb\rc", vec!["a", "b", "c"]),
            ("a\r\nb\r\n", vec!["a", "b"]),
            ("a\r\rb\r", vec!["a", "", "b"]),
            ("\r\n\r\n", vec!["", ""]),
        ] {
            for piece in [1, 2, 3, usize::MAX] {
                assert_eq!(read(text, piece), expected, "{text:?} {piece}");
            }
        }
    }

    #[test]
    fn held_lines_can_be_read_again() {
        let text = (1..=40_000).map(|number| format!("N{number}\r\n")).collect::<String>();
        let mut lines = Lines::new(Pieces(text.as_bytes(), 1000));
        let mut place = None;
        for number in 1..=40_000_u64 {
            assert!(lines.advance().unwrap());
            if number == 20_000 {
                lines.hold();
                place = Some(lines.place());
            }
        }
        lines.go_to(place.unwrap());
        for number in 20_001..=40_000_u64 {
            assert!(lines.advance().unwrap());
            assert_eq!(lines.number(), number);
            let around = lines.around();
            assert!(around.has_before);
            assert_eq!(around.lines[..2], [format!("N{}", number - 1), format!("N{number}")]);
        }
        assert!(!lines.advance().unwrap());
        let mut lines = Lines::new(io::repeat(b'\n'));
        lines.hold();
        while let Ok(true) = lines.advance() {}
        assert!(matches!(lines.advance(), Err(NoLine::TooMuchHeld)));
    }

    #[test]
    fn the_lines_around_the_present_one_are_at_hand() {
        let text = (1..=40_000).map(|number| format!("N{number}\n")).collect::<String>();
        let mut lines = Lines::new(Pieces(text.as_bytes(), 1000));
        for number in 1..=40_000_u64 {
            assert!(lines.advance().unwrap());
            let around: Vec<String> = (number.max(2) - 1..=(number + 1).min(40_000))
                .map(|number| format!("N{number}"))
                .collect();
            assert_eq!(lines.around(), Around { lines: around, has_before: number > 1 });
        }
        assert!(!lines.advance().unwrap());
        assert!(lines.buffer.len() < 3 * CHUNK, "{}", lines.buffer.len());
    }

    #[test]
    fn a_line_without_end_is_not_kept() {
        let mut lines = Lines::new(io::repeat(b'x'));
        assert!(matches!(lines.advance(), Err(NoLine::TooLong)));
        assert!(lines.buffer.len() < 2 * LONGEST_LINE);
    }

    #[test]
    fn a_line_that_is_not_utf8_is_latin_1() {
        assert_eq!(decode(b"(Gr\xf6\xdfe)"), "(Größe)");
        assert_eq!(decode("(Größe)".as_bytes()), "(Größe)");
        assert_eq!(character("é1".as_bytes(), 0), ('é', 2));
        assert_eq!(character(b"\xe9\x80", 0), ('é', 1));
        assert_eq!(character(b"", 0), ('\u{fffd}', 1));
    }
}
