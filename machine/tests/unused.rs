//! What a machine file says has an effect: a table or key that no mechanism reads is an error, and what
//! is read changes the machine.

#![allow(clippy::unwrap_used)]

use machine::Machine;
use machine::document::Override;
use serde_json::Value;

/// The shipped files.
fn files() -> Vec<(String, String)> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../machines");
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            files.push((name, std::fs::read_to_string(&path).unwrap()));
        }
    }
    files.sort();
    files
}

/// What two readings of a file differ in, but for places and what is told.
fn is_other(one: &Machine, other: &Machine) -> bool {
    let bare = |machine: &Machine| Machine {
        warnings: Vec::new(),
        name: String::new(),
        ..machine.clone()
    };
    bare(one) != bare(other)
}

/// Keys whose values are only compared with others, or only told.
const COMPARED: [&str; 4] = ["nominal_torque", "nominal_speed", "name", "description"];

#[test]
fn every_number_that_is_given_changes_the_machine() {
    for (name, text) in files() {
        let machine = Machine::parse(&name, &text, &[]).unwrap();
        for (index, line) in text.lines().enumerate() {
            let code = line.split('#').next().unwrap();
            let Some((key, value)) = code.split_once('=') else { continue };
            let key = key.trim();
            if COMPARED.contains(&key) {
                continue;
            }
            let Some((number, factor)) = first_number(value) else { continue };
            let changed = value.replacen(&number, &factor, 1);
            let mut lines: Vec<&str> = text.lines().collect();
            let line = format!("{key} = {changed}");
            lines[index] = &line;
            if let Ok(other) = Machine::parse(&name, &lines.join("\n"), &[]) {
                assert!(is_other(&machine, &other), "{name}: `{line}` changes nothing");
            }
        }
    }
}

/// The first number of a value, and another one near it.
fn first_number(value: &str) -> Option<(String, String)> {
    let start = value.find(|letter: char| letter.is_ascii_digit())?;
    let rest = &value[start..];
    let end = rest.find(|letter: char| !letter.is_ascii_digit() && !".e-".contains(letter));
    let number = &rest[..end.unwrap_or(rest.len())];
    let found: f64 = number.parse().ok()?;
    let other = if found == 0.0 {
        0.001
    } else if found.fract() == 0.0 {
        found + 1.0
    } else {
        found * 1.01
    };
    Some((number.to_owned(), other.to_string()))
}

/// The table of the schema that a value at `path` of a file belongs to.
fn table_of<'a>(path: &str, schema: &'a Value) -> &'a Value {
    let mut table = schema;
    for part in path.split('.') {
        let field = &table["properties"][part];
        let field = if field.is_null() { &table["additionalProperties"] } else { field };
        table = resolved(field, schema);
        if table["type"] == "array" {
            table = resolved(&table["items"], schema);
        }
    }
    table
}

fn resolved<'a>(field: &'a Value, root: &'a Value) -> &'a Value {
    let alternatives =
        ["anyOf", "allOf", "oneOf"].into_iter().find_map(|key| field[key].as_array());
    let one = alternatives.and_then(|all| all.iter().find(|one| one.get("$ref").is_some()));
    let found = one.unwrap_or(field);
    match found["$ref"].as_str() {
        Some(reference) => root.pointer(reference.trim_start_matches('#')).unwrap(),
        None => found,
    }
}

/// A value that the schema of a key takes; `None` for tables and words.
fn example(field: &Value) -> Option<String> {
    if let Some(text) = field["examples"].get(0).and_then(Value::as_str) {
        return Some(text.to_owned());
    }
    if field["type"] == "number" {
        // No default is that, and it is a share too.
        return Some("0.37".to_owned());
    }
    if field["type"] == "array" {
        let one = example(&field["items"])?;
        let count = field["minItems"].as_u64().unwrap_or(1) as usize;
        let one = if field["items"]["type"] == "number" { one } else { format!("\"{one}\"") };
        return Some(format!("[{}]", vec![one; count].join(", ")));
    }
    field["anyOf"].as_array()?.iter().find_map(example)
}

