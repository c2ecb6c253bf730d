//! The committed schema is the generated one. `GRAVER_WRITE_SCHEMA=1 cargo test -p machine --test
//! schema` writes it.

#![allow(clippy::unwrap_used)]

use serde_json::Value;

const MACHINES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../machines");

const PAGE: &str = include_str!("../../docs/mechanisms.md");

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
    let mut files = 0;
    for entry in std::fs::read_dir(MACHINES).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            let table: toml::Table = std::fs::read_to_string(&path).unwrap().parse().unwrap();
            walk(&toml::Value::Table(table), &schema, &schema, &path.display().to_string());
            files += 1;
        }
    }
    assert!(files >= 9, "{files}");
}

/// Every key of a mechanism's table is named in its section of `docs/mechanisms.md`.
#[test]
fn the_page_of_mechanisms_names_every_key() {
    let schema: Value = serde_json::from_str(&machine::file::schema()).unwrap();
    let kinds = resolved(&schema, "/properties/mechanism", &schema)["properties"].clone();
    assert_eq!(kinds.as_object().unwrap().len(), 10);
    for (kind, table) in kinds.as_object().unwrap() {
        let (_, rest) =
            PAGE.split_once(&format!("\n## {kind}\n")).unwrap_or_else(|| panic!("{kind}"));
        let section = rest.split("\n## ").next().unwrap();
        for key in resolved(table, "", &schema)["properties"].as_object().unwrap().keys() {
            let is_named = [format!("`{key}`"), format!("`{key}."), format!(".{key}`")]
                .iter()
                .any(|name| section.contains(name))
                || key == "link" && section.contains("[[mechanism.serial.link]]");
            assert!(is_named, "`{key}` of {kind} is not in docs/mechanisms.md");
        }
    }
}

/// The schema at `pointer` in `schema`, its reference followed.
fn resolved<'a>(schema: &'a Value, pointer: &str, root: &'a Value) -> &'a Value {
    let mut found = schema.pointer(pointer).unwrap();
    for alternatives in ["anyOf", "allOf", "oneOf"] {
        if let Some(list) = found.get(alternatives).and_then(Value::as_array) {
            found = list.iter().find(|one| one.get("$ref").is_some()).unwrap_or(found);
        }
    }
    match found.get("$ref").and_then(Value::as_str) {
        Some(reference) => root.pointer(reference.trim_start_matches('#')).unwrap(),
        None => found,
    }
}

fn walk(value: &toml::Value, schema: &Value, root: &Value, path: &str) {
    let schema = match schema.get("$ref").or_else(|| schema.pointer("/allOf/0/$ref")) {
        Some(reference) => {
            root.pointer(reference.as_str().unwrap().trim_start_matches('#')).unwrap()
        }
        None => schema,
    };
    // Of alternatives the one of the value's own kind.
    let kind = match value {
        toml::Value::Array(_) => "array",
        toml::Value::String(_) => "string",
        _ => "",
    };
    let alternatives = schema.get("anyOf").and_then(Value::as_array).into_iter().flatten();
    let schema = alternatives
        .filter(|one| one["type"] == kind || kind == "string" && one.get("enum").is_some())
        .chain([schema])
        .next()
        .unwrap();
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
