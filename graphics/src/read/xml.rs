//! XML documents within bounds.

use roxmltree::{Document, ParsingOptions};

use super::{MOST_DEPTH, MOST_ELEMENTS};
use crate::ReadError;

/// Where the lines of a text begin.
#[derive(Debug)]
pub(crate) struct Lines {
    ends: Vec<usize>,
}

impl Lines {
    pub(crate) fn new(text: &str) -> Self {
        let ends = text.bytes().enumerate().filter(|&(_, byte)| byte == b'\n');
        Self { ends: ends.map(|(place, _)| place).collect() }
    }

    /// The line of a byte, from 1.
    pub(crate) fn of(&self, place: usize) -> u64 {
        self.ends.partition_point(|&end| end < place) as u64 + 1
    }
}

/// The text of a file in UTF-8, or in UTF-16 with a byte order mark.
///
/// # Errors
///
/// Where it is not text, with its place.
pub(crate) fn text(bytes: &[u8]) -> Result<String, ReadError> {
    let wide = |from: fn([u8; 2]) -> u16| {
        let units = bytes[2..].chunks_exact(2).map(|pair| from([pair[0], pair[1]]));
        char::decode_utf16(units).map(|unit| unit.unwrap_or('\u{fffd}')).collect()
    };
    match bytes {
        [0xff, 0xfe, ..] => return Ok(wide(u16::from_le_bytes)),
        [0xfe, 0xff, ..] => return Ok(wide(u16::from_be_bytes)),
        _ => {}
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    match core::str::from_utf8(bytes) {
        Ok(text) => Ok(text.to_owned()),
        Err(_) if is_latin(bytes) => Ok(bytes.iter().map(|&byte| char::from(byte)).collect()),
        Err(error) => {
            let line = bytes[..error.valid_up_to()].iter().filter(|&&byte| byte == b'\n').count();
            Err(ReadError::new("the file is not text in UTF-8", "save it as UTF-8")
                .at_line(line as u64 + 1))
        }
    }
}

/// Whether the declaration of a document says ISO 8859-1, whose bytes are characters.
fn is_latin(bytes: &[u8]) -> bool {
    let head = bytes[..bytes.len().min(200)].to_ascii_lowercase();
    let head = String::from_utf8_lossy(&head).into_owned();
    let declaration = head.split("?>").next().unwrap_or("");
    declaration.contains("iso-8859-1") || declaration.contains("windows-1252")
}

/// A document of bounded size and depth.
///
/// # Errors
///
/// Where it is not well formed, with line and column, or exceeds a bound.
pub(crate) fn parse(text: &str) -> Result<Document<'_>, ReadError> {
    let options = ParsingOptions {
        allow_dtd: true,
        nodes_limit: u32::try_from(4 * MOST_ELEMENTS).unwrap_or(u32::MAX),
        ..ParsingOptions::default()
    };
    let document = Document::parse_with_options(text, options).map_err(|error| match error {
        roxmltree::Error::NodesLimitReached => too_many(),
        error => {
            let place = error.pos();
            // The place is said by the fields; the message of roxmltree ends with it.
            let message = error.to_string();
            let message = message.split(" at ").next().unwrap_or(&message);
            ReadError::new(format!("the file is not well-formed XML: {message}"), "save it again")
                .at_line(u64::from(place.row))
                .at_column(u64::from(place.col))
        }
    })?;
    let mut depths = vec![0_u32; 1];
    let mut elements = 0;
    for node in document.descendants() {
        let above = node.parent().map_or(0, |parent| depths[parent.id().get_usize()]);
        depths.resize(node.id().get_usize() + 1, 0);
        depths[node.id().get_usize()] = above + 1;
        elements += usize::from(node.is_element());
        if above as usize > MOST_DEPTH {
            let line = text[..node.range().start.min(text.len())].matches('\n').count();
            return Err(ReadError::new(
                format!("elements are nested more than {MOST_DEPTH} deep"),
                "ungroup the drawing",
            )
            .at_line(line as u64 + 1));
        }
    }
    if elements > MOST_ELEMENTS {
        return Err(too_many());
    }
    Ok(document)
}

pub(crate) fn too_many() -> ReadError {
    ReadError::new(
        format!("the drawing has more than {MOST_ELEMENTS} elements"),
        "divide it into several files, or join its paths",
    )
}

#[cfg(test)]
mod tests {
    use super::{Lines, parse, text};
    use crate::read::{MOST_DEPTH, MOST_ELEMENTS};

    #[test]
    fn lines_count_from_one() {
        let lines = Lines::new("ab\ncd\n\nef");
        let found: Vec<u64> = [0, 2, 3, 6, 7, 8].into_iter().map(|at| lines.of(at)).collect();
        assert_eq!(found, [1, 1, 2, 3, 4, 4]);
    }

    #[test]
    fn a_fault_has_its_line_and_column() {
        let error = parse("<a>\n  <b></c>\n</a>").expect_err("mismatched");
        assert_eq!((error.line, error.column), (Some(2), Some(6)), "{error}");
    }

    #[test]
    fn depth_and_number_are_bounded() {
        let deep = format!("{}{}", "<g>".repeat(MOST_DEPTH), "</g>".repeat(MOST_DEPTH));
        assert!(parse(&deep).is_ok());
        let deeper = format!("{}{}", "<g>".repeat(100_000), "</g>".repeat(100_000));
        assert!(parse(&deeper).is_err());
        let many = format!("<g>{}</g>", "<a/>".repeat(MOST_ELEMENTS));
        assert!(parse(&many).is_err());
    }

    #[test]
    fn encodings_with_a_mark_are_read() {
        assert_eq!(text(b"\xef\xbb\xbf<a/>").expect("UTF-8"), "<a/>");
        assert_eq!(text(b"\xff\xfe<\0a\0").expect("UTF-16"), "<a");
        assert_eq!(text(b"\xfe\xff\0<\0a").expect("UTF-16"), "<a");
        let latin = b"<?xml version='1.0' encoding='ISO-8859-1'?><a>\xe4</a>";
        assert!(text(latin).expect("declared").ends_with("<a>\u{e4}</a>"));
        assert_eq!(text(b"a\n\xff").expect_err("not text").line, Some(2));
    }
}
