//! Spheres.

use super::{Spot, off_surface};
use crate::kinematics::KinematicsError;
use crate::taylor::Scalar;

/// What becomes of the drawing's x and y; a sphere cannot be unrolled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SphereProjection {
    /// From the plane that touches the sphere at its top, towards the centre.
    Central,
    /// Parallel to z.
    Orthographic,
}

/// A sphere about the origin; the drawing's origin comes to its top, at z = radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// [m].
    pub radius: f64,
    /// How the drawing is put onto it.
    pub projection: SphereProjection,
}

impl Sphere {
    pub(super) fn spot<S: Scalar>(&self, x: S, y: S) -> Result<Spot<S>, KinematicsError> {
        let square = x * x + y * y;
        let radius = self.radius;
        let normal = match self.projection {
            SphereProjection::Central => {
                let length = (square + radius * radius).sqrt();
                let up: S = radius.into();
                [x / length, y / length, up / length]
            }
            SphereProjection::Orthographic => {
                let up = -square + radius * radius;
                // False for a number that is none too.
                let hit = up.value() > 0.0;
                if !hit {
                    let detail = "the drawing is wider than the sphere, seen from above";
                    return Err(off_surface(square.value().sqrt(), radius, detail));
                }
                [x / radius, y / radius, up.sqrt() / radius]
            }
        };
        Ok(Spot { point: normal.map(|part| part * radius), normal })
    }

    fn distance<S: Scalar>(point: [S; 3]) -> Result<S, KinematicsError> {
        let square = point[0] * point[0] + point[1] * point[1] + point[2] * point[2];
        if square.value() > 0.0 {
            return Ok(square.sqrt());
        }
        Err(off_surface(square.value().sqrt(), 0.0, "in the centre of a sphere there is no normal"))
    }

    pub(super) fn normal_beside<S: Scalar>(
        &self,
        point: [S; 3],
    ) -> Result<[S; 3], KinematicsError> {
        let distance = Self::distance(point)?;
        Ok(point.map(|part| part / distance))
    }

    pub(super) fn height<S: Scalar>(&self, point: [S; 3]) -> Result<S, KinematicsError> {
        Ok(Self::distance(point)? - self.radius)
    }
}
