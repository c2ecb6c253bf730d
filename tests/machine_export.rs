//! `graver machine export`: profiles that LightBurn and Rayforge read. `tests/independent/profiles.py` gives them to
//! Rayforge's own readers of both.

#![allow(clippy::unwrap_used)]

mod support;

use serde_json::Value;
use support::{Place, assert_valid};

fn read(path: &std::path::Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn a_gantry_is_told_as_it_is() {
    let place = Place::new();
    let machine = support::source("machines/gantry.toml");
    let machine = machine.to_str().unwrap();
    let arguments = ["machine", "export", "--machine", machine, "--json"];
    let exported = |more: &[&str]| {
        let report = place.graver(&[&arguments[..], more].concat()).json(0);
        assert_valid("machine_export", &report);
        report
    };
    let report = exported(&["--lbdev", "--out", "gantry.lbdev"]);
    let profile = &report["profile"];
    let device = &read(&place.path("gantry.lbdev"))["DeviceList"][0];
    let close = |value: &Value, si: &Value| {
        let (value, si) = (value.as_f64().unwrap(), si.as_f64().unwrap());
        assert!((value - si * 1e3).abs() < 1e-6, "{value} {si}");
    };
    close(&device["Width"], &profile["width"]);
    close(&device["Height"], &profile["depth"]);
    close(&device["Settings"]["Sim_RapidSpeed"], &profile["rapid"]);
    assert_eq!(device["HomeOnStartup"], profile["homes"]);
    assert_eq!(device["Settings"]["S_Scale"], profile["full_scale"]);
    assert_eq!(device["DisplayName"], profile["name"]);

    let report =
        exported(&["--rayforge", "--out", "gantry", "--host", "laser.local", "--port", "23"]);
    assert_eq!(report["files"], serde_json::json!(["gantry/device.yaml", "gantry/dialect.yaml"]));
    let device = read(&place.path("gantry/device.yaml"));
    assert_eq!(device["api_version"], 1);
    let machine = &device["machine"];
    assert_eq!(machine["driver_args"], serde_json::json!({"host": "laser.local", "port": 23}));
    close(&machine["axis_extents"][0], &profile["width"]);
    let speed = machine["max_cut_speed"].as_f64().unwrap() / 60e3;
    assert!((speed - profile["speed"].as_f64().unwrap()).abs() < 1e-4);
    let dialect = read(&place.path("gantry/dialect.yaml"));
    assert_eq!(dialect["laser_off"], "M5");
}

#[test]
fn an_origin_that_is_not_in_the_corner_is_told_with_what_to_do() {
    let place = Place::new();
    let export = |more: &[&str]| {
        let arguments = ["machine", "export", "--lbdev", "--out", "a.lbdev", "--json"];
        place.graver(&[&arguments[..], more].concat()).json(0)
    };
    let notes = |report: &Value| report["notes"].as_array().unwrap().len();
    // The note on LightBurn's port is always there.
    let machine = support::source("machines/diode_corexy.toml");
    assert_eq!(notes(&export(&["--machine", machine.to_str().unwrap()])), 1);
    let in_the_middle = export(&[]);
    assert_eq!(in_the_middle["profile"]["origin"], serde_json::json!([0.1, 0.1]));
    assert_eq!(notes(&in_the_middle), 2);
    let note = in_the_middle["notes"][0].as_str().unwrap();
    assert!(note.contains("100.000, 100.000 mm") && note.contains("g54"), "{note}");
}

#[test]
fn one_program_is_named_and_the_machine_file_is_not_written_over() {
    let place = Place::new();
    for wrong in [&["machine", "export"][..], &["machine", "export", "--lbdev", "--rayforge"]] {
        assert_eq!(place.graver(wrong).code, Some(2));
    }
    let text = std::fs::read_to_string(support::source("machines/cartesian.toml")).unwrap();
    let machine = place.file("mine.toml", &text);
    let machine = machine.to_str().unwrap();
    let ended =
        place.graver(&["machine", "export", "--lbdev", "--machine", machine, "--out", machine]);
    assert_eq!(ended.code, Some(2));
    assert!(ended.error.contains("the machine file"), "{}", ended.error);
    assert_eq!(std::fs::read_to_string(machine).unwrap(), text);
}
