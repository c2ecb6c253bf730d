//! A gantry: two motors on the y axis of a Cartesian machine, one of them mounted the other way round.

#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use drives::PlantOptions;
use machine::document::Override;
use machine::{Machine, Motor};
use messages::{ControllerReport, Fault, FaultCode, MAX_ACTUATORS};
use monitor::marks::{Marks, StreamEnd};
use monitor::recording::CycleRecord;
use monitor::run_analysis::{Clock, RunAnalysis};
use monitor::summary::FaultSummary;
use planner::{Job, Plan};
use workbench::simulation::{SimulationError, simulate};

const PAIR: &str = "[axis.y.actuator.left]\n[axis.y.actuator.right]\nmirrored = true\n";

/// The actuators of y.
const LEFT: usize = 1;
const RIGHT: usize = 2;

fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name)
}

/// The machine file of this name as a gantry, with `settings` laid over it.
fn gantry(name: &str, settings: &[&str]) -> Machine {
    let text = std::fs::read_to_string(shipped("machines").join(format!("{name}.toml"))).unwrap();
    let overrides: Vec<Override> = settings.iter().map(|text| text.parse().unwrap()).collect();
    Machine::parse("gantry.toml", &format!("{text}{PAIR}"), &overrides).unwrap()
}

fn letter(machine: &Machine, text: &str) -> Plan {
    let changes = [format!("letters.text={text}"), "letters.height=20 mm".to_owned()];
    let overrides: Vec<Override> = changes.iter().map(|change| change.parse().unwrap()).collect();
    let job = Job::read(&shipped("jobs/letters.toml"), &overrides, machine).unwrap();
    planner::plan(machine, &job).unwrap()
}

struct Simulated {
    marks: Option<Marks>,
    report: ControllerReport,
    /// How far apart the two motors of y were at most, and at the first record [m].
    racking: [f64; 2],
}

fn racking(machine: &Machine, record: &CycleRecord) -> f64 {
    let place = |index: usize| record.feedback.position[index] * machine.actuators[index].ratio;
    (place(LEFT) - place(RIGHT)).abs()
}

fn run(machine: &Machine, plant: &Machine, text: &str) -> Result<Simulated, SimulationError> {
    let plan = letter(machine, text);
    let mut analysis = RunAnalysis::new(&plan.artwork, Clock::Virtual, machine.realtime.period);
    let (mut most, mut first): (f64, Option<f64>) = (0.0, None);
    let options = PlantOptions { seed: 3, ..PlantOptions::default() };
    let simulated = simulate(machine, plant, &plan, options, |records| {
        for record in records {
            analysis.push(record);
            let racking = racking(machine, record);
            first.get_or_insert(racking);
            most = most.max(racking);
        }
    })?;
    let report = simulated.controller;
    let marks = analysis.finish(StreamEnd::Reported(&report)).marks.ok().map(|marks| marks.marks);
    Ok(Simulated { marks, report, racking: [most, first.unwrap()] })
}

fn assert_accurate(what: &str, run: &Simulated) {
    assert_eq!((run.report.completed, run.report.fault.code), (1, 0), "{what}: {:?}", run.report);
    let marks = run.marks.as_ref().unwrap();
    assert!(marks.error_max <= 15e-6, "{what}: error {:e}", marks.error_max);
    assert!(marks.tracking_max <= 15e-6, "{what}: tracking {:e}", marks.tracking_max);
    assert!(marks.error_rms <= 8e-6, "{what}: error rms {:e}", marks.error_rms);
    assert_eq!((marks.strokes_lost, marks.stray), (0, 0.0), "{what}");
}

fn named(fault: &Fault, machine: &Machine) -> (FaultCode, Option<String>) {
    (fault.code(), FaultSummary::of(fault, machine).unwrap().axis)
}

#[test]
fn letters_are_marked_as_exactly_as_with_one_motor() {
    for name in ["cartesian", "cartesian_steppers"] {
        let machine = gantry(name, &[]);
        for text in ["N", "S"] {
            let run = run(&machine, &machine, text).unwrap();
            assert_accurate(&format!("{name} {text}"), &run);
            assert!(run.racking[0] < 10e-6, "{name} {text}: {:e} m apart", run.racking[0]);
        }
    }
}

#[test]
fn two_alike_bear_half_each_and_a_mirrored_one_turns_backwards() {
    let machine = gantry("cartesian", &[]);
    let plan = letter(&machine, "S");
    let mut moved = false;
    for setpoint in plan.setpoints(1) {
        assert_eq!(setpoint.effort[LEFT], -setpoint.effort[RIGHT]);
        assert_eq!(setpoint.lead[LEFT], setpoint.lead[RIGHT]);
        moved |= setpoint.effort[LEFT].abs() > 1e-4;
        assert_eq!(setpoint.effort[3..], [0.0; MAX_ACTUATORS - 3]);
    }
    assert!(moved);
    assert_eq!((plan.facts.uses.velocity.len(), plan.facts.uses.current.len()), (2, 3));
    assert_eq!(plan.facts.uses.current[LEFT], plan.facts.uses.current[RIGHT]);
}

