//! From the feet to the platform's pose, and all that follows from it.

use messages::math;
use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, UnitQuaternion, Vector2, Vector3};

use super::assemblies::Assemblies;
use super::struts::{CLOSED, State, Struts, invert, struts};
use super::{Fold, Legs, OUTWARD, Standing, TriPlanar, TriPlanarBranch};
use crate::kinematics::{Jacobian, Joints, KinematicsError, Pose};

/// A leg of a solved chain; vectors in the machine frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Leg {
    /// From the platform's centroid to the hinge's middle, or to where the foot is beside it [m].
    pub(super) middle: Vector3<f64>,
    /// From the hinge to the foot [m].
    pub(super) height: f64,
    /// Unit vector along the hinge.
    pub(super) hinge: Vector3<f64>,
    /// Unit vector from the hinge's middle to the foot.
    pub(super) shank: Vector3<f64>,
    /// Unit normal, `hinge × shank`; upwards where the leg leans outward.
    pub(super) normal: Vector3<f64>,
    /// Rate of the turn about the hinge per twist of the platform, such that the foot stays in
    /// the stator plane.
    pub(super) turn: SVector<f64, 6>,
}

impl Leg {
    /// Which way it leans.
    fn fold(&self) -> Fold {
        if self.normal.z > 0.0 { Fold::Outward } else { Fold::Inward }
    }
}

/// The mechanism with its six struts closed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriPlanarChainState {
    pub(super) position: Vector3<f64>,
    pub(super) rotation: Matrix3<f64>,
    pub(super) feet: Joints<6>,
    pub(super) legs: [Leg; 3],
    /// Twist of the platform per rate of the feet.
    pub(super) jacobian: Jacobian<6>,
    state: State,
    /// Inverse of the matrix of the struts, for the next solution near by.
    pub(super) loosened: SMatrix<f64, 6, 6>,
}

impl TriPlanarChainState {
    pub(super) fn folds(&self) -> Legs {
        Legs(self.legs.map(|leg| leg.fold()))
    }

    /// Rates of the feet per twist of the platform, the inverse of the Jacobian in closed form.
    pub fn inverse_jacobian(&self) -> SMatrix<f64, 6, 6> {
        let mut matrix = SMatrix::<f64, 6, 6>::zeros();
        for (index, leg) in self.legs.iter().enumerate() {
            let arm = self.foot(index) - self.position;
            let swing = self.swing(index);
            let rigid = [
                SVector::<f64, 6>::from([1.0, 0.0, 0.0, 0.0, arm.z, -arm.y]),
                SVector::<f64, 6>::from([0.0, 1.0, 0.0, -arm.z, 0.0, arm.x]),
            ];
            for (axis, rigid) in rigid.into_iter().enumerate() {
                let row = rigid + leg.turn * swing[axis];
                matrix.set_row(2 * index + axis, &row.transpose());
            }
        }
        matrix
    }

    /// How fast each leg folds down against the platform for a twist of it [rad/s].
    pub fn fold_rates(&self, twist: &SVector<f64, 6>) -> [f64; 3] {
        // The fold's angle counts against the turn about the hinge.
        self.legs.map(|leg| -leg.turn.dot(twist))
    }

    /// How far each leg is folded down from the platform's plane [rad].
    pub fn fold_angles(&self) -> [f64; 3] {
        self.legs.map(|leg| {
            let platform = self.rotation.column(2);
            let outward = platform.cross(&leg.hinge);
            math::atan2(-leg.shank.dot(&platform), leg.shank.dot(&outward))
        })
    }

    pub(super) fn foot(&self, index: usize) -> Vector3<f64> {
        Vector3::new(self.feet[2 * index], self.feet[2 * index + 1], 0.0)
    }

    /// Displacement of a foot per turn about its hinge [m/rad].
    pub(super) fn swing(&self, index: usize) -> Vector3<f64> {
        let leg = &self.legs[index];
        let shank = self.foot(index) - self.position - leg.middle;
        leg.hinge.cross(&shank)
    }
}

/// Cosine of half the largest turn from a solution near by, 0.5 rad. What lies further off may be
/// another solution, and a start from it is no better than a cold one.
const NEARBY: f64 = 0.968_912_421_710_644_8;

