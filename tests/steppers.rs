//! The letters of the source on a machine without encoders, from job file to marks, in virtual time.

#![allow(clippy::unwrap_used)]

mod support;

use drives::PlantOptions;
use graver::simulation::simulate;
use machine::{Machine, Override};
use monitor::examination::Examination;
use monitor::marks::Marks;
use monitor::stage::Clock;
use planner::Job;
use signals::ControllerReport;

/// The letters at 20 mm on the machine with `changes`, simulated on a plant with `plant` changed.
fn run(plant: &[&str]) -> (Option<Marks>, ControllerReport) {
    let changes = |texts: &[&str]| -> Vec<Override> {
        texts.iter().map(|text| text.parse().unwrap()).collect()
    };
    let path = support::source("machines").join("cartesian_steppers.toml");
    let machine = Machine::load(&path, &[]).unwrap();
    let plant = Machine::load(&path, &changes(plant)).unwrap();
    let job = Job::builtin(&[], &machine).unwrap();
    let plan = planner::plan(&machine, &job).unwrap();
    let mut examination = Examination::new(&plan.artwork, Clock::Virtual);
    let simulated = simulate(&machine, &plant, &plan, PlantOptions::default(), |records| {
        records.iter().for_each(|record| examination.push(record));
    })
    .unwrap();
    (examination.finish().marks, simulated.controller)
}

#[test]
fn steppers_mark_the_letters_within_their_pulses() {
    let (marks, report) = run(&[]);
    println!("{marks:#?}");
    assert_eq!((report.completed, report.fault.code), (1, 0), "{report:?}");
}

#[test]
fn a_motor_weaker_than_the_file_says_falls_out_of_step() {
    let weak = [
        "axis.x.motor.stepper.holding_torque=0.03 N m",
        "axis.x.motor.stepper.detent_torque=0 N m",
    ];
    let (_, report) = run(&weak);
    assert_eq!((report.completed, report.fault.axis), (0, 1), "{report:?}");
    assert_eq!(report.fault.code, signals::FaultCode::DriveFault as u32);
}
