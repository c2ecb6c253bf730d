//! Carriages, one for each direction (source 003 ch. 3, where they are on ball screws).
//!
//! The joint is the carriage's position [m]. Screw, belt or rack and the gear are in the axis's ratio, so
//! the equations here are those of masses on springs. In the place of a carriage a chuck may turn the
//! workpiece under the tool: its joint is an angle, and y the way around the workpiece.

use std::sync::Arc;

use nalgebra::{SMatrix, SVector, Vector3};

use super::scaled::{self, Scale};
use crate::analysis::Bodies;
use crate::frame::Frame;
use crate::kinematics::{
    Jacobian, JointMotion, Joints, KinematicsError, Margin, Mechanism, Pose, STANDARD_GRAVITY,
    TaskSpace, ToolMotion, finite, in_plane,
};
use crate::transmission::{self, Elasticity};

/// Carriages in x, y and, with `N` = 3, z.
#[derive(Debug, Clone, PartialEq)]
pub struct Cartesian<const N: usize> {
    /// What each axis moves [kg], or turns [kg·m²].
    pub mass: [f64; N],
    /// Way of the tool per joint unit: 1 of a carriage, the radius of the workpiece in a chuck [m/rad].
    pub travel: [f64; N],
    /// Spring and damper of each transmission, seen at the joint; `None` when they are taken as rigid.
    pub elasticity: Option<[Elasticity; N]>,
    /// How the machine frame lies over the axes; `None` where they are one.
    pub frame: Option<Arc<Frame>>,
}

impl<const N: usize> Cartesian<N> {
    /// Carriages of `mass` [kg] on rigid transmissions, along the machine frame.
    pub fn rigid(mass: [f64; N]) -> Self {
        Self { mass, travel: [1.0; N], elasticity: None, frame: None }
    }

    /// The joints for the first `N` directions of `vector`.
    fn joints(&self, vector: &Vector3<f64>) -> Joints<N> {
        SVector::from_fn(|row, _| vector[row] / self.travel[row])
    }

    /// The carriages' places with the joints at `q` [m].
    fn carriages(&self, q: &Joints<N>) -> Vector3<f64> {
        // Source 003 eq. 3.1, X = p·θ with p per radian and gear included.
        Vector3::from_fn(|row, _| if row < N { q[row] * self.travel[row] } else { 0.0 })
    }

    fn check(position: &Vector3<f64>) -> Result<(), KinematicsError> {
        if N < 3 { in_plane(position) } else { finite(position) }
    }
}

impl<const N: usize> Scale for Cartesian<N> {
    fn scale(&mut self, mass: f64, stiffness: f64) {
        scaled::all(&mut self.mass, mass);
        scaled::soften(&mut self.elasticity, stiffness);
    }
}

impl<const N: usize> Mechanism<N> for Cartesian<N> {
    type Branch = ();
    type ChainState = Joints<N>;

    fn name(&self) -> &'static str {
        "cartesian"
    }

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
        let carriages = self.carriages(q);
        Pose::at(self.frame.as_ref().map_or(carriages, |frame| frame.tool(&carriages)))
    }

    fn margins(&self, _q: &Joints<N>) -> Vec<Margin> {
        Vec::new()
    }

    fn has_constant_mass(&self) -> bool {
        true
    }

    fn is_linear(&self) -> bool {
        self.frame.as_ref().is_none_or(|frame| frame.is_linear())
    }

    fn inverse(
        &self,
        pose: &Pose,
        _branch: (),
        _previous: &Joints<N>,
    ) -> Result<Joints<N>, KinematicsError> {
        Self::check(&pose.position)?;
        Ok(match &self.frame {
            None => self.joints(&pose.position),
            Some(frame) => self.joints(&frame.axes(&pose.position)?),
        })
    }

    fn jacobian(&self, q: &Joints<N>) -> Jacobian<N> {
        match &self.frame {
            None => Jacobian::from_fn(
                |row, column| {
                    if row == column { self.travel[column] } else { 0.0 }
                },
            ),
            Some(frame) => {
                let frame = frame.jacobian(&self.carriages(q));
                Jacobian::from_fn(|row, column| {
                    if row < N { frame[(row, column)] * self.travel[column] } else { 0.0 }
                })
            }
        }
    }

    fn joint_motion(
        &self,
        tool: &ToolMotion,
        _branch: (),
        _previous: &Joints<N>,
    ) -> Result<JointMotion<N>, KinematicsError> {
        Self::check(&tool.position)?;
        let along_axes;
        let axes = match &self.frame {
            None => tool,
            Some(frame) => {
                along_axes = frame.axes_motion(tool)?;
                &along_axes
            }
        };
        Ok(JointMotion {
            position: self.joints(&axes.position),
            velocity: self.joints(&axes.velocity),
            acceleration: self.joints(&axes.acceleration),
            jerk: self.joints(&axes.jerk),
        })
    }

    fn mass_matrix(&self, _q: &Joints<N>) -> SMatrix<f64, N, N> {
        SMatrix::from_diagonal(&SVector::from(self.mass))
    }

    fn bias(&self, q: &Joints<N>, _velocity: &Joints<N>) -> Joints<N> {
        self.gravity(q)
    }

    fn gravity(&self, _q: &Joints<N>) -> Joints<N> {
        // Up is where the tool goes up: a mirrored axis runs down.
        let up = self.frame.as_ref().map_or(1.0, |frame| frame.lift());
        SVector::from_fn(|row, _| {
            if row == 2 { self.mass[row] * STANDARD_GRAVITY * up * self.travel[row] } else { 0.0 }
        })
    }

    fn bodies(&self, q: &Joints<N>) -> Bodies {
        // One carriage bears the other; a chuck has an inertia instead.
        let masses = self.mass.into_iter().zip(self.travel);
        let masses = masses.filter(|(_, travel)| *travel == 1.0).map(|(mass, _)| mass);
        let moving_mass = masses.fold(0.0, f64::max);
        Bodies { moving_mass, points: vec![self.pose(q).position] }
    }

    fn stiffness(&self) -> Option<SMatrix<f64, N, N>> {
        transmission::stiffness(self.elasticity)
    }

    fn damping(&self) -> SMatrix<f64, N, N> {
        transmission::damping(self.elasticity)
    }
}
