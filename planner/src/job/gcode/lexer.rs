//! Words of a line: a letter and a number, and what may stand around them.
//!
//! Own rather than the crate `gcode` (0.7), which reads numbers as `f32`: seven digits cannot hold
//! a coordinate to the nanometre, and its recovery from errors would skip what must be refused.

use std::ops::Range;

use machine::gcode_settings::WordMeanings;

use super::characters;
use super::error::Refusal;
use super::expression::{Parameters, Reader, Target};
use super::lines::character;
use super::parameters;

/// Largest magnitude of a number in a program: far beyond any machine, and small enough that no
/// sum or product of such numbers overflows.
const LARGEST: f64 = 1e9;

/// What some editors begin a file with.
const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();

/// Powers of ten that a double holds exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// A letter and its number.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Word {
    /// The letter in upper case.
    pub(super) letter: u8,
    pub(super) number: f64,
    /// Bytes of the line.
    pub(super) span: Range<usize>,
}

/// What a line has next.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Token {
    Word(Word),
    /// A further power of a cluster, `:2` of `S1:2`.
    Further(f64, Range<usize>),
    /// `#1=2`: what is set to what.
    Setting(Target, f64),
    /// `O` or `:` that begins a line, with its place.
    Program(usize),
    /// `/` as the first thing of a line.
    Delete,
    /// `%`, with its place.
    Tape(usize),
}

/// Reads the tokens of one line from left to right, without allocating.
pub(super) struct Words<'a> {
    line: &'a [u8],
    at: usize,
    /// Whether anything but blanks and comments has been read.
    begun: bool,
    /// Whether that was a line number and nothing else.
    numbered: bool,
    /// Whether the last word was S.
    after_power: bool,
    words: &'a WordMeanings,
    parameters: &'a dyn Parameters,
}

impl<'a> Words<'a> {
    /// Over the bytes of one `line`, without its line feed.
    pub(super) fn new(
        line: &'a [u8],
        words: &'a WordMeanings,
        parameters: &'a dyn Parameters,
    ) -> Self {
        Self { line, at: 0, begun: false, numbered: false, after_power: false, words, parameters }
    }

    /// Over the first line of a program: some editors begin a file with a byte order mark.
    pub(super) fn first(
        line: &'a [u8],
        words: &'a WordMeanings,
        parameters: &'a dyn Parameters,
    ) -> Self {
        let mut at = 0;
        while line[at..].starts_with(BYTE_ORDER_MARK) {
            at += BYTE_ORDER_MARK.len();
        }
        Self { at, ..Self::new(line, words, parameters) }
    }

    /// The next token, `None` at the end of the line.
    pub(super) fn next(&mut self) -> Result<Option<Token>, Box<Refusal>> {
        loop {
            let Some(byte) = self.peek() else { return Ok(None) };
            let first = !self.begun;
            match byte {
                b' ' | b'\t' | b'\r' => self.at += 1,
                b'(' => self.comment()?,
                b';' => self.at = self.line.len(),
                b'/' if first => {
                    self.begun = true;
                    return Ok(Some(Token::Delete));
                }
                b'%' => {
                    self.begun = true;
                    self.at += 1;
                    return Ok(Some(Token::Tape(self.at - 1)));
                }
                b'O' | b'o' | b':' if first || self.numbered => {
                    self.begun = true;
                    self.at += 1;
                    return Ok(Some(Token::Program(self.at - 1)));
                }
                _ if byte.is_ascii_alphabetic() => {
                    let letter = byte.to_ascii_uppercase();
                    self.begun = true;
                    self.numbered = first && letter == b'N';
                    self.after_power = letter == b'S';
                    return self.word(letter).map(|word| Some(Token::Word(word)));
                }
                b'#' => {
                    self.begun = true;
                    self.numbered = false;
                    return self.setting().map(Some);
                }
                b':' if self.after_power => {
                    let Word { number, span, .. } = self.word(b':')?;
                    return Ok(Some(Token::Further(number, span)));
                }
                _ => return Err(self.stray()),
            }
        }
    }

    fn peek(&self) -> Option<u8> {
        self.line.get(self.at).copied()
    }

    fn blanks(&mut self) {
        while matches!(self.peek(), Some(b' ' | b'\t' | b'\r')) {
            self.at += 1;
        }
    }

