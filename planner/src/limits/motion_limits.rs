//! One machine's mechanism, axes and path, asked about one motion after the other.

use machine::kinematics::{JointMotion, Joints, KinematicsError, ToolMotion};
use machine::{Actuator, Axis, Machine, Mechanism, Motor, PathLimits};

use crate::geometry::attitude::AttitudeLaw;
use crate::joint_space::configuration;

/// What a motion is held to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scope {
    /// Everything that a machine cannot exceed: path, area, axes and motors.
    Machine,
    /// The limits of the path alone, as if the axes could follow anywhere.
    PathAlone,
}

/// Limits of a machine's axes and path.
#[derive(Debug, Clone)]
pub(crate) struct MotionLimits<'a, const N: usize, M: Mechanism<N>> {
    pub(crate) mechanism: &'a M,
    pub(crate) axes: &'a [Axis],
    pub(crate) actuators: &'a [Actuator],
    pub(crate) path: PathLimits,
    pub(crate) branches: Vec<M::Branch>,
    pub(crate) attitude: AttitudeLaw,
    pub(crate) scope: Scope,
    /// The least z of the paths that a flight joins, below which it does not go [m].
    pub(crate) lowest: f64,
}

impl<'a, const N: usize, M: Mechanism<N>> MotionLimits<'a, N, M> {
    /// For `machine`, whose joints stand near `near`.
    pub(crate) fn new(
        mechanism: &'a M,
        machine: &'a Machine,
        path: PathLimits,
        near: &Joints<N>,
        attitude: AttitudeLaw,
        scope: Scope,
    ) -> Self {
        let branches = configuration::branches(mechanism, near);
        let Machine { axes, actuators, .. } = machine;
        let lowest = f64::NEG_INFINITY;
        Self { mechanism, axes, actuators, path, branches, attitude, scope, lowest }
    }

    /// The joints' motion for `tool`, turned as the job asks, continuous with `previous`.
    pub(crate) fn follow(
        &self,
        tool: &ToolMotion,
        branch: &mut usize,
        previous: &Joints<N>,
    ) -> Result<JointMotion<N>, KinematicsError> {
        let tool = self.attitude.apply(tool)?;
        configuration::follow(self.mechanism, &self.branches, &tool, branch, previous)
    }

    /// The mechanism with the joints at `joints`, which bring the tool to where `tool` says, turned as the job
    /// asks, on the branch with this number.
    pub(crate) fn solve_at(
        &self,
        tool: &ToolMotion,
        joints: &Joints<N>,
        branch: usize,
        near: Option<&M::ChainState>,
    ) -> Result<M::ChainState, KinematicsError> {
        let pose = self.attitude.apply(tool)?.pose();
        self.mechanism.solve_at(&pose, joints, self.branches[branch], near)
    }

    /// The mechanism with the joints at `joints` on the branch with this number.
    pub(crate) fn solve(
        &self,
        joints: &Joints<N>,
        branch: usize,
        near: Option<&M::ChainState>,
    ) -> Result<M::ChainState, KinematicsError> {
        self.mechanism.solve(joints, self.branches[branch], near)
    }
}

/// A motor's largest torque from rest [N·m], and how fast it can change [N·m/s].
pub(crate) fn torque_and_slew(motor: &Motor) -> [f64; 2] {
    /// A stepper's torque is there after so many seconds.
    const SOON: f64 = 1e-3;
    match motor {
        Motor::Dc(motor) => [
            motor.current * motor.torque_constant,
            motor.voltage / motor.inductance * motor.torque_constant,
        ],
        Motor::Stepper(motor) => {
            let torque = motor.torque_limit(0.0);
            [torque, torque / SOON]
        }
    }
}
