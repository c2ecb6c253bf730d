//! The one trait that every mechanism implements.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Joint coordinates of a mechanism with `N` axes [m or rad].
pub type Joints<const N: usize> = SVector<f64, N>;

/// Rows: linear then angular velocity of the tool; columns: joint rates. Rows of directions that
/// the mechanism cannot move in are zero.
pub type Jacobian<const N: usize> = SMatrix<f64, 6, N>;

/// Where the tool is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Tool centre point, machine frame [m]. Planar mechanisms leave z at 0.
    pub position: Vector3<f64>,
    /// Orientation of the tool; the identity where it has none.
    pub rotation: Matrix3<f64>,
}

impl Pose {
    /// A pose without orientation.
    pub fn at(position: Vector3<f64>) -> Self {
        Self { position, rotation: Matrix3::identity() }
    }
}

/// The tool's motion at one instant: exact derivatives of a planned path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolMotion {
    /// Where it is [m].
    pub position: Vector3<f64>,
    /// Its velocity [m/s].
    pub velocity: Vector3<f64>,
    /// Its acceleration [m/s²].
    pub acceleration: Vector3<f64>,
    /// Its jerk [m/s³].
    pub jerk: Vector3<f64>,
}

/// The joints' motion that gives the tool a [`ToolMotion`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointMotion<const N: usize> {
    /// [m or rad].
    pub position: Joints<N>,
    /// [m/s or rad/s].
    pub velocity: Joints<N>,
    /// [m/s² or rad/s²].
    pub acceleration: Joints<N>,
    /// [m/s³ or rad/s³].
    pub jerk: Joints<N>,
}

/// Why a pose or a joint vector has no answer. Nothing is ever clamped instead.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{detail} ({code}): {value} against a limit of {limit}")]
pub struct KinematicsError {
    /// The code on the command line, such as `unreachable_radius`.
    pub code: &'static str,
    /// The joint it concerns, from 0.
    pub axis: Option<usize>,
    /// The offending value, SI.
    pub value: f64,
    /// What it was measured against, SI.
    pub limit: f64,
    /// What it means.
    pub detail: &'static str,
}

/// A mechanism with `N` actuated axes: pure functions of its dimensions and masses.
///
/// Elasticity sits between the motor side and the load side of the transmission and is linear:
/// `τ = K·(q_motor − q_load) + B·(q̇_motor − q̇_load)` in joint coordinates.
pub trait Mechanism<const N: usize>: Clone + Send + 'static {
    /// Which of several solutions: working mode, assembly mode, elbow, table turn.
    type Branch: Copy + core::fmt::Debug + Default + PartialEq + Send;

    /// The name in machine files and summaries.
    const NAME: &'static str;

    /// Where the tool is with the joints at `q` [m or rad].
    ///
    /// # Errors
    /// Where the chain cannot close.
    fn forward(&self, q: &Joints<N>, branch: Self::Branch) -> Result<Pose, KinematicsError>;

    /// The joints that bring the tool to `pose` on `branch`, continuous with `previous`.
    ///
    /// # Errors
    /// Out of reach or singular, with how far.
    fn inverse(
        &self,
        pose: &Pose,
        branch: Self::Branch,
        previous: &Joints<N>,
    ) -> Result<Joints<N>, KinematicsError>;

    /// Tool velocity per joint rate.
    ///
    /// Here and in the dynamics `branch` says which of several poses `q` stands for, as in
    /// [`Self::forward`]: the actuated joints alone do not tell how a closed chain is assembled.
    fn jacobian(&self, q: &Joints<N>, branch: Self::Branch) -> Jacobian<N>;

    /// The joints' motion for a motion of the tool, up to jerk.
    ///
    /// # Errors
    /// Out of reach or singular, with how far.
    fn joint_motion(
        &self,
        tool: &ToolMotion,
        branch: Self::Branch,
        previous: &Joints<N>,
    ) -> Result<JointMotion<N>, KinematicsError>;

    /// Inertia of the load in joint coordinates, symmetric and positive definite, rotors excluded
    /// [kg or kg·m²].
    fn mass_matrix(&self, q: &Joints<N>, branch: Self::Branch) -> SMatrix<f64, N, N>;

    /// Coriolis, centrifugal and gravity efforts of the load with the joints at `q` [m or rad],
    /// moving at `velocity` [m/s or rad/s]; in [N or N·m].
    fn bias(&self, q: &Joints<N>, velocity: &Joints<N>, branch: Self::Branch) -> Joints<N>;

    /// The part of [`Self::bias`] that is there at rest [N or N·m].
    fn gravity(&self, q: &Joints<N>, branch: Self::Branch) -> Joints<N>;

    /// Stiffness of the transmission [N/m or N·m/rad], symmetric; `None` when it is rigid.
    fn stiffness(&self) -> Option<SMatrix<f64, N, N>>;

    /// Damping of the transmission [N·s/m or N·m·s/rad], symmetric.
    fn damping(&self) -> SMatrix<f64, N, N>;

    /// Efforts on the load side of the transmission for a motion of the joints [N or N·m].
    fn inverse_dynamics(&self, motion: &JointMotion<N>, branch: Self::Branch) -> Joints<N> {
        self.mass_matrix(&motion.position, branch) * motion.acceleration
            + self.bias(&motion.position, &motion.velocity, branch)
    }
}

/// How far from z = 0 a planar mechanism's tool may be asked to go [m]: rounding of a path that
/// lies in the plane, far below any encoder's count.
const PLANE_TOLERANCE: f64 = 1e-9;

/// Refuses a position that a planar mechanism cannot take.
pub(crate) fn in_plane(position: &Vector3<f64>) -> Result<(), KinematicsError> {
    // Written so that a z that is not a number fails too.
    if position.z.abs() <= PLANE_TOLERANCE {
        return Ok(());
    }
    Err(KinematicsError {
        code: "out_of_plane",
        axis: None,
        value: position.z,
        limit: PLANE_TOLERANCE,
        detail: "the mechanism moves in x and y only",
    })
}
