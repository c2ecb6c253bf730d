//! From the platform's pose to the feet, leg by leg, in closed form.

use super::{Legs, OUTWARD, TriPlanar};
use crate::kinematics::KinematicsError;
use crate::taylor::Scalar;

const UNREACHABLE: [&str; 3] = ["unreachable_D", "unreachable_E", "unreachable_F"];
const SINGULAR: [&str; 3] = ["singular_leg_D", "singular_leg_E", "singular_leg_F"];

/// The feet's x and y [m] for a pose, its rotation matrix row by row.
///
/// # Errors
/// `unreachable_D` and so on where a leg is too short for the stator, `singular_leg_D` and so on
/// where it stands too upright.
pub(super) fn feet<S: Scalar>(
    mechanism: &TriPlanar,
    position: &[S; 3],
    rotation: &[[S; 3]; 3],
    branch: Legs,
) -> Result<[S; 6], KinematicsError> {
    let mut joints = [S::from(0.0); 6];
    for leg in 0..3 {
        let [x, y] = foot(mechanism, position, rotation, branch, leg)?;
        joints[2 * leg] = x;
        joints[2 * leg + 1] = y;
    }
    Ok(joints)
}

/// The foot is `m + h·(e·cos ω − n·sin ω)`: m the hinge's middle, or for a leg that is not as drawn the
/// place on the hinge that is nearest to the foot, e the unit vector from the
/// platform's centroid to it, n the platform's normal, and ω the turn from the platform's own
/// plane, downwards. It lies in the stator plane where `cos(ω − φ) = k`, with
/// `φ = atan2(n_z, −e_z)` and `k = m_z/(h·ρ)`, `ρ = √(n_z² + e_z²)`.
///
/// Sine and cosine of `ω = φ ∓ acos k` follow by the sum formulas, both signs kept.
// Source 001 eq. 8. Eq. 5 needs R₃F = (0, −h, 0) to agree with it, and sin ω from a root alone
// would be wrong past the upright.
fn foot<S: Scalar>(
    mechanism: &TriPlanar,
    position: &[S; 3],
    rotation: &[[S; 3]; 3],
    branch: Legs,
    leg: usize,
) -> Result<[S; 2], KinematicsError> {
    let (beside, height) = mechanism.shape(leg);
    let [along, across] = OUTWARD[leg];
    let e = rotation.map(|row| row[0] * along + row[1] * across);
    let n = rotation.map(|row| row[2]);
    let out = mechanism.height() / 3.0;
    let mut foot_of_hinge: [S; 3] = core::array::from_fn(|axis| position[axis] + e[axis] * out);
    if beside != 0.0 {
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let [next, last] = [(axis + 1) % 3, (axis + 2) % 3];
            (e[next] * n[last] - e[last] * n[next]) * beside
        });
        foot_of_hinge = [foot_of_hinge[0] + x, foot_of_hinge[1] + y, foot_of_hinge[2] + z];
    }
    let middle = |axis: usize| foot_of_hinge[axis];

    let rho = (n[2] * n[2] + e[2] * e[2]).sqrt();
    let k = middle(2) / (rho * height);
    // Written so that what is not a number fails too.
    let within = k.value().abs() <= 1.0;
    if !within {
        return Err(KinematicsError {
            code: UNREACHABLE[leg],
            axis: None,
            value: k.value(),
            limit: 1.0,
            detail: "the leg is too short to reach the stator plane, as a share of its reach",
        });
    }
    let upright = rho.value() * (1.0 - k.value() * k.value()).sqrt();
    let away = upright > 0.0 && upright >= mechanism.type_1_limit;
    if !away {
        return Err(KinematicsError {
            code: SINGULAR[leg],
            axis: None,
            value: upright,
            limit: mechanism.type_1_limit,
            detail: "the leg stands too upright on the stator",
        });
    }
    let root = (-(k * k) + 1.0).sqrt() * branch.0[leg].sign();
    let cosine = (n[2] * root - e[2] * k) / rho;
    let sine = (n[2] * k + e[2] * root) / rho;
    let place = |axis: usize| middle(axis) + (e[axis] * cosine - n[axis] * sine) * height;
    Ok([place(0), place(1)])
}
