//! `graver size`: what it prints, and that the machine file which it writes is a machine that does its job.

#![allow(clippy::unwrap_used)]

mod support;

use serde_json::Value;
use support::{Place, assert_valid, number, source};

fn motors(report: &Value) -> Vec<&str> {
    let axes = report["axes"].as_array().unwrap();
    axes.iter().map(|axis| axis["chosen"]["motor"].as_str().unwrap()).collect()
}

#[test]
fn the_machine_that_is_written_is_sound_and_marks_its_sample() {
    let place = Place::new();
    for name in ["cartesian", "corexy", "polar", "serial", "cartesian_steppers"] {
        let machine = source("machines").join(format!("{name}.toml"));
        let out = place.path(&format!("{name}.toml"));
        let (machine, out) = (machine.to_str().unwrap(), out.to_str().unwrap());
        let sized = place.graver(&["size", "--machine", machine, "--out", out, "--json"]).json(0);
        assert_valid("size", &sized);
        println!("{name}: {:?}", motors(&sized));
        assert_eq!(sized["confirmation"]["is_right"], true, "{sized:#}");
        assert_eq!(sized["written"], out);
        let check = place.graver(&["check", "--machine", out, "--json"]).json(0);
        assert!(check["sample_job"].as_str().unwrap().ends_with(".toml"), "{check:#}");
        let marked = place.graver(&["simulate", "--machine", out, "--json"]).json(0);
        assert_eq!(marked["outcome"], "completed");
        let error = number(&marked, "/marks/error_max");
        let confirmed = number(&sized, "/confirmation/error");
        assert!((error - confirmed).abs() < 1e-9, "{error} {confirmed}");
        // Every comment outside the motors' tables is there still.
        let [before, after] = [machine, out].map(|path| std::fs::read_to_string(path).unwrap());
        for line in before.lines().filter(|line| line.starts_with('#')) {
            assert!(after.contains(line), "{name} lost: {line}");
        }
    }
}

#[test]
fn what_size_cannot_do_it_says() {
    let place = Place::new();
    let machine = source("machines/cartesian.toml");
    let machine = machine.to_str().unwrap();
    let graver = |more: &[&str]| place.graver(&[&["size", "--machine", machine], more].concat());
    let wrong = place.file(
        "mine.toml",
        "source = \"me\"\n[[motor]]\nname = \"M\"\n[motor.dc]\nvoltage = \"24 V\"\nresistence = \"1 ohm\"\n",
    );
    let ended = graver(&["--motors", wrong.to_str().unwrap()]);
    assert_eq!(ended.code, Some(2));
    assert!(ended.error.contains("mine.toml:6:1"), "{}", ended.error);
    assert!(ended.error.contains("did you mean `resistance`?"), "{}", ended.error);
    let ended = graver(&["--motors", "nowhere.toml"]);
    assert_eq!(ended.code, Some(2));
    assert!(ended.error.contains("nowhere.toml"), "{}", ended.error);
    let ended = graver(&["--axis", "u"]);
    assert_eq!(ended.code, Some(2));
    assert!(ended.error.contains("no axis `u`"), "{}", ended.error);
    assert_eq!(graver(&["--margin", "0.5"]).code, Some(2));
    // Nothing that is read is written over, and what --set changes is not in the file.
    let ended = graver(&["--out", machine]);
    assert_eq!(ended.code, Some(2));
    assert!(ended.error.contains("the machine file"), "{}", ended.error);
    let out = place.path("out.toml");
    let out = out.to_str().unwrap();
    let ended = graver(&["--set", "machine.path.jerk=400 m/s^3", "--out", out]);
    assert_eq!(ended.code, Some(2));
    let due = "--out does not write the changes that --set makes to the machine: change the machine file instead";
    assert!(ended.error.contains(due), "{}", ended.error);
    // Where no motor does it, the limits that are broken are named and nothing is written.
    let ended = graver(&["--motors", "dc", "--margin", "50", "--json"]);
    let report = ended.json(1);
    assert_valid("size", &report);
    assert!(report["axes"][0]["chosen"].is_null());
    assert!(number(&report, "/axes/0/rejected/0/use") > 1.0);
    let ended = graver(&["--motors", "dc", "--margin", "50", "--out", out]);
    assert_eq!(ended.code, Some(1));
    assert!(!std::path::Path::new(out).exists(), "{}", ended.error);
    assert!(ended.error.contains("written   nothing"), "{}", ended.error);
    // A machine of another kind than the catalogue is told what it needs all the same.
    let planar = source("machines/tri_planar.toml");
    let ended = place.graver(&["size", "--machine", planar.to_str().unwrap(), "--json"]);
    let report = ended.json(1);
    assert_valid("size", &report);
    assert_eq!(report["axes"][0]["kind"], "planar motor");
}

#[test]
fn the_same_is_chosen_every_time() {
    let place = Place::new();
    let machine = source("machines/cartesian.toml");
    let arguments = ["size", "--machine", machine.to_str().unwrap(), "--gears", "any", "--json"];
    let once = place.graver(&arguments).json(0);
    assert_eq!(place.graver(&arguments).json(0), once);
    let by_power = place.graver(&[&arguments[..], &["--by", "power"]].concat()).json(0);
    for axis in 0..2 {
        let power = |report: &Value| number(report, &format!("/axes/{axis}/chosen/rated_power"));
        assert!(power(&by_power) <= power(&once));
    }
    let one = place.graver(&[&arguments[..], &["--axis", "y"]].concat()).json(0);
    assert!(one["axes"][0]["chosen"].is_null() && !one["axes"][1]["chosen"].is_null());
}

#[test]
fn the_machine_that_is_written_elsewhere_names_the_same_files() {
    let place = Place::new();
    let text = std::fs::read_to_string(source("machines/cartesian.toml")).unwrap();
    let below = |name: &str, text: &str| {
        std::fs::create_dir_all(place.path(name).parent().unwrap()).unwrap();
        place.file(name, text)
    };
    let mut mesh = "x [mm],y [mm],dx [um],dy [um]\n".to_owned();
    for (row, y) in [0, 100, 200].into_iter().enumerate() {
        for (column, x) in [0, 100, 200].into_iter().enumerate() {
            mesh += &format!("{x},{y},{},{}\n", 3 * row, 2 * column);
        }
    }
    let [job, mesh, out] = [
        below("jobs/s.toml", "letters.text = \"S\"\n"),
        below("measured/mesh.csv", &mesh),
        below("new/cartesian.toml", ""),
    ];
    let text = text.replace("../jobs/letters.toml", "../jobs/s.toml");
    let text = format!("{text}\n[frame.mesh]\nfile = \"../measured/mesh.csv\"\n");
    let machine =
        below("machines/deep/of/it/cartesian.toml", &text.replace("\"../", "\"../../../../"));
    let [machine, out] = [&machine, &out].map(|path| path.to_str().unwrap());
    std::fs::remove_file(out).unwrap();
    place.graver(&["size", "--machine", machine, "--out", out, "--json"]).json(0);
    let written = std::fs::read_to_string(out).unwrap();
    for (key, file) in [("sample", "../jobs/s.toml"), ("file", "../measured/mesh.csv")] {
        assert!(written.contains(&format!("{key} = \"{file}\"")), "{written}");
    }
    assert!(job.exists() && mesh.exists());
    let marked = place.graver(&["simulate", "--machine", out, "--json"]).json(0);
    assert_eq!(marked["job"]["name"], "S");
}
