//! `--set KEY=VALUE`: values of the command line laid over a document.

use core::str::FromStr;

use super::diagnostics::Diagnostics;
use super::error::{ProblemKind, Source};
use super::node::{Entry, Node, Span, Value, parse_value};

/// One setting of the command line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Override {
    /// The dotted key, without the `machine.` before it.
    pub key: String,
    /// A value as TOML writes it; what is not TOML is taken as a text.
    pub value: String,
}

/// A setting that has no `=` or no key.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error, miette::Diagnostic)]
#[error("`{0}` is not KEY=VALUE, such as path.jerk=\"500 m/s^3\"")]
pub struct MalformedOverride(String);

impl FromStr for Override {
    type Err = MalformedOverride;

    fn from_str(text: &str) -> Result<Self, MalformedOverride> {
        match text.split_once('=') {
            Some((key, value)) if !key.trim().is_empty() => {
                Ok(Self { key: key.trim().to_owned(), value: value.trim().to_owned() })
            }
            _ => Err(MalformedOverride(text.to_owned())),
        }
    }
}

impl Override {
    pub(super) fn source(&self, prefix: &str) -> Source {
        Source::command_line(format!("{prefix}{}={}", self.key, self.value))
    }
}

/// Puts the value of `setting` in its place below `root`, making tables on the way.
pub(super) fn lay_over(
    root: &mut Node,
    setting: &Override,
    prefix: &str,
    source: usize,
    diagnostics: &mut Diagnostics,
) {
    let mut node = root;
    let mut start = prefix.len();
    let mut keys = setting.key.split('.').peekable();
    while let Some(key) = keys.next() {
        let span = Span { source, start, end: start + key.len() };
        start += key.len() + 1;
        if key.is_empty() {
            diagnostics.refuse(
                ProblemKind::Syntax,
                span,
                format!("`{}` has an empty part", setting.key),
                Some("write the keys with a dot between them, such as path.jerk".to_owned()),
            );
            return;
        }
        let found = node.type_name();
        let Value::Table(entries) = &mut node.value else {
            diagnostics.refuse(
                ProblemKind::WrongType,
                span,
                format!("`{key}` is looked for in {found}, not in a table"),
                None,
            );
            return;
        };
        let index = entries.iter().position(|entry| entry.key == key).unwrap_or_else(|| {
            let node = Node { span, value: Value::Table(Vec::new()) };
            entries.push(Entry { key: key.to_owned(), span, node });
            entries.len() - 1
        });
        let Some(entry) = entries.get_mut(index) else { return };
        if keys.peek().is_none() {
            let offset = prefix.len() + setting.key.len() + 1;
            entry.span = span;
            entry.node = parse_value(&setting.value, source, offset);
            return;
        }
        node = &mut entry.node;
    }
}
