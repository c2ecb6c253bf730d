//! `graver plan --pulses`: the pulses that it lists are those that the drives send.

#![allow(clippy::unwrap_used)]

mod support;

use messages::ControllerState;
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
    let planned = place.graver(&planned).json(0);
    let out = place.path("out");
    let simulated = ["simulate", "--json", "--machine", machine, "--out", out.to_str().unwrap()];
    place.graver(&simulated).json(0);

    let listed = counts_of_list(&std::fs::read_to_string(&list).unwrap(), ["la", "lb"]);
    let mut recorded = place.recording("out");
    let ready = recorded.iter().position(|it| it.command.state() == ControllerState::Idle);
    recorded.drain(..ready.unwrap());
    let home = recorded[0].feedback.counts;
    let sent: Vec<[i64; 2]> = recorded
        .iter()
        .map(|record| [0, 1].map(|axis| record.feedback.counts[axis] - home[axis]))
        .collect();
    let first = |counts: &[[i64; 2]]| counts.iter().position(|count| *count != [0, 0]).unwrap();
    let (listed, sent) = (&listed[first(&listed)..], &sent[first(&sent)..]);
    assert!(listed.len() > 1000, "{}", listed.len());
    assert_eq!(listed, &sent[..listed.len()]);
    let pulses = &planned["pulses"];
    assert_eq!(pulses["counts"], serde_json::json!(listed.last().unwrap()));
    let rate = pulses["largest_rate"][0].as_f64().unwrap();
    let most = listed.windows(2).map(|pair| (pair[1][0] - pair[0][0]).abs()).max().unwrap();
    assert!((rate * 1e-3 - most as f64).abs() < 1.0, "{rate} against {most} in a cycle");
    // After the last pulse nothing moves.
    assert!(sent[listed.len()..].iter().all(|count| Some(count) == listed.last()));
}

#[test]
fn a_machine_without_steppers_has_no_pulses() {
    let place = Place::new();
    for option in ["--pulses", "--pulse-path"] {
        let ended = place.graver(&["plan", option, "p.csv"]);
        assert_eq!(ended.code, Some(2), "{}", ended.error);
        let expected = format!("{option}: ");
        assert!(ended.error.contains(&expected), "{}", ended.error);
        assert!(ended.error.contains("has no steppers"), "{}", ended.error);
        assert!(!place.path("p.csv").exists());
    }
}

/// Source 004's actual path: where the counts alone have the tool. It strays by no more than rounding to
/// whole pulses allows, and by most of that somewhere.
#[test]
fn the_path_of_the_pulses_strays_by_no_more_than_rounding() {
    let place = Place::new();
    let machine = support::source("machines").join("twin_actuator.toml");
    let job = support::source("jobs").join("twin_actuator.ngc");
    let files = ["pulses.csv", "path.csv", "samples.csv"].map(|name| place.path(name));
    let [list, path, samples] = files.each_ref().map(|path| path.to_str().unwrap());
    let graver = |more: &[&str]| {
        let arguments = ["plan", job.to_str().unwrap(), "--machine", machine.to_str().unwrap()];
        place.graver(&[&arguments, more].concat())
    };
    let report =
        graver(&["--json", "--pulses", list, "--pulse-path", path, "--samples", samples]).json(0);
    support::assert_valid("plan", &report);
    let of = |key: &str| report["pulses"][key].as_f64().unwrap();
    let (most, bound) = (of("deviation_max"), of("bound"));
    assert!(most <= bound * 1.02 + 1e-9, "{most} against {bound}");
    assert!(most > 0.8 * bound, "{most} against {bound}");
    assert!((1e-6..1.5e-6).contains(&bound), "{bound}");
    assert!(of("deviation_lit_max") <= most && of("deviation_rms") < 0.6 * most);

    // A row a pulse, each as near to the planned path as it says.
    let read = |path: &str| -> Vec<Vec<f64>> {
        let text = std::fs::read_to_string(path).unwrap();
        let row = |line: &str| line.split(',').map(|word| word.parse().unwrap()).collect();
        text.lines().skip(1).map(row).collect()
    };
    let (rows, planned) = (read(path), read(samples));
    assert_eq!(rows.len(), std::fs::read_to_string(list).unwrap().lines().count() - 1);
    let mut lit = 0.0_f64;
    for row in &rows {
        let [time, x, y, z, deviation, is_lit] = row[..] else { panic!("{row:?}") };
        // The sample before it, and a line to the next: at 0.5 m/s² off by 0.07 µm at most.
        let cycle = (time * 1e3) as usize;
        let share = time * 1e3 - cycle as f64;
        let at =
            |axis: usize| planned[cycle][axis] * (1.0 - share) + planned[cycle + 1][axis] * share;
        let off = messages::math::hypot(x - at(1), y - at(2));
        assert!(z == 0.0 && (off - deviation).abs() < 0.1e-6, "{row:?}: {off}");
        assert!(deviation <= most);
        lit = lit.max(deviation * is_lit);
    }
    assert!(lit <= of("deviation_lit_max") && lit > 0.9 * of("deviation_lit_max"));

    // The path alone is asked for, and told as text.
    let told = graver(&["--pulse-path", path]);
    told.accepted();
    assert!(told.error.contains("rounding allows 1."), "{}", told.error);
    let own = place.file("own.ngc", "M2\n");
    let own = own.to_str().unwrap();
    let arguments = ["plan", own, "--machine", machine.to_str().unwrap(), "--pulse-path", own];
    let taken = place.graver(&arguments);
    assert_eq!(taken.code, Some(2), "{}", taken.error);
    assert!(taken.error.contains("--pulse-path"), "{}", taken.error);
}