/// Heights of level starts, in heights of the triangle.
const LEVELS: [f64; 8] = [0.15, 0.3, 0.45, 0.6, 0.7, 0.8, 0.9, 0.97];

/// Cosine of 45°: with all legs outward there is never a second solution that is tilted less.
const NEAR_LEVEL: f64 = core::f64::consts::FRAC_1_SQRT_2;

/// Closes the chain at `q`, as [`find`] says.
///
/// # Errors
/// `no_assembly` where no start leads to such a pose, or the platform has no stiffness in it.
pub(super) fn solve(
    mechanism: &TriPlanar,
    q: &Joints<6>,
    branch: TriPlanarBranch,
    near: Option<&TriPlanarChainState>,
) -> Result<TriPlanarChainState, KinematicsError> {
    let feet = Feet::of(mechanism, q);
    find(&feet, branch, near, |stance| complete(&feet, stance, q))
}

/// The pose of [`solve`].
///
/// # Errors
/// `no_assembly` where no start leads to it.
pub(super) fn locate(
    mechanism: &TriPlanar,
    q: &Joints<6>,
    branch: TriPlanarBranch,
    near: Option<&TriPlanarChainState>,
) -> Result<Pose, KinematicsError> {
    let feet = Feet::of(mechanism, q);
    find(&feet, branch, near, |stance| {
        Ok(Pose { position: feet.position(&stance.state), rotation: stance.rotation })
    })
}

/// The chain at `q` where `pose` is known to close it, to the rounding of both; `None` if it does not.
pub(super) fn solve_at(
    mechanism: &TriPlanar,
    pose: &Pose,
    q: &Joints<6>,
    legs: Legs,
) -> Option<TriPlanarChainState> {
    let feet = Feet::of(mechanism, q);
    let rotation = Rotation3::from_matrix_unchecked(pose.rotation);
    let start = State {
        position: pose.position - feet.centroid,
        attitude: UnitQuaternion::from_rotation_matrix(&rotation),
    };
    let found = feet.equations.solve(start)?;
    // A singular pose might lead elsewhere.
    let stays = found.attitude.coords.dot(&start.attitude.coords).abs() > NEARBY;
    if stays { complete(&feet, &stand(&feet, &found, legs)?, q).ok() } else { None }
}

/// Where the feet are.
pub(super) struct Feet<'a> {
    /// The equations of the struts, counted from the centroid: so rounding does not grow with the
    /// size of the stator.
    pub(super) equations: Struts<'a>,
    /// The centroid, in the machine frame [m].
    centroid: Vector3<f64>,
}

impl<'a> Feet<'a> {
    fn of(mechanism: &'a TriPlanar, q: &Joints<6>) -> Self {
        let centroid = Vector2::new(q[0] + q[2] + q[4], q[1] + q[3] + q[5]) / 3.0;
        let feet = Joints::from_fn(|row, _| q[row] - centroid[row % 2]);
        Self {
            equations: Struts { mechanism, feet },
            centroid: Vector3::new(centroid.x, centroid.y, 0.0),
        }
    }

    /// The platform's centroid in the machine frame [m].
    fn position(&self, state: &State) -> Vector3<f64> {
        state.position + self.centroid
    }
}

/// A solved pose that the machine can stand in.
#[derive(Clone, Copy)]
pub(super) struct Stance {
    pub(super) state: State,
    pub(super) rotation: Matrix3<f64>,
    /// From the centroid to the corners [m].
    arms: [Vector3<f64>; 3],
    legs: [Leg; 3],
}

impl Stance {
    /// Tilted by at most 45°.
    fn is_near_level(&self) -> bool {
        self.rotation[(2, 2)] >= NEAR_LEVEL
    }
}

