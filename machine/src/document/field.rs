//! The types of fields: quantities, numbers, words, points.

use core::marker::PhantomData;
use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};

use super::bounds::Measured;
use super::decode::{Decode, Spanned, wrong_type};
use super::diagnostics::Diagnostics;
use super::error::ProblemKind;
use super::nearest;
use super::node::{Node, Span, Value};
use crate::quantity::{self, Dimension, Kind, LARGEST, Length, QuantityErrorKind, SMALLEST};

/// The range of a number.
pub trait Range: Copy + core::fmt::Debug + PartialEq + Send + Sync + 'static {
    /// What it must be; empty for any.
    const DUE: &'static str;
    /// How a pattern lets the number begin.
    const SIGN: &'static str;
    /// Whether `value` lies in it.
    fn contains(value: f64) -> bool;
}

/// Any finite number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Any {}

/// A number above 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Positive {}

/// 0 or above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NonNegative {}

impl Range for Any {
    const DUE: &'static str = "";
    const SIGN: &'static str = "[+-]?";
    fn contains(value: f64) -> bool {
        value.is_finite()
    }
}

impl Range for Positive {
    const DUE: &'static str = "it must be more than 0";
    const SIGN: &'static str = r"\+?";
    fn contains(value: f64) -> bool {
        value >= SMALLEST
    }
}

impl Range for NonNegative {
    const DUE: &'static str = "it must be 0 or more";
    const SIGN: &'static str = r"\+?";
    fn contains(value: f64) -> bool {
        value >= 0.0
    }
}

/// Notes a value that leaves the range `R`.
fn check_range<R: Range>(
    value: f64,
    written: &str,
    span: Span,
    diagnostics: &mut Diagnostics,
) -> Option<f64> {
    if R::contains(value) {
        return Some(value);
    }
    diagnostics.refuse(
        ProblemKind::OutOfRange,
        span,
        format!("`{written}` is out of range"),
        Some(R::DUE.to_owned()),
    );
    None
}

/// The finite number of `node`.
fn finite(number: f64, span: Span, diagnostics: &mut Diagnostics) -> Option<f64> {
    if number.abs() <= LARGEST {
        return Some(number);
    }
    let message = if number.is_finite() {
        format!("`{number:e}` is beyond any machine")
    } else {
        "this is not a finite number".to_owned()
    };
    diagnostics.refuse(ProblemKind::NotFinite, span, message, None);
    None
}

/// A text with number and unit, of kind `K` and in range `R`, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity<K, R = Any> {
    /// The value, SI units and radians.
    pub value: f64,
    /// Which of the dimensions of its kind it was given in.
    pub form: usize,
    /// Where it stands.
    pub span: Span,
    kind: PhantomData<(K, R)>,
}

impl<K: Kind, R: Range> Decode for Quantity<K, R> {
    fn example() -> Option<String> {
        Some(format!("\"{}\"", K::EXAMPLE))
    }

    fn decode(node: &Node, diagnostics: &mut Diagnostics) -> Option<Self> {
        let span = node.span;
        let due = || format!("write {} such as \"{}\"", K::NAME, K::EXAMPLE);
        let text = match &node.value {
            Value::Text(text) => text,
            Value::Number(number) => {
                let number = finite(*number, span, diagnostics)?;
                diagnostics.refuse(
                    ProblemKind::BareNumber,
                    span,
                    format!("`{number}` has no unit, but {} is needed", K::NAME),
                    Some(format!("write it with its unit, such as \"{number} {}\"", K::UNIT)),
                );
                return None;
            }
            _ => {
                wrong_type(node, K::NAME, diagnostics);
                return None;
            }
        };
        match quantity::read_form::<K>(text) {
            Ok((value, form)) => {
                let value = check_range::<R>(value, text.trim(), span, diagnostics)?;
                Some(Self { value, form, span, kind: PhantomData })
            }
            Err(error) => {
                let kind = match error.kind {
                    QuantityErrorKind::NotANumber => ProblemKind::WrongType,
                    QuantityErrorKind::NotFinite => ProblemKind::NotFinite,
                    QuantityErrorKind::NoUnit => ProblemKind::BareNumber,
                    QuantityErrorKind::UnknownUnit | QuantityErrorKind::Malformed => {
                        ProblemKind::UnknownUnit
                    }
                    QuantityErrorKind::WrongDimension => ProblemKind::WrongUnit,
                };
                let help = error.help().map_or_else(due, str::to_owned);
                diagnostics.refuse(kind, span, error.message().to_owned(), Some(help));
                None
            }
        }
    }

    fn numbers(&self) -> Vec<Measured> {
        let dimension = K::DIMENSIONS[self.form];
        vec![Measured { value: self.value, dimension, span: self.span }]
    }
}

/// The pattern of a quantity in a schema: a number, then a unit.
fn quantity_pattern<R: Range>() -> String {
    let number = r"([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?";
    format!(r"^\s*{}{number}(\s*[A-Za-zµμΩΩ°%/].*|\s+1\s*/.*)$", R::SIGN)
}

