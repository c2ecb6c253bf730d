//! `graver plan`: jobs on paper beside what is planned, and how far the tool strays from its strokes.

#![allow(clippy::unwrap_used)]

mod support;

use support::Place;

/// Source 004's line from (300, 360) to (420, 420) mm at 20 mm/s and 0.1 m/s², which makes 80,660 pulses of
/// one actuator and −34,926 of the other.
#[test]
fn a_line_on_paper_makes_the_golden_pulses() {
    let place = Place::new();
    let job = place.file("line.ngc", "G21 G90\nM4 S1000 F1200\nG1 X20 Y60\nM5\nM2\n");
    let machine = support::source("machines").join("twin_actuator.toml");
    let samples = place.path("samples.csv");
    let graver = |more: &[&str]| {
        let arguments = ["plan", job.to_str().unwrap(), "--machine", machine.to_str().unwrap()];
        let settings = [
            "machine.home=[\"300 mm\", \"360 mm\"]",
            "machine.area.x=[\"290 mm\", \"450 mm\"]",
            "machine.path.acceleration=\"0.1 m/s^2\"",
        ];
        let settings = settings.iter().flat_map(|setting| ["--set", setting]);
        let all: Vec<&str> = arguments.into_iter().chain(settings).chain(more.to_vec()).collect();
        place.graver(&all)
    };
    let pulses = place.path("pulses.csv");
    let files = ["--pulses", pulses.to_str().unwrap(), "--samples", samples.to_str().unwrap()];
    let paper = [&["--json", "--ideal", "--profile", "velocity"], &files[..]].concat();
    let report = graver(&paper).json(0);
    support::assert_valid("plan", &report);
    assert_eq!(report["pulses"]["counts"], serde_json::json!([80660, -34926]));
    let of = |key: &str| report["pulses"][key].as_f64().unwrap();
    let bound = of("bound");
    assert!((bound / 1.248_012_86e-6 - 1.0).abs() < 1e-4, "{bound}");
    // At each pulse and not each millisecond: at least what the golden vectors have.
    let most = of("deviation_max");
    assert!((1.228e-6..=1.02 * bound).contains(&most), "{most} against {bound}");
    let paper = &report["paper"];
    let time = paper["time"].as_f64().unwrap();
    assert!((time - 6.908_203_932_499_37).abs() < 1e-9, "{time}");
    assert_eq!(paper["profile"], "velocity");
    assert_eq!(paper["strokes"][0]["line"], 3);
    // What Graver makes of it is beside it: with a jerk of 10 m/s³ it takes a little longer.
    let own = report["time"].as_f64().unwrap();
    assert!(own > time && own < 1.02 * time, "{own}");
    let rows = std::fs::read_to_string(&samples).unwrap().lines().count();
    assert_eq!(rows, 6909 + 2, "a heading and both ends");

    let told = graver(&["--ideal", "--profile", "velocity"]);
    told.accepted();
    assert!(
        told.error.contains("6.9082 s at 0.0200 m/s by a trapezoid of velocity"),
        "{}",
        told.error
    );
}

#[test]
fn a_profile_is_for_paper_only() {
    let place = Place::new();
    let refused = place.graver(&["plan", "--profile", "trapezoid", "--json"]);
    let error = refused.json(2);
    let message = error["error"]["message"].as_str().unwrap();
    assert!(message.contains("--ideal"), "{message}");
    let machine = support::source("machines").join("mcm.toml");
    let machine = machine.to_str().unwrap();
    let refused = place.graver(&[
        "plan",
        "--machine",
        machine,
        "--ideal",
        "--profile",
        "trapezoid",
        "--json",
    ]);
    let error = refused.json(2);
    let message = error["error"]["message"].as_str().unwrap();
    assert!(message.contains("[surface]"), "{message}");
}

#[test]
fn the_check_of_paths_is_told_and_written() {
    let place = Place::new();
    let machine = support::source("machines").join("mcm.toml");
    let job = support::source("jobs").join("mcm.toml");
    let file = place.path("check.csv");
    let graver = |more: &[&str]| {
        let arguments = ["plan", job.to_str().unwrap(), "--machine", machine.to_str().unwrap()];
        place.graver(&[&arguments, more].concat())
    };
    let report = graver(&["--path-check", file.to_str().unwrap(), "--json"]).json(0);
    support::assert_valid("plan", &report);
    let strokes = report["strokes"].as_u64().unwrap() as usize;
    let checked = &report["path_check"];
    assert_eq!(checked["strokes"], strokes);
    assert!(checked["executed"]["surface"].as_f64().unwrap() < 1e-6, "{checked:#}");
    assert_eq!(checked["linear"]["too_many"], 0);
    let text = std::fs::read_to_string(&file).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(
        text.lines().next(),
        Some("stroke,interpolation,knots,matched,geometric,surface,axis")
    );
    assert_eq!(rows.len(), 1 + 4 * strokes);
    let knots = |name: &str| -> u64 {
        let rows = rows.iter().filter(|row| row[1] == name);
        rows.map(|row| row[2].parse::<u64>().unwrap()).sum()
    };
    for name in ["linear", "natural", "not_a_knot"] {
        assert_eq!(checked[name]["knots"], knots(name));
    }
    let worst = rows.iter().filter(|row| row[1] == "executed").map(|row| row[3].parse().unwrap());
    assert_eq!(checked["executed"]["matched"], worst.fold(0.0, f64::max));

    // Without the file the plan says as much as it saw; and no input is written over.
    let told = graver(&[]);
    told.accepted();
    assert!(told.error.contains("between   the tool strays by 0."), "{}", told.error);
    assert!(told.error.contains("from the surface"), "{}", told.error);
    let plan = graver(&["--json"]).json(0);
    assert_eq!(plan["path_check"], serde_json::Value::Null);
    assert!(plan["interpolation"]["deviation"].as_f64().unwrap() < 1e-6);
    let own = place.file("own.ngc", "G21\nM4 S1000 F600\nG1 X5\nM2\n");
    let own = own.to_str().unwrap();
    let taken = place.graver(&["plan", own, "--path-check", own]);
    assert_eq!(taken.code, Some(2), "{}", taken.error);
    assert!(taken.error.contains("--path-check"), "{}", taken.error);
    assert!(std::fs::read_to_string(own).unwrap().contains("G1 X5"));
}
