//! Open chains against a general rigid-body engine.
//!
//! `independent_serial.json` was made with pinocchio 4.1: two chains each of two to six joints, turning
//! and sliding ones mixed, random parameters, full inertias and bases that do not stand upright. Its
//! joints were placed by turns about and steps along x and z, and its efforts come from the
//! recursion on bodies, not from a mass matrix. SI units.

#![allow(clippy::unwrap_used)]

use machine::kinematics::{Joints, TaskSpace};
use machine::mechanisms::serial::{JointKind, Link};
use machine::{Mechanism, Pose, Serial};
use nalgebra::{Matrix3, SMatrix, Vector3};
use serde_json::Value;

/// Relative to the largest entry.
const TOLERANCE: f64 = 1e-9;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

fn matrix<const R: usize, const C: usize>(value: &Value) -> SMatrix<f64, R, C> {
    let rows: Vec<Vec<f64>> = value.as_array().unwrap().iter().map(numbers).collect();
    SMatrix::from_fn(|row, column| rows[row][column])
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_column_slice(&numbers(value))
}

fn pose(value: &Value) -> Pose {
    Pose { position: vector(&value["position"]), rotation: matrix::<3, 3>(&value["rotation"]) }
}

fn link(value: &Value) -> Link {
    let number = |key: &str| value[key].as_f64().unwrap();
    let kind = if value["kind"] == "R" { JointKind::Revolute } else { JointKind::Prismatic };
    Link {
        twist: number("twist"),
        length: number("length"),
        offset: number("offset"),
        angle: number("angle"),
        kind,
        mass: number("mass"),
        center: vector(&value["center"]),
        inertia: matrix::<3, 3>(&value["inertia"]),
        lower: -10.0,
        upper: 10.0,
    }
}

#[track_caller]
fn near<const R: usize, const C: usize>(
    what: &str,
    found: SMatrix<f64, R, C>,
    expected: SMatrix<f64, R, C>,
) {
    let error = (found - expected).amax();
    assert!(error <= TOLERANCE * expected.amax(), "{what}: {found} against {expected}, {error:e}");
}

fn check<const N: usize>(case: &Value) {
    let links: Vec<Link> = case["links"].as_array().unwrap().iter().map(link).collect();
    let chain = Serial::<N> {
        base: pose(&case["base"]),
        links: links.try_into().unwrap(),
        tool: pose(&case["tool"]),
        task_space: TaskSpace::Pose,
        gravity: Vector3::new(0.0, 0.0, -9.806_65),
        elasticity: None,
    };
    let [q, velocity, acceleration] =
        ["q", "qd", "qdd"].map(|key| Joints::<N>::from_column_slice(&numbers(&case[key])));
    let state = chain.solve(&q, (), None).unwrap();
    let found = chain.pose(&state);
    near("position", found.position, vector(&case["position"]));
    let turned: Matrix3<f64> = matrix(&case["rotation"]);
    near("rotation", found.rotation, turned);
    near("jacobian", chain.jacobian(&state), matrix::<6, N>(&case["jacobian"]));
    near("mass", chain.mass_matrix(&state), matrix::<N, N>(&case["mass"]));
    let effort = |key: &str| Joints::<N>::from_column_slice(&numbers(&case[key]));
    near("gravity", chain.gravity(&state), effort("gravity"));
    near("tau", chain.inverse_dynamics(&state, &velocity, &acceleration), effort("tau"));
}

#[test]
fn chains_of_two_to_six_joints_agree_with_the_engine() {
    let path = format!("{}/../tests/golden/independent_serial.json", env!("CARGO_MANIFEST_DIR"));
    let cases: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let cases = cases.as_array().unwrap();
    assert_eq!(cases.len(), 10);
    for case in cases {
        match case["links"].as_array().unwrap().len() {
            2 => check::<2>(case),
            3 => check::<3>(case),
            4 => check::<4>(case),
            5 => check::<5>(case),
            _ => check::<6>(case),
        }
    }
}
