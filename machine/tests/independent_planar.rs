//! The planar linkages against a general rigid-body engine.
//!
//! `independent_planar.json` was made with MuJoCo 4.0, without gravity: each linkage
//! cut open where its halves meet, random dimensions and masses, lengths in metres and the rest in
//! SI. Newton's method on the engine's own Jacobians closed the loop to 1e-14 m; the passive joints'
//! rates and accelerations came from the difference of the two ends' Jacobians and accelerations;
//! and the engine's inverse dynamics of the tree, with `Jᵀ·F` of the bar that moves in y only, was
//! projected on the motions that keep the loop closed. Nothing there knows the equations here.

#![allow(clippy::unwrap_used)]

use machine::Mechanism;
use machine::kinematics::{Attitude, Joints, ToolMotion};
use machine::mechanisms::{
    ActuatorBodies, FiveBar, FiveBarBranch, Prrrp, PrrrpBranch, TwinActuator, TwinBranch,
};
use nalgebra::{Vector2, Vector3};
use serde_json::Value;

/// Relative; the loop of the other side is closed to 1e-14 of its size.
const TOLERANCE: f64 = 1e-9;

fn cases(name: &str) -> Vec<Value> {
    let path = format!("{}/../tests/golden/independent_planar.json", env!("CARGO_MANIFEST_DIR"));
    let file: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let cases = file[name].as_array().unwrap().clone();
    assert_eq!(cases.len(), 3);
    cases
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn pair(value: &Value) -> Vector2<f64> {
    Vector2::new(number(&value[0]), number(&value[1]))
}

#[track_caller]
fn near(what: &str, found: Vector2<f64>, expected: Vector2<f64>) {
    let error = (found - expected).amax();
    assert!(error <= TOLERANCE * expected.amax(), "{what}: {found} against {expected}, {error:e}");
}

/// Forwards from the joints, and back from the tool.
fn check<M: Mechanism<2>>(mechanism: &M, case: &Value) {
    let [q, velocity, acceleration] = ["q", "qd", "qdd"].map(|key| pair(&case[key]));
    let chain = mechanism.solve(&q, mechanism.branch(), None).unwrap();
    assert_eq!(mechanism.branch_of(&chain), mechanism.branch());
    near("x", mechanism.pose(&chain).position.xy(), pair(&case["x"]));
    let jacobian = mechanism.jacobian(&chain);
    near("v", (jacobian * velocity).fixed_rows::<2>(0).into_owned(), pair(&case["xd"]));
    let effort = mechanism.inverse_dynamics(&chain, &velocity, &acceleration);
    near("tau", effort, pair(&case["tau"]));

    let space = |key: &str| Vector3::new(number(&case[key][0]), number(&case[key][1]), 0.0);
    let tool = ToolMotion {
        position: space("x"),
        velocity: space("xd"),
        acceleration: space("xdd"),
        jerk: Vector3::zeros(),
        attitude: Attitude::LEVEL,
    };
    let motion = mechanism.joint_motion(&tool, mechanism.branch(), &Joints::zeros()).unwrap();
    near("q", motion.position, q);
    near("q̇", motion.velocity, velocity);
    near("q̈", motion.acceleration, acceleration);
}

#[test]
fn the_five_bar_moves_as_its_free_bodies_do() {
    for case in cases("five_bar") {
        let value = |key: &str| number(&case["params"][key]);
        let mechanism = FiveBar {
            half_base: value("half_base"),
            proximal: value("proximal"),
            distal: value("distal"),
            proximal_mass: value("proximal_mass"),
            proximal_inertia: value("proximal_inertia"),
            distal_mass: value("distal_mass"),
            distal_inertia: value("distal_inertia"),
            tool_mass: value("tool_mass"),
            bar_mass: value("bar_mass"),
            type_1_limit: 0.05,
            type_2_limit: 0.05,
            branch: FiveBarBranch { working_mode: [1, -1], assembly_mode: 1 },
            elasticity: None,
        };
        check(&mechanism, &case);
    }
}

#[test]
fn the_prrrp_moves_as_its_free_bodies_do() {
    for case in cases("prrrp") {
        let value = |key: &str| number(&case["params"][key]);
        let mechanism = Prrrp {
            link: value("link"),
            link_mass: value("link_mass"),
            link_inertia: value("link_inertia"),
            cart_mass: value("cart_mass"),
            tool_mass: value("tool_mass"),
            bar_mass: value("bar_mass"),
            type_1_limit: 0.05,
            type_2_limit: 0.05,
            branch: PrrrpBranch { side: 1 },
            elasticity: None,
        };
        check(&mechanism, &case);
    }
}

#[test]
fn the_twin_actuator_moves_as_its_free_bodies_do() {
    for case in cases("twin_actuator") {
        let params = &case["params"];
        let bodies = [0, 1].map(|actuator| {
            let value = |key: &str| number(&params["bodies"][actuator][key]);
            ActuatorBodies {
                housing_inertia: value("housing_inertia"),
                rod_mass: value("rod_mass"),
                rod_inertia: value("rod_inertia"),
                rod_center: value("rod_centre"),
            }
        });
        let mechanism = TwinActuator {
            bases: [pair(&params["base_a"]), pair(&params["base_b"])],
            offset: number(&params["offset"]),
            offset_angle: number(&params["offset_angle"]),
            bodies,
            tool_mass: number(&params["tool_mass"]),
            baseline_limit: 0.05,
            near_limit: 0.01,
            branch: TwinBranch { elbow: 1 },
            elasticity: None,
        };
        check(&mechanism, &case);
    }
}
