//! Frames in space over any [`Scalar`], and the step from one link's frame to the next.

use messages::math;
use nalgebra::{Matrix3, Vector3};

use super::{JointKind, Link};
use crate::kinematics::Pose;
use crate::taylor::Scalar;

/// A vector in space.
pub(super) type Vector<S> = [S; 3];

/// `a·x + b·y` for vectors `x`, `y`.
fn blend<S, F: Copy>(a: F, x: &Vector<S>, b: F, y: &Vector<S>) -> Vector<S>
where
    S: Scalar + core::ops::Mul<F, Output = S>,
{
    core::array::from_fn(|row| x[row] * a + y[row] * b)
}

pub(super) fn difference<S: Scalar>(x: &Vector<S>, y: &Vector<S>) -> Vector<S> {
    core::array::from_fn(|row| x[row] - y[row])
}

pub(super) fn cross<S: Scalar>(x: &Vector<S>, y: &Vector<S>) -> Vector<S> {
    [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]]
}

pub(super) fn dot<S: Scalar>(x: &Vector<S>, y: &Vector<S>) -> S {
    x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
}

/// A frame seen from the machine's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame<S> {
    /// Its x, y and z axes.
    pub(super) axes: [Vector<S>; 3],
    /// Its origin [m].
    pub(super) origin: Vector<S>,
}

impl<S: Scalar> Frame<S> {
    /// The frame at `pose`.
    pub(super) fn at(pose: &Pose) -> Self {
        Self {
            axes: core::array::from_fn(|axis| {
                core::array::from_fn(|row| S::from(pose.rotation[(row, axis)]))
            }),
            origin: core::array::from_fn(|row| S::from(pose.position[row])),
        }
    }

    /// The frame of `link`, whose joint is at `q` [m or rad], on the link whose frame this is.
    // Source 000 eq. 3.1, which is Rx(α)·Tx(a)·Rz(θ)·Tz(d).
    pub(super) fn onward(&self, link: &Link, q: S) -> Self {
        let [x, y, z] = &self.axes;
        let (sine, cosine) = math::sin_cos(link.twist);
        let side = blend(cosine, y, sine, z);
        let axis = blend(-sine, y, cosine, z);
        let ((sine, cosine), travel) = match link.kind {
            JointKind::Revolute => ((q + link.angle).sin_cos(), S::from(link.offset)),
            JointKind::Prismatic => (S::from(link.angle).sin_cos(), q + link.offset),
        };
        Self {
            axes: [blend(cosine, x, sine, &side), blend(-sine, x, cosine, &side), axis],
            origin: core::array::from_fn(|row| {
                self.origin[row] + x[row] * link.length + axis[row] * travel
            }),
        }
    }

    /// The frame at `pose` of this frame.
    pub(super) fn carrying(&self, pose: &Pose) -> Self {
        let [x, y, z] = &self.axes;
        let along = |v: [f64; 3]| -> Vector<S> {
            core::array::from_fn(|row| x[row] * v[0] + y[row] * v[1] + z[row] * v[2])
        };
        let offset = along(pose.position.into());
        Self {
            axes: core::array::from_fn(|axis| {
                along(pose.rotation.column(axis).into_owned().into())
            }),
            origin: core::array::from_fn(|row| self.origin[row] + offset[row]),
        }
    }
}

impl Frame<f64> {
    /// Its axes as the columns of a rotation matrix.
    pub(super) fn rotation(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|row, axis| self.axes[axis][row])
    }

    pub(super) fn pose(&self) -> Pose {
        Pose { position: Vector3::from(self.origin), rotation: self.rotation() }
    }
}
