//! One suite for every mechanism; an instance of each, with plausible dimensions and masses.

#![allow(clippy::unwrap_used)]

mod chains;
mod dynamics;
mod frames;
mod linkages;
#[path = "../support/loads.rs"]
mod loads;
mod sample;
mod suite;
mod tables;

use machine::kinematics::Joints;
use machine::transmission::Elasticity;
use machine::{Cartesian, CoreXy, Mechanism, Pose};
use nalgebra::Vector3;
use suite::conforms;

const SCREW: Elasticity = Elasticity { stiffness: 1e8, damping: 2.5e4 };

#[test]
fn the_cartesian_conforms() {
    for elasticity in [Some([SCREW; 2]), None] {
        let mechanism = Cartesian { elasticity, ..Cartesian::rigid([1.93, 0.33]) };
        conforms(&mechanism, &[()], |random| random.joints([[0.0, 0.2]; 2]));
    }
}

#[test]
fn the_cartesian_with_a_lift_conforms() {
    let mechanism =
        Cartesian { elasticity: Some([SCREW; 3]), ..Cartesian::rigid([1.93, 0.33, 0.2]) };
    conforms(&mechanism, &[()], |random| random.joints([[0.0, 0.2], [0.0, 0.2], [-0.1, 0.1]]));
    assert_eq!(mechanism.gravity(&Joints::zeros()), Joints::from([0.0, 0.0, 0.2 * 9.806_65]));
}

#[test]
fn the_corexy_conforms() {
    let belts = [0.33, 1.06].map(|mass| Elasticity::damped(6e4, mass, 0.9));
    for elasticity in [Some(belts), None] {
        let mechanism = CoreXy { elasticity, ..CoreXy::rigid([0.33, 1.06]) };
        conforms(&mechanism, &[()], |random| random.joints([[0.0, 0.4], [-0.2, 0.2]]));
    }
}

/// A force on the head alone stretches only its own direction, by force over stiffness.
#[test]
fn the_belts_are_two_springs_along_x_and_y() {
    let belts = [Elasticity::damped(6e4, 0.33, 0.9), Elasticity::damped(3e4, 1.06, 0.9)];
    let corexy = CoreXy { elasticity: Some(belts), ..CoreXy::rigid([0.33, 1.06]) };
    let inverse = corexy.stiffness().unwrap().try_inverse().unwrap();
    let jacobian = corexy.jacobian(&Joints::zeros()).fixed_view::<2, 2>(0, 0).into_owned();
    let give = jacobian * inverse * jacobian.transpose();
    let close = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-18);
    close(give[(0, 0)], 1.0 / 6e4);
    close(give[(1, 1)], 1.0 / 3e4);
    close(give[(0, 1)], 0.0);
}

#[test]
fn a_planar_mechanism_refuses_to_leave_its_plane() {
    let corexy = CoreXy::rigid([0.33, 1.06]);
    let pose = |z| Pose::at(Vector3::new(0.1, 0.1, z));
    let error = corexy.inverse(&pose(0.01), (), &Joints::zeros()).unwrap_err();
    assert_eq!((error.code, error.value), ("out_of_plane", 0.01));
    let error = corexy.inverse(&pose(f64::NAN), (), &Joints::zeros()).unwrap_err();
    assert_eq!(error.code, "out_of_plane");
    let flat = Cartesian::rigid([1.0, 1.0]);
    assert_eq!(flat.inverse(&pose(-0.01), (), &Joints::zeros()).unwrap_err().value, -0.01);
}
