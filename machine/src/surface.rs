//! Surfaces that flat artwork is put on: where a point of the drawing lies on the workpiece, and how
//! the surface is turned there.
//!
//! A drawing has x and y [m]. The surface gives the point in the workpiece's frame and its outward
//! normal, which the tool faces. Everything is written over [`Scalar`], so that a drawing
//! that moves gives the point's derivatives too.

mod cone;
mod sphere;

use nalgebra::{Matrix3, Vector3};

use crate::kinematics::{Attitude, KinematicsError, ToolMotion};
use crate::taylor::{Scalar, Taylor};

pub use cone::{Cone, Projection};
pub use sphere::{Sphere, SphereProjection};

/// How far outside of an edge a point may be computed to lie [m]: rounding.
const EDGE_TOLERANCE: f64 = 1e-9;

/// Where the workpiece's surface is in the workpiece's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Its axes, as columns.
    pub rotation: Matrix3<f64>,
    /// Its origin [m].
    pub translation: Vector3<f64>,
}

impl Placement {
    /// The frames are the same.
    pub const HERE: Self = Self {
        rotation: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        translation: Vector3::new(0.0, 0.0, 0.0),
    };

    fn turned<S: Scalar>(&self, vector: [S; 3]) -> [S; 3] {
        let [x, y, z] = vector;
        core::array::from_fn(|row| {
            x * self.rotation[(row, 0)] + y * self.rotation[(row, 1)] + z * self.rotation[(row, 2)]
        })
    }

    fn placed<S: Scalar>(&self, point: [S; 3]) -> [S; 3] {
        let turned = self.turned(point);
        core::array::from_fn(|row| turned[row] + self.translation[row])
    }

    fn local<S: Scalar>(&self, point: [S; 3]) -> [S; 3] {
        let [x, y, z] = core::array::from_fn(|row| point[row] - self.translation[row]);
        core::array::from_fn(|row| {
            x * self.rotation[(0, row)] + y * self.rotation[(1, row)] + z * self.rotation[(2, row)]
        })
    }
}

/// A point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot<S> {
    /// Where it is [m].
    pub point: [S; 3],
    /// Outward unit vector across the surface.
    pub normal: [S; 3],
}

impl Spot<Taylor> {
    /// The motion of a tool whose focus is here and whose beam is against the normal.
    ///
    /// For mechanisms that choose the tool's axis only: the rates do not turn it about its beam,
    /// but the rotation is [`facing`] the normal anew at each instant.
    pub fn tool(&self) -> ToolMotion {
        let parts = |[x, y, z]: &[Taylor; 3]| {
            [
                Vector3::new(x.value, y.value, z.value),
                Vector3::new(x.first, y.first, z.first),
                Vector3::new(x.second, y.second, z.second),
                Vector3::new(x.third, y.third, z.third),
            ]
        };
        let [position, velocity, acceleration, jerk] = parts(&self.point);
        let [normal, first, second, third] = parts(&self.normal);
        ToolMotion {
            position,
            velocity,
            acceleration,
            jerk,
            // A unit vector turns at n × n′, and at any rate about itself.
            attitude: Attitude {
                rotation: facing(&normal),
                velocity: normal.cross(&first),
                acceleration: normal.cross(&second),
                jerk: first.cross(&second) + normal.cross(&third),
            },
        }
    }
}

/// A rotation of the tool whose z is the unit vector `normal`: the least one from upright, and for a
/// normal that points down the least one from upside down.
pub fn facing(normal: &Vector3<f64>) -> Matrix3<f64> {
    let below = normal.z < 0.0;
    let from = if below { -Vector3::z() } else { Vector3::z() };
    // Rodrigues, with sin = |v|, cos = c: I + [v] + [v]²/(1 + c).
    let lean = from.cross(normal).cross_matrix();
    let turn = Matrix3::identity() + lean + lean * lean / (1.0 + normal.z.abs());
    if below { turn * Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0)) } else { turn }
}

/// The shape of a surface, in its own frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// z = 0.
    Plane,
    /// A frustum of a cone, or a cylinder, about y.
    Cone(Cone),
    /// A sphere about the origin, its near side towards z.
    Sphere(Sphere),
}

/// A surface in its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// What it is.
    pub shape: Shape,
    /// Where it is.
    pub placement: Placement,
}

impl Surface {
    /// The spot onto which the point (x, y) of the drawing [m] comes.
    ///
    /// # Errors
    /// `off_surface` where the drawing goes beyond the surface's edges.
    pub fn spot<S: Scalar>(&self, x: S, y: S) -> Result<Spot<S>, KinematicsError> {
        let spot = match &self.shape {
            Shape::Plane => {
                let (zero, one): (S, S) = (0.0.into(), 1.0.into());
                Spot { point: [x, y, zero], normal: [zero, zero, one] }
            }
            Shape::Cone(cone) => cone.spot(x, y)?,
            Shape::Sphere(sphere) => sphere.spot(x, y)?,
        };
        Ok(Spot {
            point: self.placement.placed(spot.point),
            normal: self.placement.turned(spot.normal),
        })
    }

    /// Only the point of [`Self::spot`] [m].
    ///
    /// # Errors
    /// As there.
    pub fn point<S: Scalar>(&self, x: S, y: S) -> Result<[S; 3], KinematicsError> {
        Ok(self.spot(x, y)?.point)
    }

    /// Only the normal of [`Self::spot`].
    ///
    /// # Errors
    /// As there.
    pub fn normal<S: Scalar>(&self, x: S, y: S) -> Result<[S; 3], KinematicsError> {
        Ok(self.spot(x, y)?.normal)
    }

    /// The outward normal beside a `point` [m] of the workpiece's frame, which may be above or below
    /// the surface, or beyond its edges.
    ///
    /// # Errors
    /// `off_surface` in the axis of a cone or the centre of a sphere, where there is none.
    pub fn normal_beside<S: Scalar>(&self, point: [S; 3]) -> Result<[S; 3], KinematicsError> {
        let local = self.placement.local(point);
        let normal = match &self.shape {
            Shape::Plane => [0.0.into(), 0.0.into(), 1.0.into()],
            Shape::Cone(cone) => cone.normal_beside(local)?,
            Shape::Sphere(sphere) => sphere.normal_beside(local)?,
        };
        Ok(self.placement.turned(normal))
    }

    /// How far a `point` [m] of the workpiece's frame is above the surface, measured across it;
    /// negative inside [m].
    ///
    /// # Errors
    /// As for [`Self::normal_beside`].
    pub fn height<S: Scalar>(&self, point: [S; 3]) -> Result<S, KinematicsError> {
        let local = self.placement.local(point);
        match &self.shape {
            Shape::Plane => Ok(local[2]),
            Shape::Cone(cone) => cone.height(local),
            Shape::Sphere(sphere) => sphere.height(local),
        }
    }
}

/// A drawing, or a point, where the surface is not.
fn off_surface(value: f64, limit: f64, detail: &'static str) -> KinematicsError {
    KinematicsError { code: "off_surface", axis: None, value, limit, detail }
}
