//! From a node to a typed value.

use schemars::{JsonSchema, Schema, SchemaGenerator};

use super::bounds::Measured;
use super::diagnostics::Diagnostics;
use super::error::ProblemKind;
use super::node::{Node, Span, Value};

/// A type that a document can hold.
pub trait Decode: Sized + JsonSchema {
    /// Reads `node`; notes in `diagnostics` why not.
    fn decode(node: &Node, diagnostics: &mut Diagnostics) -> Option<Self>;

    /// The value of a key that is not there, in the table at `span`; `None` when it must be.
    fn absent(span: Span, diagnostics: &mut Diagnostics) -> Option<Self> {
        let _ = (span, diagnostics);
        None
    }

    /// The numbers in it, for the bounds of its key; tables hold theirs to bounds themselves.
    fn numbers(&self) -> Vec<Measured> {
        Vec::new()
    }

    /// Whether a key of this type must be there when it has no default.
    fn required() -> bool {
        true
    }

    /// A value as a person would write it; `None` for a table.
    fn example() -> Option<String> {
        None
    }

    /// What an editor needs to know.
    fn field_schema(generator: &mut SchemaGenerator) -> Schema {
        generator.subschema_for::<Self>()
    }
}

/// A value with its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spanned<T> {
    /// The value.
    pub value: T,
    /// Where it stands.
    pub span: Span,
}

impl<T> Spanned<T> {
    pub(super) fn new(value: T, span: Span) -> Self {
        Self { value, span }
    }
}

/// Notes that `node` is of the wrong type.
pub(super) fn wrong_type(node: &Node, due: &str, diagnostics: &mut Diagnostics) {
    diagnostics.refuse(
        ProblemKind::WrongType,
        node.span,
        format!("this is {}, but {due} is needed", node.type_name()),
        None,
    );
}

impl<T: JsonSchema> JsonSchema for Spanned<T> {
    fn inline_schema() -> bool {
        T::inline_schema()
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        T::schema_name()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        T::json_schema(generator)
    }
}

impl Decode for Spanned<String> {
    fn example() -> Option<String> {
        Some("\"…\"".to_owned())
    }

    fn decode(node: &Node, diagnostics: &mut Diagnostics) -> Option<Self> {
        match &node.value {
            Value::Text(text) => Some(Self::new(text.clone(), node.span)),
            _ => {
                wrong_type(node, "a text", diagnostics);
                None
            }
        }
    }
}

impl Decode for Spanned<bool> {
    fn example() -> Option<String> {
        Some("true".to_owned())
    }

    fn decode(node: &Node, diagnostics: &mut Diagnostics) -> Option<Self> {
        match node.value {
            Value::Flag(flag) => Some(Self::new(flag, node.span)),
            _ => {
                wrong_type(node, "true or false", diagnostics);
                None
            }
        }
    }
}

impl<T: Decode> Decode for Option<T> {
    fn example() -> Option<String> {
        T::example()
    }

    fn decode(node: &Node, diagnostics: &mut Diagnostics) -> Option<Self> {
        T::decode(node, diagnostics).map(Some)
    }

    fn numbers(&self) -> Vec<Measured> {
        self.as_ref().map(T::numbers).unwrap_or_default()
    }

    fn absent(_place: Span, _findings: &mut Diagnostics) -> Option<Self> {
        Some(None)
    }

    fn required() -> bool {
        false
    }

    fn field_schema(generator: &mut SchemaGenerator) -> Schema {
        T::field_schema(generator)
    }
}

impl<T: Decode> Decode for Vec<T> {
    fn example() -> Option<String> {
        Some(format!("[{}]", T::example()?))
    }

    fn decode(node: &Node, diagnostics: &mut Diagnostics) -> Option<Self> {
        let Value::List(nodes) = &node.value else {
            wrong_type(node, "a list", diagnostics);
            return None;
        };
        // Every element is decoded, so that every error is reported.
        let values: Vec<Option<T>> =
            nodes.iter().map(|node| T::decode(node, diagnostics)).collect();
        values.into_iter().collect()
    }

    fn numbers(&self) -> Vec<Measured> {
        self.iter().flat_map(T::numbers).collect()
    }
}

impl<T: Decode, const N: usize> Decode for [T; N]
where
    [T; N]: JsonSchema,
{
    fn example() -> Option<String> {
        Some(format!("[{}]", vec![T::example()?; N].join(", ")))
    }

    fn decode(node: &Node, diagnostics: &mut Diagnostics) -> Option<Self> {
        let Value::List(nodes) = &node.value else {
            wrong_type(node, &format!("a list of {N}"), diagnostics);
            return None;
        };
        if nodes.len() != N {
            diagnostics.refuse(
                ProblemKind::WrongType,
                node.span,
                format!("this is a list of {}, but a list of {N} is needed", nodes.len()),
                None,
            );
            return None;
        }
        Vec::decode(node, diagnostics)?.try_into().ok()
    }

    fn numbers(&self) -> Vec<Measured> {
        self.iter().flat_map(T::numbers).collect()
    }
}
