//! A simulation that was recorded is played again, bit for bit, on every machine file; one bit that
//! is another is found.

#![allow(clippy::unwrap_used)]

mod support;

use monitor::recording::file::reader::{Entry, EntryReader};
use monitor::recording::file::writer::RecordingWriter;
use monitor::recording::level::Level;
use monitor::recording::message::Origin;
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
    let origin = |deadline| Origin { deadline, ..Origin::default() };
    for entry in reader {
        let mut entry = entry.unwrap();
        change(&mut entry);
        match entry {
            Entry::Cycle(record) => writer.write(&[*record]).unwrap(),
            Entry::Setpoint(time, setpoint) => {
                writer.write_inputs(&origin(time), &[*setpoint], None).unwrap();
            }
            Entry::Request(time, request) => {
                writer.write_inputs(&origin(time), &[], Some(&request)).unwrap();
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
    changed(&recording, &other, |entry| cycles += u64::from(matches!(entry, Entry::Cycle(_))));
    assert_eq!(replayed(0)["equal"], true);
    let middle = cycles / 2;
    // A command that is off by its last bit: only the controller gave it.
    changed(&recording, &other, |entry| {
        if let Entry::Cycle(record) = entry
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
        if let Entry::Cycle(record) = entry
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
