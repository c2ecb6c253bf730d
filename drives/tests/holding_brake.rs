//! The brake that holds a load while the motor is unpowered, and for its time after that.
#![allow(clippy::unwrap_used)]

mod shaft;

use drives::plant::{Plant, PlantOptions};
use drives::{Actuation, Freshness, Measurement, Port};
use machine::{Friction, HoldingBrake, LaserSource};
use messages::{CommandMode, axis::actuator_array};
use shaft::Shaft;

/// Torque of the load [N·m].
const LOAD: f64 = 0.01;

/// A shaft under load, its brake closed, and the voltage that holds the load.
fn braked(brake: HoldingBrake) -> (Plant<1, Shaft>, f64) {
    let actuator = shaft::actuator(2e-6, Friction { coulomb: 0.0, viscous: 0.0 });
    let motor = *actuator.motor.dc().unwrap();
    let actuators = [machine::Actuator { brake, ..actuator }];
    let shaft = Shaft { load: LOAD, spread: 0.0 };
    let options = PlantOptions::default();
    let axes = [shaft::axis()];
    let plant = Plant::new(
        shaft,
        &axes,
        &actuators,
        &LaserSource::IDEAL,
        &[0.0],
        messages::time::Period::OF_SETPOINTS,
        options,
    )
    .unwrap();
    (plant, motor.voltage(LOAD / motor.torque_constant, 0.0, 0.0))
}

fn driven(volts: f64) -> Actuation {
    Actuation {
        freshness: Freshness::Fresh,
        mode: CommandMode::Driven,
        voltage: actuator_array(&[volts]),
        ..Actuation::DISABLED
    }
}

/// Where the shaft is after `cycles` under `actuation` [rad].
fn turned(plant: &mut Plant<1, Shaft>, actuation: &Actuation, cycles: u32) -> f64 {
    let mut measurement = Measurement::default();
    for _ in 0..cycles {
        plant.exchange(actuation, &mut measurement);
    }
    plant.state().angle[0]
}

#[test]
fn it_holds_for_its_release_time_after_the_power_has_come() {
    let (mut plant, _) = braked(HoldingBrake { torque: 0.05, release: 20e-3 });
    assert_eq!(turned(&mut plant, &Actuation::DISABLED, 50), 0.0);
    // The first exchange ends the cycle before.
    assert_eq!(turned(&mut plant, &driven(0.0), 1 + 20), 0.0);
    assert!(turned(&mut plant, &driven(0.0), 1) < -1e-4, "20 ms have gone by");
    // Unpowered it stops whatever moves, and its time begins anew.
    let stopped = turned(&mut plant, &Actuation::DISABLED, 10);
    assert_eq!(turned(&mut plant, &driven(0.0), 21), stopped);
    assert!(turned(&mut plant, &driven(0.0), 1) < stopped);
}

#[test]
fn one_that_takes_no_time_is_open_with_the_power() {
    let (mut plant, _) = braked(HoldingBrake { torque: 0.05, release: 0.0 });
    assert_eq!(turned(&mut plant, &Actuation::DISABLED, 50), 0.0);
    assert!(turned(&mut plant, &driven(0.0), 2) < -1e-4);
}

#[test]
fn a_load_that_the_motor_bears_by_then_does_not_move() {
    let (mut plant, volts) = braked(HoldingBrake { torque: 0.05, release: 20e-3 });
    turned(&mut plant, &Actuation::DISABLED, 5);
    let sag = turned(&mut plant, &driven(volts), 500);
    assert!(sag.abs() < 1e-6, "{sag} rad");
}
