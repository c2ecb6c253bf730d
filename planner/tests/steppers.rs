//! Plans for steppers: how far the magnetic axis leads, and what the checker refuses.

#![allow(clippy::unwrap_used)]

use machine::{Machine, Motor, StepperMotor};
use planner::plan::LimitUtilization;
use planner::{Job, PlanError, plan};

fn machine() -> Machine {
    let text = include_str!("../../machines/cartesian_steppers.toml");
    Machine::parse("cartesian_steppers.toml", text, &[]).unwrap()
}

fn stepper(machine: &mut Machine, axis: usize) -> &mut StepperMotor {
    match &mut machine.actuators[axis].motor {
        Motor::Stepper(motor) => motor,
        Motor::Dc(motor) => panic!("{motor:?}"),
    }
}

/// How long the built-in job takes on `machine` [s], and what it uses of the limits.
fn planned(machine: &Machine) -> (f64, LimitUtilization) {
    let facts = plan(machine, &Job::builtin(&[], machine).unwrap()).unwrap().facts;
    assert_eq!(facts.strokes, 8);
    (facts.duration, facts.uses)
}

#[test]
fn the_checker_reports_torque_and_pulse_rate() {
    let machine = machine();
    let job = Job::builtin(&[], &machine).unwrap();
    let uses = plan(&machine, &job).unwrap().facts.uses;
    println!("{uses:?}");
    // Somewhere the letters move at up to 0.25 m/s, 160 kHz of 200.
    let fastest = uses.velocity[0] * machine.axes[0].limits.velocity;
    let rate = fastest / machine.actuators[0].ratio * 3200.0 / core::f64::consts::TAU / 200e3;
    assert!((uses.voltage[0] / rate - 1.0).abs() < 0.02, "{} {rate}", uses.voltage[0]);
    assert!(uses.current.iter().all(|share| *share > 0.05 && *share < 1.0), "{:?}", uses.current);
}

#[test]
fn a_weak_motor_or_a_slow_driver_slows_the_job_and_is_not_exceeded() {
    let (quick, uses) = planned(&machine());
    let mut weak = machine();
    let StepperMotor { holding_torque, .. } = *stepper(&mut weak, 1);
    stepper(&mut weak, 1).holding_torque = 0.7 * uses.current[1] * holding_torque;
    let (duration, uses) = planned(&weak);
    assert!(duration > quick, "{duration} s after {quick} s");
    assert!(uses.current[1] > 0.8 && uses.current[1] <= 1.0, "{:?}", uses.current);
    let mut slow = machine();
    stepper(&mut slow, 0).pulse_rate = 40e3;
    let (duration, uses) = planned(&slow);
    assert!(duration > quick, "{duration} s after {quick} s");
    assert!(uses.voltage[0] > 0.9 && uses.voltage[0] <= 1.0, "{:?}", uses.voltage);
}

/// What holds the load at rest cannot be had by going slower.
#[test]
fn a_motor_that_cannot_move_its_axis_at_all_is_refused() {
    let mut weak = machine();
    stepper(&mut weak, 1).holding_torque = 1e-4;
    let job = Job::builtin(&[], &weak).unwrap();
    let Err(PlanError::Unreachable { cause, .. }) = plan(&weak, &job) else {
        panic!("0.1 mN·m are less than the friction")
    };
    assert_eq!((cause.code, cause.axis), ("overload", Some(1)));
}
