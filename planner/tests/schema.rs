//! The committed schema of job files is the generated one. `GRAVER_WRITE_SCHEMA=1 cargo test -p
//! planner --test schema` writes it.

#![allow(clippy::unwrap_used)]

use serde_json::Value;

const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../jobs/schema.json");

#[test]
fn the_committed_schema_is_the_generated_one() {
    let generated = planner::job::file::schema();
    if std::env::var_os("GRAVER_WRITE_SCHEMA").is_some() {
        std::fs::write(PATH, &generated).unwrap();
    }
    let committed = std::fs::read_to_string(PATH).unwrap();
    assert!(committed == generated, "jobs/schema.json is not what the tables give");
}

#[test]
fn the_schema_knows_every_key_of_the_shipped_job() {
    let schema: Value = serde_json::from_str(&planner::job::file::schema()).unwrap();
    let table: toml::Table = include_str!("../../jobs/letters.toml").parse().unwrap();
    for (section, keys) in &table {
        let reference = &schema["properties"][section];
        let reference = reference.get("$ref").or_else(|| reference.pointer("/allOf/0/$ref"));
        let path = reference.unwrap().as_str().unwrap().trim_start_matches('#');
        for key in keys.as_table().unwrap().keys() {
            let field = schema.pointer(path).unwrap().pointer(&format!("/properties/{key}"));
            assert!(field.is_some(), "{section}.{key}");
        }
    }
}
