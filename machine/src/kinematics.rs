//! The one trait that every mechanism implements.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3, Vector6};

use crate::analysis::Bodies;
use crate::taylor::Taylor;

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

/// How the tool is turned and how that changes; [`Attitude::LEVEL`] where nothing asks for more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attitude {
    /// Orientation of the tool, its columns the tool's axes; the beam shines along −z of it.
    pub rotation: Matrix3<f64>,
    /// Angular velocity, machine frame [rad/s].
    pub velocity: Vector3<f64>,
    /// Angular acceleration [rad/s²].
    pub acceleration: Vector3<f64>,
    /// Angular jerk [rad/s³].
    pub jerk: Vector3<f64>,
}

impl Attitude {
    /// The tool points straight down, and stays so.
    pub const LEVEL: Self = Self::fixed(Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0));

    /// Turned by `rotation`, and staying so.
    pub const fn fixed(rotation: Matrix3<f64>) -> Self {
        let still = Vector3::new(0.0, 0.0, 0.0);
        Self { rotation, velocity: still, acceleration: still, jerk: still }
    }

    /// The first three time derivatives of the rotation matrix.
    pub fn rates(&self) -> [Matrix3<f64>; 3] {
        let (w, a, j) = (
            self.velocity.cross_matrix(),
            self.acceleration.cross_matrix(),
            self.jerk.cross_matrix(),
        );
        // R′ = ω×R, differentiated twice more.
        let first = w * self.rotation;
        let second = a * self.rotation + w * first;
        let third = j * self.rotation + a * first * 2.0 + w * second;
        [first, second, third]
    }

    /// Row by row, the entries of the rotation matrix as series.
    pub fn series(&self) -> [[Taylor; 3]; 3] {
        let [first, second, third] = self.rates();
        core::array::from_fn(|row| {
            core::array::from_fn(|column| {
                let at = (row, column);
                Taylor::new(self.rotation[at], first[at], second[at], third[at])
            })
        })
    }
}

impl Default for Attitude {
    fn default() -> Self {
        Self::LEVEL
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
    /// How it is turned meanwhile.
    pub attitude: Attitude,
}

impl ToolMotion {
    /// At rest in `pose`.
    pub fn rest(pose: &Pose) -> Self {
        let still = Vector3::zeros();
        Self {
            position: pose.position,
            velocity: still,
            acceleration: still,
            jerk: still,
            attitude: Attitude::fixed(pose.rotation),
        }
    }

    /// Where the tool is and how it is turned.
    pub fn pose(&self) -> Pose {
        Pose { position: self.position, rotation: self.attitude.rotation }
    }

    /// The position's coordinates as series.
    pub fn series(&self) -> [Taylor; 3] {
        core::array::from_fn(|row| {
            Taylor::new(
                self.position[row],
                self.velocity[row],
                self.acceleration[row],
                self.jerk[row],
            )
        })
    }
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

impl<const N: usize> JointMotion<N> {
    /// At rest at `position` [m or rad].
    pub fn rest(position: Joints<N>) -> Self {
        let still = Joints::zeros();
        Self { position, velocity: still, acceleration: still, jerk: still }
    }

    /// The motion whose joints are these series.
    pub fn of_series(joints: &[Taylor; N]) -> Self {
        Self {
            position: Joints::from_fn(|row, _| joints[row].value),
            velocity: Joints::from_fn(|row, _| joints[row].first),
            acceleration: Joints::from_fn(|row, _| joints[row].second),
            jerk: Joints::from_fn(|row, _| joints[row].third),
        }
    }
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

/// What a tool can be told: the part of a [`Pose`] that a mechanism can choose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TaskSpace {
    /// x and y.
    Plane,
    /// x, y and z.
    Space,
    /// x, y, z and the direction of the tool, turning about itself left aside.
    Axis,
    /// x, y, z and the whole orientation.
    Pose,
}

/// One way to solve a mechanism's equations, as `graver kinematics` names and shows it.
pub trait Branch: Copy + core::fmt::Debug + PartialEq + Send + Sync + 'static {
    /// Names and values, such as `working_mode`, `[1, -1]`; empty where there is one solution.
    fn choices(&self) -> Vec<(&'static str, Vec<i32>)>;

    /// The same with `name` set to `values`; `None` where there is no such name or value.
    fn choose(self, name: &str, values: &[i32]) -> Option<Self>;

    /// The same with what depends on the place left open: the turn of a joint that turns without end,
    /// and the number of an assembly. Itself where it names neither.
    #[must_use]
    fn in_any_turn(self) -> Self {
        self
    }
}

impl Branch for () {
    fn choices(&self) -> Vec<(&'static str, Vec<i32>)> {
        Vec::new()
    }

