//! The letters of the source on both machines, from job file to marks, in virtual time.

#![allow(clippy::unwrap_used)]

mod support;

use std::path::Path;
use std::sync::Mutex;

use drives::PlantOptions;
use machine::{Machine, Override};
use messages::ControllerReport;
use messages::time::{Period, SETPOINT_TIME};
use monitor::marks::{Marks, StreamEnd};
use monitor::run_analysis::{Clock, RunAnalysis};
use planner::Job;
use workbench::simulation::simulate;

const MACHINES: [&str; 2] = ["cartesian", "corexy"];
const LETTERS: [&str; 4] = ["N", "A", "S", "O"];
const HEIGHTS: [u32; 3] = [10, 20, 50];

fn overrides(texts: &[String]) -> Vec<Override> {
    texts.iter().map(|text| text.parse().unwrap()).collect()
}

fn load(name: &str, changes: &[String]) -> Machine {
    let path = support::source("machines").join(format!("{name}.toml"));
    Machine::load(&path, &overrides(changes)).unwrap()
}

/// One simulated job: the figures that are judged.
#[derive(Debug, Clone)]
struct Outcome {
    marks: Marks,
    report: ControllerReport,
    /// From the first motion to the last [s].
    time: f64,
    axes: usize,
}

impl Outcome {
    fn largest_limit_use(&self) -> f64 {
        let report = &self.report;
        [&report.velocity_use[..], &report.acceleration_use, &report.jerk_use, &report.effort_use]
            .iter()
            .flat_map(|uses| uses.iter().take(self.axes))
            .copied()
            .chain([report.path_acceleration_use, report.path_jerk_use])
            .fold(0.0, f64::max)
    }
}

fn run(machine: &Machine, plant: &Machine, job: &Path, changes: &[String], seed: u64) -> Outcome {
    let job = Job::read(job, &overrides(changes), machine).unwrap();
    let plan = planner::plan(machine, &job).unwrap();
    let mut analysis = RunAnalysis::new(&plan.artwork, Clock::Virtual, machine.realtime.period);
    let options = PlantOptions { seed, ..PlantOptions::default() };
    let simulated = simulate(machine, plant, &plan, options, |records| {
        records.iter().for_each(|record| analysis.push(record));
    })
    .unwrap();
    let report = simulated.controller;
    assert_eq!((report.completed, report.fault.code), (1, 0), "{report:?}");
    // The stream rests before and after the motion, and one cycle sets it off; the time of a job
    // is that of the motion.
    let period = machine.realtime.period;
    let last = Period::OF_SETPOINTS.of(plan.facts.samples - 1);
    assert_eq!(report.cycles, period.cycles_for(last) + 2);
    assert!(plan.facts.duration <= plan.facts.samples as f64 * SETPOINT_TIME);
    Outcome {
        marks: analysis.finish(StreamEnd::Reported(&report)).marks.unwrap().marks,
        report,
        time: plan.facts.duration,
        axes: machine.axes.len(),
    }
}

fn letter(machine: &Machine, text: &str, height: u32, style: &str, more: &[&str]) -> Outcome {
    let mut changes = vec![
        format!("letters.text={text}"),
        format!("letters.height={height} mm"),
        format!("letters.style={style}"),
    ];
    changes.extend(more.iter().map(|change| (*change).to_owned()));
    run(machine, machine, &support::source("jobs/letters.toml"), &changes, 0)
}

/// The cases of the acceptance, worked off by two threads: a test harness runs one test in one.
fn every_letter(check: impl Fn(&Machine, &str, u32) + Sync) {
    let machines = MACHINES.map(|name| load(name, &[]));
    let mut cases: Vec<(&Machine, &str, u32)> = Vec::new();
    for machine in &machines {
        for letter in LETTERS {
            cases.extend(HEIGHTS.map(|height| (machine, letter, height)));
        }
    }
    let cases = Mutex::new(cases.into_iter());
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                loop {
                    let Some((machine, letter, height)) = cases.lock().unwrap().next() else {
                        return;
                    };
                    check(machine, letter, height);
                }
            });
        }
    });
}

/// Rows a tenth of a millimetre apart, so slow that friction holds the axis across them between its small steps.
#[test]
fn the_rows_of_a_slow_hatch_lie_where_they_should() {
    let place = support::Place::new();
    let row = |index: u32| {
        let (from, to) = if index.is_multiple_of(2) { (0, 8) } else { (8, 0) };
        format!("G0 X{from} Y{:.1}\nG1 X{to}\n", f64::from(index) * 0.1)
    };
    let rows: String = (0..12).map(row).collect();
    let job = place.file("rows.ngc", &format!("G21 G90\nM3 S500 F1200\n{rows}M5\nM2\n"));
    let machine = load("cartesian", &[]);
    let marks = run(&machine, &machine, &job, &[], 0).marks;
    assert!(marks.error_max <= 15e-6, "error {:e}", marks.error_max);
}

