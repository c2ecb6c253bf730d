//! Why a drawing is refused.

/// A drawing that cannot be read: what was found, where, and what would be right.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ReadError {
    /// Line, from 1; `None` where the whole file is meant, or the format has no lines.
    pub line: Option<u64>,
    /// Column in characters, from 1.
    pub column: Option<u64>,
    /// What is wrong, without the place.
    pub message: String,
    /// What would be right.
    pub help: String,
}

impl ReadError {
    /// Of the whole file.
    pub fn new(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { line: None, column: None, message: message.into(), help: help.into() }
    }

    /// At a line, from 1.
    #[must_use]
    pub fn at_line(self, line: u64) -> Self {
        Self { line: Some(line), ..self }
    }

    /// At a column of its line, in characters from 1.
    #[must_use]
    pub fn at_column(self, column: u64) -> Self {
        Self { column: Some(column), ..self }
    }
}
