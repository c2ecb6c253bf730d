//! A planar arm of two links without gravity: the smallest mechanism whose inertia couples its
//! joints and changes with the position.

use machine::kinematics::{
    Jacobian, JointMotion, Joints, KinematicsError, Margin, Mechanism, Pose, TaskSpace, ToolMotion,
};
use messages::math;
use nalgebra::{Matrix2, Vector2, Vector3};

/// Two links of 0.2 m that swing in a plane, the second joint relative to the first link.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Arm {
    /// Stiffness of both joints [N·m/rad]; `None` for rigid ones.
    pub(crate) stiffness: Option<f64>,
    /// Largest angle of the elbow, where the chain ends [rad].
    pub(crate) reach: f64,
}

/// Inertias `I₁ + m₂l₁²`, `m₂l₁s₂` and `I₂`, all about the joints [kg·m²].
const INERTIAS: [f64; 3] = [0.012, 0.004, 0.003];

const LENGTH: f64 = 0.2;

impl Arm {
    /// Kinetic energy of the links [J].
    pub(crate) fn kinetic(&self, q: &Joints<2>, velocity: &Joints<2>) -> f64 {
        0.5 * velocity.dot(&(self.mass_matrix(q) * velocity))
    }
}

impl Mechanism<2> for Arm {
    type Branch = ();
    type ChainState = Joints<2>;
    fn name(&self) -> &'static str {
        "arm"
    }

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
        if q[1].abs() <= self.reach {
            return Ok(*q);
        }
        Err(KinematicsError {
            code: "unreachable_angle",
            axis: Some(1),
            value: q[1],
            limit: self.reach,
            detail: "the elbow is at its end",
        })
    }

    fn pose(&self, q: &Joints<2>) -> Pose {
        let (first, second) = (math::sin_cos(q[0]), math::sin_cos(q[0] + q[1]));
        let (x, y) = (LENGTH * (first.1 + second.1), LENGTH * (first.0 + second.0));
        Pose::at(Vector3::new(x, y, 0.0))
    }

    fn margins(&self, _q: &Joints<2>) -> Vec<Margin> {
        Vec::new()
    }

    fn inverse(
        &self,
        pose: &Pose,
        _branch: (),
        _previous: &Joints<2>,
    ) -> Result<Joints<2>, KinematicsError> {
        let (x, y) = (pose.position.x, pose.position.y);
        let elbow = 2.0 * math::acos((x * x + y * y).sqrt() / (2.0 * LENGTH));
        Ok(Vector2::new(math::atan2(y, x) - elbow / 2.0, elbow))
    }

    fn jacobian(&self, q: &Joints<2>) -> Jacobian<2> {
        let (first, second) = (math::sin_cos(q[0]), math::sin_cos(q[0] + q[1]));
        let mut jacobian = Jacobian::<2>::zeros();
        jacobian[(0, 1)] = -LENGTH * second.0;
        jacobian[(1, 1)] = LENGTH * second.1;
        jacobian[(0, 0)] = jacobian[(0, 1)] - LENGTH * first.0;
        jacobian[(1, 0)] = jacobian[(1, 1)] + LENGTH * first.1;
        jacobian
    }

    fn joint_motion(
        &self,
        tool: &ToolMotion,
        _branch: (),
        previous: &Joints<2>,
    ) -> Result<JointMotion<2>, KinematicsError> {
        self.inverse(&tool.pose(), (), previous).map(JointMotion::rest)
    }

    fn mass_matrix(&self, q: &Joints<2>) -> Matrix2<f64> {
        let [first, both, second] = INERTIAS;
        let coupled = both * math::sin_cos(q[1]).1;
        Matrix2::new(first + second + 2.0 * coupled, second + coupled, second + coupled, second)
    }

    fn bias(&self, q: &Joints<2>, velocity: &Joints<2>) -> Joints<2> {
        let change = INERTIAS[1] * math::sin_cos(q[1]).0;
        let [first, second] = [velocity[0], velocity[1]];
        Vector2::new(-change * second * (2.0 * first + second), change * first * first)
    }

    fn gravity(&self, _q: &Joints<2>) -> Joints<2> {
        Vector2::zeros()
    }

    fn stiffness(&self) -> Option<Matrix2<f64>> {
        self.stiffness.map(Matrix2::from_diagonal_element)
    }

    fn damping(&self) -> Matrix2<f64> {
        Matrix2::zeros()
    }
}