    fn choose(self, _name: &str, _values: &[i32]) -> Option<Self> {
        None
    }
}

/// What a mechanism loses where a margin is used up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MarginKind {
    /// A direction of the tool, in a singularity of the first kind. The joints may pass there; a path
    /// has the rates that it needs, which the limits of the axes judge.
    Serial,
    /// Its hold on the tool, in a singularity of the second kind. Never to be passed.
    Parallel,
    /// Its room: bodies touch, or a part leaves its ground. Never to be passed.
    Collision,
}

impl MarginKind {
    /// Whether the joints may pass below the margin's limit.
    pub fn may_be_passed(self) -> bool {
        match self {
            Self::Serial => true,
            Self::Parallel | Self::Collision => false,
        }
    }
}

/// How far a configuration is from where a mechanism can no longer do what is asked of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margin {
    /// The name, such as `type_1` or `center`.
    pub name: &'static str,
    /// What is lost where it is used up.
    pub kind: MarginKind,
    /// Its value; 0 is the singularity.
    pub value: f64,
    /// What the value must not fall below.
    pub limit: f64,
}

/// A mechanism with `N` actuated axes: pure functions of its dimensions and masses.
///
/// [`Mechanism::solve`] solves the chain once for a joint position; what depends on the position
/// is then asked of the [`Mechanism::ChainState`] that it gives. Elasticity sits between the motor
/// side and the load side of the transmission and is linear:
/// `τ = K·(q_motor − q_load) + B·(q̇_motor − q̇_load)` in joint coordinates.
pub trait Mechanism<const N: usize>: Clone + Send + Sync + 'static {
    /// Which of several solutions: working mode, assembly mode, elbow, table turn.
    type Branch: Branch;

    /// The mechanism at one joint position, everything passive solved: bodies, angles, Jacobian.
    type ChainState: Copy + core::fmt::Debug + Send + 'static;

    /// The name in machine files and summaries.
    fn name(&self) -> &'static str;

    /// What of a pose it can choose.
    fn task_space(&self) -> TaskSpace;

    /// The branch in which the machine is built and works.
    fn branch(&self) -> Self::Branch;

    /// Solves the chain with the joints at `q` [m or rad]. `near` is the solved chain at a position close
    /// by, from which an iterative solution starts.
    ///
    /// # Errors
    /// Where the chain cannot close.
    fn solve(
        &self,
        q: &Joints<N>,
        branch: Self::Branch,
        near: Option<&Self::ChainState>,
    ) -> Result<Self::ChainState, KinematicsError>;

    /// The same where the tool is known to be at `pose`, from the inverse that gave `q`: what an
    /// iterative solution looks for.
    ///
    /// # Errors
    /// Where the chain cannot close.
    fn solve_at(
        &self,
        _pose: &Pose,
        q: &Joints<N>,
        branch: Self::Branch,
        near: Option<&Self::ChainState>,
    ) -> Result<Self::ChainState, KinematicsError> {
        self.solve(q, branch, near)
    }

    /// Where the tool is.
    fn pose(&self, chain: &Self::ChainState) -> Pose;

    /// The branch that a solved chain is in.
    fn branch_of(&self, chain: &Self::ChainState) -> Self::Branch;

    /// Tool velocity per joint rate.
    fn jacobian(&self, chain: &Self::ChainState) -> Jacobian<N>;

    /// Angular velocity of the body that bears the tool, against the frame of the tool's positions and
    /// in it, per joint rate [rad/m or 1]: what a moment at the tool works on. These are the angular
    /// rows of the Jacobian, except where the tool turns and its orientation is nobody's choice.
    fn tool_turning(&self, chain: &Self::ChainState) -> SMatrix<f64, 3, N> {
        self.jacobian(chain).fixed_rows::<3>(3).into_owned()
    }

    /// Efforts of the joints while the tool exerts `wrench`, a force [N] and a moment [N·m] about the
    /// tool centre point in the frame of the tool's positions, on what it marks; in [N or N·m]. The
    /// parts that the mechanism's guides bear are not in it.
    fn wrench_efforts(&self, chain: &Self::ChainState, wrench: &Vector6<f64>) -> Joints<N> {
        // Virtual work of the force and of the moment.
        self.jacobian(chain).fixed_rows::<3>(0).tr_mul(&wrench.fixed_rows::<3>(0))
            + self.tool_turning(chain).tr_mul(&wrench.fixed_rows::<3>(3))
    }

    /// Distances to the mechanism's singularities and collisions, each with what it must keep.
    fn margins(&self, chain: &Self::ChainState) -> Vec<Margin>;

    /// Where the tool is with the joints at `q` [m or rad].
    ///
    /// # Errors
    /// Where the chain cannot close.
    fn forward(&self, q: &Joints<N>, branch: Self::Branch) -> Result<Pose, KinematicsError> {
        self.locate(q, branch, None)
    }

    /// The pose of [`Self::solve`] alone, to the bit, which may be had for less than the whole chain.
    ///
    /// # Errors
    /// Where the chain cannot close.
    fn locate(
        &self,
        q: &Joints<N>,
        branch: Self::Branch,
        near: Option<&Self::ChainState>,
    ) -> Result<Pose, KinematicsError> {
        Ok(self.pose(&self.solve(q, branch, near)?))
    }

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

    /// The joints' motion for a motion of the tool, up to jerk, continuous with `previous`. A path
    /// may pass where [`Self::inverse`] of a pose alone is undefined, if its velocity decides.
    ///
    /// # Errors
    /// Out of reach or singular, with how far.
    fn joint_motion(
        &self,
        tool: &ToolMotion,
        branch: Self::Branch,
        previous: &Joints<N>,
    ) -> Result<JointMotion<N>, KinematicsError>;

    /// The joints that bring the tool to `position` [m] with the tilt and turn of its head given in
    /// the machine frame [rad]; `None` for mechanisms whose head has no such angles.
    fn inverse_machine_angles(
        &self,
        _position: &Vector3<f64>,
        _angles: [f64; 2],
        _branch: Self::Branch,
        _previous: &Joints<N>,
    ) -> Option<Result<Joints<N>, KinematicsError>> {
        None
    }

    /// Inertia of the load in joint coordinates, symmetric and positive definite, rotors excluded
    /// [kg or kg·m²].
    fn mass_matrix(&self, chain: &Self::ChainState) -> SMatrix<f64, N, N>;

    /// Coriolis, centrifugal and gravity efforts of the load, moving at `velocity` [m/s or rad/s];
    /// in [N or N·m].
    fn bias(&self, chain: &Self::ChainState, velocity: &Joints<N>) -> Joints<N>;

    /// The part of [`Self::bias`] that is there at rest [N or N·m].
    fn gravity(&self, chain: &Self::ChainState) -> Joints<N>;

    /// Whether [`Self::mass_matrix`] and [`Self::gravity`] are the same everywhere, and there is no
    /// other bias.
    fn has_constant_mass(&self) -> bool {
        false
    }

    /// Whether straight lines of the tool are straight lines of the joints.
    fn is_linear(&self) -> bool {
        false
    }

    /// What moves, and where it is: for a builder's figures, not for motion.
    fn bodies(&self, _chain: &Self::ChainState) -> Bodies {
        Bodies::default()
    }

    /// Stiffness of the transmission [N/m or N·m/rad], symmetric; `None` when it is rigid.
    fn stiffness(&self) -> Option<SMatrix<f64, N, N>>;

    /// Damping of the transmission [N·s/m or N·m·s/rad], symmetric.
    fn damping(&self) -> SMatrix<f64, N, N>;

    /// Efforts on the load side of the transmission for a motion of the joints [N or N·m].
    fn inverse_dynamics(
        &self,
        chain: &Self::ChainState,
        velocity: &Joints<N>,
        acceleration: &Joints<N>,
    ) -> Joints<N> {
        self.mass_matrix(chain) * acceleration + self.bias(chain, velocity)
    }
}

