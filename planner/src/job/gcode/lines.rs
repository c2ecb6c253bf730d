//! A program line by line, through a buffer whose size does not depend on the program's length.

use std::borrow::Cow;
use std::io::{self, ErrorKind, Read};
use std::ops::Range;

/// What is read of a file at a time [bytes].
const CHUNK: usize = 1 << 16;

/// The longest line [bytes]. No program that a machine can follow has one; a file without line feeds
/// is something else, and is not worth the memory.
pub(super) const LONGEST_LINE: usize = 1 << 20;

/// Why there is no next line.
#[derive(Debug)]
pub(super) enum NoLine {
    /// The source cannot be read on.
    Unreadable(io::Error),
    /// It is longer than [`LONGEST_LINE`].
    TooLong,
}

/// The lines of a program, with the one before at hand for messages.
#[derive(Debug)]
pub(super) struct Lines<R> {
    source: R,
    buffer: Vec<u8>,
    /// How much of the buffer holds text.
    filled: usize,
    /// Where the line before the present one is, empty at the first.
    before: Range<usize>,
    /// Where the present line is, without its line feed.
    line: Range<usize>,
    /// Where the next line begins.
    next: usize,
    /// Whether the source has no more.
    ended: bool,
}

impl<R: Read> Lines<R> {
    pub(super) fn new(source: R) -> Self {
        Self {
            source,
            buffer: vec![0; CHUNK],
            filled: 0,
            before: 0..0,
            line: 0..0,
            next: 0,
            ended: false,
        }
    }

    /// Goes to the next line. Gives back whether there is one.
    pub(super) fn advance(&mut self) -> Result<bool, NoLine> {
        let Some(end) = self.end_of_next()? else { return Ok(false) };
        self.before = std::mem::replace(&mut self.line, self.next..end);
        self.next = (end + 1).min(self.filled);
        Ok(true)
    }

    /// The present line, without its line feed.
    pub(super) fn line(&self) -> &[u8] {
        &self.buffer[self.line.clone()]
    }

    /// The present line, `number` from 1, as text between those before and after it, for a message.
    pub(super) fn around(&mut self, number: u64) -> Vec<String> {
        // What cannot be read any more is left out of the message, which is about another line.
        let after = self.end_of_next().ok().flatten().map(|end| self.next..end);
        let before = (number > 1).then(|| self.before.clone());
        [before, Some(self.line.clone()), after]
            .into_iter()
            .flatten()
            .map(|range| decode(&self.buffer[range]).into_owned())
            .collect()
    }

    /// Where the next line ends; `None` after the last.
    fn end_of_next(&mut self) -> Result<Option<usize>, NoLine> {
        let mut searched = self.next;
        loop {
            let fresh = &self.buffer[searched..self.filled];
            if let Some(length) = fresh.iter().position(|&byte| byte == b'\n') {
                return Ok(Some(searched + length));
            }
            if self.ended {
                return Ok((self.next < self.filled).then_some(self.filled));
            }
            let begun = self.filled - self.next;
            if begun > LONGEST_LINE {
                return Err(NoLine::TooLong);
            }
            self.fill().map_err(NoLine::Unreadable)?;
            searched = self.next + begun;
        }
    }

    /// Reads on, and lets go of all text before the two lines that are still wanted.
    fn fill(&mut self) -> io::Result<()> {
        let kept = if self.before.is_empty() { self.line.start } else { self.before.start };
        self.buffer.copy_within(kept..self.filled, 0);
        for place in [&mut self.before, &mut self.line] {
            *place = place.start.saturating_sub(kept)..place.end.saturating_sub(kept);
        }
        self.filled -= kept;
        self.next -= kept;
        if self.buffer.len() < self.filled + CHUNK {
            self.buffer.resize(self.filled + CHUNK, 0);
        }
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

    /// Gives out its text in pieces of one length, as a slow pipe does.
    struct Pieces<'a>(&'a [u8], usize);

    impl Read for Pieces<'_> {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            let length = self.1.min(self.0.len()).min(into.len());
            let (piece, rest) = self.0.split_at(length);
            into[..length].copy_from_slice(piece);
            self.0 = rest;
            Ok(length)
        }
    }

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
    fn the_lines_around_the_present_one_are_at_hand() {
        let text = (1..=40_000).map(|number| format!("N{number}\n")).collect::<String>();
        let mut lines = Lines::new(Pieces(text.as_bytes(), 1000));
        for number in 1..=40_000_u64 {
            assert!(lines.advance().unwrap());
            let around: Vec<String> = (number.max(2) - 1..=(number + 1).min(40_000))
                .map(|number| format!("N{number}"))
                .collect();
            assert_eq!(lines.around(number), around);
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