impl<K: Kind, R: Range> JsonSchema for Quantity<K, R> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        K::NAME.into()
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": "string",
            "pattern": quantity_pattern::<R>(),
            "examples": [K::EXAMPLE],
        })
    }
}

/// A plain number in range `R`, without unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Number<R = Any> {
    /// The number.
    pub value: f64,
    /// Where it stands.
    pub span: Span,
    range: PhantomData<R>,
}

impl<R: Range> Decode for Number<R> {
    fn example() -> Option<String> {
        Some("1".to_owned())
    }

    fn decode(node: &Node, diagnostics: &mut Diagnostics) -> Option<Self> {
        let Value::Number(number) = node.value else {
            wrong_type(node, "a number without unit", diagnostics);
            return None;
        };
        let number = finite(number, node.span, diagnostics)?;
        let value = check_range::<R>(number, &number.to_string(), node.span, diagnostics)?;
        Some(Self { value, span: node.span, range: PhantomData })
    }

    fn numbers(&self) -> Vec<Measured> {
        vec![Measured { value: self.value, dimension: Dimension::NONE, span: self.span }]
    }
}

impl<R: Range> JsonSchema for Number<R> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Number".into()
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        let mut schema = json_schema!({ "type": "number" });
        if R::contains(0.0) && !R::contains(-1.0) {
            schema.insert("minimum".to_owned(), 0.0.into());
        } else if !R::contains(0.0) {
            schema.insert("exclusiveMinimum".to_owned(), 0.0.into());
        }
        schema
    }
}

/// A share of a whole, up to 1 and in range `R`: a number, or a text such as `"80 %"`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fraction<R = NonNegative> {
    /// The share, up to 1.
    pub value: f64,
    /// Where it stands.
    pub span: Span,
    range: PhantomData<R>,
}

impl<R: Range> Decode for Fraction<R> {
    fn example() -> Option<String> {
        Some("\"80 %\"".to_owned())
    }

    fn decode(node: &Node, diagnostics: &mut Diagnostics) -> Option<Self> {
        let span = node.span;
        let (number, written) = match &node.value {
            Value::Number(number) => (finite(*number, span, diagnostics)?, number.to_string()),
            Value::Text(text) => match quantity::read_share(text) {
                Ok(number) => (number, text.trim().to_owned()),
                Err(error) => {
                    diagnostics.refuse(
                        match error.kind {
                            QuantityErrorKind::NotFinite => ProblemKind::NotFinite,
                            QuantityErrorKind::WrongDimension => ProblemKind::WrongUnit,
                            QuantityErrorKind::NotANumber => ProblemKind::WrongType,
                            _ => ProblemKind::UnknownUnit,
                        },
                        span,
                        error.message().to_owned(),
                        Some("write a share such as \"80 %\" or 0.8".to_owned()),
                    );
                    return None;
                }
            },
            _ => {
                wrong_type(node, "a share such as \"80 %\"", diagnostics);
                return None;
            }
        };
        let value = check_range::<R>(number, &written, span, diagnostics)?;
        if value > 1.0 {
            diagnostics.refuse(
                ProblemKind::OutOfRange,
                span,
                format!("`{written}` is more than the whole"),
                Some("write a share up to \"100 %\"".to_owned()),
            );
            return None;
        }
        Some(Self { value, span, range: PhantomData })
    }

    fn numbers(&self) -> Vec<Measured> {
        vec![Measured { value: self.value, dimension: Dimension::NONE, span: self.span }]
    }
}

impl<R: Range> JsonSchema for Fraction<R> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Fraction".into()
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "anyOf": [
                { "type": "number", "minimum": 0, "maximum": 1 },
                { "type": "string", "pattern": r"^\s*\+?[0-9.]+([eE][+-]?[0-9]+)?\s*%?\s*$" },
            ],
            "examples": ["80 %", 0.8],
        })
    }
}

/// An enumeration that is written as a word.
pub trait Keyword: Copy + 'static {
    /// What it chooses, with its article: `a style`.
    const NAME: &'static str;
    /// The words and what they mean.
    const WORDS: &'static [(&'static str, Self)];
}

/// Makes a type a [`Keyword`](crate::document::Keyword), in documents and in their schema: the type, what
/// it chooses, and its words.
///
/// ```
/// #[derive(Debug, Clone, Copy)]
/// enum Side {
///     Left,
///     Right,
/// }
///
/// machine::keyword! { Side, "a side", "left" => Self::Left, "right" => Self::Right }
/// ```
#[macro_export]
macro_rules! keyword {
    ($type:ty, $name:literal, $($word:literal => $value:expr),+ $(,)?) => {
        impl $crate::document::Keyword for $type {
            const NAME: &'static str = $name;
            const WORDS: &'static [(&'static str, Self)] = &[$(($word, $value)),+];
        }

        impl $crate::document::JsonSchema for $type {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($type).into()
            }

            fn json_schema(
                _generator: &mut $crate::document::SchemaGenerator,
            ) -> $crate::document::Schema {
                $crate::document::json_schema!({ "enum": [$($word),+] })
            }
        }
    };
}

