//! A stepper's axis in the plant: it follows a move to within its pulses, holds a load at its load
//! angle, falls out of step when it must, and refuses what its driver cannot do.
#![allow(clippy::unwrap_used)]

#[allow(dead_code)]
mod shaft;

use drives::plant::{Plant, PlantOptions};
use drives::{Actuation, Freshness, Measurement, Port, Power};
use machine::{Actuator, Axis, Encoder, Friction, LaserSource, LoopGains, Motor, StepperMotor};
use messages::time::SETPOINT_TIME as CYCLE_TIME;
use messages::{CommandMode, FaultCode, axis::actuator_array};
use shaft::Shaft;

const DARK: LaserSource = LaserSource::IDEAL;

/// 2 mm a turn: what the tests call micrometres.
const LEAD: f64 = 0.002 / core::f64::consts::TAU;

fn motor() -> StepperMotor {
    StepperMotor {
        full_steps: 200.0,
        microsteps: 64.0,
        holding_torque: 0.5,
        detent_torque: 0.0,
        rotor_inertia: 1e-5,
        current: 2.0,
        resistance: 1.1,
        inductance: 1.5e-3,
        voltage: 36.0,
        damping: 8e-3,
        pulse_rate: 500e3,
    }
}

fn actuator(motor: StepperMotor, coulomb: f64) -> Actuator {
    Actuator {
        motor: Motor::Stepper(motor),
        encoder: Encoder { counts: motor.pulses_per_turn() },
        gains: LoopGains {
            position: 0.0,
            velocity: 0.0,
            current: 0.0,
            inertia: motor.rotor_inertia,
        },
        ..shaft::actuator(1.0, Friction { coulomb, viscous: 1e-5 })
    }
}

/// An axis that bears `load` [N·m].
fn plant(actuator: &Actuator, load: f64) -> Plant<1, Shaft> {
    plant_of(&shaft::axis(), actuator, load)
}

fn plant_of(axis: &Axis, actuator: &Actuator, load: f64) -> Plant<1, Shaft> {
    let shaft = Shaft { load, spread: 0.0 };
    let (axes, actuators) = (core::slice::from_ref(axis), core::slice::from_ref(actuator));
    Plant::new(
        shaft,
        axes,
        actuators,
        &DARK,
        &[0.0],
        messages::time::Period::OF_SETPOINTS,
        PlantOptions::default(),
    )
    .unwrap()
}

fn to(position: f64, velocity: f64) -> Actuation {
    Actuation {
        freshness: Freshness::Fresh,
        mode: CommandMode::Driven,
        position: actuator_array(&[position]),
        velocity: actuator_array(&[velocity]),
        ..Actuation::DISABLED
    }
}

fn exchange(port: &mut impl Port, actuation: &Actuation) -> Measurement {
    let mut measurement = Measurement::default();
    port.exchange(actuation, &mut measurement);
    measurement
}

/// A rest-to-rest quintic over `distance` [rad] in `time` [s]: angle, speed, acceleration at `at`.
fn quintic(distance: f64, time: f64, at: f64) -> [f64; 3] {
    let s = (at / time).clamp(0.0, 1.0);
    [
        distance * s * s * s * (10.0 + s * (6.0 * s - 15.0)),
        distance / time * 30.0 * s * s * (1.0 + s * (s - 2.0)),
        distance / (time * time) * 60.0 * s * (1.0 + s * (2.0 * s - 3.0)),
    ]
}

#[test]
fn a_led_rotor_follows_a_move_to_within_its_pulses() {
    let (motor, coulomb) = (motor(), 0.02);
    let mut plant = plant(&actuator(motor, coulomb), 0.0);
    // 10 mm in 0.4 s: at most 47 mm/s, 300 kHz.
    let (distance, time) = (10.0 * core::f64::consts::PI, 0.4);
    let lead = |at: f64| {
        let [_, speed, acceleration] = quintic(distance, time, at);
        let moving = if speed > 0.01 { coulomb } else { 0.0 };
        let torque = motor.rotor_inertia * acceleration + 1e-5 * speed + moving;
        motor.load_angle(torque, speed).unwrap()
    };
    let mut worst: f64 = 0.0;
    for cycle in 0..=500 {
        let end = f64::from(cycle + 1) * CYCLE_TIME;
        let [angle, speed, _] = quintic(distance, time, end);
        let slope = (lead(end + 1e-4) - lead((end - 1e-4).max(0.0))) / 2e-4;
        let measurement = exchange(&mut plant, &to(angle + lead(end), speed + slope));
        assert!(!measurement.fault.is_some(), "{:?}", measurement.fault);
        let [planned, ..] = quintic(distance, time, end - CYCLE_TIME);
        worst = worst.max((plant.state().angle[0] - planned).abs());
    }
    let pulse = LEAD / motor.pulses_per_radian();
    println!("worst {:.2} µm, a pulse is {:.2} µm", worst * LEAD * 1e6, pulse * 1e6);
    assert!(worst * LEAD < pulse + 3e-6, "{} µm", worst * LEAD * 1e6);
}

