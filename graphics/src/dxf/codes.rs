//! The pairs of group code and value that a DXF file consists of, as text or binary.

use crate::ReadError;

/// What a binary file begins with.
pub(super) const SENTINEL: &[u8] = b"AutoCAD Binary DXF\r\n\x1a\0";

/// Pairs of a file: more take too much memory.
const MOST_PAIRS: usize = 8_000_000;

/// One value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pair<'a> {
    pub(super) code: i32,
    /// Line of the code in a text file, from 1; 0 in a binary one.
    pub(super) line: u32,
    value: Value<'a>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Value<'a> {
    Text(&'a str),
    Real(f64),
    Whole(i64),
}

impl<'a> Pair<'a> {
    /// The value as text; of a number in a binary file nothing.
    pub(super) fn text(&self) -> &'a str {
        match self.value {
            Value::Text(text) => text,
            _ => "",
        }
    }

    /// The value as a number; `None` where it is none, or not finite.
    pub(super) fn real(&self) -> Option<f64> {
        let value = match self.value {
            Value::Text(text) => text.trim().parse().ok()?,
            Value::Real(value) => value,
            Value::Whole(value) => value as f64,
        };
        value.is_finite().then_some(value)
    }

    /// The value as a whole number.
    pub(super) fn whole(&self) -> Option<i64> {
        match self.value {
            Value::Text(text) => text.trim().parse().ok(),
            Value::Real(_) => None,
            Value::Whole(value) => Some(value),
        }
    }

    /// Whether it is this text under this code.
    pub(super) fn is(&self, code: i32, text: &str) -> bool {
        self.code == code && self.text().trim() == text
    }
}

/// The pairs of a text file.
///
/// # Errors
///
/// Where a group code is no number, or the last one has no value, with the line.
pub(super) fn of_text(text: &str) -> Result<Vec<Pair<'_>>, ReadError> {
    let mut pairs = Vec::new();
    let mut lines = text.lines().enumerate();
    while let Some((number, code)) = lines.next() {
        let line = u32::try_from(number + 1).unwrap_or(u32::MAX);
        if code.trim().is_empty() && lines.clone().all(|(_, rest)| rest.trim().is_empty()) {
            break;
        }
        let Ok(code) = code.trim().parse() else {
            return Err(ReadError::new(
                format!("\"{}\" is no group code", shortened(code.trim())),
                "a DXF file has a number on each odd line: save it again",
            )
            .at_line(u64::from(line)));
        };
        let Some((_, value)) = lines.next() else {
            return Err(cut_off().at_line(u64::from(line)));
        };
        push(&mut pairs, Pair { code, line, value: Value::Text(value) })?;
        if pairs.last().is_some_and(|pair| pair.is(0, "EOF")) {
            break;
        }
    }
    Ok(pairs)
}

fn shortened(text: &str) -> String {
    text.chars().take(20).collect()
}

fn cut_off() -> ReadError {
    ReadError::new("the file ends in the middle of a value", "copy or save it again")
}

fn push<'a>(pairs: &mut Vec<Pair<'a>>, pair: Pair<'a>) -> Result<(), ReadError> {
    if pairs.len() >= MOST_PAIRS {
        return Err(crate::read::too_large());
    }
    pairs.push(pair);
    Ok(())
}

/// The pairs of a binary file; its texts are as UTF-8 has them.
///
/// # Errors
///
/// Where it ends in the middle of a value, with the byte.
pub(super) fn of_binary(bytes: &[u8]) -> Result<Vec<Pair<'_>>, ReadError> {
    let rest = bytes.strip_prefix(SENTINEL).unwrap_or(bytes);
    // Until release 12 a code has one byte: the file begins with code 0 and SECTION.
    let is_old = rest.get(1) == Some(&b'S');
    let mut bytes = Bytes { rest };
    let mut pairs = Vec::new();
    while !bytes.rest.is_empty() {
        let at = rest.len() - bytes.rest.len() + SENTINEL.len();
        let Some(pair) = bytes.pair(is_old) else {
            let error = cut_off();
            return Err(ReadError { message: format!("{} at byte {at}", error.message), ..error });
        };
        push(&mut pairs, pair)?;
        if pair.is(0, "EOF") {
            break;
        }
    }
    Ok(pairs)
}

