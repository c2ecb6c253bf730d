//! Any open chain of revolute and prismatic joints, by modified Denavit-Hartenberg parameters
//! (source 000 sec. 3, after Craig).
//!
//! Joint `i` turns about or slides along the z axis of frame `i`. The inverse is found by iteration
//! from the previous joints, so a chain stays in its configuration.

mod dynamics;
mod frame;
mod inverse;
mod task;

use nalgebra::{Matrix3, SMatrix, Vector3};

pub use dynamics::SerialChainState;

use super::scaled::{self, Scale};
use crate::analysis::Bodies;
use crate::kinematics::{
    Jacobian, JointMotion, Joints, KinematicsError, Margin, MarginKind, Mechanism, Pose, TaskSpace,
    ToolMotion,
};
use crate::transmission::{self, Elasticity};

/// How a joint moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// Turns; the joint coordinate adds to [`Link::angle`].
    Revolute,
    /// Slides; the joint coordinate adds to [`Link::offset`].
    Prismatic,
}

/// A link, and the joint that carries it on the link before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// From the previous joint's axis to this one's, about the previous x: α of the previous [rad].
    pub twist: f64,
    /// From the previous joint's axis to this one's, along the previous x: a of the previous [m].
    // Source 000 table 1 heads both this and the twist a_{i−1}: an erratum.
    pub length: f64,
    /// Along this joint's axis: d [m].
    pub offset: f64,
    /// About this joint's axis: θ [rad].
    pub angle: f64,
    /// How the joint moves.
    pub kind: JointKind,
    /// Mass, with what is fixed to the link [kg].
    pub mass: f64,
    /// Centre of mass, frame of the link [m].
    pub center: Vector3<f64>,
    /// Inertia about the centre of mass, frame of the link [kg·m²].
    pub inertia: Matrix3<f64>,
    /// The least that the joint can be at [m or rad]; −∞ for a joint that turns without end.
    pub lower: f64,
    /// The most that it can be at [m or rad].
    pub upper: f64,
}

/// An open chain of `N` joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Serial<const N: usize> {
    /// Where frame 0 stands, machine frame.
    pub base: Pose,
    /// From the base on.
    pub links: [Link; N],
    /// The tool in the last link's frame; the beam shines along −z of the tool.
    pub tool: Pose,
    /// The part of a pose that the joints have to meet.
    pub task_space: TaskSpace,
    /// Acceleration of a falling body, machine frame [m/s²].
    pub gravity: Vector3<f64>,
    /// Spring and damper of each joint's transmission, in the joint's own unit [N/m or N·m/rad];
    /// `None` when they are taken as rigid.
    pub elasticity: Option<[Elasticity; N]>,
}

impl<const N: usize> Scale for Serial<N> {
    fn scale(&mut self, mass: f64, stiffness: f64) {
        for link in &mut self.links {
            link.mass *= mass;
            link.inertia *= mass;
        }
        scaled::soften(&mut self.elasticity, stiffness);
    }
}

impl<const N: usize> Mechanism<N> for Serial<N> {
    type Branch = ();
    type ChainState = SerialChainState<N>;

    fn name(&self) -> &'static str {
        "serial"
    }

    fn task_space(&self) -> TaskSpace {
        self.task_space
    }

    fn branch(&self) {}

    fn branch_of(&self, _state: &SerialChainState<N>) {}

    fn solve(
        &self,
        q: &Joints<N>,
        _branch: (),
        _near: Option<&SerialChainState<N>>,
    ) -> Result<SerialChainState<N>, KinematicsError> {
        let chain = self.chain(&(*q).into());
        Ok(SerialChainState { links: self.placed(&chain), tool: chain.tool.pose(), joints: *q })
    }

    fn pose(&self, state: &SerialChainState<N>) -> Pose {
        state.tool
    }

    fn jacobian(&self, state: &SerialChainState<N>) -> Jacobian<N> {
        let mut jacobian = Jacobian::<N>::zeros();
        for joint in 0..N {
            let (linear, angular) = self.column(&state.links, joint, &state.tool.position);
            jacobian.fixed_view_mut::<3, 1>(0, joint).copy_from(&linear);
            jacobian.fixed_view_mut::<3, 1>(3, joint).copy_from(&angular);
        }
        jacobian
    }

    fn margins(&self, state: &SerialChainState<N>) -> Vec<Margin> {
        // Smallest singular value of what the freedom asks for, lengths divided by the reach.
        let rows = self.rows(&self.chain(&state.joints.into()), self.reach());
        vec![Margin {
            name: "singular_value",
            kind: MarginKind::Serial,
            value: rows.smallest_singular_value(),
            limit: inverse::SINGULAR,
        }]
    }

    fn inverse(
        &self,
        pose: &Pose,
        _branch: (),
        previous: &Joints<N>,
    ) -> Result<Joints<N>, KinematicsError> {
        self.joints_of_pose(pose, previous)
    }

    fn joint_motion(
        &self,
        tool: &ToolMotion,
        _branch: (),
        previous: &Joints<N>,
    ) -> Result<JointMotion<N>, KinematicsError> {
        self.joints_of_motion(tool, previous)
    }

    fn mass_matrix(&self, state: &SerialChainState<N>) -> SMatrix<f64, N, N> {
        self.inertia(&state.links)
    }

    fn bias(&self, state: &SerialChainState<N>, velocity: &Joints<N>) -> Joints<N> {
        self.efforts(&state.links, velocity)
    }

    fn gravity(&self, state: &SerialChainState<N>) -> Joints<N> {
        self.efforts(&state.links, &Joints::zeros())
    }

    fn bodies(&self, state: &SerialChainState<N>) -> Bodies {
        let origins = state.links.iter().map(|link| link.origin);
        Bodies {
            moving_mass: self.links.iter().map(|link| link.mass).sum(),
            points: origins.chain([state.tool.position]).collect(),
        }
    }

    fn stiffness(&self) -> Option<SMatrix<f64, N, N>> {
        transmission::stiffness(self.elasticity)
    }

    fn damping(&self) -> SMatrix<f64, N, N> {
        transmission::damping(self.elasticity)
    }
}
