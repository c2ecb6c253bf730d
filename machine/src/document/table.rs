//! Tables with a fixed set of keys, declared with [`table!`](crate::table!).

use schemars::{Schema, SchemaGenerator, json_schema};

use super::bounds;
use super::decode::{Decode, wrong_type};
use super::diagnostics::Diagnostics;
use super::error::ProblemKind;
use super::nearest;
use super::node::{Entry, Literal, Node, Span, Value};

/// A key of a declared table.
#[derive(Debug, Clone)]
pub struct Field {
    /// The key.
    pub key: &'static str,
    /// Its documentation, as it was written.
    pub documentation: &'static str,
    /// What it is when it is not there.
    pub default: Option<Literal>,
    /// Whether it must be there.
    pub required: bool,
}

/// Reads the fields of one table.
#[derive(Debug)]
pub struct TableReader<'a> {
    name: &'static str,
    entries: &'a [Entry],
    span: Span,
    misspelt: Vec<&'static str>,
}

impl<'a> TableReader<'a> {
    /// Starts on `node`, which must be a table of the type called `name`, and reports the keys that
    /// `fields` does not have.
    pub fn open(
        name: &'static str,
        node: &'a Node,
        fields: &[Field],
        diagnostics: &mut Diagnostics,
    ) -> Option<Self> {
        let Value::Table(entries) = &node.value else {
            wrong_type(node, "a table", diagnostics);
            return None;
        };
        let mut misspelt = Vec::new();
        for entry in entries {
            if fields.iter().any(|field| field.key == entry.key) {
                continue;
            }
            // Keys that are already there were hardly meant twice, except tables: a part of one
            // may stand under its own header.
            let keys = || fields.iter().map(|field| field.key);
            let is_free = |key: &&str| entries.iter().all(|entry| entry.key != *key);
            let near =
                nearest(&entry.key, keys().filter(is_free)).or_else(|| nearest(&entry.key, keys()));
            let help = match near {
                Some(near) => format!("did you mean `{near}`?"),
                None if fields.is_empty() => "nothing can be set here".to_owned(),
                None => {
                    let keys: Vec<&str> = keys().collect();
                    format!("what can be set here is {}", keys.join(", "))
                }
            };
            if let Some(near) = fields.iter().find(|field| Some(field.key) == near) {
                misspelt.push(near.key);
            }
            diagnostics.refuse(
                ProblemKind::UnknownKey,
                entry.span,
                format!("unknown key `{}`", entry.key),
                Some(help),
            );
        }
        Some(Self { name, entries, span: node.span, misspelt })
    }

    /// The value of `key`, its default, or what its absence means.
    pub fn read<T: Decode>(
        &self,
        key: &str,
        default: Option<Literal>,
        diagnostics: &mut Diagnostics,
    ) -> Option<T> {
        if let Some(entry) = self.entries.iter().find(|entry| entry.key == key) {
            let value = T::decode(&entry.node, diagnostics)?;
            for number in value.numbers() {
                bounds::check(self.name, key, &number, diagnostics);
            }
            return Some(value);
        }
        if let Some(default) = default {
            return T::decode(&default.node(self.span), diagnostics);
        }
        let absent = T::absent(self.span, diagnostics);
        // A misspelt key was reported where it stands; that it is missing too would be noise.
        if absent.is_none() && !self.misspelt.contains(&key) {
            let table = match diagnostics.text(self.span) {
                "" => "the file".to_owned(),
                table => format!("the table `{table}`"),
            };
            let help = match T::example() {
                Some(example) => format!("add `{key} = {example}` to {table}"),
                None => format!("add the table `{key}` to {table}"),
            };
            diagnostics.refuse(
                ProblemKind::MissingKey,
                self.span,
                format!("`{key}` is missing in {table}"),
                Some(help),
            );
        }
        absent
    }
}

