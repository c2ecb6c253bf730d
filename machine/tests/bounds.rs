//! The bounds of a machine file's numbers, as a table.

#![allow(clippy::unwrap_used)]

use machine::document::{Bounds, Override, ProblemKind};
use machine::file::bounds::BOUNDS;
use machine::{Machine, quantity};
use serde_json::Value;

const MANUAL: &str = include_str!("../../docs/machine-files.md");

const COREXY: &str = include_str!("../../machines/corexy.toml");

/// The laser's delays, the period of the cycle and the tolerated stall have one range each, which
/// `validate` tells in words of its own.
const ELSEWHERE: [&str; 4] =
    ["LaserTable.on_delay", "LaserTable.off_delay", "RealtimeTable.period", "RealtimeTable.stall"];

#[test]
fn every_range_is_written_in_one_unit_and_what_is_usual_is_possible() {
    for bounds in BOUNDS {
        let read = |ends| Bounds::range(ends).unwrap_or_else(|| panic!("{bounds:?}"));
        let (possible, dimension) = read(bounds.possible);
        let (usual, of_usual) = read(bounds.usual);
        assert_eq!(dimension, of_usual, "{bounds:?}");
        let order = [possible[0], usual[0], usual[1], possible[1]];
        assert!(order.is_sorted() && possible[0] < possible[1], "{bounds:?}");
        assert!(!bounds.keys.is_empty() && bounds.reason.len() > 10, "{bounds:?}");
        // Products of a few values at their ends stay numbers.
        assert!(possible.iter().all(|end| end.abs() <= quantity::LARGEST), "{bounds:?}");
    }
}

/// Every key of the schema that takes a number, as TYPE.key.
fn numeric_keys() -> Vec<String> {
    fn is_numeric(schema: &Value) -> bool {
        let alternatives = schema["anyOf"].as_array().into_iter().flatten();
        schema["type"] == "number"
            || schema.get("pattern").is_some()
            || schema.get("items").is_some_and(is_numeric)
            || alternatives.into_iter().any(is_numeric)
    }
    let schema: Value = serde_json::from_str(&machine::file::schema()).unwrap();
    let definitions = schema["definitions"].as_object().unwrap();
    let root = ("MachineTable".to_owned(), schema.clone());
    let tables = definitions.iter().map(|(name, table)| (name.clone(), table.clone()));
    let mut keys = Vec::new();
    for (name, table) in tables.chain([root]) {
        for (key, field) in table["properties"].as_object().into_iter().flatten() {
            if is_numeric(field) {
                keys.push(format!("{name}.{key}"));
            }
        }
    }
    keys
}

#[test]
fn every_number_of_a_machine_file_has_bounds_and_every_bound_a_number() {
    let keys = numeric_keys();
    assert!(keys.len() > 120, "{}", keys.len());
    for key in &keys {
        let rows = BOUNDS.iter().filter(|bounds| bounds.keys.contains(&key.as_str())).count();
        let elsewhere = ELSEWHERE.contains(&key.as_str());
        assert!(elsewhere || (1..=2).contains(&rows), "{key} has {rows} rows");
    }
    for key in BOUNDS.iter().flat_map(|bounds| bounds.keys) {
        assert!(keys.iter().any(|known| known == key), "{key} is no key that takes a number");
    }
}

/// The manual's table between its two marks.
fn manual_table() -> String {
    let mut table = String::from("| keys | possible | usual | taken from |\n|---|---|---|---|\n");
    for Bounds { keys, possible, usual, reason } in BOUNDS {
        let keys: Vec<String> = keys.iter().map(|key| format!("`{}`", in_a_file(key))).collect();
        let range = |ends: &[&str; 2]| format!("{} to {}", ends[0], ends[1]);
        table += &format!(
            "| {} | {} | {} | {reason} |\n",
            keys.join(", "),
            range(possible),
            range(usual)
        );
    }
    table
}

/// A key as a person finds it: the type of a table without its last word.
fn in_a_file(key: &str) -> String {
    let (table, key) = key.split_once('.').unwrap();
    let words = table.strip_suffix("Table").unwrap();
    let mut name = String::new();
    for letter in words.chars() {
        if letter.is_uppercase() && !name.is_empty() {
            name.push('_');
        }
        name.extend(letter.to_lowercase());
    }
    match name.as_str() {
        "machine" => key.to_owned(),
        name => format!("{name}.{key}"),
    }
}

