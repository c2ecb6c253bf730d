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

/// The number in an attribute; `None` where it is none, or not finite.
#[cfg(feature = "lightburn")]
pub(crate) fn number(node: roxmltree::Node<'_, '_>, name: &str) -> Option<f64> {
    let value: f64 = node.attribute(name)?.trim().parse().ok()?;
    value.is_finite().then_some(value)
}

pub(crate) fn too_many() -> ReadError {
    ReadError::new(
        format!("the drawing has more than {MOST_ELEMENTS} elements"),
        "divide it into several files, or join its paths",
    )
}

#[cfg(test)]
mod tests {
    use super::{Lines, parse};
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
}
