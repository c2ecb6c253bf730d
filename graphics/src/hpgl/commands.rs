//! The commands of a plotter file: two letters, and numbers.

use crate::ReadError;
use crate::read::notes::Notes;

/// Numbers of one command: more are in no file.
const MOST_NUMBERS: usize = 2_000_000;

/// One command.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Command {
    /// Two capital letters.
    pub(super) name: [u8; 2],
    pub(super) numbers: Vec<f64>,
    pub(super) line: u64,
}

/// Reads commands one after the other.
#[derive(Debug)]
pub(super) struct Commands<'a> {
    bytes: &'a [u8],
    at: usize,
    line: u64,
    line_start: usize,
    /// What ends a label.
    terminator: u8,
}

impl<'a> Commands<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, line: 1, line_start: 0, terminator: 3 }
    }

    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    fn advance(&mut self) {
        if self.peek() == Some(b'\n') {
            self.line += 1;
            self.line_start = self.at + 1;
        }
        self.at += 1;
    }

    fn fault(&self, message: String, help: &str) -> ReadError {
        ReadError::new(message, help)
            .at_line(self.line)
            .at_column((self.at - self.line_start) as u64 + 1)
    }

    /// The next command; `None` at the end of the file.
    ///
    /// # Errors
    ///
    /// Where there is no command, or a number is at fault, with line and column.
    pub(super) fn next(&mut self, notes: &mut Notes) -> Result<Option<Command>, ReadError> {
        loop {
            match self.peek() {
                None => return Ok(None),
                Some(0x1b) => self.escape(notes),
                Some(byte) if byte.is_ascii_alphabetic() => break,
                Some(byte) if byte == b';' || byte == b',' || byte <= b' ' => self.advance(),
                Some(byte) => {
                    let shown = char::from(byte).escape_default();
                    return Err(self.fault(
                        format!("'{shown}' is no command of a plotter"),
                        "commands are two letters: is this an HPGL file?",
                    ));
                }
            }
        }
        let line = self.line;
        let first = self.peek().unwrap_or(b' ').to_ascii_uppercase();
        self.advance();
        let Some(second) = self.peek().filter(u8::is_ascii_alphabetic) else {
            return Err(self.fault(
                format!("'{}' is only half of a command", char::from(first)),
                "commands are two letters: is this an HPGL file?",
            ));
        };
        let name = [first, second.to_ascii_uppercase()];
        self.advance();
        match &name {
            b"LB" => {
                self.skip_to(self.terminator);
                return Ok(Some(Command { name, numbers: Vec::new(), line }));
            }
            b"DT" => {
                if let Some(byte) = self.peek().filter(|&byte| byte != b';') {
                    self.terminator = byte;
                    self.advance();
                }
                return Ok(Some(Command { name, numbers: Vec::new(), line }));
            }
            b"PE" => {
                self.skip_to(b';');
                return Ok(Some(Command { name, numbers: Vec::new(), line }));
            }
            b"CO" => {
                // A comment in quotation marks.
                self.skip_to(b';');
                return Ok(Some(Command { name, numbers: Vec::new(), line }));
            }
            _ => {}
        }
        let numbers = self.numbers()?;
        Ok(Some(Command { name, numbers, line }))
    }

    fn skip_to(&mut self, end: u8) {
        while let Some(byte) = self.peek() {
            self.advance();
            if byte == end {
                return;
            }
        }
    }

    /// A command of the device: `ESC .` and a letter, with numbers up to a colon, or `ESC % … letter`.
    fn escape(&mut self, notes: &mut Notes) {
        notes.add("a command of the device (escape) is left out", self.line);
        self.advance();
        match self.peek() {
            Some(b'.') => {
                self.advance();
                let has_numbers = matches!(self.peek(), Some(b'@' | b'H'..=b'N' | b'P'..=b'T'));
                self.advance_in_file();
                if has_numbers {
                    self.skip_to(b':');
                }
            }
            Some(b'%') => {
                while let Some(byte) = self.peek() {
                    self.advance();
                    if byte.is_ascii_alphabetic() {
                        return;
                    }
                }
            }
            _ => self.advance_in_file(),
        }
    }

    fn advance_in_file(&mut self) {
        if self.peek().is_some() {
            self.advance();
        }
    }

    fn numbers(&mut self) -> Result<Vec<f64>, ReadError> {
        let mut numbers = Vec::new();
        loop {
            match self.peek() {
                Some(b',') => self.advance(),
                Some(byte) if byte <= b' ' && byte != 0x1b => self.advance(),
                Some(b'0'..=b'9' | b'+' | b'-' | b'.') => {
                    if numbers.len() >= MOST_NUMBERS {
                        return Err(crate::read::too_large());
                    }
                    numbers.push(self.number()?);
                }
                _ => return Ok(numbers),
            }
        }
    }

    fn number(&mut self) -> Result<f64, ReadError> {
        let rest = &self.bytes[self.at..];
        let is_part = |(place, &byte): (usize, &u8)| match byte {
            b'0'..=b'9' | b'.' => true,
            b'+' | b'-' => place == 0,
            _ => false,
        };
        let length = rest.iter().enumerate().take_while(|&part| is_part(part)).count();
        let text = core::str::from_utf8(&rest[..length]).unwrap_or("");
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => {
                self.at += length;
                Ok(number)
            }
            _ => {
                let text: String = text.chars().take(20).collect();
                Err(self.fault(format!("\"{text}\" is no number"), "give a number such as 400"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Command, Commands};
    use crate::ReadError;
    use crate::read::notes::Notes;

    fn all(text: &[u8]) -> Result<Vec<Command>, ReadError> {
        let mut commands = Commands::new(text);
        let mut notes = Notes::default();
        let mut found = Vec::new();
        while let Some(command) = commands.next(&mut notes)? {
            found.push(command);
        }
        Ok(found)
    }

    #[test]
    fn commands_need_no_separators() {
        let found = all(b"\x1b.(;IN;SP1PU100,200PD-5 -6+7.5-8;\npa;\x1b.M10;20:LBHi, PU!\x03CI4")
            .expect("all");
        let names: Vec<&[u8]> = found.iter().map(|command| &command.name[..]).collect();
        assert_eq!(names, [&b"IN"[..], b"SP", b"PU", b"PD", b"PA", b"LB", b"CI"]);
        assert_eq!(found[3].numbers, [-5.0, -6.0, 7.5, -8.0]);
        assert_eq!(found[4].line, 2);
    }

    #[test]
    fn a_fault_has_line_and_column() {
        let error = all(b"IN;\nPD1,2,#").expect_err("no command");
        assert_eq!((error.line, error.column), (Some(2), Some(7)), "{error}");
        let error = all(b"PD1.2.3").expect_err("no number");
        assert_eq!((error.line, error.column), (Some(1), Some(3)), "{error}");
        assert!(all(b"P1").is_err());
    }
}
