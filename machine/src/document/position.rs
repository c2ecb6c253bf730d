//! Where a diagnostic points, for those who print it as data.

use miette::{Diagnostic, SourceSpan};

use super::error::COMMAND_LINE;

/// The place of an error as people count it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Position {
    /// The file as it was named; `None` for a setting of the command line, or for no place at all.
    pub file: Option<String>,
    /// Line from 1.
    pub line: Option<u64>,
    /// Column in characters from 1.
    pub column: Option<u64>,
}

impl Position {
    /// Where the first label of any `diagnostic` points.
    pub fn of(diagnostic: &dyn Diagnostic) -> Self {
        position(diagnostic).unwrap_or_default()
    }
}

fn position(diagnostic: &dyn Diagnostic) -> Option<Position> {
    let label = diagnostic.labels()?.next()?;
    let source = diagnostic.source_code()?;
    let contents = source.read_span(label.inner(), 0, 0).ok()?;
    if contents.name() == Some(COMMAND_LINE) {
        return None;
    }
    // miette counts the column in bytes: the line is read again up to there, and its letters
    // counted.
    let bytes = contents.column();
    let before = SourceSpan::new(label.offset().saturating_sub(bytes).into(), bytes);
    let column = match source.read_span(&before, 0, 0) {
        Ok(line) if bytes > 0 => {
            String::from_utf8_lossy(line.data().get(..bytes).unwrap_or_default()).chars().count()
        }
        _ => 0,
    };
    Some(Position {
        file: contents.name().map(str::to_owned),
        line: Some(contents.line() as u64 + 1),
        column: Some(column as u64 + 1),
    })
}