/// Every key that could stand in a table of a shipped file and does not, and every transmission that an
/// axis could have: it is refused, or changes the machine.
#[test]
fn every_key_that_could_be_given_changes_the_machine_or_is_refused() {
    let schema: Value = serde_json::from_str(&machine::file::schema()).unwrap();
    let mut tried = 0;
    for (name, text) in files() {
        let machine = Machine::parse(&name, &text, &[]).unwrap();
        let headers = text.lines().filter(|line| line.starts_with('[') && !line.starts_with("[["));
        let paths: Vec<&str> = headers
            .map(|line| line.split('#').next().unwrap().trim().trim_matches(['[', ']']))
            .collect();
        for path in &paths {
            // A table of names that the file chooses has none.
            let keys = table_of(path, &schema)["properties"].as_object();
            for (key, field) in keys.into_iter().flatten() {
                let Some(value) = example(field) else { continue };
                if COMPARED.contains(&key.as_str()) || is_there(&text, path, key) {
                    continue;
                }
                let setting: Override = format!("{path}.{key}={value}").parse().unwrap();
                if let Ok(other) = Machine::parse(&name, &text, &[setting]) {
                    tried += 1;
                    let told = format!("{name}: {path}.{key} = {value}");
                    assert!(is_other(&machine, &other), "{told} changes nothing");
                }
            }
        }
        for axis in &machine.axes {
            for transmission in [
                "screw.lead=5.3 mm/rev",
                "belt.pulley_radius=10.3 mm",
                "rack.pinion_radius=10.3 mm",
                "planar.pitch=1.3 mm",
                "direct.inertia=1.3e-5 kg m^2",
            ] {
                let setting = format!("axis.{}.transmission.{transmission}", axis.name);
                let setting: Override = setting.parse().unwrap();
                if let Ok(other) = Machine::parse(&name, &text, &[setting]) {
                    tried += 1;
                    assert!(is_other(&machine, &other), "{name}: {} {transmission}", axis.name);
                }
            }
        }
    }
    assert!(tried > 100, "{tried}");
}

/// Whether the file has this key.
fn is_there(text: &str, path: &str, key: &str) -> bool {
    let table: toml::Table = text.parse().unwrap();
    let mut found = Some(toml::Value::Table(table));
    for part in path.split('.').chain([key]) {
        found = found.and_then(|value| value.get(part).cloned());
    }
    found.is_some()
}

/// The first refusal of a shipped file with this setting.
fn refusal(name: &str, setting: &str) -> String {
    let (name, text) = files().into_iter().find(|(file, _)| file == name).unwrap();
    let error = Machine::parse(&name, &text, &[setting.parse().unwrap()]).unwrap_err();
    error.problems().next().unwrap().message()
}

#[test]
fn a_refusal_names_what_takes_its_place() {
    for (file, setting, expected) in [
        (
            "five_bar.toml",
            "frame.rotation=1 mrad",
            "[frame] has no effect on [mechanism.five_bar]; put what it says into the dimensions of the \
             mechanism; it is of a cartesian, a corexy and a galvo",
        ),
        (
            "corexy.toml",
            "home_axes=[\"0 mm\", \"0 mm\"]",
            "`home_axes` has no effect: a place of a corexy says how its axes stand; write `home`, where \
             the tool rests",
        ),
        (
            "corexy.toml",
            "axis.a.friction.brake_release=10 ms",
            "`brake_release` has no effect: there is no `brake`; give the `brake` its torque, or remove \
             its release",
        ),
        (
            "polar.toml",
            "axis.d.transmission.screw.damping_ratio=0.5",
            "`damping_ratio` has no effect: without a `stiffness` the transmission is rigid; say how \
             stiff it is, or leave the damping out",
        ),
        (
            "corexy.toml",
            "frame.scale_z=1.001",
            "this has no effect: the mechanism has no z axis; leave z out, or add the z axis",
        ),
        (
            "galvo.toml",
            "mechanism.galvo.mirror_distance=15 mm",
            "`mirror_distance` has no effect: a lens brings beams of one direction to one place, wherever \
             they enter; remove it",
        ),
    ] {
        assert_eq!(refusal(file, setting), expected, "{file} {setting}");
    }
}
