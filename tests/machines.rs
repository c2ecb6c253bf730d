//! Every machine file that ships, on its own sample job: it is done, within the limits, and the
//! marks lie where they are drawn.

#![allow(clippy::unwrap_used)]

mod support;

use serde_json::Value;
use support::{Place, golden, number};

/// How far a mark may lie from the drawn line [m].
const ERROR: f64 = 50e-6;

/// How much may be missing or doubled at the end of a stroke [m].
const STROKE_END: f64 = 100e-6;

/// The arguments for a machine on its sample job, where that is long on a part of it.
fn sample(name: &str) -> Vec<String> {
    let machine = support::source("machines").join(format!("{name}.toml"));
    let mut arguments = vec!["--machine".to_owned(), machine.to_str().unwrap().to_owned()];
    let part = match name {
        "polar" | "polar_beam" => Some("cloud.sphere.count=20"),
        "tri_planar" | "twin_actuator" => None,
        _ => Some("letters.text=S"),
    };
    arguments.extend(part.into_iter().flat_map(|part| ["--set".to_owned(), part.to_owned()]));
    arguments
}

fn simulate(place: &Place, name: &str, job: &[&str]) -> Value {
    let sample = sample(name);
    // A job of its own takes nothing from the sample but the machine.
    let given = if job.is_empty() { &sample[..] } else { &sample[..2] };
    let mut arguments = vec!["simulate", "--json"];
    arguments.extend(given.iter().map(String::as_str));
    arguments.extend(job);
    let summary = place.graver(&arguments).json(0);
    support::assert_valid("summary", &summary);
    summary
}

/// Asserts that the job was done, how accurately, and that no limit was broken.
fn assert_done(what: &str, summary: &Value, error: f64) {
    assert_eq!(summary["outcome"], "completed", "{what}: {summary:#}");
    assert_eq!((&summary["fault"], &summary["error"]), (&Value::Null, &Value::Null), "{what}");
    let marks = |key: &str| number(summary, &format!("/marks/{key}"));
    assert!(marks("length") > 0.0, "{what}: nothing is marked");
    assert!(marks("error_max") <= error, "{what}: error {:e}", marks("error_max"));
    for key in ["missing_end_max", "double_end_max"] {
        assert!(marks(key) <= STROKE_END, "{what}: {key} {:e}", marks(key));
    }
    assert_eq!(summary["marks"]["strokes_lost"], 0, "{what}");
    for (name, used) in summary["limits"].as_object().unwrap() {
        let shares = used.as_array().cloned().unwrap_or_else(|| vec![used.clone()]);
        for share in shares.iter().map(|share| share.as_f64().unwrap()) {
            assert!((0.0..=1.01).contains(&share), "{what}: {share} of {name}");
        }
    }
}

#[test]
fn every_machine_marks_its_sample_job() {
    for name in [
        "cartesian",
        "cartesian_steppers",
        "corexy",
        "five_bar",
        "hostmot2_galvo",
        "hostmot2_steppers",
        "mcm",
        "polar",
        "polar_beam",
        "prrrp",
        "serial",
        "tri_planar",
    ] {
        assert_done(name, &simulate(&Place::new(), name, &[]), ERROR);
    }
}

#[test]
fn the_twin_actuator_errs_by_little_more_than_its_pulses() {
    // The golden vectors are of the same dimensions and the same pulses as the machine file.
    let golden = golden("twin_actuator");
    let cases = golden["cases"].as_array().unwrap().iter();
    let bound = cases.map(|case| number(case, "/output/quant_bound")).fold(0.0, f64::max);
    assert!(0.0 < bound && bound < 10e-6, "{bound:e}");
    let summary = simulate(&Place::new(), "twin_actuator", &[]);
    assert_done("twin_actuator", &summary, bound + 10e-6);
}

#[test]
fn a_job_has_one_digest_however_often_it_is_simulated() {
    for name in ["polar", "prrrp"] {
        let place = Place::new();
        let [first, again] = [0, 1].map(|_| simulate(&place, name, &[]));
        assert_eq!(first["digest"], again["digest"], "{name}");
        assert_eq!(first["marks"], again["marks"], "{name}");
    }
}