/// What `accept` makes of the pose that closes the chain.
///
/// Of the poses that close it, few have all corners above the stator (source 001), the platform not
/// upside down and legs that lean as `branch` says; mostly one. A solution near by goes on as it is,
/// where `branch` does not number an assembly.
///
/// # Errors
/// `no_assembly` where there is no such pose, `ambiguous_assembly` where there are several.
#[inline(always)] // What it finds would be copied on the way out.
fn find<T>(
    feet: &Feet<'_>,
    branch: TriPlanarBranch,
    near: Option<&TriPlanarChainState>,
    accept: impl Fn(&Stance) -> Result<T, KinematicsError>,
) -> Result<T, KinematicsError> {
    if let (Some(near), None) = (near, branch.assembly) {
        let start = State { position: near.position - feet.centroid, ..near.state };
        let found = feet
            .equations
            .follow(start, &near.loosened)
            .or_else(|| feet.equations.solve(start))
            .filter(|found| found.attitude.coords.dot(&start.attitude.coords).abs() > NEARBY);
        if let Some(stance) = found.and_then(|found| stand(feet, &found, branch.legs)) {
            let done = accept(&stance);
            if done.is_ok() {
                return done;
            }
        }
    }
    let stance = search(feet, branch)?;
    accept(&stance)
}

/// The stance of `branch` on the feet, from nothing.
#[cold]
#[inline(never)]
fn search(feet: &Feet<'_>, branch: TriPlanarBranch) -> Result<Stance, KinematicsError> {
    let equations = &feet.equations;
    let mut starts = LEVELS.map(|level| {
        let start = equations.level(level, branch.legs);
        (equations.residual(&start).norm(), start)
    });
    starts.sort_unstable_by(|one, other| one.0.total_cmp(&other.0));
    if branch.legs.is_outward() && branch.assembly.is_none() {
        for (_, start) in &starts {
            let found = equations.solve(*start).and_then(|found| stand(feet, &found, branch.legs));
            if let Some(stance) = found.filter(Stance::is_near_level) {
                return Ok(stance);
            }
        }
    }
    let found = Assemblies::of(feet, branch.legs);
    let missing = || no_assembly(starts[0].0);
    match (found.count(), branch.assembly) {
        (0, _) => Err(missing()),
        (1, None) => found.get(0).ok_or_else(missing),
        (count, None) => carried(feet, branch.legs).ok_or(KinematicsError {
            code: "ambiguous_assembly",
            axis: None,
            value: count as f64,
            limit: 1.0,
            detail: "several poses close the legs on these feet; name one by `assembly` of the \
                     branch, from 1, the most level one first",
        }),
        (count, Some(number)) => {
            found.get(usize::from(number).wrapping_sub(1)).ok_or(KinematicsError {
                code: "no_assembly",
                axis: None,
                value: f64::from(number),
                limit: count as f64,
                detail: "fewer poses than `assembly` counts close the legs on these feet",
            })
        }
    }
}

/// The stance on the feet to which the one at home leads while they go there straight.
fn carried(feet: &Feet<'_>, legs: Legs) -> Option<Stance> {
    /// Steps of the way.
    const STEPS: u32 = 64;
    let mechanism = feet.equations.mechanism;
    let Standing { joints, platform, .. } =
        mechanism.home.as_ref().filter(|home| home.legs == legs)?;
    let to = Joints::from_fn(|row, _| feet.equations.feet[row] + feet.centroid[row % 2]);
    let rotation = Rotation3::from_matrix_unchecked(platform.rotation);
    let mut attitude = UnitQuaternion::from_rotation_matrix(&rotation);
    let mut position = platform.position;
    for step in 1..=STEPS {
        let share = f64::from(step) / f64::from(STEPS);
        let here = Feet::of(mechanism, &(joints + (to - joints) * share));
        let state = State { position: position - here.centroid, attitude };
        let found = here.equations.solve(state)?;
        if found.attitude.coords.dot(&attitude.coords).abs() <= NEARBY {
            return None;
        }
        stand(&here, &found, legs)?;
        (position, attitude) = (here.position(&found), found.attitude);
    }
    stand(feet, &State { position: position - feet.centroid, attitude }, legs)
}