struct Bytes<'a> {
    rest: &'a [u8],
}

impl<'a> Bytes<'a> {
    fn pair(&mut self, is_old: bool) -> Option<Pair<'a>> {
        let code = match is_old {
            true => match self.take(1)? {
                [255] => i32::from(self.short()?),
                code => i32::from(code[0]),
            },
            false => i32::from(self.short()?),
        };
        // Group code value types, DXF reference.
        let value = match code {
            10..=59 | 110..=149 | 210..=239 | 460..=469 | 1010..=1059 => Value::Real(self.real()?),
            60..=79 | 170..=179 | 270..=289 | 370..=389 | 400..=409 | 1060..=1070 => {
                Value::Whole(self.short()?.into())
            }
            90..=99 | 420..=429 | 440..=459 | 1071 => {
                Value::Whole(i32::from_le_bytes(self.take(4)?.try_into().ok()?).into())
            }
            160..=169 => Value::Whole(i64::from_le_bytes(self.take(8)?.try_into().ok()?)),
            290..=299 => Value::Whole(self.take(1)?[0].into()),
            310..=319 | 1004 => {
                let length = self.take(1)?[0];
                self.take(length.into())?;
                Value::Text("")
            }
            _ => Value::Text(self.text()?),
        };
        Some(Pair { code, line: 0, value })
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(count)?;
        self.rest = rest;
        Some(taken)
    }

    fn short(&mut self) -> Option<i16> {
        Some(i16::from_le_bytes(self.take(2)?.try_into().ok()?))
    }

    fn real(&mut self) -> Option<f64> {
        Some(f64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    fn text(&mut self) -> Option<&'a str> {
        let length = self.rest.iter().position(|&byte| byte == 0)?;
        let text = self.take(length)?;
        self.take(1)?;
        // A name in another encoding up to where it is readable.
        Some(text.utf8_chunks().next().map_or("", |chunk| chunk.valid()))
    }
}

#[cfg(test)]
mod tests {
    use super::{SENTINEL, of_binary, of_text};

    #[test]
    fn text_is_read_with_lines() {
        let pairs = of_text("  0\nLINE\n 10\n 1.5\n0\nEOF\nrubbish\n").expect("pairs");
        assert_eq!(pairs.len(), 3);
        assert!(pairs[0].is(0, "LINE"));
        assert_eq!((pairs[1].code, pairs[1].real(), pairs[1].line), (10, Some(1.5), 3));
        assert_eq!(of_text("0\nLINE\nx\n1\n").expect_err("no code").line, Some(3));
        assert_eq!(of_text("0\nLINE\n10\n").expect_err("cut off").line, Some(3));
        assert_eq!(of_text("10\nnan\n").expect("pairs")[0].real(), None);
    }

    #[test]
    fn both_kinds_of_binary_files_are_read() {
        let old = [SENTINEL, b"\0SECTION\0\x0a", &1.5_f64.to_le_bytes(), b"\x3e\x05\0"].concat();
        let pairs = of_binary(&old).expect("pairs");
        assert!(pairs[0].is(0, "SECTION"));
        assert_eq!(pairs[1].real(), Some(1.5));
        assert_eq!((pairs[2].code, pairs[2].whole()), (62, Some(5)));
        let new = [SENTINEL, b"\0\0SECTION\0\x22\x01\x01\x5a\0\x07\0\0\0"].concat();
        let pairs = of_binary(&new).expect("pairs");
        assert_eq!((pairs[1].code, pairs[1].whole()), (290, Some(1)));
        assert_eq!((pairs[2].code, pairs[2].whole()), (90, Some(7)));
        assert!(of_binary(&new[..new.len() - 2]).expect_err("cut off").message.contains("byte"));
    }
}
