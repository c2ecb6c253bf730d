//! Whether a job is one file. What comes from far away must open no other file of the computer that it comes to.

use super::JOB_FILE;
use super::composition::is_font_file;
use machine::Override;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Keys of a job file whose values are paths.
const FILES: [&str; 2] = ["file", "csv"];

/// The key of a font: a path, or the name of one that the computer has.
const FONT: &str = "font";

/// The longest name that is repeated [characters].
const LONGEST: usize = 200;

/// Another file that a job names.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{key} = {name:?}` names another file, and this job must be one file with all that it needs"
)]
pub struct OtherFile {
    /// The key that names it.
    pub key: String,
    /// What it names.
    pub name: String,
    /// The line of the job file from 1; `None` in a change of the job.
    pub line: Option<u64>,
}

/// The first other file that the job in the file called `path`, with this content and these changes, would open. Nothing is
/// opened for this. A job file that is not TOML names none: it is refused before it is read on.
pub fn other_file(path: &Path, content: &[u8], changes: &[Override]) -> Option<OtherFile> {
    let extension = path.extension().and_then(|extension| extension.to_str());
    // Of any other kind the changes alone are a job file.
    let is_job_file = extension.is_some_and(|extension| extension.eq_ignore_ascii_case(JOB_FILE));
    let text = if is_job_file { String::from_utf8_lossy(content) } else { "".into() };
    let (table, _) = DeTable::parse_recoverable(&text);
    let line =
        |start: usize| text.get(..start).map(|before| before.matches('\n').count() as u64 + 1);
    let named = in_table(table.get_ref()).map(|(key, name, start)| OtherFile {
        key,
        name,
        line: line(start),
    });
    named.or_else(|| changes.iter().find_map(in_change))
}

/// What a change names, as `--set` takes it: a value of TOML, or else a text.
fn in_change(change: &Override) -> Option<OtherFile> {
    let key = change.key.rsplit('.').next().unwrap_or_default();
    let (key, name) = match DeValue::parse(&change.value) {
        Ok(value) => in_value(key, &value).map(|(key, name, _)| (key, name))?,
        Err(_) => path_in(key, &change.value)?,
    };
    Some(OtherFile { key, name, line: None })
}

/// Key, path and place of the first path below a table.
fn in_table(table: &DeTable<'_>) -> Option<(String, String, usize)> {
    // In the order of the file, which the table does not have.
    let found = table.iter().filter_map(|(key, value)| in_value(key.get_ref(), value));
    found.min_by_key(|(_, _, start)| *start)
}

fn in_value(key: &str, value: &Spanned<DeValue<'_>>) -> Option<(String, String, usize)> {
    match value.get_ref() {
        DeValue::String(text) => {
            let (key, name) = path_in(key, text)?;
            Some((key, name, value.span().start))
        }
        DeValue::Array(values) => values.iter().find_map(|value| in_value(key, value)),
        DeValue::Table(table) => in_table(table),
        _ => None,
    }
}

/// The key and the path, if this text is one.
fn path_in(key: &str, text: &str) -> Option<(String, String)> {
    let is_path = FILES.contains(&key) || (key == FONT && is_font_file(text));
    is_path.then(|| (key.to_owned(), text.chars().take(LONGEST).collect()))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use serde_json::Value;

    fn found(name: &str, content: &str, set: &[&str]) -> Option<(String, Option<u64>)> {
        let set: Vec<Override> = set.iter().map(|change| change.parse().unwrap()).collect();
        let other = other_file(Path::new(name), content.as_bytes(), &set);
        other.map(|other| (other.name, other.line))
    }

    #[test]
    fn a_file_that_a_job_names_is_found_wherever_it_is_named() {
        let at = |name: &str, line: u64| Some((name.to_owned(), Some(line)));
        for (text, expect) in [
            ("[gcode]\nfile = \"/etc/passwd\"\n", at("/etc/passwd", 2)),
            (
                "[[drawing]]\ntext.text = \"a\"\n[[drawing]]\n\"file\" = '''../x.svg'''\n",
                at("../x.svg", 4),
            ),
            ("drawing = [{ serial = { csv = \"x.csv\" } }]\n", at("x.csv", 1)),
            ("drawing.text = { text = \"a\", font = \"/fonts/a.ttf\" }", at("/fonts/a.ttf", 1)),
            ("drawing.text = { text = \"a\", font = \"a.OTF\" }", at("a.OTF", 1)),
            ("drawing.text = { text = \"/etc/passwd\", font = \"DejaVu Sans\" }", None),
            ("[letters]\ntext = \"S\"\n", None),
        ] {
            for name in ["job.toml", "JOB.TOML"] {
                assert_eq!(found(name, text, &[]), expect, "{text}");
            }
            assert_eq!(found("job.ngc", text, &[]), None, "it is G-code, whatever is in it");
        }
    }

    #[test]
    fn a_change_names_files_as_well() {
        let file = |name: &str| Some((name.to_owned(), None));
        assert_eq!(
            found("a.svg", "<svg/>", &["drawing.serial.csv=/etc/passwd"]),
            file("/etc/passwd")
        );
        assert_eq!(found("a.toml", "", &["cloud={file=\"p.ply\"}"]), file("p.ply"));
        assert_eq!(found("a.toml", "", &["drawing.text.font=b.ttf"]), file("b.ttf"));
        assert_eq!(found("a.ngc", "M2", &["marking.power=30 %"]), None);
        assert_eq!(
            found("a.toml", "file = \"b.ngc\"\n[", &[]),
            Some(("b.ngc".to_owned(), Some(1))),
            "cut short"
        );
        let other = other_file(Path::new("a.toml"), b"[gcode]\nfile = \"b.ngc\"", &[]).unwrap();
        let words = other.to_string();
        assert!(words.contains("file = \"b.ngc\"") && words.contains("one file"), "{words}");
    }

    /// Whoever adds a path to the job file finds this test: what is relative to the job file is a path.
    #[test]
    fn every_path_of_the_job_file_is_known_here() {
        let schema = concat!(env!("CARGO_MANIFEST_DIR"), "/../jobs/schema.json");
        let schema: Value = serde_json::from_slice(&std::fs::read(schema).unwrap()).unwrap();
        let mut keys = Vec::new();
        paths(&schema, &mut keys);
        keys.sort();
        keys.dedup();
        assert_eq!(keys, ["csv", "file", "font"]);
    }

    fn paths(schema: &Value, keys: &mut Vec<String>) {
        let properties = schema["properties"].as_object().into_iter().flatten();
        for (key, property) in properties {
            let text = property["description"].as_str().unwrap_or_default();
            if text.contains("relative to this") {
                keys.push(key.clone());
            }
        }
        match schema {
            Value::Object(object) => object.values().for_each(|value| paths(value, keys)),
            Value::Array(list) => list.iter().for_each(|value| paths(value, keys)),
            _ => {}
        }
    }
}
