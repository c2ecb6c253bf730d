//! Two crossed belts that move one head in x and y (source 003 ch. 4), and an axis that lifts it.
//!
//! The joints are the belts' travels [m], pulley and gear being in the axis's ratio:
//! `x = (q₁ + q₂)/2`, `y = (q₁ − q₂)/2` (eq. 4.1 and 4.2). The lift's joint is the height of the head.

use std::sync::Arc;

use nalgebra::{SMatrix, Vector3};

use super::scaled::{self, Scale};
use crate::analysis::Bodies;
use crate::frame::Frame;
use crate::kinematics::{
    Jacobian, JointMotion, Joints, KinematicsError, Margin, Mechanism, Pose, STANDARD_GRAVITY,
    TaskSpace, ToolMotion, finite, in_plane,
};
use crate::transmission::Elasticity;

/// The head on its two belts, and with `N` = 3 on a lift.
///
/// Masses and springs are per direction of the tool: the heavy bridge moves in y only. The two
/// belts act together on each direction, so a spring of x or y is both of them.
#[derive(Debug, Clone, PartialEq)]
pub struct CoreXy<const N: usize = 2> {
    /// Mass that moves in x, then in y, then in z [kg]; the second includes the first.
    // Source 003 eq. 4.6 has the heavy mass on x: an erratum.
    pub mass: [f64; N],
    /// Spring and damper of the belts in x, then in y, then of the lift; `None` when they are taken as
    /// rigid.
    pub elasticity: Option<[Elasticity; N]>,
    /// How the machine frame lies over the axes; `None` where they are one.
    pub frame: Option<Arc<Frame>>,
}

impl<const N: usize> CoreXy<N> {
    /// A head of `mass` [kg] on rigid belts, along the machine frame.
    pub fn rigid(mass: [f64; N]) -> Self {
        Self { mass, elasticity: None, frame: None }
    }

    /// The head with the joints at `q` [m].
    fn head(q: &Joints<N>) -> Vector3<f64> {
        let z = if N > 2 { q[2] } else { 0.0 };
        Vector3::new((q[0] + q[1]) / 2.0, (q[0] - q[1]) / 2.0, z)
    }

    fn check(position: &Vector3<f64>) -> Result<(), KinematicsError> {
        if N < 3 { in_plane(position) } else { finite(position) }
    }
}

/// Travels of belts and lift for a displacement of the head, `J⁻¹·d`.
fn belts<const N: usize>(head: &Vector3<f64>) -> Joints<N> {
    Joints::from_fn(|row, _| match row {
        0 => head.x + head.y,
        1 => head.x - head.y,
        _ => head.z,
    })
}

/// A diagonal matrix over x, y and z seen from belts and lift, `Jᵀ·diag(x, y, z)·J`.
fn seen_from_belts<const N: usize>(diagonal: [f64; N]) -> SMatrix<f64, N, N> {
    let same = (diagonal[0] + diagonal[1]) / 4.0;
    let cross = (diagonal[0] - diagonal[1]) / 4.0;
    SMatrix::from_fn(|row, column| match (row, column) {
        (0, 0) | (1, 1) => same,
        (0, 1) | (1, 0) => cross,
        _ if row == column => diagonal[row],
        _ => 0.0,
    })
}

impl<const N: usize> Scale for CoreXy<N> {
    fn scale(&mut self, mass: f64, stiffness: f64) {
        scaled::all(&mut self.mass, mass);
        scaled::soften(&mut self.elasticity, stiffness);
    }
}

impl<const N: usize> Mechanism<N> for CoreXy<N> {
    type Branch = ();
    type ChainState = Joints<N>;

    fn name(&self) -> &'static str {
        "corexy"
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
        let head = Self::head(q);
        Pose::at(self.frame.as_ref().map_or(head, |frame| frame.tool(&head)))
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
            None => belts(&pose.position),
            Some(frame) => belts(&frame.axes(&pose.position)?),
        })
    }

    fn jacobian(&self, q: &Joints<N>) -> Jacobian<N> {
        let mut jacobian = Jacobian::<N>::zeros();
        jacobian[(0, 0)] = 0.5;
        jacobian[(0, 1)] = 0.5;
        jacobian[(1, 0)] = 0.5;
        jacobian[(1, 1)] = -0.5;
        if N > 2 {
            jacobian[(2, 2)] = 1.0;
        }
        if let Some(frame) = &self.frame {
            let linear = frame.jacobian(&Self::head(q)) * jacobian.fixed_rows::<3>(0).into_owned();
            jacobian.fixed_rows_mut::<3>(0).copy_from(&linear);
        }
        jacobian
    }

    #[inline]
    fn joint_motion(
        &self,
        tool: &ToolMotion,
        _branch: (),
        _previous: &Joints<N>,
    ) -> Result<JointMotion<N>, KinematicsError> {
        Self::check(&tool.position)?;
        let along_axes;
        let head = match &self.frame {
            None => tool,
            Some(frame) => {
                along_axes = frame.axes_motion(tool)?;
                &along_axes
            }
        };
        Ok(JointMotion {
            position: belts(&head.position),
            velocity: belts(&head.velocity),
            acceleration: belts(&head.acceleration),
            jerk: belts(&head.jerk),
        })
    }

    fn mass_matrix(&self, _q: &Joints<N>) -> SMatrix<f64, N, N> {
        // Source 003 eq. 4.6 and 4.7: τ = Jᵀ·M·a.
        seen_from_belts(self.mass)
    }

    fn bias(&self, q: &Joints<N>, _velocity: &Joints<N>) -> Joints<N> {
        self.gravity(q)
    }

    fn gravity(&self, _q: &Joints<N>) -> Joints<N> {
        // Up is where the tool goes up: a mirrored lift runs down.
        let up = self.frame.as_ref().map_or(1.0, |frame| frame.lift());
        Joints::from_fn(
            |row, _| {
                if row == 2 { self.mass[row] * STANDARD_GRAVITY * up } else { 0.0 }
            },
        )
    }

    fn bodies(&self, q: &Joints<N>) -> Bodies {
        Bodies { moving_mass: self.mass[1], points: vec![self.pose(q).position] }
    }

    fn stiffness(&self) -> Option<SMatrix<f64, N, N>> {
        self.elasticity.map(|springs| seen_from_belts(springs.map(|spring| spring.stiffness)))
    }

    fn damping(&self) -> SMatrix<f64, N, N> {
        self.elasticity.map_or_else(SMatrix::zeros, |springs| {
            seen_from_belts(springs.map(|spring| spring.damping))
        })
    }
}