    /// `#1=2`.
    fn setting(&mut self) -> Result<Token, Box<Refusal>> {
        let start = self.at;
        let mut reader = Reader::new(self.line, self.at, self.parameters);
        let refuse = |end: usize, message: String| {
            Err(Refusal::new(
                start..end,
                message,
                "parameter",
                "a line that begins with # sets a parameter, as #1=2.5 does; a comment begins with ; or \
                 stands in ( )",
            ))
        };
        let target = match reader.target() {
            Ok(target) => target,
            Err(refusal) if refusal.is_of_values() => return Err(refusal),
            Err(refusal) => return refuse(refusal.span.end, refusal.message),
        };
        reader.blanks();
        if self.line.get(reader.at) != Some(&b'=') {
            return refuse(reader.at, "a parameter has no value after it".to_owned());
        }
        if let Some(message) = parameters::refusal(&target) {
            return refuse(reader.at, message);
        }
        reader.at += 1;
        let value = reader.value()?;
        self.at = reader.at;
        self.after_number('#')?;
        Ok(Token::Setting(target, value))
    }

    /// Passes over `( … )`.
    fn comment(&mut self) -> Result<(), Box<Refusal>> {
        let start = self.at;
        let mut depth = 1_u32;
        self.at += 1;
        while let Some(byte) = self.peek() {
            match byte {
                b')' => {
                    self.at += 1;
                    depth -= 1;
                    if depth == 0 {
                        return Ok(());
                    }
                }
                b'(' if self.words.nested_comments => {
                    self.at += 1;
                    depth += 1;
                }
                b'(' => {
                    return Err(Refusal::new(
                        self.at..self.at + 1,
                        "a comment begins inside a comment",
                        "second (",
                        "close the first comment with ) before, or set gcode.nested_comments = true",
                    ));
                }
                _ => self.at += 1,
            }
        }
        Err(Refusal::new(
            start..start + 1,
            "a comment is not closed on its line",
            "opened here",
            "close it with ) on the same line, or begin it with ;",
        ))
    }

