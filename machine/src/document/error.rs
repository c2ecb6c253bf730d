//! What is said of a document that is not sound.

use core::fmt;
use std::sync::Arc;

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};

use super::node::Span;

/// The name of a text that came with `--set`.
pub(super) const COMMAND_LINE: &str = "--set";

/// What a text that values come from is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SourceKind {
    /// The document's file.
    File,
    /// A file that the document names.
    Attachment,
    /// One override.
    CommandLine,
}

/// A text that values come from: the file, one that it names, or one override.
#[derive(Debug)]
pub(crate) struct Source {
    pub(crate) name: String,
    pub(crate) text: String,
    pub(super) kind: SourceKind,
    code: NamedSource<String>,
}

impl Source {
    pub(crate) fn file(name: &str, text: &str) -> Arc<Self> {
        Arc::new(Self::new(name, text.to_owned(), SourceKind::File))
    }

    pub(super) fn attachment(name: &str, text: String) -> Arc<Self> {
        Arc::new(Self::new(name, text, SourceKind::Attachment))
    }

    pub(crate) fn command_line(text: String) -> Self {
        Self::new(COMMAND_LINE, text, SourceKind::CommandLine)
    }

    fn new(name: &str, text: String, kind: SourceKind) -> Self {
        Self { name: name.to_owned(), kind, code: NamedSource::new(name, text.clone()), text }
    }

    /// Line and column of byte `offset`, both from 1, the column in characters; `None` in an override.
    pub(crate) fn position(&self, offset: usize) -> Option<(usize, usize)> {
        if self.kind == SourceKind::CommandLine {
            return None;
        }
        let before = self.text.get(..offset).unwrap_or(&self.text);
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        let line = before.matches('\n').count() + 1;
        let column = before.get(line_start..).map_or(0, |text| text.chars().count()) + 1;
        Some((line, column))
    }
}

/// What kind of thing is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProblemKind {
    /// The file cannot be read.
    Unreadable,
    /// It is not TOML.
    Syntax,
    /// A key that means nothing here.
    UnknownKey,
    /// A key that must be there is not.
    MissingKey,
    /// A value of another type than is needed.
    WrongType,
    /// A number without a unit where a quantity is needed.
    BareNumber,
    /// A unit that does not exist or cannot be read.
    UnknownUnit,
    /// A quantity of another kind than is needed.
    WrongUnit,
    /// A word that is none of those possible.
    UnknownWord,
    /// NaN, infinite or beyond any machine.
    NotFinite,
    /// A number outside its range.
    OutOfRange,
    /// Two values that cannot both be right.
    Contradiction,
}

/// One thing that is wrong, with its place.
#[derive(Debug, Clone)]
pub struct Problem {
    /// What kind of thing.
    pub kind: ProblemKind,
    pub(super) source: Arc<Source>,
    pub(super) span: Span,
    pub(super) message: String,
    pub(super) help: Option<String>,
}

impl Problem {
    /// What is wrong and what would be right, without the place.
    pub fn message(&self) -> String {
        match &self.help {
            Some(help) => format!("{}; {help}", self.message),
            None => self.message.clone(),
        }
    }

    /// Line from 1; `None` for an override or an unreadable file.
    pub fn line(&self) -> Option<usize> {
        self.position().map(|(line, _)| line)
    }

    /// Column in characters from 1; `None` for an override or an unreadable file.
    pub fn column(&self) -> Option<usize> {
        self.position().map(|(_, column)| column)
    }

    /// The file that it stands in where that is one that the document names.
    fn attachment(&self) -> Option<&str> {
        (self.source.kind == SourceKind::Attachment).then_some(self.source.name.as_str())
    }

    fn position(&self) -> Option<(usize, usize)> {
        if self.kind == ProblemKind::Unreadable {
            return None;
        }
        self.source.position(self.span.start)
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.position() {
            Some((line, column)) => write!(formatter, "{}:{line}:{column}: ", self.source.name)?,
            None if self.kind == ProblemKind::Unreadable => {
                write!(formatter, "{} ", self.source.name)?;
            }
            None => write!(formatter, "--set {}: ", self.source.text)?,
        }
        write!(formatter, "{}", self.message)
    }
}

impl core::error::Error for Problem {}

impl Diagnostic for Problem {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        (self.kind != ProblemKind::Unreadable).then_some(&self.source.code as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        if self.kind == ProblemKind::Unreadable {
            return None;
        }
        let length = self.span.end.saturating_sub(self.span.start);
        let label = LabeledSpan::new_primary_with_span(
            Some(self.message.clone()),
            (self.span.start, length),
        );
        Some(Box::new(core::iter::once(label)))
    }
}

/// A document that is not sound: at least one [`Problem`], what is there before what is missing,
/// else in the order of the file, overrides last.
#[derive(Debug, Clone)]
pub struct DocumentError {
    file: String,
    // Boxed to keep the results that carry this small.
    first: Box<Problem>,
    others: Vec<Problem>,
}

impl DocumentError {
    pub(super) fn new(file: String, first: Problem, others: Vec<Problem>) -> Self {
        Self { file, first: Box::new(first), others }
    }

    pub(super) fn unreadable(file: &str, message: String) -> Self {
        let first = Problem {
            kind: ProblemKind::Unreadable,
            source: Source::file(file, ""),
            span: Span { source: 0, start: 0, end: 0 },
            message,
            help: None,
        };
        Self::new(file.to_owned(), first, Vec::new())
    }

    /// The file of the first problem: the document as it was named, or one that it names.
    pub fn file(&self) -> &str {
        self.file_of(&self.first)
    }

    /// The file of one of its problems.
    pub fn file_of<'a>(&'a self, problem: &'a Problem) -> &'a str {
        problem.attachment().unwrap_or(&self.file)
    }

    /// Everything that is wrong.
    pub fn problems(&self) -> impl Iterator<Item = &Problem> {
        core::iter::once(&*self.first).chain(&self.others)
    }

    /// Line of the first problem from 1; `None` for an override or an unreadable file.
    pub fn line(&self) -> Option<usize> {
        self.first.line()
    }

    /// Column of the first problem in characters from 1; as [`Self::line`].
    pub fn column(&self) -> Option<usize> {
        self.first.column()
    }

    /// What is wrong first and what would be right, without its place.
    pub fn message(&self) -> String {
        self.first.message()
    }
}

impl fmt::Display for DocumentError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.first, formatter)
    }
}

impl core::error::Error for DocumentError {}

impl Diagnostic for DocumentError {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.first.help()
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.first.source_code()
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.first.labels()
    }

    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn Diagnostic> + 'a>> {
        if self.others.is_empty() {
            return None;
        }
        Some(Box::new(self.others.iter().map(|problem| problem as &dyn Diagnostic)))
    }
}