#[test]
fn a_load_is_held_at_home_and_counted_in_pulses() {
    let motor = motor();
    let mut plant = plant(&actuator(motor, 0.0), 0.25);
    // asin(0.25/0.5) is 30° electrical: the count starts where the magnetic axis stands, 0.6° on.
    let start = exchange(&mut plant, &Actuation::DISABLED);
    assert_eq!(start.counts[0], 0);
    assert!((start.position[0] - 0.6_f64.to_radians()).abs() < 1e-12);
    let home = start.position[0];
    let mut plant = self::plant(&actuator(motor, 0.0), 0.25);
    for _ in 0..300 {
        let measurement = exchange(&mut plant, &to(home, 0.0));
        assert_eq!((measurement.power, measurement.counts[0]), (Power::On, 0));
    }
    assert!(plant.state().angle[0].abs() < 1e-9, "{}", plant.state().angle[0]);
    // A command between pulses is rounded to the nearest.
    let third = 10.3 / motor.pulses_per_radian();
    for _ in 0..3 {
        exchange(&mut plant, &to(home + third, 0.0));
    }
    let measurement = exchange(&mut plant, &to(home + third, 0.0));
    assert_eq!(measurement.counts[0], 10);
    assert_eq!(
        measurement.position[0],
        home + 10.0 / motor.pulses_per_turn() * std::f64::consts::TAU
    );
}

/// The first fault on a ramp of `acceleration` [rad/s²], with the speed that it was told at.
fn ramp(plant: &mut Plant<1, Shaft>, acceleration: f64) -> (messages::Fault, f64) {
    for cycle in 1..2000 {
        let time = f64::from(cycle) * CYCLE_TIME;
        let speed = acceleration * time;
        let measurement = exchange(plant, &to(0.5 * speed * time, speed));
        if measurement.fault.is_some() {
            return (measurement.fault, speed);
        }
    }
    panic!("no fault");
}

#[test]
fn a_rotor_that_cannot_follow_falls_out_of_step() {
    let motor = motor();
    // 60 000 rad/s² would need 0.6 N·m.
    let mut plant = plant(&actuator(motor, 0.0), 0.0);
    let (fault, _) = ramp(&mut plant, 6e4);
    assert_eq!((fault.code, fault.actuator), (FaultCode::DriveFault as u32, 1));
    assert!((fault.limit - 3.6_f64.to_radians()).abs() < 1e-12);
    assert!(fault.value > fault.limit && fault.value < 2.0 * fault.limit, "{fault:?}");
    // It brakes while the fault is latched, and starts anew after it was disabled.
    for _ in 0..300 {
        assert_eq!(exchange(&mut plant, &to(0.0, 0.0)).fault.code, fault.code);
    }
    for _ in 0..2000 {
        exchange(&mut plant, &Actuation::DISABLED);
    }
    let standing = exchange(&mut plant, &Actuation::DISABLED).position[0];
    for _ in 0..20 {
        assert!(!exchange(&mut plant, &to(standing, 0.0)).fault.is_some());
    }
}

#[test]
fn a_gentle_ramp_ends_at_the_speed_where_the_torque_does() {
    let motor = StepperMotor { voltage: 6.0, damping: 1e-3, ..motor() };
    let mut plant = plant(&actuator(motor, 0.0), 0.1);
    let (_, speed) = ramp(&mut plant, 200.0);
    // Load, inertia and viscous friction against the pull-out torque.
    let need = |speed: f64| 0.1 + 1e-5 * 200.0 + 1e-5 * speed;
    let mut pull_out = 0.0;
    while motor.pull_out_torque(pull_out) > need(pull_out) {
        pull_out += 0.01;
    }
    println!("out of step at {speed:.1} rad/s, pull-out at {pull_out:.1} rad/s");
    assert!((speed / pull_out - 1.0).abs() < 0.05, "{speed} {pull_out}");
}

#[test]
fn a_pulse_rate_beyond_the_driver_is_refused() {
    let motor = StepperMotor { pulse_rate: 100e3, ..motor() };
    let mut plant = plant(&actuator(motor, 0.0), 0.0);
    let (fault, speed) = ramp(&mut plant, 2000.0);
    assert_eq!((fault.code, fault.actuator, fault.limit), (FaultCode::DriveFault as u32, 1, 100e3));
    let rate = speed * motor.pulses_per_radian();
    assert!(rate > 100e3 && rate < 106e3 && (fault.value / rate - 1.0).abs() < 1e-9, "{rate}");
}

#[test]
fn a_quick_stop_ramps_the_pulses_down_and_holds() {
    let motor = motor();
    let mut axis = shaft::axis();
    axis.limits.acceleration = 500.0;
    let mut plant = plant_of(&axis, &actuator(motor, 0.0), 0.0);
    let mut angle = 0.0;
    for cycle in 1..=200 {
        let time = f64::from(cycle) * CYCLE_TIME;
        angle = 0.5 * 400.0 * time * time;
        exchange(&mut plant, &to(angle, 400.0 * time));
    }
    let mut measurement = Measurement::default();
    for _ in 0..300 {
        measurement = exchange(&mut plant, &Actuation::QUICK_STOP);
        assert!(!measurement.fault.is_some());
    }
    // 80 rad/s at 500 rad/s² take 6.4 rad.
    let error = measurement.position[0] - (angle + 6.4);
    assert!(error.abs() < 1.0 / motor.pulses_per_radian(), "{error}");
    assert!((plant.state().angle[0] - measurement.position[0]).abs() < 1e-4);
}