/// The accuracy that is promised, and the limits that are kept.
fn assert_accurate(what: &str, outcome: &Outcome) {
    let marks = &outcome.marks;
    assert!(marks.error_max <= 15e-6, "{what}: error {:e}", marks.error_max);
    assert!(marks.tracking_max <= 15e-6, "{what}: tracking {:e}", marks.tracking_max);
    assert!(marks.error_rms <= 8e-6, "{what}: error rms {:e}", marks.error_rms);
    assert!(marks.missing_end_max <= 20e-6, "{what}: missing {:e}", marks.missing_end_max);
    assert!(marks.double_end_max <= 20e-6, "{what}: double {:e}", marks.double_end_max);
    assert_eq!((marks.strokes_lost, marks.stray), (0, 0.0), "{what}");
    let largest = outcome.largest_limit_use();
    assert!(largest <= 1.01, "{what}: {largest} of a limit");
}

/// The printed times and speeds, table 3-1, as the golden file repeats them.
fn printed(letter: &str, height: u32) -> (f64, f64) {
    let golden = support::golden("letters");
    let results = &golden["H1_literal_J500"]["letters"][letter]["results"];
    let found = results.as_array().unwrap().iter().find(|result| {
        (result["scale_m"].as_f64().unwrap() - f64::from(height) * 1e-3).abs() < 1e-9
    });
    let thesis = &found.unwrap()["thesis"];
    (thesis["T"].as_f64().unwrap(), thesis["V"].as_f64().unwrap())
}

#[test]
fn chord_by_chord_the_letters_are_accurate_and_take_the_printed_times() {
    every_letter(|machine, text, height| {
        let what = format!("{} {text} {height} mm h1", machine.name);
        let (time, speed) = printed(text, height);
        let speed = format!("marking.speed={speed} m/s");
        let outcome = letter(machine, text, height, "h1", &[&speed]);
        assert_accurate(&format!("{what} at the printed speed"), &outcome);
        let share = outcome.time / time;
        assert!((share - 1.0).abs() <= 0.06, "{what}: {} s, {share} of table 3-1", outcome.time);

        let optimum = letter(machine, text, height, "h1", &[]);
        assert_accurate(&format!("{what} at the optimum speed"), &optimum);
        assert!(optimum.time <= outcome.time + 1e-9, "{what}: {} s", optimum.time);
    });
}

/// Acceptance 4: shares of the printed times that S and O may take as curves.
fn allowed_share(letter: &str, height: u32) -> Option<f64> {
    match (letter, height) {
        ("S", _) => Some(0.25),
        ("O", 50) => Some(0.215),
        ("O", _) => Some(0.17),
        _ => None,
    }
}

#[test]
fn as_curves_the_letters_are_accurate_and_several_times_faster() {
    every_letter(|machine, text, height| {
        let what = format!("{} {text} {height} mm curves", machine.name);
        let outcome = letter(machine, text, height, "curves", &[]);
        assert_accurate(&what, &outcome);
        if let Some(share) = allowed_share(text, height) {
            let (time, _) = printed(text, height);
            assert!(outcome.time <= share * time, "{what}: {} s of {time} s", outcome.time);
            // One speed while lit, but for a ripple that the plant's own tool shows.
            let (slow, fast) = (outcome.marks.speed_min, outcome.marks.speed_max);
            assert!(fast <= 0.25 * 1.03 && slow >= fast * 0.9, "{what}: {slow} to {fast} m/s");
        }
    });
}

#[test]
fn two_runs_have_one_digest_and_the_seed_changes_no_mark_by_more_than_its_noise() {
    for name in MACHINES {
        let machine = load(name, &[]);
        let job = support::source("jobs/letters.toml");
        let simulated = |seed| run(&machine, &machine, &job, &["letters.text=SO".into()], seed);
        let (first, again) = (simulated(0), simulated(0));
        assert_eq!(first.report.digest, again.report.digest, "{name}");
        assert_eq!(first.marks, again.marks, "{name}");
        for seed in [1, 2, u64::MAX] {
            let seeded = simulated(seed);
            assert_accurate(&format!("{name}, seed {seed}"), &seeded);
        }
    }
}

