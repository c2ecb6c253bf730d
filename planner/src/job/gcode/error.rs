//! Why a program is refused: what was found, where, and what would be right.

use std::ops::Range;

use miette::{Diagnostic, MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};

use super::lines::{Around, decode};

/// A G-code program that cannot be marked as it stands.
#[derive(Debug, Clone, thiserror::Error, Diagnostic)]
#[error("{file}:{line}:{column}: {message}")]
pub struct GcodeError {
    /// Name of the file.
    pub file: String,
    /// Line, from 1.
    pub line: u64,
    /// Column in characters, from 1.
    pub column: u64,
    /// What is wrong, without the place.
    pub message: String,
    /// What stands at the place.
    pub found: String,
    /// What would be right.
    #[help]
    pub help: String,
    /// What else is wrong further down in the file, each thing once and a few at most.
    #[related]
    pub others: Vec<GcodeError>,
    #[source_code]
    excerpt: Excerpt,
    #[label("{found}")]
    span: SourceSpan,
}

/// A refusal while its place is still a range of bytes in its line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Refusal {
    pub(super) span: Range<usize>,
    pub(super) message: String,
    pub(super) found: String,
    pub(super) help: String,
    /// On what of the lines before it depends.
    pub(super) needs: Needs,
}

/// What a refusal depends on: where a line before could not be done, it may only follow from that.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Needs {
    /// Only its own line.
    Nothing,
    /// The motion in force.
    Motion,
    /// Motion and feed.
    Feed,
    /// Motion and place.
    Place,
    /// Parameters, and where the flow is.
    Values,
}

impl Refusal {
    /// Boxed, so that the way without errors stays small.
    pub(super) fn new(
        span: Range<usize>,
        message: impl Into<String>,
        found: impl Into<String>,
        help: impl Into<String>,
    ) -> Box<Self> {
        Box::new(Self {
            span,
            message: message.into(),
            found: found.into(),
            help: help.into(),
            needs: Needs::Nothing,
        })
    }

    /// The same, of which `needs` says what it depends on.
    pub(super) fn needing(mut self: Box<Self>, needs: Needs) -> Box<Self> {
        self.needs = needs;
        self
    }

    /// Whether it depends on what parameters are worth.
    pub(super) fn is_of_values(&self) -> bool {
        self.needs == Needs::Values
    }
}

impl GcodeError {
    /// Of a `refusal` in the line `number`, from 1, of `file`.
    pub(super) fn new(
        file: &str,
        number: u64,
        line: &[u8],
        around: &Around,
        refusal: Refusal,
    ) -> Self {
        let Refusal { span, message, found, help, needs: _ } = refusal;
        let within = |bytes: &Range<usize>| bytes.start.min(line.len())..bytes.end.min(line.len());
        let span = within(&span);
        // An illegible line is taken for Latin-1, so that places before it are places in its text.
        let text = decode(line);
        let place = |byte: usize| match text {
            std::borrow::Cow::Borrowed(_) => byte,
            std::borrow::Cow::Owned(_) => line[..byte].iter().map(|&byte| width(byte)).sum(),
        };
        let (start, end) = (place(span.start), place(span.end));
        let before = around.lines.first().filter(|_| around.has_before);
        let offset = before.map_or(0, |before| before.len() + 1);
        Self {
            file: file.to_owned(),
            line: number,
            column: 1 + text.char_indices().take_while(|&(at, _)| at < start).count() as u64,
            message,
            found,
            help,
            others: Vec::new(),
            excerpt: Excerpt {
                file: file.to_owned(),
                text: around.lines.join("\n"),
                first: number.saturating_sub(1 + u64::from(before.is_some())) as usize,
            },
            span: (offset + start, end.saturating_sub(start)).into(),
        }
    }
}

impl GcodeError {
    /// Of nothing that is known.
    pub(super) fn unknown() -> Self {
        let refusal = Refusal::new(0..0, "the program cannot be read", "here", "look at the file");
        Self::new("", 0, &[], &Around::default(), *refusal)
    }
}

/// Bytes of the character that a byte of Latin-1 stands for, in UTF-8.
fn width(byte: u8) -> usize {
    char::from(byte).len_utf8()
}

/// A few lines of a file, which keep their numbers.
#[derive(Debug, Clone)]
struct Excerpt {
    file: String,
    text: String,
    /// Lines of the file before them.
    first: usize,
}

impl SourceCode for Excerpt {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        lines_before: usize,
        lines_after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let contents = self.text.read_span(span, lines_before, lines_after)?;
        Ok(Box::new(MietteSpanContents::new_named(
            self.file.clone(),
            contents.data(),
            *contents.span(),
            contents.line() + self.first,
            contents.column(),
            contents.line_count(),
        )))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn an_excerpt_keeps_the_numbers_of_its_lines() {
        let lines = ["G21", "G0 X1 \u{e9}", "M2"].map(str::to_owned).to_vec();
        let around = Around { lines, has_before: true };
        let refusal = *Refusal::new(6..7, "wrong", "here", "better");
        let error = GcodeError::new("a.nc", 700, b"G0 X1 \xe9", &around, refusal);
        assert_eq!((error.line, error.column), (700, 7));
        let mut text = String::new();
        let theme = miette::GraphicalTheme::unicode_nocolor();
        miette::GraphicalReportHandler::new_themed(theme).render_report(&mut text, &error).unwrap();
        for expected in ["a.nc:700:7", "699 │ G21", "700 │ G0 X1 \u{e9}", "701 │ M2"] {
            assert!(text.contains(expected), "{expected}\n{text}");
        }
    }
}
