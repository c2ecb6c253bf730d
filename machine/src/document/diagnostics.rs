//! What is found wrong while a document is decoded and checked.

use std::sync::Arc;

use super::attachments::{Attached, Attachments};
use super::bounds::{self, Bounds, Measured};
use super::decode::Spanned;
use super::error::{DocumentError, Problem, ProblemKind, Source, SourceKind};
use super::node::Span;

/// Problems and warnings so far, and the texts that they point into.
#[derive(Debug)]
pub struct Diagnostics {
    sources: Vec<Arc<Source>>,
    problems: Vec<Problem>,
    warnings: Vec<Warning>,
    bounds: &'static [Bounds],
    attachments: Attachments,
}

/// What can be true but should be looked at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// Where the value stands.
    pub span: Span,
    /// What is wrong or unusual, with the numbers.
    pub text: String,
    /// What it bears on.
    pub concern: Concern,
}

/// What a warning bears on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Concern {
    /// A value that is used, whenever the document is.
    Use,
    /// A value that is only compared with others.
    Comparison,
}

impl Diagnostics {
    pub(super) fn new(file: Arc<Source>) -> Self {
        Self {
            sources: vec![file],
            problems: Vec::new(),
            warnings: Vec::new(),
            bounds: &[],
            attachments: Attachments::default(),
        }
    }

    /// Holds the numbers that are decoded from now on to `bounds`.
    pub(super) fn hold_to(&mut self, bounds: &'static [Bounds]) {
        self.bounds = bounds;
    }

    /// Finds the files that the document names in `attachments`.
    pub(super) fn attach(&mut self, attachments: Attachments) {
        self.attachments = attachments;
    }

    /// The file that the document names by `name`; refuses the name where it cannot be read.
    pub(crate) fn attached(&mut self, name: &Spanned<String>) -> Option<Attached> {
        match self.attachments.read(&name.value) {
            Ok((path, text)) => {
                let source = Source::attachment(&path, text);
                self.sources.push(source.clone());
                Some(Attached::new(source, self.sources.len() - 1))
            }
            Err(message) => {
                let help = "a path is relative to the folder of the file that names it";
                self.contradict(name.span, message, help);
                None
            }
        }
    }

    /// Holds a number that stands in an attached file to the bounds of `key` in the table of type `table`. Says
    /// whether it is possible.
    pub(crate) fn hold(&mut self, table: &str, key: &str, number: &Measured) -> bool {
        let before = self.problems.len();
        bounds::check(table, key, number, self);
        self.problems.len() == before
    }

    /// What numbers are held to.
    pub(super) fn bounds(&self) -> &'static [Bounds] {
        self.bounds
    }

    pub(super) fn add_source(&mut self, source: Arc<Source>) -> usize {
        self.sources.push(source);
        self.sources.len() - 1
    }

    /// The file as it was named.
    pub fn file(&self) -> &str {
        self.sources.first().map_or("", |source| &source.name)
    }

    /// Whether nothing is wrong so far.
    pub fn is_empty(&self) -> bool {
        self.problems.is_empty()
    }

    /// Line and column of `span` in the file, both from 1; `None` for an override, and in a file that the
    /// document names.
    pub fn position(&self, span: Span) -> Option<(usize, usize)> {
        let source = self.sources.get(span.source)?;
        if source.kind == SourceKind::File { source.position(span.start) } else { None }
    }

    /// The file that `span` is in where the document names it, with the line from 1.
    pub(crate) fn attachment(&self, span: Span) -> Option<(&str, usize)> {
        let source = self.sources.get(span.source)?;
        let (line, _) = source.position(span.start)?;
        (source.kind == SourceKind::Attachment).then_some((source.name.as_str(), line))
    }

    /// What stands at `span`.
    pub(crate) fn text(&self, span: Span) -> &str {
        let source = self.sources.get(span.source);
        source.and_then(|source| source.text.get(span.start..span.end)).unwrap_or_default()
    }

    /// The text of the value at `span`, as it was written.
    pub(super) fn written(&self, span: Span) -> String {
        let text = self.text(span);
        match self.override_text(span) {
            // Of an override the place is all of it.
            Some(setting) if text == setting => {
                setting.split_once('=').map_or(setting, |(_, value)| value).to_owned()
            }
            _ => text.to_owned(),
        }
    }

    /// The override that `span` is in, as on the command line; `None` for a file.
    pub fn override_text(&self, span: Span) -> Option<&str> {
        let source = self.sources.get(span.source)?;
        (source.kind == SourceKind::CommandLine).then_some(source.text.as_str())
    }

    /// Notes that what stands at `span` is wrong, and what would be right.
    pub fn refuse(&mut self, kind: ProblemKind, span: Span, message: String, help: Option<String>) {
        let Some(source) = self.sources.get(span.source).cloned() else { return };
        self.problems.push(Problem { kind, source, span, message, help });
    }

    /// Notes that what stands at `span` should be looked at.
    pub fn warn(&mut self, span: Span, text: String) {
        self.warnings.push(Warning { span, text, concern: Concern::Use });
    }

    /// Notes the same of a value that is only compared with others.
    pub fn remark(&mut self, span: Span, text: String) {
        self.warnings.push(Warning { span, text, concern: Concern::Comparison });
    }

    /// The warnings so far, in the order in which they were noted; from now on there are none.
    pub fn take_warnings(&mut self) -> Vec<Warning> {
        core::mem::take(&mut self.warnings)
    }

    /// Notes that a value contradicts another.
    pub fn contradict(&mut self, span: Span, message: String, help: &str) {
        self.refuse(ProblemKind::Contradiction, span, message, Some(help.to_owned()));
    }

    /// Gives `value` if nothing is wrong.
    ///
    /// # Errors
    /// Everything that is wrong.
    pub fn finish<T>(self, value: T) -> Result<T, DocumentError> {
        if self.problems.is_empty() { Ok(value) } else { Err(self.into_error()) }
    }

    /// Everything that is wrong. What is missing comes last: a wrong key is often its cause.
    ///
    /// Called only when something is.
    pub(super) fn into_error(mut self) -> DocumentError {
        let file = self.file().to_owned();
        self.problems.sort_by_key(|problem| {
            (problem.kind == ProblemKind::MissingKey, problem.span.source, problem.span.start)
        });
        let mut problems = self.problems.into_iter();
        match problems.next() {
            Some(first) => DocumentError::new(file, first, problems.collect()),
            None => DocumentError::unreadable(&file, "is empty".to_owned()),
        }
    }

    /// Gives up after something was found wrong.
    pub fn fail<T>(self) -> Result<T, DocumentError> {
        Err(self.into_error())
    }
}
