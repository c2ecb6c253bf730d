//! A machine that is operated by hand, as processes: enabled, homed, jogged, probed, tested and stopped with the
//! commands that a person has.

#![allow(clippy::unwrap_used)]

mod cell;
mod kept;
mod modbus;
mod outputs;
#[path = "../support/mod.rs"]
mod support;

use cell::Cell;
use support::{Ended, INTERRUPT, KILL, Place, assert_valid, lines, source};

/// Asserts that a request was refused with these words.
fn refused(ended: &Ended, words: &str) {
    assert_eq!(ended.code, Some(1), "{}", ended.error);
    assert!(ended.error.contains("refused: ") && ended.error.contains(words), "{}", ended.error);
}

/// Asserts the exit code, and that standard error says this.
fn says(ended: &Ended, code: i32, words: &str) {
    assert_eq!(ended.code, Some(code), "{}", ended.error);
    assert!(ended.error.contains(words), "{words:?} is not in {:?}", ended.error);
}

#[test]
fn a_job_is_refused_until_every_axis_is_homed() {
    let cell = Cell::new("");
    let job = cell.place.file("job.ngc", &lines(1));
    let out = cell.place.path("run");
    let submit = ["submit", job.to_str().unwrap(), "--json", "--out", out.to_str().unwrap()];
    refused(&cell.ask(&["home"]), "disabled: `graver enable`");
    let summary = cell.ask(&submit).json(2);
    assert_eq!(summary["outcome"], "refused");
    let message = summary["error"]["message"].as_str().unwrap();
    assert!(message.contains("axis x is not homed"), "{message}");
    // It has enabled the machine.
    says(&cell.ask(&["home", "y"]), 0, "homed; y at 100.000 mm\n");
    let status = cell.status();
    assert_eq!((&status["homed"][0], &status["unhomed"][0]), (&"y".into(), &"x".into()));
    refused(&cell.ask(&["home", "q"]), "there is no axis \"q\"; the machine has x, y");
    says(&cell.ask(&["home"]), 0, "homed; x at 100.000 mm, y at 100.000 mm\n");
    assert_eq!(cell.ask(&submit).json(0)["outcome"], "completed");
    cell.end();
}

#[test]
fn a_run_of_its_own_homes_first_if_it_is_told_to() {
    let place = Place::new();
    let machine = place.file("cell.toml", &cell::machine("[safety]\ndoor = \"stop\"\n"));
    let job = place.file("job.ngc", &lines(1));
    let of = ["--machine", machine.to_str().unwrap()];
    let summary = place.run(&job, "refused", &of).wait().json(2);
    assert_eq!(summary["outcome"], "refused");
    let message = summary["error"]["message"].as_str().unwrap();
    assert!(message.contains("x is not homed: `graver run --home`"), "{message}");
    let homing = [&of[..], &["--home"]].concat();
    let summary = place.run(&job, "homed", &homing).wait().json(0);
    assert_eq!(summary["outcome"], "completed");
    assert!(summary["marks"]["error_max"].as_f64().unwrap() < 20e-6, "{summary:#}");
    // A signal while it homes stops it, and nothing of the job was played.
    let mut running = place.run(&job, "stopped", &homing);
    place.await_status(&mut running, "homing", |status| status["state"] == "homing");
    running.signal(INTERRUPT);
    let summary = running.wait().json(1);
    assert_eq!((&summary["outcome"], &summary["cycles"]), (&"stopped".into(), &0.into()));
    place.assert_nothing_left(&[]);
}

#[test]
fn a_jog_goes_as_far_as_it_is_asked_to_and_as_it_may() {
    let cell = Cell::homed("");
    says(&cell.ask(&["jog", "x", "10 mm", "--speed", "100 mm/s"]), 0, "x at 110.000 mm\n");
    refused(
        &cell.ask(&["jog", "x", "1 m", "--speed", "100 mm/s"]),
        "x would be at 1110.000 mm, beyond its soft limit of 201.000 mm",
    );
    refused(&cell.ask(&["jog", "x", "10 deg", "--speed", "1 deg/s"]), "x slides: write a length");
    refused(&cell.ask(&["jog", "x", "1 mm", "--speed", "9 m/s"]), "moved by hand at");
    refused(&cell.ask(&["jog", "x", "0 mm", "--speed", "9 mm/s"]), "leads nowhere");
    says(&cell.ask(&["jog", "x", "1 mm", "--speed", "9 deg/s"]), 2, "do not fit");
    says(&cell.ask(&["jog", "x", "1 kg", "--speed", "9 mm/s"]), 2, "distance \"1 kg\"");
    // On to the soft limit, which ends it.
    let limit = cell.ask(&["jog", "x", "--speed", "200 mm/s", "--json"]);
    let reply = limit.json(0);
    assert_valid("motion", &reply);
    assert_eq!((&reply["end"], &reply["state"]), (&"soft_limit".into(), &"idle".into()));
    let place = reply["axes"]["x"]["position"].as_f64().unwrap();
    assert!((0.2..=0.201).contains(&place), "{place}");
    let again = cell.ask(&["jog", "x", "--speed", "200 mm/s"]);
    assert!(
        again.error.contains("its soft limit") && again.error.contains("201.000 mm"),
        "{}",
        again.error
    );
    assert!(cell.x() <= 0.201);
    cell.end();
}

