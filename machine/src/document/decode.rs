//! From a node to a typed value.

use schemars::{JsonSchema, Schema, SchemaGenerator};

use super::bounds::Measured;
use super::error::ProblemKind;
use super::findings::Findings;
use super::node::{Node, Place, Value};

/// A type that a document can hold.
pub trait Decode: Sized + JsonSchema {
    /// Reads `node`; notes in `findings` why not.
    fn decode(node: &Node, findings: &mut Findings) -> Option<Self>;

    /// The value of a key that is not there, in the table at `place`; `None` when it must be.
    fn absent(place: Place, findings: &mut Findings) -> Option<Self> {
        let _ = (place, findings);
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
pub struct Located<T> {
    /// The value.
    pub value: T,
    /// Where it stands.
    pub place: Place,
}

impl<T> Located<T> {
    pub(super) fn new(value: T, place: Place) -> Self {
        Self { value, place }
    }
}

/// Notes that `node` is of the wrong type.
pub(super) fn wrong_type(node: &Node, due: &str, findings: &mut Findings) {
    findings.refuse(
        ProblemKind::WrongType,
        node.place,
        format!("this is {}, {due} is due", node.type_name()),
        None,
    );
}

impl<T: JsonSchema> JsonSchema for Located<T> {
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

impl Decode for Located<String> {
    fn example() -> Option<String> {
        Some("\"…\"".to_owned())
    }

    fn decode(node: &Node, findings: &mut Findings) -> Option<Self> {
        match &node.value {
            Value::Text(text) => Some(Self::new(text.clone(), node.place)),
            _ => {
                wrong_type(node, "a text", findings);
                None
            }
        }
    }
}

impl Decode for Located<bool> {
    fn example() -> Option<String> {
        Some("true".to_owned())
    }

    fn decode(node: &Node, findings: &mut Findings) -> Option<Self> {
        match node.value {
            Value::Flag(flag) => Some(Self::new(flag, node.place)),
            _ => {
                wrong_type(node, "true or false", findings);
                None
            }
        }
    }
}

impl<T: Decode> Decode for Option<T> {
    fn example() -> Option<String> {
        T::example()
    }

    fn decode(node: &Node, findings: &mut Findings) -> Option<Self> {
        T::decode(node, findings).map(Some)
    }

    fn numbers(&self) -> Vec<Measured> {
        self.as_ref().map(T::numbers).unwrap_or_default()
    }

    fn absent(_place: Place, _findings: &mut Findings) -> Option<Self> {
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

    fn decode(node: &Node, findings: &mut Findings) -> Option<Self> {
        let Value::List(nodes) = &node.value else {
            wrong_type(node, "a list", findings);
            return None;
        };
        // Every element is looked at, so that every error is reported.
        let values: Vec<Option<T>> = nodes.iter().map(|node| T::decode(node, findings)).collect();
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

    fn decode(node: &Node, findings: &mut Findings) -> Option<Self> {
        let Value::List(nodes) = &node.value else {
            wrong_type(node, &format!("a list of {N}"), findings);
            return None;
        };
        if nodes.len() != N {
            findings.refuse(
                ProblemKind::WrongType,
                node.place,
                format!("this is a list of {}, a list of {N} is due", nodes.len()),
                None,
            );
            return None;
        }
        Vec::decode(node, findings)?.try_into().ok()
    }

    fn numbers(&self) -> Vec<Measured> {
        self.iter().flat_map(T::numbers).collect()
    }
}
