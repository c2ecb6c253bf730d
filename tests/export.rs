//! `graver export`: a recording as comma-separated values.

#![allow(clippy::unwrap_used)]

mod support;

use std::path::Path;
use support::{Place, lines, number};

/// A run folder of a simulated job.
fn simulated(place: &Place) -> std::path::PathBuf {
    let job = place.file("lines.ngc", &lines(1));
    let out = place.path("run");
    place.graver(&["simulate", job.to_str().unwrap(), "--out", out.to_str().unwrap()]).accepted();
    out
}

fn exported(place: &Place, path: &Path) -> Vec<Vec<String>> {
    let ended = place.graver(&["export", path.to_str().unwrap()]);
    ended.accepted();
    let rows: Vec<Vec<String>> =
        ended.output.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect();
    assert!(rows.iter().all(|row| row.len() == rows[0].len()));
    rows
}

#[test]
fn every_cycle_is_a_line_with_the_machines_axes() {
    let place = Place::new();
    let folder = simulated(&place);
    let rows = exported(&place, &folder);
    let records = place.recording("run");
    assert_eq!(rows.len(), records.len() + 1);
    let column = |name: &str| {
        let index = rows[0].iter().position(|column| column == name);
        index.unwrap_or_else(|| panic!("{name} in {:?}", rows[0]))
    };
    let summary = place.summary("run");
    let axes = summary["machine"]["axes"].as_array().unwrap();
    assert_eq!(rows[0].len(), 12 + 4 * axes.len());
    for (index, axis) in axes.iter().enumerate() {
        let position = column(&format!("{}_position", axis.as_str().unwrap()));
        for (row, record) in rows[1..].iter().zip(&records) {
            assert_eq!(row[position].parse(), Ok(record.feedback.position[index]));
        }
    }
    // One stroke of 30 mm: what the table says was lit is as long as what was judged.
    let values = |name: &str| -> Vec<f64> {
        let index = column(name);
        rows[1..].iter().map(|row| row[index].parse().unwrap_or(0.0)).collect()
    };
    let (lit, x) = (values("lit"), values("tool_x"));
    let length: f64 = lit[1..].iter().zip(x.windows(2)).map(|(lit, x)| lit * (x[1] - x[0])).sum();
    let marked = number(&summary, "/marks/length");
    assert!((length - marked).abs() < 1e-5, "{length} m in the table, {marked} m judged");

    let csv = place.path("samples.csv");
    let to_file = ["export", folder.to_str().unwrap(), "--out", csv.to_str().unwrap()];
    place.graver(&to_file).accepted();
    let text = std::fs::read_to_string(csv).unwrap();
    let written: Vec<Vec<String>> =
        text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect();
    assert_eq!(written, rows);
}

#[test]
fn without_a_summary_the_actuators_are_named_by_the_recording() {
    let place = Place::new();
    let folder = simulated(&place);
    let samples = folder.join("samples.mcap");
    std::fs::remove_file(folder.join("summary.json")).unwrap();
    let rows = exported(&place, &samples);
    assert_eq!(rows[0].len(), 12 + 4 * 2);
    assert!(rows[0].iter().any(|column| column == "b_voltage"), "{:?}", rows[0]);
}

#[test]
fn a_recording_cut_short_gives_its_whole_records_and_a_warning() {
    let place = Place::new();
    let folder = simulated(&place);
    let samples = folder.join("samples.mcap");
    let whole = std::fs::read(&samples).unwrap();
    std::fs::write(&samples, &whole[..whole.len() * 2 / 3]).unwrap();
    let ended = place.graver(&["export", folder.to_str().unwrap()]);
    ended.accepted();
    assert_eq!(ended.output.lines().count(), place.recording("run").len() + 1);
    assert!(ended.error.contains("ends inside record"), "{}", ended.error);
}

#[test]
fn what_is_no_recording_is_refused_and_left_alone() {
    let place = Place::new();
    let empty = place.path("empty");
    std::fs::create_dir(&empty).unwrap();
    let foreign = place.file("foreign.bin", "GRAVEL and other things that are not a recording");
    let folder = simulated(&place);
    let samples = folder.join("samples.mcap");
    for (path, expect) in [
        (&place.path("nowhere"), "No such file"),
        (&empty, "samples.mcap: No such file"),
        (&foreign, "not a recording"),
    ] {
        let ended = place.graver(&["export", path.to_str().unwrap()]);
        assert_eq!((ended.code, ended.output.as_str()), (Some(2), ""), "{path:?}: {}", ended.error);
        assert!(ended.error.contains(expect), "{path:?}: {}", ended.error);
    }
    let before = std::fs::read(&samples).unwrap();
    let itself = ["export", folder.to_str().unwrap(), "--out", samples.to_str().unwrap()];
    let ended = place.graver(&itself);
    assert_eq!(ended.code, Some(2), "{}", ended.error);
    assert!(ended.error.contains("the recording itself"), "{}", ended.error);
    assert_eq!(std::fs::read(&samples).unwrap(), before);
}

#[test]
fn a_simulation_that_was_exported_can_be_played_again() {
    let place = Place::new();
    let folder = simulated(&place);
    let exported = place.path("exported.mcap");
    let arguments = ["export", folder.to_str().unwrap(), "--format", "mcap", "--out"];
    place.graver(&[&arguments[..], &[exported.to_str().unwrap()]].concat()).accepted();
    let played =
        |recording: &Path| place.graver(&["replay", recording.to_str().unwrap(), "--json"]).json(0);
    let (one, other) = (played(&folder), played(&exported));
    assert_eq!((&other["equal"], &one["cycles"]), (&true.into(), &other["cycles"]));
    // Nothing of it is another.
    let (before, after) = (folder.join("samples.mcap"), &exported);
    assert_eq!(std::fs::read(before).unwrap(), std::fs::read(after).unwrap());
}
