//! The plant's backlash: hysteresis, coasting, and that a gap gives no energy away.
#![allow(clippy::unwrap_used)]

use drives::plant::dynamics::Dynamics;
use drives::plant::friction;
use drives::plant::motors::Motors;
use drives::plant::state::{Phases, State};
use machine::transmission::Elasticity;
use machine::{Cartesian, CoreXy, Friction, Machine, Mechanism};
use nalgebra::Vector2;

const SUBSTEP: f64 = 50e-6;
const BACKLASH: f64 = 40e-6;

/// The motors of the built-in machine without friction, with backlash.
fn motors(backlash: [f64; 2]) -> Motors<2> {
    let Machine { mut axes, mut actuators, .. } = Machine::builtin();
    actuators.iter_mut().for_each(|it| it.friction = Friction { coulomb: 0.0, viscous: 0.0 });
    axes.iter_mut().zip(backlash).for_each(|(axis, backlash)| axis.backlash = backlash);
    Motors::of(&axes, &actuators)
}

fn springs(damping: f64) -> [Elasticity; 2] {
    [Elasticity { stiffness: 6e4, damping }; 2]
}

fn carriages(damping: f64) -> Cartesian<2> {
    Cartesian { elasticity: Some(springs(damping)), ..Cartesian::rigid([0.33, 1.06]) }
}

fn dynamics<M: Mechanism<2, ChainState = Vector2<f64>>>(
    mechanism: M,
    motors: Motors<2>,
) -> Dynamics<2, M> {
    Dynamics::new(mechanism, motors, Vector2::zeros()).unwrap()
}

fn at_rest() -> State<2> {
    let zero = Vector2::zeros();
    State { current: zero, angle: zero, speed: zero, load: zero, load_speed: zero }
}

/// The motors are driven evenly faster, then evenly slower; the load has nothing but its inertia.
#[test]
fn a_load_lies_behind_its_gap_when_driven_and_before_it_when_braked() {
    const ACCELERATION: f64 = 0.5;
    let mut dynamics = dynamics(carriages(400.0), motors([BACKLASH, 0.0]));
    let weights = dynamics.motors().windings.weights(SUBSTEP);
    let ratio = dynamics.motors().ratio;
    let mut state = at_rest();
    let mut motor = [0.0; 2];
    let mut drive = |acceleration: f64| {
        for _ in 0..4000 {
            let [place, speed] = motor;
            motor = [
                place + speed * SUBSTEP + acceleration * SUBSTEP * SUBSTEP / 2.0,
                speed + acceleration * SUBSTEP,
            ];
            // The motors are where they are put.
            (state.angle, state.speed) = (
                [0, 1].map(|axis| place / ratio[axis]).into(),
                [0, 1].map(|axis| speed / ratio[axis]).into(),
            );
            let after = friction::advance(&mut dynamics, &state, &Phases::Open, &weights).unwrap();
            (state.load, state.load_speed) = (after.load, after.load_speed);
        }
        state.load - Vector2::repeat(motor[0])
    };
    for acceleration in [ACCELERATION, -ACCELERATION] {
        let ahead = drive(acceleration);
        let stretch = [0.33, 1.06].map(|mass| mass * acceleration / 6e4);
        let expected =
            Vector2::new(-BACKLASH / 2.0 * acceleration.signum() - stretch[0], -stretch[1]);
        assert!((ahead - expected).amax() < 0.5e-6, "{ahead} instead of {expected}");
    }
}

#[test]
fn a_load_in_its_gap_coasts() {
    let mut dynamics = dynamics(carriages(400.0), motors([BACKLASH; 2]));
    let weights = dynamics.motors().windings.weights(SUBSTEP);
    let speed = Vector2::new(1e-3, -2e-3);
    let mut state = State { load_speed: speed, ..at_rest() };
    for step in 1..=100 {
        state = friction::advance(&mut dynamics, &state, &Phases::Open, &weights).unwrap();
        let coasted = speed * (f64::from(step) * SUBSTEP);
        assert!((state.load - coasted).amax() < 1e-15 && state.speed == Vector2::zeros());
    }
}

/// Energy in rotors, carriages and springs [J].
fn energy<M: Mechanism<2, ChainState = Vector2<f64>>>(
    dynamics: &Dynamics<2, M>,
    state: &State<2>,
    wound: &Vector2<f64>,
) -> f64 {
    let motors = dynamics.motors();
    let mechanism = dynamics.mechanism();
    let rotors = motors.inertia.dot(&state.speed.component_mul(&state.speed));
    let load = state.load_speed.dot(&(mechanism.mass_matrix(&state.load) * state.load_speed));
    let springs = wound.dot(&(mechanism.stiffness().unwrap() * wound));
    0.5 * (rotors + load + springs)
}

/// Carriages that bounce to and fro between undamped flanks, and crossed belts that do.
fn bounce<M: Mechanism<2, ChainState = Vector2<f64>>>(mechanism: M) -> f64 {
    let mut dynamics = dynamics(mechanism, motors([BACKLASH, BACKLASH / 3.0]));
    let weights = dynamics.motors().windings.weights(SUBSTEP);
    let mut state = State { load_speed: Vector2::new(0.05, -0.08), ..at_rest() };
    let wound = |dynamics: &Dynamics<2, M>, state: &State<2>| {
        let motors = dynamics.motors();
        let ahead = motors.ratio.component_mul(&state.angle) - state.load;
        let stiffness = dynamics.mechanism().stiffness().unwrap();
        machine::transmission::backlash::wound(&stiffness, &ahead, &motors.gap)
    };
    let before = energy(&dynamics, &state, &wound(&dynamics, &state));
    let mut worst: f64 = 0.0;
    for _ in 0..4000 {
        state = friction::advance(&mut dynamics, &state, &Phases::Open, &weights).unwrap();
        let now = energy(&dynamics, &state, &wound(&dynamics, &state));
        worst = worst.max((now / before - 1.0).abs());
    }
    worst
}

#[test]
fn a_gap_neither_gives_nor_takes_energy() {
    // The corner of the gap falls inside a step: a part in ten thousand in 0.2 s of bouncing.
    let carriages = bounce(carriages(0.0));
    assert!(carriages < 1e-4, "{carriages:e}");
    let mut belts = springs(0.0);
    belts[1].stiffness = 3e4;
    let crossed = bounce(CoreXy { elasticity: Some(belts), ..CoreXy::rigid([0.33, 1.06]) });
    assert!(crossed < 1e-4, "{crossed:e}");
}
