//! The machine file of an axis with a stepper, and every way of getting it wrong.

#![allow(clippy::unwrap_used)]

use machine::{Machine, Motor};

const FILE: &str = include_str!("../../machines/cartesian_steppers.toml");

/// What the errors say, their help left out, of the file with `from` replaced by `to`.
fn errors(from: &str, to: &str) -> Vec<String> {
    assert!(FILE.contains(from), "{from}");
    let error = Machine::parse("m.toml", &FILE.replacen(from, to, 1), &[]).unwrap_err();
    let first = |message: String| message.split(';').next().unwrap().to_owned();
    error.problems().map(|problem| first(problem.message())).collect()
}

#[test]
fn a_stepper_is_counted_in_its_pulses() {
    let machine = Machine::parse("m.toml", FILE, &[]).unwrap();
    assert!(machine.warnings.is_empty(), "{:?}", machine.warnings);
    let axis = &machine.actuators[0];
    let Motor::Stepper(motor) = axis.motor else { panic!("{axis:?}") };
    assert_eq!((motor.full_steps, motor.microsteps, axis.encoder.counts), (200.0, 16.0, 3200.0));
    assert!((motor.pulse_rate - 200e3).abs() < 1e-6);
    // The rotor and the screw through the gear: 3.8e-6 + 6.468e-6/9.
    assert!((motor.rotor_inertia - 4.518_667e-6).abs() < 1e-12);
    // 5 mm a turn: 90 % of 200 kHz are 0.28125 m/s.
    assert!(
        (machine.axes[0].limits.velocity - 0.281_25).abs() < 1e-12,
        "{}",
        machine.axes[0].limits.velocity
    );
    // 50 turns a second, as the file's comment says.
    let torque = motor.pull_out_torque(100.0 * core::f64::consts::PI);
    assert!((torque - 0.2444).abs() < 5e-4, "{torque}");
    assert_eq!((axis.gains.position, axis.gains.velocity, axis.gains.current), (0.0, 0.0, 0.0));
}

#[test]
fn what_a_stepper_does_not_have_is_refused() {
    let found = errors(
        "[axis.x.limits]",
        "[axis.x.encoder]\nresolution = \"4096 counts/rev\"\n\n[axis.x.limits]",
    );
    assert_eq!(found, ["an axis with a stepper has no `encoder`"]);
    let found =
        errors("[axis.y.limits]", "[axis.y.loops]\nposition = \"40 1/s\"\n\n[axis.y.limits]");
    assert_eq!(found, ["an axis with a stepper has no `loops`"]);
}

#[test]
fn steps_are_whole_and_currents_can_be_driven() {
    let found = errors("full_steps = 200", "full_steps = 202");
    assert_eq!(found, ["202 is not possible here: it must be a multiple of 4"]);
    let found = errors("microsteps = 16", "microsteps = 2.5");
    assert_eq!(found, ["2.5 is not possible here: it must be a multiple of 1"]);
    let found = errors("voltage = \"48 V\"", "voltage = \"2 V\"");
    assert_eq!(found, ["2.0 V across 1.650 Ω drive at most 1.21 A, not 1.68 A"]);
}

#[test]
fn an_axis_has_one_motor_and_all_axes_the_same_kind() {
    let dc = "motor.dc]\nvoltage = \"12 V\"\ncurrent = \"5.2 A\"\nresistance = \"2.3 ohm\"\n\
              inductance = \"2.3 mH\"\ntorque_constant = \"0.021 N m/A\"\n\
              rotor_inertia = \"2e-6 kg m^2\"\n";
    let first = "[axis.x.motor.stepper]\n";
    let found = errors(first, &format!("[axis.x.{dc}\n{first}"));
    assert_eq!(found, ["axis `x` has two motors"]);
    let begin = FILE.find("[axis.y.motor.stepper]").unwrap();
    let end = begin + FILE[begin..].find("\n\n").unwrap();
    let found = errors(&FILE[begin..end], "[axis.y.motor]");
    assert_eq!(found, ["axis `y` has no motor"]);
    let encoder = "\n[axis.y.encoder]\nresolution = \"4096 counts/rev\"\n";
    let found = errors(&FILE[begin..end], &format!("[axis.y.{dc}{encoder}"));
    assert_eq!(found, ["axes `x` and `y` have motors of different kinds"]);
    let found = errors(&FILE[begin..end], &format!("[axis.y.{dc}"));
    assert_eq!(found, ["`encoder` is missing in the table `y`"]);
}