/// The documentation of a key in one paragraph.
fn paragraph(documentation: &str) -> String {
    documentation.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The schema of a table; `types` gives the schema of each field in turn.
#[doc(hidden)]
pub fn table_schema(
    documentation: &str,
    fields: &[Field],
    types: &[fn(&mut SchemaGenerator) -> Schema],
    generator: &mut SchemaGenerator,
) -> Schema {
    let mut properties = serde_json::Map::new();
    let mut required = Vec::new();
    for (field, schema_of) in fields.iter().zip(types) {
        let mut schema = schema_of(generator);
        schema.insert("description".to_owned(), paragraph(field.documentation).into());
        if let Some(default) = field.default {
            schema.insert("default".to_owned(), default.json());
        }
        properties.insert(field.key.to_owned(), schema.to_value());
        if field.required {
            required.push(field.key);
        }
    }
    let mut schema = json_schema!({
        "type": "object",
        "description": paragraph(documentation),
        "properties": properties,
        "additionalProperties": false,
    });
    if !required.is_empty() {
        schema.insert("required".to_owned(), required.into());
    }
    schema
}

/// Declares a table of a document: a struct, how it is decoded, and its JSON schema.
///
/// A field is a key; its documentation goes into the schema. `= literal` is its default, written
/// as in the document. Without one, [`Option`]s and tables without required keys may be left out,
/// and everything else must be there. The struct gets a further field `span`, that of its key.
#[macro_export]
macro_rules! table {
    (
        $(#[doc = $about:expr])*
        pub struct $name:ident {
            $( $(#[doc = $doc:expr])* pub $field:ident : $type:ty $(= $default:literal)? ),* $(,)?
        }
    ) => {
        $(#[doc = $about])*
        #[derive(Debug, Clone)]
        pub struct $name {
            $( $(#[doc = $doc])* pub $field: $type, )*
            /// Where the table stands.
            pub span: $crate::document::Span,
        }

        impl $name {
            /// The keys of the table, in the order of their declaration.
            pub fn fields() -> Vec<$crate::document::Field> {
                vec![$( {
                    let default: Option<$crate::document::Literal> =
                        $crate::table!(@default $($default)?);
                    $crate::document::Field {
                        key: stringify!($field),
                        documentation: concat!($($doc, "\n"),*),
                        required: default.is_none()
                            && <$type as $crate::document::Decode>::required(),
                        default,
                    }
                } ),*]
            }
        }

        impl $crate::document::Decode for $name {
            fn decode(
                node: &$crate::document::Node,
                diagnostics: &mut $crate::document::Diagnostics,
            ) -> Option<Self> {
                let reader = $crate::document::TableReader::open(
                    stringify!($name),
                    node,
                    &Self::fields(),
                    diagnostics,
                )?;
                $(
                    let $field: Option<$type> = reader.read(
                        stringify!($field),
                        $crate::table!(@default $($default)?),
                        diagnostics,
                    );
                )*
                Some(Self { $( $field: $field?, )* span: node.span })
            }

            fn absent(
                span: $crate::document::Span,
                diagnostics: &mut $crate::document::Diagnostics,
            ) -> Option<Self> {
                if <Self as $crate::document::Decode>::required() {
                    return None;
                }
                <Self as $crate::document::Decode>::decode(
                    &$crate::document::Node::empty_table(span),
                    diagnostics,
                )
            }

            fn required() -> bool {
                Self::fields().iter().any(|field| field.required)
            }
        }

        impl $crate::document::JsonSchema for $name {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(
                generator: &mut $crate::document::SchemaGenerator,
            ) -> $crate::document::Schema {
                $crate::document::table_schema(
                    concat!($($about, "\n"),*),
                    &Self::fields(),
                    &[$( <$type as $crate::document::Decode>::field_schema ),*],
                    generator,
                )
            }
        }
    };
    (@default) => { None };
    (@default $default:literal) => { Some($crate::document::Literal::from($default)) };
}
