//! Drives that act later than they are told: the declared latency is in the plan of each actuator and of the
//! gate, so that marks are as accurate as without one.

#![allow(clippy::unwrap_used)]

mod support;

use drives::PlantOptions;
use machine::{Machine, Override};
use monitor::marks::{Marks, StreamEnd};
use monitor::run_analysis::{Clock, RunAnalysis};
use planner::Job;
use workbench::simulation::simulate;

fn overrides(texts: &[&str]) -> Vec<Override> {
    texts.iter().map(|text| text.parse().unwrap()).collect()
}

/// The marks of one letter on a machine with these changes.
fn mark(file: &str, changes: &[&str]) -> Marks {
    let path = support::source("machines").join(format!("{file}.toml"));
    let machine = Machine::load(&path, &overrides(changes)).unwrap();
    let letter = ["letters.text=S", "letters.height=10 mm"];
    let job =
        Job::read(&support::source("jobs/letters.toml"), &overrides(&letter), &machine).unwrap();
    let plan = planner::plan(&machine, &job).unwrap();
    let mut analysis = RunAnalysis::new(&plan.artwork, Clock::Virtual, machine.realtime.period);
    let options = PlantOptions::default();
    let simulated = simulate(&machine, &machine, &plan, options, |records| {
        records.iter().for_each(|record| analysis.push(record));
    });
    let report = simulated.unwrap().controller;
    assert_eq!((report.completed, report.fault.code), (1, 0), "{changes:?}: {report:?}");
    analysis.finish(StreamEnd::Reported(&report)).marks.unwrap().marks
}

/// How far the marks of a machine with these changes may be off [m].
fn assert_accurate(file: &str, changes: &[&str], bound: f64) {
    let marks = mark(file, changes);
    let what = format!("{file} {changes:?}: {marks:?}");
    assert!(marks.error_max <= bound, "{what}");
    assert!(marks.tracking_max <= bound, "{what}");
    assert!(marks.missing_end_max <= 20e-6 && marks.double_end_max <= 20e-6, "{what}");
    assert_eq!((marks.strokes_lost, marks.stray), (0, 0.0), "{what}");
}

#[test]
fn a_latency_of_whole_cycles_costs_no_accuracy() {
    let latency = |time: &str| {
        ["latency", "gate_latency"].map(|key| format!("drives.simulated.{key}={time}"))
    };
    let late = latency("1 ms");
    let late: Vec<&str> = late.iter().map(String::as_str).collect();
    assert_accurate("corexy", &late, 15e-6);
    let very_late = latency("2 ms");
    let modes = ["axis.a.mode=position", "axis.b.mode=position"];
    let changes: Vec<&str> = very_late.iter().map(String::as_str).chain(modes).collect();
    assert_accurate("corexy", &changes, 15e-6);
}

#[test]
fn written_loops_that_swing_with_the_latency_are_refused_and_those_of_the_drive_are_not() {
    let load = |changes: &[&str]| {
        let path = support::source("machines").join("corexy.toml");
        Machine::load(&path, &overrides(changes))
    };
    let late = "drives.simulated.latency=2 ms";
    let refused = load(&[late]).unwrap_err().to_string();
    let words = "a current loop of 349 rad/s swings without end in a control cycle of 1 ms with a drive that acts \
                 2 ms after it is told";
    assert!(refused.contains(words), "{refused}");
    // The drive closes its current loop itself.
    let torque = ["axis.a.mode=torque", "axis.b.mode=torque"];
    load(&[&[late][..], &torque].concat()).unwrap();
}

