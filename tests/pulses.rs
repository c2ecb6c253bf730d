//! `graver plan --pulses`: the pulses that it lists are those that the drives send.

#![allow(clippy::unwrap_used)]

mod support;

use support::Place;

/// Counts of both actuators at the end of each cycle of the list, up to its last pulse.
fn counts_of_list(text: &str, names: [&str; 2]) -> Vec<[i64; 2]> {
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("t,axis,count"));
    let (mut counts, mut now, mut last) = (Vec::new(), [0; 2], 0.0);
    for line in lines {
        let fields: Vec<&str> = line.split(',').collect();
        let [time, axis, count] = fields[..] else { panic!("{line}") };
        let (time, count): (f64, i64) = (time.parse().unwrap(), count.parse().unwrap());
        assert!(time >= last, "{line}: before {last}");
        last = time;
        while time > (counts.len() + 1) as f64 * 1e-3 + 1e-12 {
            counts.push(now);
        }
        let index = names.iter().position(|name| *name == axis).unwrap();
        assert_eq!((count - now[index]).abs(), 1, "{line}");
        now[index] = count;
    }
    counts.push(now);
    counts
}

#[test]
fn the_list_of_pulses_is_what_the_drives_send() {
    let place = Place::new();
    let machine = support::source("machines").join("twin_actuator.toml");
    let machine = machine.to_str().unwrap();
    let list = place.path("pulses.csv");
    let planned = ["plan", "--json", "--machine", machine, "--pulses", list.to_str().unwrap()];
    place.graver(&planned).json(0);
    let out = place.path("out");
    let simulated = ["simulate", "--json", "--machine", machine, "--out", out.to_str().unwrap()];
    place.graver(&simulated).json(0);

    let listed = counts_of_list(&std::fs::read_to_string(&list).unwrap(), ["la", "lb"]);
    let recorded = place.recording("out");
    let home = recorded[0].feedback.counts;
    let sent: Vec<[i64; 2]> = recorded
        .iter()
        .map(|record| [0, 1].map(|axis| record.feedback.counts[axis] - home[axis]))
        .collect();
    let first = |counts: &[[i64; 2]]| counts.iter().position(|count| *count != [0, 0]).unwrap();
    let (listed, sent) = (&listed[first(&listed)..], &sent[first(&sent)..]);
    assert!(listed.len() > 1000, "{}", listed.len());
    assert_eq!(listed, &sent[..listed.len()]);
    // After the last pulse nothing moves.
    assert!(sent[listed.len()..].iter().all(|count| Some(count) == listed.last()));
}

#[test]
fn a_machine_without_steppers_has_no_pulses() {
    let place = Place::new();
    let ended = place.graver(&["plan", "--pulses", "p.csv"]);
    assert_eq!(ended.code, Some(2), "{}", ended.error);
    assert!(ended.error.contains("has no steppers"), "{}", ended.error);
    assert!(!place.path("p.csv").exists());
}