#[test]
fn x_and_y_of_a_corexy_are_jogged_and_no_belt_leads_out_of_its_area() {
    let machine = |name: &str| std::fs::read_to_string(source(name)).unwrap();
    let cell = Cell::of(&machine("machines/corexy.toml"));
    cell.ask(&["enable"]).accepted();
    let jog = |axis, distance| ["jog", axis, distance, "--speed", "150 mm/s"];
    says(&cell.ask(&jog("x", "10 mm")), 0, "x at 110.000 mm\n");
    let axes = cell.status()["axes"].clone();
    let at = |axis: &str| axes[axis]["position"].as_f64().unwrap();
    // Both belts went on by as much: a is x + y, b is x - y.
    for (axis, place) in [("y", 0.1), ("a", 0.21), ("b", 0.01)] {
        assert!((at(axis) - place).abs() < 1e-6, "{axes:#}");
    }
    let area = "the tool would be at x 202.500 mm, beyond its area, which ends at 200.000 mm";
    refused(&cell.ask(&jog("a", "185 mm")), area);
    refused(&cell.ask(&jog("y", "-101 mm")), "the tool would be at y -1.000 mm");
    refused(&cell.ask(&["home", "x"]), "there is no axis \"x\"; the machine has a, b");
    says(&cell.ask(&["jog", "x", "--speed", "200 mm/s"]), 0, "its soft limit is 200.000 mm\n");
    cell.end();
    let cell = Cell::of(&machine("machines/five_bar.toml"));
    cell.ask(&["enable"]).accepted();
    refused(
        &cell.ask(&jog("x", "1 mm")),
        "does not go straight along x with its joints: jog its axes",
    );
    cell.end();
}

#[test]
fn a_jog_ends_when_its_client_dies_and_when_anybody_stops_it() {
    let mut cell = Cell::homed("");
    let moves = |from: f64| {
        move |status: &serde_json::Value| {
            status["axes"]["x"]["position"].as_f64().unwrap() > from + 1e-3
        }
    };
    let jog = ["jog", "x", "--speed", "10 mm/s"];
    let client = cell.start(&jog);
    cell.until("a jog", moves(cell.x()));
    client.signal(KILL);
    assert_eq!(client.wait().code, None);
    let status = cell.until("rest", |status| status["state"] == "idle");
    assert_eq!(status["motion_end"], "dead_man");
    let place = cell.x();
    assert!(place < 0.2, "{place}");

    let client = cell.start(&jog);
    cell.until("a jog", moves(place));
    cell.ask(&["stop"]).accepted();
    says(&client.wait(), 1, "stopped because somebody else said so; x at ");
    let status = cell.until("rest", |status| status["state"] == "idle");
    assert_eq!(status["motion_end"], "stopped");

    let place = cell.x();
    let client = cell.start(&jog);
    cell.until("a jog", moves(place));
    client.signal(INTERRUPT);
    says(&client.wait(), 0, "x at ");
    assert_eq!(cell.status()["state"], "idle");
    cell.end();
}

#[test]
fn a_limit_switch_is_a_fault_and_the_axis_gets_away_from_it() {
    let cell = Cell::enabled("");
    let ended = cell.ask(&["jog", "x", "--speed", "100 mm/s"]);
    says(&ended, 3, "fault: hard_limit of axis x: ");
    refused(&cell.ask(&["enable"]), "faulted: `graver reset`");
    cell.ask(&["reset"]).accepted();
    says(&cell.ask(&["enable"]), 0, "(not homed)");
    refused(&cell.ask(&["jog", "x", "5 mm", "--speed", "50 mm/s"]), "on its limit switch");
    cell.ask(&["jog", "x", "-10 mm", "--speed", "50 mm/s"]).accepted();
    let status = cell.status();
    assert_eq!(status["inputs"]["x_max"], false);
    assert_eq!(status["faults"][0]["code"], "hard_limit");
    assert_eq!(status["fault"], serde_json::Value::Null);
    cell.end();
}

