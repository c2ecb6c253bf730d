//! Plans for steppers: how far the magnetic axis leads, and what the checker refuses.

#![allow(clippy::unwrap_used)]

use machine::{Machine, Motor, StepperMotor};
use planner::check::Quantity;
use planner::{Job, PlanError, plan};

fn machine() -> Machine {
    let text = include_str!("../../machines/cartesian_steppers.toml");
    Machine::parse("cartesian_steppers.toml", text, &[]).unwrap()
}

fn stepper(machine: &mut Machine, axis: usize) -> &mut StepperMotor {
    match &mut machine.axes[axis].motor {
        Motor::Stepper(motor) => motor,
        Motor::Dc(motor) => panic!("{motor:?}"),
    }
}

/// What is refused of the built-in job on `machine`, with axis, limit and unit.
fn refused(machine: &Machine) -> (String, Quantity, f64, &'static str) {
    let job = Job::builtin(&[], machine).unwrap();
    match plan(machine, &job).unwrap_err() {
        PlanError::Limit { breach, .. } => {
            assert!(breach.value > breach.limit, "{breach:?}");
            (breach.axis.unwrap(), breach.quantity, breach.limit, breach.unit)
        }
        other => panic!("{other}"),
    }
}

#[test]
fn the_checker_reports_torque_and_pulse_rate() {
    let machine = machine();
    let job = Job::builtin(&[], &machine).unwrap();
    let uses = plan(&machine, &job).unwrap().facts.uses;
    println!("{uses:?}");
    // Somewhere the letters move at up to 0.25 m/s, 160 kHz of 200.
    let rate = uses.velocity[0] * machine.axes[0].limits.velocity / machine.axes[0].ratio * 3200.0
        / core::f64::consts::TAU
        / 200e3;
    assert!((uses.voltage[0] / rate - 1.0).abs() < 0.02, "{} {rate}", uses.voltage[0]);
    assert!(uses.current.iter().all(|share| *share > 0.05 && *share < 1.0), "{:?}", uses.current);
}

#[test]
fn a_motor_beyond_its_torque_or_its_driver_is_refused() {
    let mut weak = machine();
    stepper(&mut weak, 1).holding_torque = 0.01;
    let (axis, quantity, limit, unit) = refused(&weak);
    assert_eq!((axis.as_str(), quantity, unit), ("y", Quantity::MotorTorque, "N·m"));
    assert!(limit <= 0.01, "{limit}");
    let mut slow = machine();
    stepper(&mut slow, 0).pulse_rate = 40e3;
    let (axis, quantity, limit, unit) = refused(&slow);
    assert_eq!((axis.as_str(), quantity, limit, unit), ("x", Quantity::PulseRate, 40e3, "1/s"));
}
