//! Carriages on ball screws, one for each direction (source 003 ch. 3).
//!
//! The joint is the carriage's position [m]. Screw and gear are in the axis's ratio, so the
//! equations here are those of masses on springs.

use nalgebra::{SMatrix, SVector, Vector3};

use crate::analysis::Bodies;
use crate::kinematics::{
    Jacobian, JointMotion, Joints, KinematicsError, Margin, Mechanism, Pose, STANDARD_GRAVITY,
    TaskSpace, ToolMotion, finite, in_plane,
};
use crate::transmission::{self, Elasticity};

/// Carriages in x, y and, with `N` = 3, z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cartesian<const N: usize> {
    /// Mass that each axis moves [kg].
    pub mass: [f64; N],
    /// Spring and damper of each screw, seen at its nut; `None` when they are taken as rigid.
    pub elasticity: Option<[Elasticity; N]>,
}

impl<const N: usize> Cartesian<N> {
    /// The joints that belong to the first `N` directions of `vector`.
    fn joints(vector: &Vector3<f64>) -> Joints<N> {
        SVector::from_fn(|row, _| vector[row])
    }

    fn check(position: &Vector3<f64>) -> Result<(), KinematicsError> {
        if N < 3 { in_plane(position) } else { finite(position) }
    }
}

impl<const N: usize> Mechanism<N> for Cartesian<N> {
    type Branch = ();
    type ChainState = Joints<N>;

    const NAME: &'static str = "cartesian";

    fn task_space(&self) -> TaskSpace {
        if N < 3 { TaskSpace::Plane } else { TaskSpace::Space }
    }

    fn branch(&self) {}

    fn branch_of(&self, _q: &Joints<N>) {}

    fn solve(
        &self,
        q: &Joints<N>,
        _branch: (),
        _near: Option<&Joints<N>>,
    ) -> Result<Joints<N>, KinematicsError> {
        Ok(*q)
    }

    fn pose(&self, q: &Joints<N>) -> Pose {
        // Source 003 eq. 3.1, X = p·θ with p per radian and gear included.
        Pose::at(Vector3::from_fn(|row, _| if row < N { q[row] } else { 0.0 }))
    }

    fn margins(&self, _q: &Joints<N>) -> Vec<Margin> {
        Vec::new()
    }

    fn has_constant_mass(&self) -> bool {
        true
    }

    fn is_linear(&self) -> bool {
        true
    }

    fn inverse(
        &self,
        pose: &Pose,
        _branch: (),
        _previous: &Joints<N>,
    ) -> Result<Joints<N>, KinematicsError> {
        Self::check(&pose.position)?;
        Ok(Self::joints(&pose.position))
    }

    fn jacobian(&self, _q: &Joints<N>) -> Jacobian<N> {
        Jacobian::from_fn(|row, column| if row == column { 1.0 } else { 0.0 })
    }

    fn joint_motion(
        &self,
        tool: &ToolMotion,
        _branch: (),
        _previous: &Joints<N>,
    ) -> Result<JointMotion<N>, KinematicsError> {
        Self::check(&tool.position)?;
        Ok(JointMotion {
            position: Self::joints(&tool.position),
            velocity: Self::joints(&tool.velocity),
            acceleration: Self::joints(&tool.acceleration),
            jerk: Self::joints(&tool.jerk),
        })
    }

    fn mass_matrix(&self, _q: &Joints<N>) -> SMatrix<f64, N, N> {
        SMatrix::from_diagonal(&SVector::from(self.mass))
    }

    fn bias(&self, q: &Joints<N>, _velocity: &Joints<N>) -> Joints<N> {
        self.gravity(q)
    }

    fn gravity(&self, _q: &Joints<N>) -> Joints<N> {
        SVector::from_fn(|row, _| if row == 2 { self.mass[row] * STANDARD_GRAVITY } else { 0.0 })
    }

    fn bodies(&self, q: &Joints<N>) -> Bodies {
        // One carriage bears the other.
        let moving_mass = self.mass.into_iter().fold(0.0, f64::max);
        Bodies { moving_mass, points: vec![self.pose(q).position] }
    }

    fn stiffness(&self) -> Option<SMatrix<f64, N, N>> {
        transmission::stiffness(self.elasticity)
    }

    fn damping(&self) -> SMatrix<f64, N, N> {
        transmission::damping(self.elasticity)
    }
}