impl<K: Keyword> Decode for Spanned<K>
where
    Spanned<K>: JsonSchema,
{
    fn example() -> Option<String> {
        Some(format!("\"{}\"", K::WORDS.first()?.0))
    }

    fn decode(node: &Node, diagnostics: &mut Diagnostics) -> Option<Self> {
        let words = || K::WORDS.iter().map(|(word, _)| *word);
        let list = || words().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ");
        let Value::Text(text) = &node.value else {
            wrong_type(node, &format!("{} ({})", K::NAME, list()), diagnostics);
            return None;
        };
        if let Some((_, value)) = K::WORDS.iter().find(|(word, _)| word == text) {
            return Some(Self::new(*value, node.span));
        }
        let help = match nearest(text, words()) {
            Some(near) => format!("did you mean \"{near}\"?"),
            None => format!("write one of {}", list()),
        };
        diagnostics.refuse(
            ProblemKind::UnknownWord,
            node.span,
            format!("`{text}` is not {}", K::NAME),
            Some(help),
        );
        None
    }
}

/// A word of `K`, or else a `T`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Either<K, T> {
    /// One of the words.
    Word(Spanned<K>),
    /// A value.
    Value(T),
}

impl<K: Keyword, T: Decode> Decode for Either<K, T>
where
    Spanned<K>: JsonSchema,
{
    fn example() -> Option<String> {
        Some(format!("\"{}\"", K::WORDS.first()?.0))
    }

    fn decode(node: &Node, diagnostics: &mut Diagnostics) -> Option<Self> {
        if let Value::Text(text) = &node.value {
            let words = || K::WORDS.iter().map(|(word, _)| *word);
            // A text without a digit is a word, and reported as one when it is misspelt.
            let is_word = words().any(|word| word == text);
            let is_quantity = text.contains(|letter: char| letter.is_ascii_digit());
            if is_word || (!is_quantity && nearest(text, words()).is_some()) {
                return Spanned::<K>::decode(node, diagnostics).map(Self::Word);
            }
        }
        T::decode(node, diagnostics).map(Self::Value)
    }

    fn numbers(&self) -> Vec<Measured> {
        match self {
            Self::Word(_) => Vec::new(),
            Self::Value(value) => value.numbers(),
        }
    }
}

impl<K: Keyword, T: Decode> JsonSchema for Either<K, T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Either".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let words: Vec<&str> = K::WORDS.iter().map(|(word, _)| *word).collect();
        let value = T::field_schema(generator);
        json_schema!({ "anyOf": [{ "enum": words }, value] })
    }
}

/// Two or three lengths; z is 0 when it is left out [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// The point [m].
    pub value: [f64; 3],
    /// Where it stands.
    pub span: Span,
}

impl Decode for Point {
    fn example() -> Option<String> {
        Some("[\"10 mm\", \"5 mm\"]".to_owned())
    }

    fn decode(node: &Node, diagnostics: &mut Diagnostics) -> Option<Self> {
        let Value::List(nodes) = &node.value else {
            wrong_type(node, "a point such as [\"10 mm\", \"5 mm\"]", diagnostics);
            return None;
        };
        if !matches!(nodes.len(), 2 | 3) {
            diagnostics.refuse(
                ProblemKind::WrongType,
                node.span,
                format!("this is a list of {}, a point has x, y and perhaps z", nodes.len()),
                Some("write a point such as [\"10 mm\", \"5 mm\"]".to_owned()),
            );
            return None;
        }
        let lengths: Vec<Quantity<Length>> = Vec::decode(node, diagnostics)?;
        let mut value = [0.0; 3];
        for (coordinate, length) in value.iter_mut().zip(lengths) {
            *coordinate = length.value;
        }
        Some(Self { value, span: node.span })
    }

    fn numbers(&self) -> Vec<Measured> {
        let (dimension, span) = (Length::DIMENSIONS[0], self.span);
        self.value.map(|value| Measured { value, dimension, span }).into()
    }
}

impl JsonSchema for Point {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Point".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let length = Quantity::<Length>::field_schema(generator);
        json_schema!({ "type": "array", "items": length, "minItems": 2, "maxItems": 3 })
    }
}

/// Tables of one type under names that the document chooses, in its order.
#[derive(Debug, Clone, PartialEq)]
pub struct Named<T> {
    /// Names and tables.
    pub entries: Vec<(Spanned<String>, T)>,
    /// Where the table that holds them stands.
    pub span: Span,
}

impl<T: Decode> Decode for Named<T> {
    fn decode(node: &Node, diagnostics: &mut Diagnostics) -> Option<Self> {
        let Value::Table(entries) = &node.value else {
            wrong_type(node, "a table of tables", diagnostics);
            return None;
        };
        let decoded: Vec<Option<(Spanned<String>, T)>> = entries
            .iter()
            .map(|entry| {
                let name = Spanned::new(entry.key.clone(), entry.span);
                T::decode(&entry.node, diagnostics).map(|value| (name, value))
            })
            .collect();
        Some(Self { entries: decoded.into_iter().collect::<Option<_>>()?, span: node.span })
    }
}

impl<T: Decode> JsonSchema for Named<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Named".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let value = T::field_schema(generator);
        json_schema!({ "type": "object", "additionalProperties": value })
    }
}
