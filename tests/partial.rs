//! Jobs of which not all is done, or not lit, as commands do them: what is marked of them, and what is told.

#![allow(clippy::unwrap_used)]

mod support;

use serde_json::Value;
use support::Place;

/// Four lines, two of them on one straight path.
const PROGRAM: &str =
    "G21 G90\nM4 S500 F3000\nG1 X5\nG1 X10 S0\nG1 X15 S500\nG0 Y5\nG1 X9\nG0 Y7\nG1 X2\nM2\n";

fn simulated(options: &[&str]) -> Value {
    let place = Place::new();
    let job = place.file("job.ngc", PROGRAM);
    let arguments = [&["simulate", job.to_str().unwrap(), "--json"], options].concat();
    let summary = place.graver(&arguments).json(0);
    support::assert_valid("summary", &summary);
    summary
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// What was marked up to each stroke and from it on is the whole job, nothing twice and nothing left out.
#[test]
fn a_job_goes_on_with_a_stroke_without_doubling_or_missing_a_mark() {
    let whole = simulated(&[]);
    let lengths = [5e-3, 5e-3, 6e-3, 7e-3];
    assert!((number(&whole["job"]["length"]) - 23e-3).abs() < 1e-9);
    for first in 2..=4_usize {
        let rest = simulated(&["--from-stroke", &first.to_string()]);
        assert_eq!(rest["job"]["strokes"], 5 - first);
        let length: f64 = lengths[first - 1..].iter().sum();
        assert!((number(&rest["job"]["length"]) - length).abs() < 1e-9, "{first}");
        let marks = &rest["marks"];
        assert!((number(&marks["length"]) - length).abs() < 2e-5, "{first} {marks:#}");
        for key in ["missing", "double", "stray"] {
            assert!(number(&marks[key]) < 2e-5, "{first} {marks:#}");
        }
        assert_eq!(marks["strokes_lost"], 0);
    }
}

/// The first and the last place at which light fell in a simulation, and the marks as judged.
fn lit_from(options: &[&str]) -> ([f64; 2], Value) {
    let place = Place::new();
    let job = place.file("job.ngc", PROGRAM);
    let out = place.path("run");
    let arguments = ["simulate", job.to_str().unwrap(), "--json", "--out", out.to_str().unwrap()];
    let summary = place.graver(&[&arguments[..], options].concat()).json(0);
    let records = place.recording("run");
    // Light falls in the cycle before the measurement; at the speed of the job that is 50 µm.
    let lit = records.windows(2).filter(|pair| pair[1].feedback.laser.is_lit());
    let places: Vec<f64> =
        lit.flat_map(|pair| [pair[0].feedback.tool[0], pair[1].feedback.tool[0]]).collect();
    ([places[0], *places.last().unwrap()], summary)
}

/// Stopped within a stroke, and gone on with from there: both runs together mark the job once, and the way to the place is
/// dark.
#[test]
fn a_job_goes_on_within_a_stroke_without_doubling_or_missing_a_mark() {
    let (whole, all) = lit_from(&[]);
    // The second stroke is from 10 to 15 mm of a path on which the first one lies too.
    for along in [1.25, 3.0] {
        let length = format!("{along} mm");
        let (rest, summary) = lit_from(&["--from-stroke", "2", "--from-along", &length]);
        support::assert_valid("summary", &summary);
        let marks = &summary["marks"];
        let expected = 18e-3 - along * 1e-3;
        assert!((number(&summary["job"]["length"]) - expected).abs() < 1e-9);
        assert!((number(&marks["length"]) - expected).abs() < 2e-5, "{marks:#}");
        for key in ["missing", "double", "stray"] {
            assert!(number(&marks[key]) < 2e-5, "{marks:#}");
        }
        // Where the first run would have been stopped, and not before.
        let offset = rest[0] - (whole[0] + 10e-3 + along * 1e-3);
        assert!(offset.abs() < 120e-6, "light begins {offset} m off");
        assert!((rest[1] - whole[1]).abs() < 120e-6);
        let together = 5e-3 + along * 1e-3 + number(&marks["length"]);
        let marked = number(&all["marks"]["length"]);
        assert!((together - marked).abs() < 4e-5, "{together} m of {marked} m");
    }
}

#[test]
fn a_dry_run_and_a_frame_mark_nothing_and_miss_nothing() {
    let whole = simulated(&[]);
    for (options, dry) in [(&["--dry-run"][..], true), (&["--frame"], false)] {
        let summary = simulated(options);
        assert_eq!(summary["outcome"], "completed");
        assert_eq!(summary["job"]["dry_run"], dry);
        for key in ["length", "missing", "double", "strokes_lost"] {
            assert_eq!(number(&summary["marks"][key]), 0.0, "{options:?} {key}");
        }
        assert_eq!(dry, summary["time"] == whole["time"]);
        let told = summary["warnings"].as_array().unwrap();
        let what = if dry { "dry run" } else { "only the frame is shown, 15.000 mm × 7.000 mm" };
        assert!(told.iter().any(|text| text.as_str().unwrap().contains(what)), "{told:?}");
    }
}

#[test]
fn every_command_that_takes_a_job_takes_these_options() {
    let place = Place::new();
    let job = place.file("job.ngc", PROGRAM);
    let job = job.to_str().unwrap();
    let plan = place.graver(&["plan", job, "--from-line", "7", "--json"]).json(0);
    assert_eq!(plan["strokes"], 2);
    let check = place.graver(&["check", job, "--dry-run", "--json"]).json(0);
    assert_eq!((&check["job"]["dry_run"], &check["job"]["strokes"]), (&true.into(), &0.into()));
    for command in ["plan", "check", "simulate"] {
        let refused = place.graver(&[command, job, "--from-line", "11", "--json"]).json(2);
        let message = refused["error"]["message"].as_str().unwrap();
        assert!(message.contains("no line 11") && message.contains("line 10"), "{message}");
        let both = place.graver(&[command, job, "--from-line", "3", "--from-stroke", "2"]);
        assert_eq!(both.code, Some(2));
    }
    for arguments in [vec!["run", job], vec!["submit", job]] {
        let told = place.ask(&[&arguments[..], &["--from-stroke", "x"]].concat());
        assert_eq!(told.code, Some(2));
        assert!(told.error.contains("--from-stroke"), "{}", told.error);
    }
}