#[test]
fn the_processes_do_what_simulate_does() {
    for name in ["five_bar", "cartesian_steppers"] {
        let place = Place::new();
        let simulated = simulate(&place, name, &[]);
        let sample = sample(name);
        let mut arguments = vec!["run", "--no-realtime", "--json"];
        arguments.extend(sample.iter().map(String::as_str));
        let summary = place.ask(&arguments).json(0);
        support::assert_valid("summary", &summary);
        assert_done(name, &summary, ERROR);
        support::assert_same_commands(&summary, &simulated);
        place.assert_nothing_left(&[]);
    }
}

#[test]
fn a_backlash_that_the_machine_file_knows_of_does_little_harm() {
    let place = Place::new();
    let marks = |who: &str| {
        let mut job = vec!["--set".to_owned(), "letters.text=S".to_owned()];
        for axis in ["x", "y"] {
            job.push("--set".to_owned());
            job.push(format!("{who}.axis.{axis}.backlash=\"50 um\""));
        }
        let mut arguments = vec!["simulate", "--json", "--machine"];
        let machine = support::source("machines").join("cartesian.toml");
        arguments.push(machine.to_str().unwrap());
        arguments.extend(job.iter().map(String::as_str));
        let summary = place.graver(&arguments).json(0);
        assert_eq!(summary["outcome"], "completed", "{who}: {summary:#}");
        number(&summary, "/marks/error_rms")
    };
    // Of the plant alone, the carriages lie half a gap to either side of where they should.
    let (unknown, known) = (marks("plant"), marks("machine"));
    assert!((15e-6..35e-6).contains(&unknown), "{unknown:e}");
    assert!(known < unknown / 5.0, "{known:e} of {unknown:e}");
}

/// A line of 40 mm along x, `beside` the centre of the table [mm].
fn line(beside: f64) -> String {
    format!("G21 G90 G54\nG0 X-20 Y{beside}\nM3 S800\nF1200\nG1 X20\nM5\nG0 X60 Y0\nM2\n")
}

#[test]
fn the_polar_machine_marks_through_the_centre_of_its_table_and_beside_it() {
    let place = Place::new();
    let [through, beside] = [0.0, 1.0].map(|distance| {
        let job = place.file("line.ngc", &line(distance));
        let summary = simulate(&place, "polar", &[job.to_str().unwrap()]);
        assert_done(&format!("{distance} mm beside the centre"), &summary, ERROR);
        let length = number(&summary, "/marks/length");
        assert!((length - 0.04).abs() <= 2.0 * STROKE_END, "{length}");
        summary
    });
    // Through the centre the arm swings to the other side while the table hardly turns; beside it
    // the table turns by almost half a turn, and the laser slows down for it.
    let table = |summary| number(summary, "/limits/velocity/1");
    assert!(table(&beside) > 5.0 * table(&through), "{}", table(&beside));
    assert!(number(&beside, "/time") > number(&through, "/time"));
    let slowest = |summary| number(summary, "/marks/speed_min");
    assert!(slowest(&beside) < 0.6 * slowest(&through), "{}", slowest(&beside));
}

/// Half circles that grow from 20 to 44 mm about the table's centre, six turns of it in one stroke.
fn spiral() -> String {
    let mut job = "G21 G90 G17\nG0 X20 Y0\nM3 S1000\nF3000\n".to_owned();
    let mut from = 20.0;
    for index in 0..12 {
        let to = -(from + if index % 2 == 0 { 2.0 } else { -2.0 });
        job.push_str(&format!("G3 X{to} Y0 I{} J0\n", (to - from) / 2.0));
        from = to;
    }
    job + "M5\nM2\n"
}

#[test]
fn a_stroke_marked_in_parts_has_no_step_where_the_table_was_turned_back() {
    let place = Place::new();
    let job = place.file("spiral.ngc", &spiral());
    let travel = "machine.axis.th2.limits.position=[\"-540 deg\", \"540 deg\"]";
    let summary = simulate(&place, "polar", &[job.to_str().unwrap(), "--set", travel]);
    // While the table turns back for two seconds, the arm creeps by less than a count of its
    // encoder: nothing may wind up in its loop.
    assert_done("the spiral", &summary, 5e-6);
    assert_eq!(summary["job"]["strokes"], 3);
}
