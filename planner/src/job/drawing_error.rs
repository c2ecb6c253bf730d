//! Why a drawing's file is refused, with its place.

use std::path::PathBuf;

use graphics::ReadError;

/// A drawing that cannot be marked as it stands.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error, miette::Diagnostic)]
#[error("{}: {message}", self.place())]
pub struct DrawingError {
    /// The file.
    pub path: PathBuf,
    /// Line, from 1; `None` where the whole file is meant.
    pub line: Option<u64>,
    /// Column in characters, from 1.
    pub column: Option<u64>,
    /// What is wrong, without the place.
    pub message: String,
    /// What would be right.
    #[help]
    pub help: String,
}

impl DrawingError {
    pub(super) fn new(path: PathBuf, error: ReadError) -> Self {
        let ReadError { line, column, message, help } = error;
        Self { path, line, column, message, help }
    }

    fn place(&self) -> String {
        let path = self.path.display();
        match (self.line, self.column) {
            (Some(line), Some(column)) => format!("{path}:{line}:{column}"),
            (Some(line), None) => format!("{path}:{line}"),
            (None, _) => path.to_string(),
        }
    }
}