/// `GRAVER_WRITE_SCHEMA=1 cargo test -p machine --test bounds` writes the manual's table anew.
#[test]
fn the_manual_has_the_table() {
    let (from, to) = ("<!-- bounds -->\n", "<!-- end of bounds -->");
    let (before, rest) = MANUAL.split_once(from).unwrap();
    let (table, after) = rest.split_once(to).unwrap();
    if std::env::var_os("GRAVER_WRITE_SCHEMA").is_some() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/machine-files.md");
        std::fs::write(path, format!("{before}{from}{}{to}{after}", manual_table())).unwrap();
        return;
    }
    assert!(table == manual_table(), "docs/machine-files.md does not have the table of bounds");
}

#[test]
fn what_is_not_possible_is_an_error_and_what_is_unusual_a_warning() {
    let parse = |from: &str, to: &str| {
        assert_eq!(COREXY.matches(from).count().min(1), 1, "{from}");
        Machine::parse("corexy.toml", &COREXY.replacen(from, to, 1), &[])
    };
    let error = parse("2.3 ohm", "2.3e-12 ohm").unwrap_err();
    let problem = error.problems().next().unwrap();
    assert_eq!((problem.kind, problem.line()), (ProblemKind::OutOfRange, Some(47)));
    assert_eq!(
        problem.message(),
        "`resistance` cannot be `2.3e-12 ohm`; possible is 1e-4 ohm to 1e5 ohm, usual 0.01 ohm to \
         1000 ohm: large servo motors have 20 mohm, motors of 6 mm for 6 V 100 ohm"
    );
    let machine = parse("2.3 ohm", "2.3 mohm").unwrap();
    let warning = &machine.warnings[0];
    assert_eq!((warning.line, warning.column), (47, 14));
    assert_eq!(
        warning.text,
        "`resistance` of 2.3 mohm is unusual: it is mostly 0.01 ohm to 1000 ohm (large servo motors \
         have 20 mohm, motors of 6 mm for 6 V 100 ohm)"
    );
    let setting: Override = "axis.a.motor.dc.resistance=2.3 mohm".parse().unwrap();
    let machine = Machine::parse("corexy.toml", COREXY, &[setting]).unwrap();
    let warning = &machine.warnings[0];
    assert_eq!((warning.line, warning.column), (0, 0));
    let told =
        "--set machine.axis.a.motor.dc.resistance=2.3 mohm: `resistance` of 2.3 mohm is unusual";
    assert!(warning.text.starts_with(told), "{}", warning.text);
}

/// Slips of a unit: 54 g cm² written as kg m², 2 mm in a turn as in a degree, a pulley's diameter in metres.
#[test]
fn slips_of_a_unit_are_errors() {
    let cartesian = include_str!("../../machines/cartesian.toml");
    let refused = |text: &str, setting: &str| {
        let error = Machine::parse("x.toml", text, &[setting.parse().unwrap()]).unwrap_err();
        let problem = error.problems().next().unwrap();
        assert_eq!(problem.kind, ProblemKind::OutOfRange, "{setting}: {error}");
    };
    refused(COREXY, "axis.a.motor.dc.rotor_inertia=54 kg m^2");
    refused(cartesian, "mechanism.cartesian.x.lead=2 mm/deg");
    refused(COREXY, "mechanism.corexy.pulley_radius=12.73 m");
    refused(COREXY, "mechanism.corexy.mass_x=330000 kg");
    refused(COREXY, "frame.skew=0.4 rev");
    refused(COREXY, "frame.scale_x=20");
}

#[test]
fn a_joint_has_bounds_of_its_own_unit() {
    // 5 cm are no following error, 0.05 rad are.
    let five_bar = include_str!("../../machines/five_bar.toml");
    let set = |text: &str, setting: &str| {
        let machine = Machine::parse("x.toml", text, &[setting.parse().unwrap()]).unwrap();
        machine.warnings.iter().filter(|warning| warning.text.contains("is unusual")).count()
    };
    assert_eq!(set(COREXY, "axis.a.limits.following_error=50 mm"), 1);
    assert_eq!(set(five_bar, "axis.th1.limits.following_error=0.05 rad"), 0);
    assert_eq!(set(five_bar, "axis.th1.limits.following_error=30 deg"), 1);
}

#[test]
fn the_shipped_files_are_usual() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../machines");
    let mut files = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        files += 1;
        let machine = Machine::load(&path, &[]).unwrap();
        // The source's own table contradicts itself, and the files tell it as it is printed.
        let warnings: Vec<&str> = machine
            .warnings
            .iter()
            .map(|warning| warning.text.as_str())
            .filter(|text| !text.contains("the nominal torque of 0.200 N·m at 3000 rpm"))
            .collect();
        assert!(warnings.is_empty(), "{}: {warnings:#?}", path.display());
    }
    assert_eq!(files, 18);
}