    fn word(&mut self, letter: u8) -> Result<Word, Box<Refusal>> {
        let start = self.at;
        self.at += 1;
        self.blanks();
        let name = char::from(letter);
        let digits = self.at;
        let is_bare = !matches!(self.peek(), Some(b'0'..=b'9' | b'.' | b'+' | b'-'));
        if letter == b'I' && is_bare && self.words.printer_words {
            return Ok(Word { letter, number: 0.0, span: start..start + 1 });
        }
        let negative = self.peek() == Some(b'-');
        if negative || self.peek() == Some(b'+') {
            self.at += 1;
            self.blanks();
        }
        let unsigned = self.at;
        if matches!(self.peek(), Some(b'#' | b'[' | b'A'..=b'Z' | b'a'..=b'z'))
            && letter != b'N'
            && Reader::begins(self.line, digits)
        {
            return self.computed(letter, start, digits);
        }
        let mut mantissa = 0_u64;
        let mut count = 0_usize;
        let mut decimals = None;
        loop {
            match self.peek() {
                Some(digit @ b'0'..=b'9') => {
                    mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit - b'0'));
                    count += 1;
                    if let Some(places) = &mut decimals {
                        *places += 1;
                    }
                }
                Some(b'.') if decimals.is_none() => decimals = Some(0_usize),
                _ => break,
            }
            self.at += 1;
        }
        if count == 0 {
            return Err(self.no_number(name, start, digits));
        }
        // Up to 15 digits the mantissa and the power of ten are exact, and so their quotient is
        // the correctly rounded number; a longer one takes the library's way to the same.
        let places = decimals.unwrap_or(0);
        let magnitude = if count <= 15 {
            mantissa as f64 / POWERS[places]
        } else {
            let digits = std::str::from_utf8(&self.line[unsigned..self.at]).unwrap_or("");
            digits.parse().unwrap_or(f64::INFINITY)
        };
        if magnitude > LARGEST {
            return Err(self.too_large(name, start));
        }
        let number = if negative { -magnitude } else { magnitude };
        let span = start..self.at;
        self.after_number(name)?;
        Ok(Word { letter, number, span })
    }

    fn too_large(&self, name: char, start: usize) -> Box<Refusal> {
        Refusal::new(
            start..self.at,
            format!("the number of {name} is too large"),
            format!("beyond {LARGEST:e}"),
            format!("numbers lie between -{LARGEST:e} and {LARGEST:e}"),
        )
    }

    /// A word whose number is a parameter, a function or an expression.
    fn computed(&mut self, letter: u8, start: usize, at: usize) -> Result<Word, Box<Refusal>> {
        let mut reader = Reader::new(self.line, at, self.parameters);
        let number = reader.value()?;
        self.at = reader.at;
        let name = char::from(letter);
        if number.abs() > LARGEST {
            return Err(self.too_large(name, start));
        }
        let span = start..self.at;
        self.after_number(name)?;
        Ok(Word { letter, number, span })
    }

    /// What stands where the number of a word was due.
    fn no_number(&self, name: char, start: usize, digits: usize) -> Box<Refusal> {
        let wanted = match name {
            'G' | 'M' => format!("write a number after {name}, such as {name}1"),
            _ => format!("write a decimal number after {name}, such as {name}10 or {name}2.5"),
        };
        match self.line.get(digits) {
            Some(byte) if !(b' '..=b'~').contains(byte) && *byte != b'\t' => {
                let (character, length) = character(self.line, digits);
                Refusal::new(
                    digits..digits + length,
                    format!("{name} has no number, but {}", characters::name(character)),
                    "not a number",
                    characters::instead(character).map_or(wanted, str::to_owned),
                )
            }
            _ => Refusal::new(
                start..self.at.max(start + 1),
                format!("{name} has no number"),
                "no number",
                match name {
                    'I' => format!("{wanted}; M3 I is Marlin's: set gcode.dialect = \"marlin\""),
                    _ => wanted,
                },
            ),
        }
    }

    /// Refuses what would read as part of the number that has just ended.
    fn after_number(&mut self, name: char) -> Result<(), Box<Refusal>> {
        self.blanks();
        let at = self.at;
        match self.peek() {
            Some(b'0'..=b'9' | b'.' | b'+' | b'-') => Err(Refusal::new(
                at..at + 1,
                format!("{name} has more than one number"),
                "second number",
                "write one number after each letter, without blanks inside it",
            )),
            Some(b',') => Err(Refusal::new(
                at..at + 1,
                "a comma cannot stand in a number",
                "comma",
                "write the decimal sign as a point",
            )),
            _ => Ok(()),
        }
    }

    /// What stands where a word was due.
    fn stray(&self) -> Box<Refusal> {
        let (character, length) = character(self.line, self.at);
        let span = self.at..self.at + length;
        let (message, help) = match character {
            ':' => ("a : stands where no power is before it".to_owned(), "a cluster is S1:2:3"),
            '[' | ']' => {
                ("an expression without a letter".to_owned(), "a word is a letter and a number: X[1+2]")
            }
            '*' => ("checksums (*) are not supported".to_owned(), "save the program without them"),
            '/' => (
                "/ stands inside a line".to_owned(),
                "block delete (/) is the first character of a line",
            ),
            ')' => ("a comment is closed that was not opened".to_owned(), "open it with ("),
            '0'..='9' | '.' | '+' | '-' => {
                ("a number without a letter".to_owned(), "a word is a letter and a number: X10")
            }
            '$' | '?' | '!' | '~' | '\u{18}' => {
                return Refusal::new(
                    span,
                    format!("{} is a sender's command, not a program's", characters::command(character)),
                    "not a word",
                    characters::command_advice(character),
                );
            }
            _ => (
                format!("unexpected {}", characters::name(character)),
                characters::instead(character).unwrap_or(
                    "a line consists of words such as G1, X10 or F600, and of comments in ( ) or after ;",
                ),
            ),
        };
        Refusal::new(span, message, "not a word", help)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use machine::gcode_settings::Dialect;

    struct NoParameters;

    impl Parameters for NoParameters {
        fn numbered(&self, _index: u32) -> Option<f64> {
            Some(2.0)
        }

        fn named(&self, _name: &str) -> Option<f64> {
            None
        }
    }

    fn words(line: &str) -> Result<Vec<(char, f64)>, Box<Refusal>> {
        let meanings = Dialect::Standard.meanings();
        let store = NoParameters;
        let mut words = Words::new(line.as_bytes(), &meanings, &store);
        let mut read = Vec::new();
        while let Some(token) = words.next()? {
            match token {
                Token::Word(word) => read.push((char::from(word.letter), word.number)),
                Token::Further(number, _) => read.push((':', number)),
                Token::Program(_) => read.push(('O', 0.0)),
                other => panic!("{other:?}"),
            }
        }
        Ok(read)
    }

    #[test]
    fn a_word_is_read_whatever_its_case_and_blanks() {
        assert_eq!(words("g0x10 y 2").unwrap(), [('G', 0.0), ('X', 10.0), ('Y', 2.0)]);
        assert_eq!(
            words("N10 G01 X-.5 Y+5. Z - 0.25;end").unwrap(),
            [('N', 10.0), ('G', 1.0), ('X', -0.5), ('Y', 5.0), ('Z', -0.25)]
        );
        assert_eq!(
            words("S1:0.5: 0 X1").unwrap(),
            [('S', 1.0), (':', 0.5), (':', 0.0), ('X', 1.0)]
        );
        assert_eq!(
            words("X#1 Y-[1+#1]z sin[30]").unwrap(),
            [('X', 2.0), ('Y', -3.0), ('Z', 0.49999999999999994)]
        );
        assert_eq!(words("(a) X1 (b;c) Y2 (d)\r").unwrap(), [('X', 1.0), ('Y', 2.0)]);
    }

    #[test]
    fn a_number_is_the_nearest_double() {
        for text in [
            "0.1",
            "123.456",
            "99999.9999999999",
            "0.12345678901234567890123",
            "1.00000000000000000000000000000001",
            "000000000000000000000000000007.25",
            "999999999.99999",
            "0.30000000000000004",
        ] {
            let expected: f64 = text.parse().unwrap();
            assert_eq!(words(&format!("X{text}")).unwrap(), [('X', expected)], "{text}");
        }
    }

    #[test]
    fn what_is_not_a_word_is_named_with_its_place() {
        let check = |line: &str, start: usize, message: &str| {
            let refusal = words(line).unwrap_err();
            assert_eq!((refusal.span.start, refusal.message.as_str()), (start, message), "{line}");
        };
        check("G1 X", 3, "X has no number");
        check("G1 X Y2", 3, "X has no number");
        check("X-", 0, "X has no number");
        check("X.", 0, "X has no number");
        check("Xnan", 0, "X has no number");
        check("X#<a>", 1, "#<a> has no value");
        check("X[1+2", 1, "the expression is not closed by ]");
        check("X[1 2]", 4, "an operator or ] is missing");
        check("X1 [2]", 3, "an expression without a letter");
        check("# 4mm x 4mm square", 0, "a parameter has no value after it");
        check("#this", 0, "this is no function");
        check("#5420=1", 0, "#5420 is not set by a program: those are #1 to #5000");
        check("#<_x>=1", 0, "#<_x> is predefined and cannot be set");
        check("X1:2", 2, "a : stands where no power is before it");
        check("X1 2", 3, "X has more than one number");
        check("X1.2.3", 4, "X has more than one number");
        check("X1,5", 2, "a comma cannot stand in a number");
        check("X2000000000", 0, "the number of X is too large");
        check("G1 10", 3, "G has more than one number");
        check("10", 0, "a number without a letter");
        check("X1 (a", 3, "a comment is not closed on its line");
        check("(a (b) c)", 3, "a comment begins inside a comment");
        check("X1 )", 3, "a comment is closed that was not opened");
        check("X1 é", 3, "unexpected character 'é' (U+00E9)");
        check("G1\u{a0}X1", 2, "unexpected no-break space (U+00A0)");
        check("G1 X\u{2013}20", 4, "X has no number, but en dash (U+2013)");
        check("$H", 0, "$ is a sender's command, not a program's");
        check("G0 X1 !", 6, "! is a sender's command, not a program's");
        check("\u{18}", 0, "ctrl-X is a sender's command, not a program's");
        check("X1*71", 2, "checksums (*) are not supported");
        check("X1 / Y", 3, "/ stands inside a line");
    }
}
