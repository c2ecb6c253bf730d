//! The tree of a document, with the place of every key and value.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::diagnostics::Diagnostics;
use super::error::ProblemKind;

/// Where something stands: which text, and which bytes of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Span {
    pub(super) source: usize,
    pub(super) start: usize,
    pub(super) end: usize,
}

/// A value and its place.
#[derive(Debug, Clone)]
pub struct Node {
    /// Where it stands; of a table, its key.
    pub span: Span,
    pub(super) value: Value,
}

/// A value of TOML.
#[derive(Debug, Clone)]
pub(super) enum Value {
    Text(String),
    /// Integers and floats alike.
    Number(f64),
    Flag(bool),
    Time,
    List(Vec<Node>),
    Table(Vec<Entry>),
}

/// A key of a table and its value.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    pub(super) key: String,
    pub(super) span: Span,
    pub(super) node: Node,
}

/// A default as it is written in a declaration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Literal {
    /// A text or quantity.
    Text(&'static str),
    /// A plain number.
    Number(f64),
    /// A flag.
    Flag(bool),
}

impl From<&'static str> for Literal {
    fn from(text: &'static str) -> Self {
        Self::Text(text)
    }
}

impl From<f64> for Literal {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<bool> for Literal {
    fn from(flag: bool) -> Self {
        Self::Flag(flag)
    }
}

impl Literal {
    /// The default as a node of a table at `span`.
    pub fn node(self, span: Span) -> Node {
        let value = match self {
            Self::Text(text) => Value::Text(text.to_owned()),
            Self::Number(number) => Value::Number(number),
            Self::Flag(flag) => Value::Flag(flag),
        };
        Node { span, value }
    }

    /// The default for a schema.
    pub fn json(self) -> serde_json::Value {
        match self {
            Self::Text(text) => text.into(),
            Self::Number(number) => number.into(),
            Self::Flag(flag) => flag.into(),
        }
    }
}

impl Node {
    /// A table without keys.
    pub fn empty_table(span: Span) -> Self {
        Self { span, value: Value::Table(Vec::new()) }
    }

    /// The text at the dotted `key` below it.
    pub(super) fn text_at(&self, key: &str) -> Option<&str> {
        let below = key.split('.').try_fold(self, |node, key| match &node.value {
            Value::Table(entries) => {
                entries.iter().find(|entry| entry.key == key).map(|entry| &entry.node)
            }
            _ => None,
        })?;
        match &below.value {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }

    /// What it is, with its article, for error texts.
    pub(super) fn type_name(&self) -> &'static str {
        match self.value {
            Value::Text(_) => "a text",
            Value::Number(_) => "a number",
            Value::Flag(_) => "true or false",
            Value::Time => "a date or time",
            Value::List(_) => "a list",
            Value::Table(_) => "a table",
        }
    }
}

/// Parses a whole document; `None` when something was found wrong.
pub(super) fn parse(text: &str, source: usize, diagnostics: &mut Diagnostics) -> Option<Node> {
    let (table, mut errors) = DeTable::parse_recoverable(text);
    if errors.is_empty() {
        let span = Span { source, start: 0, end: 0 };
        return Some(Node { span, value: from_table(table.get_ref(), source) });
    }
    errors.sort_by_key(|error| error.span().map_or(text.len(), |bytes| bytes.start));
    for error in errors {
        let is_duplicate = error.message() == "duplicate key";
        let bytes = error.span().unwrap_or(text.len()..text.len());
        let span = Span { source, start: bytes.start, end: bytes.end };
        let message = match text.get(bytes) {
            Some(key) if is_duplicate => format!("duplicate key `{key}`"),
            _ => error.message().to_owned(),
        };
        let help = message.starts_with("missing comma between array elements");
        let help = help.then(|| "is a `]` missing before it?".to_owned());
        diagnostics.refuse(ProblemKind::Syntax, span, message, help);
        // Behind a place where TOML is malformed errors only follow from it: of one missing bracket hundreds.
        if !is_duplicate {
            break;
        }
    }
    None
}

/// Parses one value of an override, which starts at byte `offset` of its source; a text that is
/// no TOML value is a string, so that shells need no second layer of quotes.
pub(super) fn parse_value(text: &str, source: usize, offset: usize) -> Node {
    let span = Span { source, start: offset, end: offset + text.len() };
    let value = match DeValue::parse(text) {
        Ok(value) => from_value(value.get_ref(), source),
        Err(_) => Value::Text(text.to_owned()),
    };
    // Places inside the value would be off by the key's length: the whole value is named.
    let mut node = Node { span, value };
    relocate(&mut node, span);
    node
}

fn relocate(node: &mut Node, span: Span) {
    node.span = span;
    match &mut node.value {
        Value::List(nodes) => nodes.iter_mut().for_each(|node| relocate(node, span)),
        Value::Table(entries) => {
            for entry in entries {
                entry.span = span;
                relocate(&mut entry.node, span);
            }
        }
        Value::Text(_) | Value::Number(_) | Value::Flag(_) | Value::Time => {}
    }
}

fn from_table(table: &DeTable<'_>, source: usize) -> Value {
    let mut entries: Vec<Entry> = table
        .iter()
        .map(|(key, value)| {
            let span = key.span();
            let span = Span { source, start: span.start, end: span.end };
            let mut node = from_spanned(value, source);
            if matches!(node.value, Value::Table(_)) {
                node.span = span;
            }
            Entry { key: key.get_ref().to_string(), span, node }
        })
        .collect();
    entries.sort_by_key(|entry| entry.span);
    Value::Table(entries)
}

fn from_spanned(value: &Spanned<DeValue<'_>>, source: usize) -> Node {
    let span = value.span();
    let span = Span { source, start: span.start, end: span.end };
    Node { span, value: from_value(value.get_ref(), source) }
}

fn from_value(value: &DeValue<'_>, source: usize) -> Value {
    match value {
        DeValue::String(text) => Value::Text(text.to_string()),
        DeValue::Integer(integer) => Value::Number(
            // Numbers beyond an i128 are beyond any range as well.
            i128::from_str_radix(integer.as_str(), integer.radix())
                .map_or(f64::INFINITY, |integer| integer as f64),
        ),
        DeValue::Float(float) => Value::Number(float.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(flag) => Value::Flag(*flag),
        DeValue::Datetime(_) => Value::Time,
        DeValue::Array(values) => {
            Value::List(values.iter().map(|value| from_spanned(value, source)).collect())
        }
        DeValue::Table(table) => from_table(table, source),
    }
}
