//! How the light goes with the motion: which policy holds, how low power may fall, and what is done
//! where there is no room to come to speed in the dark.

#![allow(clippy::unwrap_used)]

mod support;

use machine::Machine;
use nalgebra::Vector3;
use planner::drawing::Note;
use planner::{Job, Plan, plan};
use support::{job, lit, machine, overrides, planned};

const LINES: &str = "G21 G90\nM4 S100 F6000\nG1 X40\nG1 Y30\nG0 X0 Y0\nG1 X5\n";

/// The powers while it is lit.
fn powers(plan: &Plan) -> impl Iterator<Item = f64> + '_ {
    plan.trajectory.laser.iter().map(|change| change.power).filter(|power| *power > 0.0)
}

fn least(plan: &Plan) -> f64 {
    powers(plan).fold(1.0, f64::min)
}

fn texts(notes: &[Note], part: &str) -> Vec<(u64, String)> {
    let found = notes.iter().filter(|note| note.text.contains(part));
    found.map(|note| (note.line, note.text.clone())).collect()
}

#[test]
fn power_in_proportion_falls_to_nothing_but_where_the_laser_has_a_least() {
    for (settings, expected) in [
        (&[][..], 0.0..0.005),
        (&["laser.min_power=4 %"][..], 0.04..0.04 + 1e-12),
        (&["laser.proportional_floor=0.3"][..], 0.03..0.03 + 1e-12),
        (&["laser.proportional_floor=0.3", "laser.min_power=0.02"][..], 0.03..0.03 + 1e-12),
        (&["laser.proportional_floor=0.3", "laser.min_power=0.05"][..], 0.05..0.05 + 1e-12),
        (&["laser.proportional_floor=1"][..], 0.1..0.1 + 1e-12),
    ] {
        let plan = planned(LINES, &[], &machine(false, settings));
        assert!(expected.contains(&least(&plan)), "{settings:?}: {}", least(&plan));
        assert!(powers(&plan).all(|power| power <= 0.1), "{settings:?}");
        assert!(plan.facts.notes.is_empty(), "{settings:?}: {:?}", plan.facts.notes);
    }
}

#[test]
fn power_below_the_least_of_the_laser_is_raised_to_it_and_told_once() {
    let machine = machine(false, &["laser.min_power=0.05"]);
    for mode in ["M3", "M4"] {
        let text = format!(
            "G21 G90\n{mode} S500 F6000\nG1 X40\nS20\nG1 Y30\nG0 X0 Y0\nG1 X5 S30\nG1 X9 S0\nG4 P0.01\n"
        );
        let plan = planned(&text, &[], &machine);
        assert_eq!(least(&plan), 0.05, "{mode}");
        let expected = "power of 0.020 is marked at 0.050 of full scale, the least that the laser gives (min_power)";
        assert_eq!(texts(&plan.facts.notes, "min_power"), [(5, expected.to_owned())], "{mode}");
        // White stays white.
        let end = lit(&plan, [0.0; 2]).last().unwrap()[1].x;
        assert!((end - 5e-3).abs() < 1e-6, "{mode}: {end}");
    }
}

#[test]
fn a_job_chooses_the_policy_against_the_words_of_its_program() {
    let machine = machine(false, &[]);
    let constant = LINES.replace("M4", "M3");
    let by = |text: &str, policy: &str| {
        planned(text, &[&format!("marking.policy={policy}")], &machine).trajectory
    };
    assert_eq!(by(&constant, "proportional"), planned(LINES, &[], &machine).trajectory);
    assert_eq!(by(LINES, "constant"), planned(&constant, &[], &machine).trajectory);
    assert_eq!(by(LINES, "proportional"), planned(LINES, &[], &machine).trajectory);
    assert_ne!(by(LINES, "constant"), by(LINES, "proportional"));
}

#[test]
fn letters_and_paths_are_marked_from_rest_to_rest_where_the_job_says_so() {
    let machine = Machine::builtin();
    for text in [
        "[letters]\ntext = \"NO\"\n",
        "[path]\npoints = [[\"0 mm\", \"0 mm\"], [\"30 mm\", \"9 mm\"]]\n",
    ] {
        let constant = plan(&machine, &job("job.toml", text, &[], &machine)).unwrap();
        assert!(powers(&constant).all(|power| power == 1.0));
        let text = format!("{text}\n[marking]\npolicy = \"proportional\"\nspeed = \"0.1 m/s\"\n");
        let job = job("job.toml", &text, &[], &machine);
        let proportional = plan(&machine, &job).unwrap();
        assert!(least(&proportional) < 0.02);
        assert!(powers(&proportional).any(|power| power > 0.99));
        let lengths = [&constant, &proportional].map(|plan| plan.artwork.length());
        assert!((lengths[0] / lengths[1] - 1.0).abs() < 1e-3, "{lengths:?}");
    }
}

#[test]
fn points_stay_lit_at_rest_whatever_the_policy() {
    let machine = Machine::builtin();
    let text = "[points]\npoints = [[\"1 mm\", \"0 mm\"]]\n[marking]\npolicy = \"proportional\"\n";
    let plan = plan(&machine, &job("job.toml", text, &[], &machine)).unwrap();
    assert_eq!(powers(&plan).collect::<Vec<_>>(), [1.0]);
}

