//! Why a program is refused: what was found, where, and what would be right.

use std::ops::Range;

use miette::{Diagnostic, NamedSource, SourceSpan};

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
    #[source_code]
    source_code: NamedSource<String>,
    #[label("{found}")]
    span: SourceSpan,
}

/// A refusal while its place is still a range of bytes in the text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Refusal {
    pub(super) span: Range<usize>,
    pub(super) message: String,
    pub(super) found: String,
    pub(super) help: String,
}

impl Refusal {
    /// Boxed, so that the way without errors stays small.
    pub(super) fn new(
        span: Range<usize>,
        message: impl Into<String>,
        found: impl Into<String>,
        help: impl Into<String>,
    ) -> Box<Self> {
        Box::new(Self { span, message: message.into(), found: found.into(), help: help.into() })
    }
}

impl GcodeError {
    /// Turns the bytes of `refusal` into line and column of `text`.
    pub(super) fn new(file: &str, text: &str, refusal: Refusal) -> Self {
        let Refusal { span, message, found, help } = refusal;
        let before = &text.as_bytes()[..span.start.min(text.len())];
        let line_start = before.iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
        // Every byte that does not continue a character begins one.
        let begins_character = |byte: &&u8| **byte & 0xC0 != 0x80;
        Self {
            file: file.to_owned(),
            line: 1 + before.iter().filter(|&&byte| byte == b'\n').count() as u64,
            column: 1 + before[line_start..].iter().filter(begins_character).count() as u64,
            message,
            found,
            help,
            source_code: NamedSource::new(file, text.to_owned()),
            span: (span.start, span.end.saturating_sub(span.start)).into(),
        }
    }
}