/// Shares of unlike motors: the efforts of a joint at rest to each other are as what the motors can give.
#[test]
fn an_unlike_pair_shares_by_what_each_motor_can_give() {
    let mut machine = gantry("cartesian", &["axis.y.actuator.right.gear=1.5"]);
    let [left, right] = [LEFT, RIGHT].map(|index| machine.actuators[index].clone());
    assert!((left.share - 2.0 * right.share).abs() < 1e-12);
    // Without rotors and screws all of the effort is the load's.
    for actuator in &mut machine.actuators {
        let Motor::Dc(motor) = &mut actuator.motor else { panic!() };
        motor.rotor_inertia = 1e-15;
    }
    let mut most: f64 = 0.0;
    for setpoint in letter(&machine, "N").setpoints(1) {
        let [one, other] =
            [(LEFT, &left), (RIGHT, &right)].map(|(index, it)| setpoint.effort[index] / it.ratio);
        assert!((one - 2.0 * other).abs() < 1e-6, "{one} {other}");
        most = most.max(one.abs());
    }
    assert!(most > 0.5, "{most} N");
}

#[test]
fn a_pair_that_is_less_alike_than_planned_follows_and_stays_together() {
    let machine = gantry("cartesian", &[]);
    let mut plant = machine.clone();
    let right = &mut plant.actuators[RIGHT];
    right.friction.coulomb *= 2.0;
    right.motor.dc_mut().unwrap().torque_constant *= 0.9;
    let run = run(&machine, &plant, "S").unwrap();
    assert_eq!((run.report.completed, run.report.fault.code), (1, 0), "{:?}", run.report);
    assert!(run.racking[0] < 0.1 * machine.axes[1].limits.racking, "{:e}", run.racking[0]);
}

#[test]
fn one_that_jams_is_named() {
    let machine = gantry("cartesian", &["mechanism.cartesian.y.stiffness=\"2 N m/rad\""]);
    for (index, name) in [(LEFT, "y.left"), (RIGHT, "y.right")] {
        let mut plant = machine.clone();
        plant.actuators[index].friction.coulomb = 2.0;
        let run = run(&machine, &plant, "N").unwrap();
        assert_eq!(run.report.completed, 0);
        let named = named(&run.report.fault, &machine);
        assert_eq!(named, (FaultCode::FollowingError, Some(name.to_owned())));
    }
}

#[test]
fn two_that_part_too_far_are_stopped_before_either_is_lost() {
    let machine = gantry(
        "cartesian",
        &["mechanism.cartesian.y.stiffness=\"2 N m/rad\"", "axis.y.limits.racking=\"0.3 mm\""],
    );
    let mut plant = machine.clone();
    plant.actuators[RIGHT].friction.coulomb = 2.0;
    let run = run(&machine, &plant, "N").unwrap();
    let (code, name) = named(&run.report.fault, &machine);
    assert_eq!(code, FaultCode::Racking);
    assert!(name.unwrap().starts_with("y."));
    assert!((run.report.fault.limit().unwrap() - 0.3e-3).abs() < 1e-12);
}

/// Belts so soft that friction holds the motors where they come up.
const SOFT: &str = "mechanism.cartesian.y.stiffness=\"0.5 N m/rad\"";

#[test]
fn a_gantry_that_comes_up_crooked_is_squared_before_it_is_ready() {
    for name in ["cartesian", "cartesian_steppers"] {
        let machine = gantry(name, &[SOFT]);
        let plant = gantry(name, &[SOFT, "axis.y.actuator.right.square=\"0.12 mm\""]);
        let run = run(&machine, &plant, "N").unwrap();
        // The first record is of the machine that has just become ready, each motor within its tolerance.
        let most = 2.0 * machine.path.tolerance;
        assert!(run.racking[1] <= most, "{name}: {:e} m apart when ready", run.racking[1]);
        assert_accurate(name, &run);
    }
}

#[test]
fn one_that_is_too_crooked_is_not_enabled() {
    let machine = gantry("cartesian", &[SOFT, "axis.y.limits.racking=\"0.1 mm\""]);
    let mut plant = machine.clone();
    plant.actuators[RIGHT].square = 0.12e-3;
    let Err(SimulationError::Faulted { fault, words }) = run(&machine, &plant, "N") else {
        panic!()
    };
    assert_eq!(fault.code(), FaultCode::Racking);
    assert!(words.contains("racking of axis y."), "{words}");
}
