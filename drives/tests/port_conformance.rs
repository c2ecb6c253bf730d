//! The simulated plant against the contract of ports; the ports to hardware are held to it by the tests of the
//! emulators.
#![allow(clippy::unwrap_used)]

mod conformance;

use conformance::Subject;
use drives::{PlantOptions, SimulatedPlant};
use machine::transmission::{Elasticity, screw::at_nut};
use machine::{ActuatorMode, Cartesian, Machine, MechanismKind};

fn rigid() -> Machine {
    let mut machine = Machine::builtin();
    if let MechanismKind::CoreXy(corexy) = &mut machine.mechanism {
        corexy.elasticity = None;
    }
    machine
}

fn cartesian() -> Machine {
    let mut machine = Machine::builtin();
    let lead = 0.015 / core::f64::consts::TAU;
    let mass = [1.93, 0.33];
    machine.mechanism = MechanismKind::Cartesian(Cartesian {
        elasticity: Some(mass.map(|mass| Elasticity::damped(at_nut(600.0, lead), mass, 0.9))),
        ..Cartesian::rigid(mass)
    });
    for actuator in &mut machine.actuators {
        actuator.ratio = lead / 3.0;
        actuator.motor.dc_mut().unwrap().rotor_inertia = 2e-6 + 6.468e-6 / 9.0;
        actuator.gains.inertia = 3.94e-6;
    }
    machine
}

fn following(mode: ActuatorMode) -> Machine {
    let mut machine = Machine::builtin();
    machine.actuators.iter_mut().for_each(|actuator| actuator.mode = mode);
    machine
}

fn subjects() -> Vec<Subject> {
    [
        ("plant of elastic belts", Machine::builtin()),
        ("plant of rigid belts", rigid()),
        ("plant of screws", cartesian()),
        ("plant with drives that follow velocities", following(ActuatorMode::Velocity)),
        ("plant with drives that follow positions", following(ActuatorMode::Position)),
    ]
    .into_iter()
    .map(|(name, machine)| {
        let port = SimulatedPlant::new(&machine, PlantOptions::default()).unwrap();
        Subject::new(name, machine, port)
    })
    .collect()
}

conformance::suite! { subjects }
