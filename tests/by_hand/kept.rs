//! What outlives a pipeline: offsets beside the machine file, and the faults of the instance.

use super::cell::Cell;
use super::support::{assert_valid, number};
use super::{refused, says};
use serde_json::Value;

/// Marks a line of 1 mm, 70 mm below and left of the origin of a system: the lower corner of all that it moves to.
fn program(words: &str) -> String {
    format!("G21 G90 {words}\nM3 S500 F600\nG0 X-70 Y-70\nG1 X-69\nM5\nM2\n")
}

/// Where the origin of the program is, by `graver plan` [m].
fn origin(cell: &Cell, words: &str) -> [f64; 2] {
    let job = cell.place.file("offset.ngc", &program(words));
    let machine = cell.place.path("cell.toml");
    let plan = ["plan", job.to_str().unwrap(), "--machine", machine.to_str().unwrap(), "--json"];
    let plan = cell.place.graver(&plan).json(0);
    let at = |axis: usize| number(&plan, &format!("/program/lower/{axis}")) + 0.07;
    [at(0), at(1)]
}

fn near(one: [f64; 2], other: [f64; 2]) {
    let is_near = one.iter().zip(&other).all(|(one, other)| (one - other).abs() < 1e-9);
    assert!(is_near, "{one:?} is not {other:?}");
}

#[test]
fn offsets_are_set_used_by_jobs_that_ask_for_them_and_kept_over_restarts() {
    let cell = Cell::new("");
    let file = cell.place.path("cell.offsets.toml");
    let list = cell.ask(&["offset", "list", "--json"]).json(0);
    assert_valid("offsets", &list);
    assert_eq!(list["origins"]["g54"]["is_set"], false);
    assert!(!file.exists());
    says(
        &cell.ask(&["offset", "here", "g55"]),
        1,
        "while the machine is disabled: `graver enable`",
    );
    cell.ask(&["enable"]).accepted();
    says(&cell.ask(&["offset", "here", "g55"]), 1, "axis x is not homed: `graver home`");
    cell.ask(&["home"]).accepted();
    cell.ask(&["jog", "x", "20 mm", "--speed", "200 mm/s"]).accepted();
    says(
        &cell.ask(&["offset", "here", "g55"]),
        0,
        "g55    x 120.000 mm, y 100.000 mm, z 0.000 mm\n",
    );
    near(origin(&cell, "G55"), [0.12, 0.1]);
    near(origin(&cell, "G54"), [0.1, 0.1]);
    // Here is x 5 mm; y stays.
    cell.ask(&["offset", "here", "g55", "--x", "5 mm"]).accepted();
    near(origin(&cell, "G55"), [0.115, 0.1]);
    cell.ask(&["offset", "set", "G54", "--y", "80 mm"]).accepted();
    near(origin(&cell, ""), [0.1, 0.08]);
    cell.ask(&["offset", "set", "tool", "--x", "2 mm", "--y", "0.5 mm"]).accepted();
    near(origin(&cell, "G55 G43"), [0.117, 0.1005]);
    near(origin(&cell, "G55 G43\nG49"), [0.115, 0.1]);
    near(origin(&cell, "G55"), [0.115, 0.1]);
    says(&cell.ask(&["offset", "set", "g60", "--x", "1 mm"]), 2, "there is no system \"g60\"");
    says(&cell.ask(&["offset", "set", "g56"]), 2, "say where");
    says(&cell.ask(&["offset", "here", "tool"]), 2, "graver offset set tool");

    let cell = cell.again();
    let list = cell.ask(&["offset", "list", "--json"]).json(0);
    assert_eq!(list["origins"]["g55"]["is_set"], true);
    near(
        [number(&list, "/origins/g55/place/0"), number(&list, "/origins/g55/place/1")],
        [0.115, 0.1],
    );
    cell.ask(&["enable"]).accepted();
    cell.ask(&["home"]).accepted();
    // A job of the running pipeline has those of when its turn comes.
    let job = cell.place.file("job.ngc", &program("G55 G43"));
    let out = cell.place.path("run");
    let submit = ["submit", job.to_str().unwrap(), "--json", "--out", out.to_str().unwrap()];
    assert_eq!(cell.ask(&submit).json(0)["outcome"], "completed");
    let artwork = std::fs::read_to_string(out.join("artwork.jsonl")).unwrap();
    assert!(artwork.contains("0.047"), "{artwork}");
    cell.ask(&["offset", "clear", "g55"]).accepted();
    near(origin(&cell, "G55"), [0.1, 0.1]);
    cell.ask(&["offset", "clear", "all"]).accepted();
    near(origin(&cell, "G43"), [0.1, 0.1]);

    // A damaged file is told by everybody who reads it, with the place.
    std::fs::write(&file, "[origins]\ng54 = [\"1 mm\", \"2 kg\"]\n").unwrap();
    let summary = cell.ask(&submit).json(2);
    let error = &summary["error"];
    assert_eq!((&error["line"], summary["outcome"].as_str()), (&2.into(), Some("refused")));
    assert!(error["file"].as_str().unwrap().ends_with("cell.offsets.toml"), "{error}");
    says(&cell.ask(&["offset", "list"]), 2, "cell.offsets.toml:2:");
    says(&cell.ask(&["offset", "set", "g54", "--x", "1 mm"]), 2, "cell.offsets.toml:2:");
    assert!(std::fs::read_to_string(&file).unwrap().contains("2 kg"), "it is left as it is");
    cell.end();
}

#[test]
fn faults_are_kept_and_shown_after_a_restart_and_without_a_pipeline() {
    let cell = Cell::enabled("");
    says(&cell.ask(&["faults"]), 0, "no faults\n");
    assert_eq!(cell.ask(&["jog", "x", "--speed", "200 mm/s"]).code, Some(3));
    let faults = cell.ask(&["faults", "--json"]).json(0);
    assert_valid("faults", &faults);
    assert_eq!(
        (&faults["faults"][0]["code"], &faults["faults"][0]["job"]),
        (&"hard_limit".into(), &Value::Null)
    );
    says(&cell.ask(&["faults"]), 0, "  hard_limit of axis x: ");

    let cell = cell.again();
    let status = cell.status();
    assert_eq!((&status["fault"], &status["faults"]), (&Value::Null, &faults["faults"]));
    refused(&cell.ask(&["reset"]), "disabled");
    let place = cell.stop();
    let after = place.ask(&["faults", "--json"]).json(0);
    assert_eq!(after["faults"], faults["faults"]);
}