#[test]
fn actuators_and_gate_may_be_late_by_different_parts_of_a_cycle() {
    for (x, y, gate) in
        [("0 ms", "0 ms", "0.3 ms"), ("0.4 ms", "1.7 ms", "0 ms"), ("1 ms", "0 ms", "2.6 ms")]
    {
        let changes = [
            format!("drives.simulated.actuators.x.latency={x}"),
            format!("drives.simulated.actuators.y.latency={y}"),
            format!("drives.simulated.gate_latency={gate}"),
        ];
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        assert_accurate("cartesian", &changes, 15e-6);
        assert_accurate("cartesian_steppers", &changes, 15e-6);
        // Without a latency: 12.8, 4.6 and 3.8 um.
        for (mode, bound) in [("torque", 20e-6), ("velocity", 15e-6), ("position", 15e-6)] {
            let modes = ["x", "y"].map(|axis| format!("axis.{axis}.mode={mode}"));
            let changes: Vec<&str> =
                changes.iter().copied().chain(modes.iter().map(String::as_str)).collect();
            assert_accurate("cartesian", &changes, bound);
        }
    }
}

#[test]
fn a_shorter_cycle_counts_the_same_latency_in_more_cycles() {
    let changes = [
        "realtime.period=250 us",
        "drives.simulated.latency=0.9 ms",
        "drives.simulated.gate_latency=0.35 ms",
    ];
    assert_accurate("corexy", &changes, 15e-6);
}

#[test]
fn places_that_were_measured_before_the_deadline_are_held_to_the_plan_of_that_instant() {
    // Drives on a bus measure half a cycle before: 125 um at 0.25 m/s.
    for (mode, bound) in [("position", 15e-6), ("velocity", 25e-6)] {
        let modes = ["x", "y", "z"].map(|axis| format!("axis.{axis}.mode={mode}"));
        let modes: Vec<&str> = modes.iter().map(String::as_str).collect();
        assert_accurate("servo_gantry", &modes, bound);
    }
}

/// A raster of dots as dense as the light can change, in proportion to the speed.
fn raster() -> String {
    let mut text = String::from("G21 G90\nF15000\nG0 X-10 Y0\nM4 S100\n");
    for dot in 1..1200 {
        let power = [0, 600, 300, 0, 900][dot % 5];
        text += &format!("G1 X{:.4} S{power}\n", -10.0 + 0.013 * dot as f64);
    }
    text + "M5\nM2\n"
}

#[test]
fn a_gate_that_is_late_by_a_part_of_a_cycle_has_room_for_every_change_of_a_dense_raster() {
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("raster.ngc");
    std::fs::write(&program, raster()).unwrap();
    let path = support::source("machines").join("corexy.toml");
    for (period, latency) in
        [("1 ms", "0.3 ms"), ("1 ms", "1.85 ms"), ("500 us", "0.2 ms"), ("1.5 ms", "0.4 ms")]
    {
        let changes = [
            format!("realtime.period={period}"),
            format!("drives.simulated.gate_latency={latency}"),
            "laser.off_delay=45 us".to_owned(),
        ];
        let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
        let machine = Machine::load(&path, &overrides(&changes)).unwrap();
        let job = Job::read(&program, &[], &machine).unwrap();
        let plan = planner::plan(&machine, &job).unwrap();
        let (mut times, mut last) = (Vec::new(), (0, 0.0));
        for setpoint in plan.setpoints(1) {
            let start = setpoint.sequence as i64 * 1_000_000;
            let laser = &setpoint.laser;
            if last != (laser.gate, laser.power) {
                times.push(start);
            }
            times.extend(laser.edges().iter().map(|edge| start + i64::from(edge.offset)));
            last = laser.last();
        }
        assert!(times.len() > 1000, "{} changes", times.len());
        // Wherever a cycle begins, one more change than a sample holds is not in it.
        let length = machine.realtime.period.time().0;
        let closest =
            times.windows(messages::MAX_EDGES + 1).map(|it| it[messages::MAX_EDGES] - it[0]);
        assert!(closest.min() >= Some(length), "{period}, {latency}");
        let simulated = simulate(&machine, &machine, &plan, PlantOptions::default(), |_| {});
        let report = simulated.unwrap().controller;
        assert_eq!((report.completed, report.fault.is_some()), (1, false), "{:?}", report.fault);
    }
}
