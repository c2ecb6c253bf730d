//! The loops of the simulated drives: a bare motor that follows a torque, a velocity or a position.
#![allow(clippy::unwrap_used)]

mod shaft;

use core::f64::consts::TAU;

use drives::plant::{Plant, PlantOptions};
use drives::{Actuation, Freshness, Measurement, Port};
use machine::{ActuatorMode, Friction, LaserSource};
use messages::{ActuatorArray, CommandMode, FaultCode, axis::actuator_array};
use shaft::Shaft;

/// Rotor and what it turns [kg·m²].
const INERTIA: f64 = 4e-6;

/// Cycles of the motion, [s] of one.
const CYCLES: usize = 200;
const CYCLE: f64 = 1e-3;

fn plant(mode: ActuatorMode) -> Plant<1, Shaft> {
    let mut actuator = shaft::actuator(INERTIA, Friction { coulomb: 0.0, viscous: 0.0 });
    actuator.mode = mode;
    let shaft = Shaft { load: 0.0, spread: 0.0 };
    let options = PlantOptions::default();
    let (laser, period) = (LaserSource::IDEAL, messages::time::Period::OF_SETPOINTS);
    Plant::new(shaft, &[shaft::axis()], &[actuator], &laser, &[0.0], period, options).unwrap()
}

/// From rest to rest over one turn in [`CYCLES`]: angle and speed [rad, rad/s] at the end of `cycle`.
fn motion(cycle: usize) -> [f64; 2] {
    let time = CYCLES as f64 * CYCLE;
    let at = (cycle.min(CYCLES) as f64 / CYCLES as f64).min(1.0);
    let angle = TAU * at * at * at * (10.0 + at * (6.0 * at - 15.0));
    [angle, TAU * 30.0 * at * at * (1.0 - at) * (1.0 - at) / time]
}

/// The targets of `cycle`, with the position's velocity at its end and the means of the others.
fn targets(mode: ActuatorMode, cycle: usize, feedforward: f64) -> Actuation {
    let ([from, from_speed], [to, to_speed]) = (motion(cycle), motion(cycle + 1));
    let mean = (to - from) / CYCLE;
    let velocity = if mode == ActuatorMode::Position { to_speed } else { mean };
    let effort = feedforward * INERTIA * (to_speed - from_speed) / CYCLE;
    let only = |value: f64| -> ActuatorArray { actuator_array(&[value]) };
    Actuation {
        freshness: Freshness::Fresh,
        mode: CommandMode::Driven,
        position: only(to),
        velocity: only(velocity),
        effort: only(effort),
        ..Actuation::DISABLED
    }
}

/// The largest distance from the motion at the ends of its cycles [rad], and where it stands 100 cycles later.
fn follow(mode: ActuatorMode, feedforward: f64) -> [f64; 2] {
    let mut plant = plant(mode);
    let mut measurement = Measurement::default();
    plant.exchange(&Actuation::DISABLED, &mut measurement);
    let mut worst = 0.0_f64;
    for cycle in 0..CYCLES + 100 {
        plant.exchange(&targets(mode, cycle, feedforward), &mut measurement);
        assert!(!measurement.fault.is_some(), "{mode:?}: {:?}", measurement.fault);
        worst = worst.max((plant.state().angle[0] - motion(cycle)[0]).abs());
    }
    [worst, plant.state().angle[0] - TAU]
}

#[test]
fn a_drive_follows_the_target_of_its_mode() {
    // A torque is followed as fast as the current loop is, which is a substep or ten late.
    for (mode, most) in [
        (ActuatorMode::Torque, 0.05),
        (ActuatorMode::Velocity, 0.02),
        (ActuatorMode::Position, 0.005),
    ] {
        let [worst, _] = follow(mode, 1.0);
        assert!(worst < most, "{mode:?}: {worst} rad");
    }
}

#[test]
fn a_position_is_reached_without_any_feedforward() {
    let [worst, rest] = follow(ActuatorMode::Position, 0.0);
    assert!(worst < 0.2 && rest.abs() < 2e-3, "{worst} rad on the way, {rest} rad at its end");
}

#[test]
fn a_position_goes_on_at_its_speed_while_nobody_says_where_to() {
    let mut plant = plant(ActuatorMode::Position);
    let mut measurement = Measurement::default();
    for cycle in 0..CYCLES / 2 {
        plant.exchange(&targets(ActuatorMode::Position, cycle, 1.0), &mut measurement);
    }
    let last = targets(ActuatorMode::Position, CYCLES / 2 - 1, 1.0);
    let [angle, speed] = motion(CYCLES / 2);
    for late in 0..5 {
        let stale = Actuation { freshness: Freshness::Stale, ..last };
        plant.exchange(&stale, &mut measurement);
        let due = angle + speed * CYCLE * f64::from(late);
        let off = plant.state().angle[0] - due;
        assert!(off.abs() < 0.01, "{off} rad off, {late} cycles late");
    }
}

#[test]
fn a_target_that_is_not_finite_is_refused_whatever_the_mode() {
    for mode in ActuatorMode::ALL {
        let mut plant = plant(mode);
        let mut measurement = Measurement::default();
        let good = targets(mode, 0, 1.0);
        let bad = Actuation { effort: actuator_array(&[f64::NAN]), ..good };
        plant.exchange(&good, &mut measurement);
        plant.exchange(&bad, &mut measurement);
        assert_eq!(measurement.fault.code(), FaultCode::NotFinite, "{mode:?}");
    }
}
