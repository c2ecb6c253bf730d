//! The light: how its power goes with the motion.

pub(crate) mod exposure;

use machine::document::Keyword;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};

/// How light and speed go together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Policy {
    /// One speed while the light is on: the tool comes up to it in the dark and slows down in the
    /// dark.
    Constant,
    /// The light is on from rest to rest, its power in proportion to the speed.
    Proportional,
}

impl Keyword for Policy {
    const NAME: &'static str = "a policy of the light";
    const WORDS: &'static [(&'static str, Self)] =
        &[("constant", Self::Constant), ("proportional", Self::Proportional)];
}

impl JsonSchema for Policy {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Policy".into()
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        json_schema!({ "enum": ["constant", "proportional"] })
    }
}