/// The branch of a solved chain, its assembly numbered where it is not the only one.
pub(super) fn branch_of(mechanism: &TriPlanar, chain: &TriPlanarChainState) -> TriPlanarBranch {
    let legs = chain.folds();
    let level = chain.rotation[(2, 2)] >= NEAR_LEVEL;
    if legs.is_outward() && level {
        return legs.into();
    }
    let feet = Feet::of(mechanism, &chain.feet);
    let start = State { position: chain.position - feet.centroid, ..chain.state };
    let found = Assemblies::of(&feet, legs);
    let number = found.place_of(&start).filter(|_| found.count() > 1);
    TriPlanarBranch { legs, assembly: number.and_then(|index| u8::try_from(index + 1).ok()) }
}

/// The failure, with the best start's residual.
#[cold]
fn no_assembly(residual: f64) -> KinematicsError {
    KinematicsError {
        code: "no_assembly",
        axis: None,
        value: residual,
        limit: CLOSED,
        detail: "no pose above the stator closes the legs on these feet in this branch; \
                 the value is the best start's residual",
    }
}

/// The leg `index` of a solved pose.
#[inline]
fn leg(equations: &Struts<'_>, state: &State, rotation: &Matrix3<f64>, index: usize) -> Leg {
    let (beside, height) = equations.mechanism.shape(index);
    let [x, y] = OUTWARD[index];
    let outward: Vector3<f64> = rotation.column(0) * x + rotation.column(1) * y;
    let hinge = outward.cross(&rotation.column(2));
    let middle = outward * (equations.mechanism.height() / 3.0) + hinge * beside;
    let foot = Vector3::new(equations.feet[2 * index], equations.feet[2 * index + 1], 0.0);
    let arm = foot - state.position;
    let shank = (arm - middle) / height;
    let normal = hinge.cross(&shank);
    // The foot's velocity along z, v_z + (Ω×arm)_z + h·turn·normal_z, is none.
    let turn = SVector::from([0.0, 0.0, 1.0, arm.y, -arm.x, 0.0]) / (-height * normal.z);
    Leg { middle, height, hinge, shank, normal, turn }
}

/// The stance of a solved pose, if it is one that the machine can stand in: see [`find`].
pub(super) fn stand(feet: &Feet<'_>, state: &State, folds: Legs) -> Option<Stance> {
    let equations = &feet.equations;
    let rotation = state.attitude.to_rotation_matrix().into_inner();
    let arms = equations.mechanism.arms(&rotation);
    let above = |arm: &Vector3<f64>| arm.z + state.position.z > 0.0;
    if !(rotation[(2, 2)] > 0.0 && above(&arms[0]) && above(&arms[1]) && above(&arms[2])) {
        return None;
    }
    let leg = |index: usize| leg(equations, state, &rotation, index);
    let legs = [leg(0), leg(1), leg(2)];
    let leans = |(leg, fold): (&Leg, Fold)| leg.normal.z.abs() > 0.0 && fold == leg.fold();
    let stands = legs.iter().zip(folds.0).all(leans);
    stands.then_some(Stance { state: *state, rotation, arms, legs })
}

/// Everything else that follows from a stance on the feet `q`.
///
/// # Errors
/// `no_assembly` where the platform has no stiffness.
#[inline]
fn complete(
    feet: &Feet<'_>,
    stance: &Stance,
    q: &Joints<6>,
) -> Result<TriPlanarChainState, KinematicsError> {
    let mechanism = feet.equations.mechanism;
    let Stance { state, rotation, arms, legs } = stance;
    let struts = struts(mechanism, arms, &state.position, &feet.equations.feet);
    let Some(loosened) = invert(struts) else { return Err(no_assembly(0.0)) };
    // l·v + (r×l)·Ω = l·ḟ for each strut, in the units of the matrix.
    let mut jacobian = Jacobian::zeros();
    for column in 0..6 {
        let first = column - column % 2;
        let axis = column % 2;
        let rates = loosened.column(first) * struts[(first, axis)]
            + loosened.column(first + 1) * struts[(first + 1, axis)];
        for row in 0..6 {
            jacobian[(row, column)] =
                if row < 3 { rates[row] } else { rates[row] / mechanism.side };
        }
    }
    Ok(TriPlanarChainState {
        position: feet.position(state),
        rotation: *rotation,
        feet: *q,
        legs: *legs,
        jacobian,
        state: *state,
        loosened,
    })
}
