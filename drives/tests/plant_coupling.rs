//! The plant of a mechanism whose inertia couples its joints: energy, order, and where its chain
//! ends.
#![allow(clippy::unwrap_used)]

mod arm;
#[allow(dead_code)]
mod shaft;

use arm::Arm;
use drives::plant::dynamics::Dynamics;
use drives::plant::motors::Motors;
use drives::plant::state::{Phases, State};
use drives::plant::{Plant, PlantOptions, friction};
use drives::{Actuation, Freshness, Measurement, Port};
use machine::kinematics::Joints;
use machine::{Actuator, Axis, Friction, LaserSource, Mechanism, Pose};
use messages::{CommandMode, FaultCode, axis::actuator_array};
use nalgebra::{Vector2, Vector3};

const SUBSTEP: f64 = 50e-6;
const FREE: f64 = f64::INFINITY;

/// Geared motors without friction.
fn drives() -> (Vec<Axis>, Vec<Actuator>) {
    let mut actuator = shaft::actuator(1e-5, Friction { coulomb: 0.0, viscous: 0.0 });
    actuator.ratio = 0.05;
    actuator.gains.inertia = 1e-4;
    shaft::alike(&actuator, 2)
}

fn dynamics(arm: Arm) -> Dynamics<2, Arm> {
    let (axes, actuators) = drives();
    Dynamics::new(arm, Motors::of(&axes, &actuators), Vector2::new(0.0, 0.5)).unwrap()
}

/// The arm swinging, its motors with it.
fn swinging() -> State<2> {
    let load = Vector2::new(0.1, 0.8);
    let load_speed = Vector2::new(3.0, -5.0);
    let zero = Vector2::zeros();
    State { current: zero, angle: load / 0.05, speed: load_speed / 0.05, load, load_speed }
}

/// Energy in rotors, links and springs [J].
fn energy(dynamics: &Dynamics<2, Arm>, state: &State<2>) -> f64 {
    let motors = dynamics.motors();
    let arm = dynamics.mechanism();
    let stretch = motors.ratio.component_mul(&state.angle) - state.load;
    0.5 * motors.inertia.dot(&state.speed.component_mul(&state.speed))
        + 0.5 * arm.stiffness.unwrap_or(0.0) * stretch.norm_squared()
        + arm.kinetic(&state.load, &state.load_speed)
}

/// Where a free arm that was in `state` is after `time` [s].
fn swing(arm: Arm, start: State<2>, substep: f64, time: f64) -> (Dynamics<2, Arm>, State<2>) {
    let mut dynamics = dynamics(arm);
    let weights = dynamics.motors().windings.weights(substep);
    let mut state = start;
    for _ in 0..(time / substep).round() as usize {
        state = friction::advance(&mut dynamics, &state, &Phases::Open, &weights).unwrap();
    }
    (dynamics, state)
}

#[test]
fn a_free_arm_keeps_its_energy_for_ten_seconds() {
    for stiffness in [None, Some(40.0)] {
        let arm = Arm { stiffness, reach: FREE };
        let before = energy(&dynamics(arm), &swinging());
        let (dynamics, state) = swing(arm, swinging(), SUBSTEP, 10.0);
        let drift = (energy(&dynamics, &state) / before - 1.0).abs();
        println!("stiffness {stiffness:?}: energy drift over 10 s {drift:e}");
        assert!(drift < 1e-6, "{stiffness:?}: {drift:e}");
    }
}

#[test]
fn halving_the_substep_divides_the_error_by_eight() {
    // From rest, drawn by its springs: nobody throws a real arm at full speed out of nothing.
    let zero = Vector2::zeros();
    let load = Vector2::new(0.1, 0.8);
    let drawn = State { speed: zero, load_speed: zero, load: load * 0.5, ..swinging() };
    let arm = Arm { stiffness: Some(40.0), reach: FREE };
    let end = |substep| swing(arm, drawn, substep, 0.5).1.load;
    let exact = end(SUBSTEP / 32.0);
    let errors = [1.0, 2.0, 4.0].map(|parts| (end(SUBSTEP / parts) - exact).norm());
    println!("{errors:?} rad");
    for pair in errors.windows(2) {
        assert!(pair[0] / pair[1] > 6.0, "{errors:?}");
    }
    assert!(errors[0] < 1e-6, "{errors:?}");
}

#[test]
fn where_the_chain_ends_the_plant_jams_with_a_fault() {
    let arm = Arm { stiffness: Some(40.0), reach: 1.2 };
    let dark = LaserSource::IDEAL;
    let pose = Pose::at(Vector3::new(0.35, 0.0, 0.0));
    let home = arm.inverse(&pose, (), &Joints::zeros()).unwrap();
    let (axes, actuators) = drives();
    let mut plant: Plant<2, _> = Plant::new(
        arm,
        &axes,
        &actuators,
        &dark,
        home.as_slice(),
        messages::time::Period::OF_SETPOINTS,
        PlantOptions::default(),
    )
    .unwrap();
    let push = Actuation {
        freshness: Freshness::Fresh,
        mode: CommandMode::Driven,
        voltage: actuator_array(&[0.0, 6.0]),
        ..Actuation::DISABLED
    };
    let mut measurement = Measurement::default();
    let mut cycles = 0;
    while !measurement.fault.is_some() && cycles < 1000 {
        plant.exchange(&push, &mut measurement);
        cycles += 1;
    }
    let fault = measurement.fault;
    assert_eq!((fault.code, fault.axis), (FaultCode::DriveFault as u32, 2));
    assert!(fault.value > 1.2 && fault.limit == 1.2, "{fault:?}");
    assert!(plant.state().load[1] > 1.1 && plant.state().load[1] <= 1.2);
    // Latched while powered, whatever the motors do meanwhile; gone once it is disabled.
    for _ in 0..50 {
        plant.exchange(&push, &mut measurement);
        assert_eq!(measurement.fault.code, FaultCode::DriveFault as u32);
        assert!(measurement.position[..2].iter().all(|position| position.is_finite()));
    }
    plant.exchange(&Actuation::DISABLED, &mut measurement);
    assert!(!measurement.fault.is_some());
}
