//! What was recorded is played again, bit for bit: simulations on every machine file, and runs in real time; one bit
//! that is another is found.

#![allow(clippy::unwrap_used)]

mod support;

use monitor::recording::file::reader::{Entry, EntryReader};
use monitor::recording::file::writer::RecordingWriter;
use monitor::recording::level::Level;
use std::path::Path;
use support::{Place, assert_valid, lines};

fn simulate(place: &Place, out: &str, more: &[&str]) -> String {
    let out = place.path(out).to_str().unwrap().to_owned();
    let mut arguments = vec!["simulate", "--out", &out];
    arguments.extend(more);
    place.graver(&arguments).accepted();
    out
}

#[test]
fn every_machine_file_gives_the_same_bits_again() {
    let place = Place::new();
    let machines = support::source("machines");
    let mut files: Vec<_> =
        std::fs::read_dir(machines).unwrap().map(|it| it.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    files.sort();
    assert!(files.len() > 15, "{files:?}");
    for file in files {
        let out = simulate(&place, "run", &["--machine", file.to_str().unwrap()]);
        let report = place.graver(&["replay", &out, "--json"]).json(0);
        assert_valid("replay", &report);
        assert_eq!(report["equal"], true, "{file:?}: {report:#}");
        assert!(report["cycles"].as_u64() > Some(500), "{file:?}: {report:#}");
        std::fs::remove_dir_all(&out).unwrap();
    }
}

/// A recording anew, with something in it changed.
fn changed(from: &Path, to: &Path, mut change: impl FnMut(&mut Entry)) {
    let reader = EntryReader::open(from).unwrap();
    let mut writer = RecordingWriter::create(to, reader.description(), Level::Full).unwrap();
    for entry in reader {
        let mut entry = entry.unwrap();
        change(&mut entry);
        match entry {
            Entry::Cycle(record, setpoints) => writer.write_cycle(&record, &setpoints).unwrap(),
            Entry::Lead(record, setpoints) => {
                let mut message = Vec::new();
                record.put(&setpoints, &mut message);
                writer.write_lead(record.origin().deadline, &message).unwrap();
            }
            Entry::Event(_) => {}
        }
    }
    writer.finish().unwrap();
}

#[test]
fn one_bit_that_differs_is_named_with_its_cycle_and_field() {
    let place = Place::new();
    let job = place.file("lines.ngc", &lines(1));
    let seed = ["--seed", "3", "--set", "plant.axis.a.friction.coulomb=7 mN m"];
    let out = simulate(&place, "run", &[&[job.to_str().unwrap()][..], &seed].concat());
    let recording = Path::new(&out).join("samples.mcap");
    let other = place.path("other.mcap");
    let replayed = |code| place.graver(&["replay", other.to_str().unwrap(), "--json"]).json(code);
    let mut cycles = 0;
    changed(&recording, &other, |entry| cycles += u64::from(matches!(entry, Entry::Cycle(..))));
    assert_eq!(replayed(0)["equal"], true);
    let middle = cycles / 2;
    // A command that is off by its last bit: only the controller gave it.
    changed(&recording, &other, |entry| {
        if let Entry::Cycle(record, _) = entry
            && record.feedback.cycle.0 == middle
        {
            record.command.voltage[1] = record.command.voltage[1].next_up();
        }
    });
    let report = replayed(1);
    assert_valid("replay", &report);
    let difference = &report["difference"];
    assert_eq!(
        (&difference["stage"], &difference["field"]),
        (&"controller".into(), &"voltage".into())
    );
    assert_eq!(difference["cycle"], middle);
    changed(&recording, &other, |entry| {
        if let Entry::Cycle(record, _) = entry
            && record.feedback.cycle.0 == middle
        {
            record.feedback.counts[0] += 1;
        }
    });
    let difference = &replayed(1)["difference"];
    assert_eq!((&difference["stage"], &difference["field"]), (&"drives".into(), &"counts".into()));
}

#[test]
fn what_cannot_be_played_is_refused() {
    let place = Place::new();
    let job = place.file("lines.ngc", &lines(1));
    let job = job.to_str().unwrap();
    for (level, expect) in [("off", "No such file"), ("events", "no cycle"), ("decimated", "cycle")]
    {
        let out = simulate(&place, level, &[job, "--record", level]);
        let ended = place.graver(&["replay", &out]);
        assert_eq!(ended.code, Some(2), "{level}: {}", ended.error);
        assert!(ended.error.contains(expect), "{level}: {}", ended.error);
    }
}

#[test]
fn a_run_in_real_time_is_played_again_with_its_hold() {
    let place = Place::new();
    let job = place.file("lines.ngc", &lines(3));
    let mut running = place.run(&job, "run", &[]);
    place.await_played(&mut running, 200);
    place.ask(&["hold"]).accepted();
    place.await_status(&mut running, "at rest", |status| {
        status["state"] == "holding" && status["rate"].as_f64() == Some(0.0)
    });
    place.ask(&["override", "60 %", "--power", "80 %"]).accepted();
    place.ask(&["resume"]).accepted();
    assert_eq!(running.wait().json(0)["outcome"], "completed");
    let out = place.path("run");
    let report = place.graver(&["replay", out.to_str().unwrap(), "--json"]).json(0);
    assert_valid("replay", &report);
    assert_eq!(report["equal"], true, "{report:#}");
    let records = place.recording("run");
    // More than the job: the controller began before it.
    assert!(report["cycles"].as_u64() > Some(records.len() as u64), "{report:#}");
    let holding = messages::ControllerState::Holding as u32;
    assert!(records.iter().any(|record| record.command.state == holding));

    // What is exported can be played too, also without the end of its file.
    let whole = place.path("whole.mcap");
    let export =
        ["export", out.to_str().unwrap(), "--format", "mcap", "--out", whole.to_str().unwrap()];
    place.graver(&export).accepted();
    let replayed = |code| place.graver(&["replay", whole.to_str().unwrap(), "--json"]).json(code);
    assert_eq!(replayed(0)["cycles"], report["cycles"]);
    let mut bytes = std::fs::read(&whole).unwrap();
    bytes.truncate(bytes.len() * 2 / 3);
    std::fs::write(&whole, bytes).unwrap();
    let torn = replayed(0);
    assert!(torn["cycles"].as_u64() < report["cycles"].as_u64(), "{torn:#}");

    // A request that came a cycle later would have been answered otherwise.
    let hold = messages::OperatorVerb::Hold as u32;
    let held = records.iter().find(|record| record.command.given.request.verb == hold).unwrap();
    let (held, other) = (held.feedback.cycle, place.path("other.mcap"));
    changed(&out.join("samples.mcap"), &other, |entry| {
        if let Entry::Cycle(record, _) = entry
            && record.feedback.cycle == held
        {
            record.command.given.request = messages::OperatorRequest::default();
        }
    });
    let difference =
        &place.graver(&["replay", other.to_str().unwrap(), "--json"]).json(1)["difference"];
    assert_eq!(
        (&difference["stage"], &difference["cycle"]),
        (&"controller".into(), &held.0.into())
    );
}
