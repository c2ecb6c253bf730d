//! Two crossed belts that move one head in x and y (source 003 ch. 4).
//!
//! The joints are the belts' travels [m], pulley and gear being in the axis's ratio:
//! `x = (q₁ + q₂)/2`, `y = (q₁ − q₂)/2` (eq. 4.1 and 4.2).

use nalgebra::{Matrix2, Vector2, Vector3};

use crate::analysis::Bodies;
use crate::kinematics::{
    Jacobian, JointMotion, Joints, KinematicsError, Margin, Mechanism, Pose, TaskSpace, ToolMotion,
    in_plane,
};
use crate::transmission::Elasticity;

/// The head on its two belts.
///
/// Masses and springs are per direction of the tool: the heavy bridge moves in y only. The two
/// belts act together on each direction, so a spring here is both of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoreXy {
    /// Mass that moves in x, then in y [kg]; the latter includes the former's.
    // Source 003 eq. 4.6 has the heavy mass on x: an erratum.
    pub mass: [f64; 2],
    /// Spring and damper of the belts in x, then in y; `None` when they are taken as rigid.
    pub elasticity: Option<[Elasticity; 2]>,
}

/// Belt travels for a displacement of the tool, `J⁻¹·d`.
fn belts(tool: &Vector3<f64>) -> Vector2<f64> {
    Vector2::new(tool.x + tool.y, tool.x - tool.y)
}

/// A diagonal matrix over x and y seen from the belts, `Jᵀ·diag(x, y)·J`.
fn seen_from_belts([x, y]: [f64; 2]) -> Matrix2<f64> {
    let same = (x + y) / 4.0;
    let cross = (x - y) / 4.0;
    Matrix2::new(same, cross, cross, same)
}

impl Mechanism<2> for CoreXy {
    type Branch = ();
    type ChainState = Joints<2>;

    const NAME: &'static str = "corexy";

    fn task_space(&self) -> TaskSpace {
        TaskSpace::Plane
    }

    fn branch(&self) {}

    fn branch_of(&self, _q: &Joints<2>) {}

    fn solve(
        &self,
        q: &Joints<2>,
        _branch: (),
        _near: Option<&Joints<2>>,
    ) -> Result<Joints<2>, KinematicsError> {
        Ok(*q)
    }

    fn pose(&self, q: &Joints<2>) -> Pose {
        Pose::at(Vector3::new((q[0] + q[1]) / 2.0, (q[0] - q[1]) / 2.0, 0.0))
    }

    fn margins(&self, _q: &Joints<2>) -> Vec<Margin> {
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
        _previous: &Joints<2>,
    ) -> Result<Joints<2>, KinematicsError> {
        in_plane(&pose.position)?;
        Ok(belts(&pose.position))
    }

    fn jacobian(&self, _q: &Joints<2>) -> Jacobian<2> {
        let mut jacobian = Jacobian::zeros();
        jacobian[(0, 0)] = 0.5;
        jacobian[(0, 1)] = 0.5;
        jacobian[(1, 0)] = 0.5;
        jacobian[(1, 1)] = -0.5;
        jacobian
    }

    #[inline]
    fn joint_motion(
        &self,
        tool: &ToolMotion,
        _branch: (),
        _previous: &Joints<2>,
    ) -> Result<JointMotion<2>, KinematicsError> {
        in_plane(&tool.position)?;
        Ok(JointMotion {
            position: belts(&tool.position),
            velocity: belts(&tool.velocity),
            acceleration: belts(&tool.acceleration),
            jerk: belts(&tool.jerk),
        })
    }

    fn mass_matrix(&self, _q: &Joints<2>) -> Matrix2<f64> {
        // Source 003 eq. 4.6 and 4.7: τ = Jᵀ·M·a.
        seen_from_belts(self.mass)
    }

    fn bias(&self, q: &Joints<2>, _velocity: &Joints<2>) -> Joints<2> {
        self.gravity(q)
    }

    fn gravity(&self, _q: &Joints<2>) -> Joints<2> {
        Joints::zeros()
    }

    fn bodies(&self, q: &Joints<2>) -> Bodies {
        Bodies { moving_mass: self.mass[1], points: vec![self.pose(q).position] }
    }

    fn stiffness(&self) -> Option<Matrix2<f64>> {
        self.elasticity.map(|springs| seen_from_belts(springs.map(|spring| spring.stiffness)))
    }

    fn damping(&self) -> Matrix2<f64> {
        self.elasticity.map_or_else(Matrix2::zeros, |springs| {
            seen_from_belts(springs.map(|spring| spring.damping))
        })
    }
}