#[test]
fn a_misspelt_policy_is_told_with_the_right_one() {
    let machine = Machine::builtin();
    let settings = overrides(&["marking.policy=proportionel"]);
    let error = Job::builtin(&settings, &machine).unwrap_err();
    let report = format!("{:?}", miette::Report::new(error));
    assert!(report.contains("did you mean \"proportional\"?"), "{report}");
}

const NO_ROOM: &str = "there is no room to come to speed in the dark";

/// The places of all setpoints.
fn places(plan: &Plan) -> Vec<Vector3<f64>> {
    let setpoints = plan.setpoints(1);
    setpoints.map(|it| Vector3::new(it.position[0], it.position[1], it.position[2])).collect()
}

/// That exactly these lines are lit, from end to end [mm].
fn assert_marked(plan: &Plan, lines: &[[[f64; 3]; 2]]) {
    let lit = lit(plan, [0.0; 2]);
    assert_eq!(lit.len(), lines.len(), "{lit:?}");
    for (lit, line) in lit.iter().zip(lines) {
        for (lit, end) in lit.iter().zip(line) {
            let off = (lit - Vector3::from(*end) * 1e-3).norm();
            assert!(off < 1e-6, "{lit} instead of {end:?}");
        }
    }
}

#[test]
fn lines_at_the_edges_of_the_area_are_marked_whole_and_within_it() {
    let machine = machine(false, &[]);
    // Along each edge from corner to corner, then from the middle out to each and back from it.
    let text = "G21 G90\nM3 S500 F12000\nG0 X-300 Y-300\nG1 X300\nG1 Y300\nG1 X-300\nG1 Y-300\n\
                G0 X0 Y0\nG1 X300\nG0 Y0 X0\nG1 X-300\nG0 X0\nG1 Y300\nG0 Y-300\nG1 Y0\n";
    let plan = planned(text, &[], &machine);
    for place in places(&plan) {
        assert!(place.amax() <= 0.3 + 1e-9, "{place}");
    }
    let notes = texts(&plan.facts.notes, NO_ROOM);
    assert_eq!(notes.len(), 1, "{:?}", plan.facts.notes);
    assert_eq!(notes[0].0, 4);
    let corners =
        [[-300.0, -300.0, 0.0], [300.0, -300.0, 0.0], [300.0, 300.0, 0.0], [-300.0, 300.0, 0.0]];
    let mut lines: Vec<_> =
        (0..4).map(|index| [corners[index], corners[(index + 1) % 4]]).collect();
    for end in [[300.0, 0.0, 0.0], [-300.0, 0.0, 0.0], [0.0, 300.0, 0.0]] {
        lines.push([[0.0; 3], end]);
    }
    lines.push([[0.0, -300.0, 0.0], [0.0; 3]]);
    assert_marked(&plan, &lines);
    // Power falls with the speed where there is no room, and never rises above what was asked for.
    assert!(least(&plan) < 0.05 && powers(&plan).all(|power| power <= 0.5));
}

#[test]
fn a_plunge_never_goes_below_the_written_height() {
    let machine = machine(true, &[]);
    let text = "G21 G90\nG0 X0 Y0 Z0\nM3 S500 F1200\nG1 Z-1\nG0 X10\nG1 X30 Z-1\nG0 Z0\n\
                G1 X50 Z-1\nG0 X60\nG1 Z0\nG0 X70\nG1 X90\n";
    let plan = planned(text, &[], &machine);
    let lowest = places(&plan).iter().map(|place| place.z).fold(f64::INFINITY, f64::min);
    assert!(lowest >= -1e-3 - 1e-9, "{lowest}");
    let notes = texts(&plan.facts.notes, NO_ROOM);
    assert_eq!(notes.len(), 1, "{:?}", plan.facts.notes);
    assert_eq!(notes[0].0, 4);
    let mark = |from, to| [from, to];
    assert_marked(
        &plan,
        &[
            mark([0.0, 0.0, 0.0], [0.0, 0.0, -1.0]),
            mark([10.0, 0.0, -1.0], [30.0, 0.0, -1.0]),
            mark([30.0, 0.0, 0.0], [50.0, 0.0, -1.0]),
            mark([60.0, 0.0, -1.0], [60.0, 0.0, 0.0]),
            mark([70.0, 0.0, 0.0], [90.0, 0.0, 0.0]),
        ],
    );
    // What is level is marked at full power from end to end.
    let mut text = "G21 G90\nG0 X0 Y0 Z-1\nM3 S500 F1200\nG1 X30\nG0 X40\nG1 Y30\n".to_owned();
    for policy in ["constant", "proportional"] {
        let plan = planned(&text, &[&format!("marking.policy={policy}")], &machine);
        assert_eq!(least(&plan) == 0.5, policy == "constant");
        assert!(texts(&plan.facts.notes, NO_ROOM).is_empty(), "{:?}", plan.facts.notes);
        text += "M5\n";
    }
}