#[test]
fn an_emergency_stop_is_told_and_its_fault_stays_until_it_is_reset() {
    for category in 0..3 {
        let mut cell = Cell::homed(&format!("[safety]\nestop = {category}\n"));
        let jog = cell.start(&["jog", "x", "--speed", "10 mm/s"]);
        cell.until("a jog", |status| status["state"] == "jogging");
        cell.ask(&["input", "estop", "on"]).accepted();
        says(&jog.wait(), 3, "fault: emergency_stop");
        let state = if category == 2 { "halted" } else { "faulted" };
        let status = cell.until("a stop", |status| status["state"] == state);
        assert_eq!(
            (&status["fault"], &status["inputs"]["estop"]),
            (&"emergency_stop".into(), &true.into())
        );
        refused(&cell.ask(&["reset"]), "the emergency stop is pressed");
        cell.ask(&["input", "estop", "off"]).accepted();
        cell.until("a release", |status| status["inputs"]["estop"] == false);
        assert_eq!(cell.status()["state"], state, "nothing begins by itself");
        cell.ask(&["reset"]).accepted();
        if category < 2 {
            cell.ask(&["enable"]).accepted();
        }
        cell.ask(&["jog", "x", "1 mm", "--speed", "50 mm/s"]).accepted();
        assert!(cell.status()["unhomed"].as_array().unwrap().is_empty(), "places stay known");
        cell.end();
    }
}

#[test]
fn an_open_door_holds_a_job_and_an_interlock_its_light() {
    for input in ["door", "chiller"] {
        let mut cell = Cell::homed("");
        let job = cell.place.file("job.ngc", &lines(8));
        let out = cell.place.path("run");
        let submit = ["submit", job.to_str().unwrap(), "--json", "--out", out.to_str().unwrap()];
        let job = cell.start(&submit);
        cell.until("light", |status| status["stroke"].as_u64() > Some(0));
        cell.ask(&["input", input, "on"]).accepted();
        let status = cell.until("a hold", |status| status["state"] == "holding");
        assert_eq!(status["inputs"][input], true);
        refused(&cell.ask(&["resume"]), if input == "door" { "door is open" } else { "interlock" });
        cell.ask(&["input", input, "off"]).accepted();
        cell.until("a closed door", |status| status["inputs"][input] == false);
        cell.ask(&["resume"]).accepted();
        let summary = job.wait().json(0);
        assert_eq!(summary["outcome"], "completed", "{input}");
        let missing = summary["marks"]["missing"].as_f64().unwrap();
        assert!(missing < 1e-4, "{input}: {missing} m are missing");
        cell.end();
    }
}

#[test]
fn a_test_pulse_is_bounded_and_a_probe_says_where_it_touched() {
    let mut cell = Cell::homed("");
    says(&cell.ask(&["test-pulse", "5 %", "10 ms"]), 0, "lit for 10 ms at 5 %");
    refused(
        &cell.ask(&["test-pulse", "11 %", "10 ms"]),
        "10 % at most (`safety.test_power`), not 11 %",
    );
    refused(&cell.ask(&["test-pulse", "5 %", "1 s"]), "100 ms at most (`safety.test_time`)");
    for (input, words) in [("chiller", "an interlock is missing"), ("door", "the door is open")] {
        cell.ask(&["input", input, "on"]).accepted();
        cell.until("an input", |status| status["inputs"][input] == true);
        refused(&cell.ask(&["test-pulse", "5 %", "10 ms"]), words);
        cell.ask(&["input", input, "off"]).accepted();
        cell.until("an input", |status| status["inputs"][input] == false);
    }
    refused(
        &cell.ask(&["input", "window", "on"]),
        "there is no input \"window\"; the machine has x_home",
    );
    let probe = |distance| ["probe", "x", distance, "--speed", "10 mm/s"];
    says(&cell.ask(&probe("2 mm")), 1, "the probe did not touch on its way; x at 10");
    says(&cell.ask(&probe("10 mm")), 0, "touched at 10");
    let probed = cell.status()["probed"].clone();
    assert_eq!((&probed["axis"], &probed["unit"]), (&"x".into(), &"m".into()));
    let place = probed["position"].as_f64().unwrap();
    assert!((place - 0.105).abs() < 20e-6, "{place}");
    refused(&cell.ask(&probe("10 mm")), "touches already");
    cell.end();
}