/// The loops that suit a cycle of 1 ms, as much slower as the cycle is longer.
fn at_period(name: &str, milliseconds: f64) -> Machine {
    let mut changes = vec![format!("realtime.period={milliseconds} ms")];
    if milliseconds > 1.0 {
        for axis in load(name, &[]).axes {
            for (key, bandwidth) in [("position", 40.0), ("velocity", 160.0), ("current", 349.0)] {
                let bandwidth = bandwidth / milliseconds;
                changes.push(format!("axis.{}.loops.{key}={bandwidth} rad/s", axis.name));
            }
        }
    }
    load(name, &changes)
}

#[test]
fn at_4_and_8_khz_the_letters_are_no_worse_than_at_1_khz() {
    for name in MACHINES {
        for style in ["curves", "h1"] {
            let [slow, fast, fastest] = [1.0, 0.25, 0.125]
                .map(|period| letter(&at_period(name, period), "NASO", 20, style, &[]).marks);
            for (rate, marks) in [("4 kHz", fast), ("8 kHz", fastest)] {
                for (figure, found, limit) in [
                    ("error", marks.error_max, slow.error_max),
                    ("rms error", marks.error_rms, slow.error_rms),
                    ("tracking", marks.tracking_max, slow.tracking_max),
                ] {
                    let what = format!("{name} {style} at {rate}: {figure}");
                    assert!(found <= limit, "{what} {found:e}, {limit:e} at 1 kHz");
                }
                assert_eq!((marks.strokes_lost, marks.stray), (0, 0.0), "{name} at {rate}");
            }
        }
    }
}

#[test]
fn at_250_hz_the_letters_are_marked_whole() {
    for name in MACHINES {
        let outcome = letter(&at_period(name, 4.0), "NASO", 20, "curves", &[]);
        let marks = &outcome.marks;
        assert_eq!((marks.strokes_lost, marks.stray), (0, 0.0), "{name}");
        assert!(marks.error_max <= 100e-6, "{name}: {:e}", marks.error_max);
        assert!(outcome.largest_limit_use() <= 1.01, "{name}: {}", outcome.largest_limit_use());
    }
}

#[test]
fn another_job_has_another_digest() {
    let machine = load("corexy", &[]);
    let digest = |text, height| letter(&machine, text, height, "curves", &[]).report.digest;
    let digests = [digest("N", 10), digest("N", 20), digest("A", 10)];
    assert!(digests[0] != digests[1] && digests[0] != digests[2], "{digests:x?}");
}

#[test]
fn a_plant_that_differs_from_the_machine_file_is_marked_worse() {
    let job = support::source("jobs/letters.toml");
    let letters = ["letters.text=SO".to_owned()];
    for (name, change) in [
        ("corexy", "mechanism.corexy.mass_x=0.5 kg"),
        ("corexy", "axis.a.friction.coulomb=8 mN m"),
        ("corexy", "mechanism.corexy.belt.stiffness=40 N/mm"),
        ("cartesian", "axis.x.friction.coulomb=8 mN m"),
    ] {
        let machine = load(name, &[]);
        let nominal = run(&machine, &machine, &job, &letters, 0);
        let plant = load(name, &[change.to_owned()]);
        let other = run(&machine, &plant, &job, &letters, 0);
        assert!(
            other.marks.error_max > 1.5 * nominal.marks.error_max,
            "{name}, {change}: {:e} against {:e}",
            other.marks.error_max,
            nominal.marks.error_max
        );
        // What is commanded answers to the plan, not to the plant.
        assert_eq!(other.report.digest, nominal.report.digest, "{name}, {change}");
    }
}

#[test]
fn the_command_tells_the_planned_time_and_how_fast_it_went() {
    let place = support::Place::new();
    for set in ["letters.text=N", "letters.style=h1"] {
        let planned = place.graver(&["plan", "--json", "--set", set]).json(0);
        let summary = place.graver(&["simulate", "--json", "--set", set]).json(0);
        let (planned, simulated) =
            (support::number(&planned, "/time"), support::number(&summary, "/time"));
        assert!((simulated - planned).abs() < 1e-9, "{set}: {simulated} s, planned {planned} s");
        assert!(support::number(&summary, "/realtime_factor") > 0.0);
        assert_eq!(summary["out"], serde_json::Value::Null);
    }
}

/// Such a job never began, and the simulation waited for its end for ever.
#[test]
fn a_job_that_the_controller_does_not_start_is_refused() {
    let place = support::Place::new();
    let machine = support::source("machines").join("servo_gantry.toml");
    let switch = "machine.inputs.x_max.at=41 um";
    let arguments = ["simulate", "--json", "--machine", machine.to_str().unwrap(), "--set", switch];
    let summary = place.graver(&arguments).json(2);
    assert_eq!(
        summary["error"]["message"],
        "the controller refused to start the job: axis x is on its limit switch: jog it away from it"
    );
}