/// Gravity at the surface [m/s²], against the z axis.
pub const STANDARD_GRAVITY: f64 = 9.806_65;

/// How far from z = 0 a planar mechanism's tool may be asked to go [m]: rounding of a path that
/// lies in the plane, far below any encoder's count.
const PLANE_TOLERANCE: f64 = 1e-9;

/// Refuses a position that a planar mechanism cannot take.
pub(crate) fn in_plane(position: &Vector3<f64>) -> Result<(), KinematicsError> {
    // Written so that a z that is not a number fails too.
    if position.z.abs() <= PLANE_TOLERANCE {
        return finite(position);
    }
    Err(KinematicsError {
        code: "out_of_plane",
        axis: None,
        value: position.z,
        limit: PLANE_TOLERANCE,
        detail: "the mechanism moves in x and y only",
    })
}

/// Refuses a position or direction that is nowhere, which equations would hand on as joints that are
/// nowhere.
pub(crate) fn finite<const N: usize>(target: &SVector<f64, N>) -> Result<(), KinematicsError> {
    let Some(number) = target.iter().find(|number| !number.is_finite()) else { return Ok(()) };
    Err(KinematicsError {
        code: "not_a_number",
        axis: None,
        value: *number,
        limit: f64::MAX,
        detail: "a coordinate of the target, or of the joints before it, is not a finite number",
    })
}
