//! `graver figures`: pictures, their numbers, and a page of them all.

#![allow(clippy::unwrap_used)]

mod support;

use support::{Place, assert_valid, lines};

#[test]
fn figures_of_the_source_are_files_that_the_report_names() {
    let place = Place::new();
    let out = place.path("figures");
    let arguments =
        ["figures", "stiffness", "chords", "modes", "--json", "--out", out.to_str().unwrap()];
    let report = place.graver(&arguments).json(0);
    assert_valid("figures", &report);
    let figures = report["figures"].as_array().unwrap();
    assert!(figures.len() >= 10, "{report:#}");
    let read = |name: &serde_json::Value| {
        std::fs::read_to_string(out.join(name.as_str().unwrap())).unwrap()
    };
    let page = read(&report["page"]);
    for figure in figures {
        let svg = read(&figure["svg"]);
        for axis in ["x", "y"] {
            assert!(svg.contains(figure["axes"][axis].as_str().unwrap()), "{figure:#}");
        }
        let rows = read(&figure["csv"]).lines().count() as u64;
        assert_eq!(Some(rows), figure["rows"].as_u64().map(|rows| rows + 1), "{figure:#}");
        assert!(page.contains(figure["svg"].as_str().unwrap()));
    }
    // Of the source's chords, figure 2-6.
    assert!(figures.iter().any(|figure| figure["source"] == "2-6"), "{report:#}");
}

#[test]
fn a_job_is_drawn_on_the_machines_that_are_named() {
    let place = Place::new();
    let job = place.file("lines.ngc", &lines(1));
    let machine = support::source("machines/cartesian.toml");
    let out = place.path("figures");
    let arguments = [
        "figures",
        "torque",
        "motor",
        job.to_str().unwrap(),
        "--machine",
        machine.to_str().unwrap(),
        "--machine",
        machine.to_str().unwrap(),
        "--json",
        "--out",
        out.to_str().unwrap(),
    ];
    let report = place.graver(&arguments).json(0);
    assert_valid("figures", &report);
    // One machine twice has two names.
    for file in ["torque_cartesian_lines.csv", "torque_cartesian_2_lines.svg"] {
        assert!(out.join(file).is_file(), "{report:#}");
    }
    let motors = report["figures"].as_array().unwrap().iter().filter(|one| one["name"] == "motor");
    for motor in motors {
        let points = motor["more"][0].as_str().unwrap();
        assert!(std::fs::read_to_string(out.join(points)).unwrap().lines().count() > 100);
    }
}

#[test]
fn what_is_no_figure_and_no_job_is_refused_with_the_names() {
    let place = Place::new();
    let refused = place.graver(&["figures", "torques", "--json"]).json(2);
    assert_valid("summary", &refused);
    let message = refused["error"]["message"].as_str().unwrap();
    assert!(message.contains("torques") && message.contains("ellipses"), "{message}");
    // A rigid machine has no modes: nothing could be drawn.
    let machine = support::source("machines/mcm.toml");
    let refused = place
        .graver(&["figures", "modes", "--machine", machine.to_str().unwrap(), "--json"])
        .json(2);
    assert!(refused["error"]["message"].as_str().unwrap().contains("rigid"), "{refused:#}");
}
