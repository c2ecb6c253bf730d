//! `graver machine new`: what it writes is a machine that `check` has nothing to say of and that marks its
//! sample, whatever of it is left out, and nothing is lost by it.
//!
//! Machines of all sizes are in `workbench/tests/new.rs`.

#![allow(clippy::unwrap_used)]

mod support;

use support::{Place, assert_valid, number};
use workbench::new::Kind;

#[test]
fn every_kind_can_be_made_checked_and_simulated() {
    let place = Place::new();
    for kind in Kind::ALL {
        let out = place.path(&format!("{}.toml", kind.name()));
        let out = out.to_str().unwrap();
        let made = place.graver(&["machine", "new", kind.name(), "--out", out, "--json"]).json(0);
        assert_valid("machine_new", &made);
        assert_eq!(made["machine"], out);
        assert_eq!(made["lowered"].as_array().unwrap().len(), 0, "{made:#}");
        let check = place.graver(&["check", "--machine", out, "--json"]).json(0);
        assert_eq!(check["warnings"].as_array().unwrap().len(), 0, "{check:#}");
        assert_eq!(check["sample_job"], made["sample"]);
        // The very centre of a table has no angle; an MCM rests outside of its work.
        let least = if kind == Kind::Mcm { 0.75 } else { 0.999 };
        assert!(number(&check, "/reach/reached") >= least, "{}: {check:#}", kind.name());
        let marked = place.graver(&["simulate", "--machine", out, "--json"]).json(0);
        assert_eq!(marked["outcome"], "completed");
        let error = number(&marked, "/marks/error_max");
        assert!((error - number(&made, "/error_max")).abs() < 1e-12);
        assert!(error <= 20e-6, "{}: {error}", kind.name());
    }
}

#[test]
fn what_is_asked_for_is_what_is_written() {
    let place = Place::new();
    let out = place.path("mine.toml");
    let out = out.to_str().unwrap();
    let asked = [
        "--area",
        "300 x 150 mm",
        "--z",
        "6 cm",
        "--head",
        "800 g",
        "--speed",
        "0.3",
        "--acceleration",
        "8 m/s^2",
        "--name",
        "My \"first\"",
    ];
    let command = [&["machine", "new", "cartesian_lift", "--out", out][..], &asked].concat();
    // Nobody sits there to be asked.
    let made = place.graver(&command);
    made.accepted();
    assert!(made.error.contains("mine-sample.toml"), "{}", made.error);
    assert!(made.error.contains("graver check --machine"), "{}", made.error);
    let text = std::fs::read_to_string(out).unwrap();
    for line in [
        "x = [\"0 mm\", \"300 mm\"]",
        "y = [\"0 mm\", \"150 mm\"]",
        "z = [\"0 mm\", \"60 mm\"]",
        "speed = \"0.3 m/s\"",
        "acceleration = \"8 m/s^2\"",
        "sample = \"mine-sample.toml\"",
        "[axis.z.motor.dc]",
    ] {
        assert!(text.contains(line), "{line} is not in\n{text}");
    }
    let check = place.graver(&["check", "--machine", out, "--json"]).json(0);
    assert_eq!(check["machine"]["name"], "My \"first\"");
    // It is not written over, nor is its sample, but by force.
    let again = place.graver(&command);
    assert_eq!(again.code, Some(2));
    assert!(again.error.contains("mine.toml is there already"), "{}", again.error);
    assert_eq!(std::fs::read_to_string(out).unwrap(), text);
    std::fs::remove_file(out).unwrap();
    let again = place.graver(&command);
    assert!(again.error.contains("mine-sample.toml is there already"), "{}", again.error);
    place.graver(&[&command[..], &["--force"]].concat()).accepted();
    assert_eq!(std::fs::read_to_string(out).unwrap(), text);
}

#[test]
fn what_cannot_be_had_is_refused_and_nothing_is_written() {
    let place = Place::new();
    let out = place.path("mine.toml");
    let path = out.to_str().unwrap();
    let refused = |more: &[&str], text: &str| {
        let ended = place.graver(&[&["machine", "new"], more, &["--out", path]].concat());
        assert_eq!(ended.code, Some(2), "{more:?}");
        assert!(ended.error.contains(text), "{more:?}: {}", ended.error);
        assert!(!out.exists());
    };
    refused(
        &["cartesian", "--area", "10 x 200 mm"],
        "--area 10 mm: from 20 to 2000 mm can be asked for",
    );
    refused(&["corexy", "--head", "21 kg"], "--head 21 kg: from 0.01 to 20 kg can be asked for");
    refused(&["corexy", "--speed", "fast"], "--speed: ");
    refused(&["corexy", "--z", "50 mm"], "cartesian_lift does");
    refused(&["tri_planar", "--steppers"], "planar motors");
    refused(&["hexapod"], "tri_planar");
    refused(&["corexy", "--motors", "steppers"], "no corexy was found that does this");
}
