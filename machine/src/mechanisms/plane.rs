//! What the planar linkages share: vectors turned by a right angle, and rigid bodies in the plane.

use nalgebra::{Matrix2, Vector2, Vector3};

use crate::kinematics::Jacobian;

/// `vector` turned by a right angle, counter-clockwise.
pub(super) fn turned(vector: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-vector.y, vector.x)
}

/// `point` in space, at height 0.
pub(super) fn level(point: Vector2<f64>) -> Vector3<f64> {
    Vector3::new(point.x, point.y, 0.0)
}

/// The part of `a × b` that stands on the plane.
pub(super) fn cross(a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}

/// The full Jacobian of a tool that moves in x and y without turning.
pub(super) fn jacobian(plane: &Matrix2<f64>) -> Jacobian<2> {
    let mut jacobian = Jacobian::<2>::zeros();
    jacobian.fixed_view_mut::<2, 2>(0, 0).copy_from(plane);
    jacobian
}

/// A rigid link: what resists its centre's motion and its turning.
#[derive(Debug, Clone, Copy)]
pub(super) struct Body {
    /// [kg], in x and in y.
    pub(super) mass: Vector2<f64>,
    /// About the centre of mass [kg·m²].
    pub(super) inertia: f64,
}

impl Body {
    /// One whose mass is the same in x and y.
    pub(super) fn new(mass: f64, inertia: f64) -> Self {
        Self { mass: Vector2::repeat(mass), inertia }
    }

    /// Its share `JᵀmJ` of the mass matrix, its centre moving by `velocity` and itself turning by
    /// `rate` per joint rate.
    pub(super) fn joint_mass(&self, velocity: &Matrix2<f64>, rate: &Vector2<f64>) -> Matrix2<f64> {
        let (first, second) = (velocity.column(0), velocity.column(1));
        let (heavy_first, heavy_second) =
            (first.component_mul(&self.mass), second.component_mul(&self.mass));
        let turning = self.inertia * rate;
        let cross = heavy_first.dot(&second) + turning.x * rate.y;
        Matrix2::new(
            heavy_first.dot(&first) + turning.x * rate.x,
            cross,
            cross,
            heavy_second.dot(&second) + turning.y * rate.y,
        )
    }

    /// Its share of the joints' efforts while they move evenly: `acceleration` of its centre and
    /// `turning` of itself are what the joint rates alone cause.
    pub(super) fn joint_effort(
        &self,
        velocity: &Matrix2<f64>,
        rate: &Vector2<f64>,
        acceleration: Vector2<f64>,
        turning: f64,
    ) -> Vector2<f64> {
        velocity.tr_mul(&acceleration.component_mul(&self.mass)) + rate * (self.inertia * turning)
    }
}

/// `value`, if it is a sign.
pub(super) fn sign(value: i32) -> Option<i32> {
    matches!(value, 1 | -1).then_some(value)
}
