//! What a pose must keep besides every leg's reach: clearance, stator, gaps, a stiff platform.

use nalgebra::{SMatrix, SVD, Vector3};

use super::struts::struts;
use super::{TriPlanar, TriPlanarChainState};
use crate::kinematics::{Joints, KinematicsError, Margin, MarginKind, Pose};
use crate::mechanisms::spectrum::largest_eigenvalue;

const OFF_STATOR: [&str; 3] = ["off_stator_D", "off_stator_E", "off_stator_F"];

/// The feet that can meet, with the name of the margin between them.
const PAIRS: [(usize, usize, &str); 3] = [(0, 1, "gap_DE"), (1, 2, "gap_EF"), (0, 2, "gap_DF")];

/// How far inside the stator a foot is at its nearest edge, with the joint along which it is.
fn inside(mechanism: &TriPlanar, feet: &Joints<6>, leg: usize) -> (usize, f64) {
    let margin = |axis: usize| {
        let [low, high] = mechanism.stator[axis];
        let place = feet[2 * leg + axis];
        (place - low).min(high - place) - mechanism.inductor / 2.0
    };
    let (x, y) = (margin(0), margin(1));
    if x <= y || x.is_nan() { (2 * leg, x) } else { (2 * leg + 1, y) }
}

/// Distance between the bodies of two planar motors, squares that keep parallel; below 0 where
/// they overlap.
fn between(mechanism: &TriPlanar, feet: &Joints<6>, one: usize, other: usize) -> f64 {
    let x = (feet[2 * one] - feet[2 * other]).abs();
    let y = (feet[2 * one + 1] - feet[2 * other + 1]).abs();
    x.max(y) - mechanism.inductor
}

fn lowest(arms: &[Vector3<f64>; 3], position: &Vector3<f64>) -> f64 {
    position.z + arms[0].z.min(arms[1].z).min(arms[2].z)
}

/// Not a number where the iteration comes to no end.
fn smallest_singular_value(matrix: &SMatrix<f64, 6, 6>) -> f64 {
    /// Turns of the iteration before it is given up; a dozen are usual.
    const MOST_TURNS: usize = 1000;
    SVD::try_new_unordered(*matrix, false, false, 5.0 * f64::EPSILON, MOST_TURNS)
        .map_or(f64::NAN, |decomposed| decomposed.singular_values.min())
}

/// Whether the smallest singular value of `matrix` reaches `limit`: then `AᵀA − limit²` is
/// positive definite, which elimination decides in a tenth of the time of the value itself.
fn reaches(matrix: &SMatrix<f64, 6, 6>, limit: f64) -> bool {
    let mut square = matrix.transpose() * matrix;
    for index in 0..6 {
        square[(index, index)] -= limit * limit;
    }
    for pivot in 0..6 {
        let head = square[(pivot, pivot)];
        if !head.is_finite() || head <= 0.0 {
            return false;
        }
        for row in pivot + 1..6 {
            let factor = square[(row, pivot)] / head;
            for column in row..6 {
                square[(column, row)] -= factor * square[(column, pivot)];
            }
        }
    }
    true
}

/// Checks everything of a pose but the legs' own reach.
///
/// # Errors
/// `platform_too_low`, `off_stator_D` and so on, `feet_collision`, `singular_platform`.
pub(super) fn check(
    mechanism: &TriPlanar,
    pose: &Pose,
    feet: &Joints<6>,
) -> Result<(), KinematicsError> {
    let arms = mechanism.arms(&pose.rotation);
    let low = lowest(&arms, &pose.position);
    // The comparisons are written so that what is not a number fails too.
    let clear = low >= mechanism.clearance;
    if !clear {
        return Err(KinematicsError {
            code: "platform_too_low",
            axis: None,
            value: low,
            limit: mechanism.clearance,
            detail: "a corner of the platform is too near the stator",
        });
    }
    for (leg, code) in OFF_STATOR.into_iter().enumerate() {
        let (axis, margin) = inside(mechanism, feet, leg);
        let on = margin >= 0.0;
        if !on {
            let [low, high] = mechanism.stator[axis % 2];
            let half = mechanism.inductor / 2.0;
            let below = feet[axis] < low + half;
            return Err(KinematicsError {
                code,
                axis: Some(axis),
                value: feet[axis],
                limit: if below { low + half } else { high - half },
                detail: "the planar motor would leave the stator",
            });
        }
    }
    for (one, other, _) in PAIRS {
        let distance = between(mechanism, feet, one, other);
        let apart = distance >= mechanism.gap;
        if !apart {
            return Err(KinematicsError {
                code: "feet_collision",
                axis: None,
                value: distance,
                limit: mechanism.gap,
                detail: "two planar motors come too near each other",
            });
        }
    }
    let struts = struts(mechanism, &arms, &pose.position, feet);
    if reaches(&struts, mechanism.type_2_limit) {
        return Ok(());
    }
    Err(KinematicsError {
        code: "singular_platform",
        axis: None,
        value: smallest_singular_value(&struts),
        limit: mechanism.type_2_limit,
        detail: "the feet can hardly hold the platform",
    })
}

pub(super) fn margins(mechanism: &TriPlanar, chain: &TriPlanarChainState) -> Vec<Margin> {
    let arms = mechanism.arms(&chain.rotation);
    let feet = &chain.feet;
    use MarginKind::{Collision, Parallel, Serial};
    let mut margins = Vec::with_capacity(11);
    let mut add = |name, kind, value, limit| margins.push(Margin { name, kind, value, limit });
    for (name, leg) in ["type_1_D", "type_1_E", "type_1_F"].into_iter().zip(&chain.legs) {
        add(name, Serial, leg.normal.z.abs(), mechanism.type_1_limit);
    }
    // The smallest singular value is one over the largest of the inverse, whose square loses
    // nothing where the value is small.
    let square = chain.loosened * chain.loosened.transpose();
    let type_2 = 1.0 / largest_eigenvalue(square).sqrt();
    add("type_2", Parallel, type_2, mechanism.type_2_limit);
    add("clearance", Collision, lowest(&arms, &chain.position), mechanism.clearance);
    for (leg, name) in ["stator_D", "stator_E", "stator_F"].into_iter().enumerate() {
        add(name, Collision, inside(mechanism, feet, leg).1, 0.0);
    }
    for (one, other, name) in PAIRS {
        add(name, Collision, between(mechanism, feet, one, other), mechanism.gap);
    }
    margins
}
