//! Frustums of cones, and cylinders (source 002, projection onto the workpiece).

use messages::math;

use super::{EDGE_TOLERANCE, Spot, off_surface};
use crate::kinematics::KinematicsError;
use crate::taylor::Scalar;

/// What becomes of the drawing's x and y.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Projection {
    /// x on the plane that touches the cone above its axis, seen from the axis: α = atan(x/r). It
    /// stretches; the source has only this.
    Central,
    /// x along the circle about the axis: α = x/r.
    Arc,
    /// Parallel to z: x stays, α = asin(x/r).
    Orthographic,
    /// Unrolled: lengths and angles of the drawing stay; y goes along the slant.
    Developed,
}

impl Projection {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Central, Self::Arc, Self::Orthographic, Self::Developed];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Central => "central",
            Self::Arc => "arc",
            Self::Orthographic => "ortho",
            Self::Developed => "develop",
        }
    }
}

/// A frustum about y, from y = 0 to its height; z is up at the middle of the drawing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    /// Radius at y = 0, R_b [m].
    pub bottom: f64,
    /// Radius at the other end, R_t [m]; the same makes a cylinder, and it may be the larger.
    pub top: f64,
    /// Length along the axis, h [m].
    pub length: f64,
    /// How the drawing is put onto it.
    pub projection: Projection,
}

impl Cone {
    /// Half of the angle at the apex, φ [rad]; negative where the top is wider.
    // Source 002 eq. 15 and 16 halve the difference of the radii, right for diameters only.
    pub fn half_angle(&self) -> f64 {
        math::atan(self.slope())
    }

    fn slope(&self) -> f64 {
        (self.bottom - self.top) / self.length
    }

    /// Sine and cosine of the half angle.
    fn sine_cosine(&self) -> (f64, f64) {
        let slope = self.slope();
        let cosine = 1.0 / (1.0 + slope * slope).sqrt();
        (slope * cosine, cosine)
    }

    /// Radius at `y` along the axis [m].
    // Source 002 eq. 17 grows upwards.
    fn radius<S: Scalar>(&self, y: S) -> S {
        y * -self.slope() + self.bottom
    }

    fn check_length(&self, y: f64) -> Result<(), KinematicsError> {
        // False for a y that is not a number too.
        if y >= -EDGE_TOLERANCE && y <= self.length + EDGE_TOLERANCE {
            return Ok(());
        }
        let limit = if y > self.length { self.length } else { 0.0 };
        Err(off_surface(y, limit, "the drawing goes beyond an end of the cone"))
    }

    /// Angle about the axis [rad] and place along it [m] for a point of the drawing.
    fn place<S: Scalar>(&self, x: S, y: S) -> Result<[S; 2], KinematicsError> {
        if self.projection == Projection::Developed {
            let place = self.unrolled(x, y)?;
            self.check_length(place[1].value())?;
            return Ok(place);
        }
        self.check_length(y.value())?;
        let radius = self.radius(y);
        let angle = match self.projection {
            Projection::Orthographic => {
                // False for an x that is not a number too.
                let hit = x.value().abs() < radius.value();
                if !hit {
                    let detail = "the drawing is wider than the cone, seen from above";
                    return Err(off_surface(x.value(), radius.value(), detail));
                }
                (x / radius).asin()
            }
            // Source 002 eq. 14.
            Projection::Central => x.atan2(radius),
            Projection::Arc | Projection::Developed => x / radius,
        };
        Ok([angle, y])
    }

    /// In the unrolled plane the apex is s_b = R_b/sin φ away; a point at the distance ρ from it
    /// and at the angle β of the plane comes to α = β/sin φ, y = (s_b − ρ)·cos φ. Both multiplied by
    /// sin φ, they stay good down to a cylinder.
    fn unrolled<S: Scalar>(&self, x: S, y: S) -> Result<[S; 2], KinematicsError> {
        let (sine, cosine) = self.sine_cosine();
        let near = y * -sine + self.bottom;
        // False for a number that is none too.
        let this_side = near.value() > 0.0;
        if !this_side {
            return Err(off_surface(near.value(), 0.0, "the drawing goes beyond the cone's apex"));
        }
        let aside = x * sine;
        let far = (aside * aside + near * near).sqrt();
        let angle = if sine == 0.0 { x / near } else { aside.atan2(near) / sine };
        Ok([angle, (y - x * aside / (near + far)) * cosine])
    }

    pub(super) fn spot<S: Scalar>(&self, x: S, y: S) -> Result<Spot<S>, KinematicsError> {
        let [angle, y] = self.place(x, y)?;
        let (aside, up) = angle.sin_cos();
        let radius = self.radius(y);
        // Source 002 eq. 18, which reduces to r·cos α.
        Ok(Spot { point: [radius * aside, y, radius * up], normal: self.across(aside, up) })
    }

    /// The outward normal in the direction (sin α, cos α) from the axis.
    fn across<S: Scalar>(&self, aside: S, up: S) -> [S; 3] {
        let (sine, cosine) = self.sine_cosine();
        [aside * cosine, sine.into(), up * cosine]
    }

    /// Distance from the axis [m].
    fn distance<S: Scalar>([x, _, z]: [S; 3]) -> Result<S, KinematicsError> {
        let square = x * x + z * z;
        if square.value() > 0.0 {
            return Ok(square.sqrt());
        }
        Err(off_surface(square.value().sqrt(), 0.0, "in the axis of a cone there is no normal"))
    }

    pub(super) fn normal_beside<S: Scalar>(
        &self,
        point: [S; 3],
    ) -> Result<[S; 3], KinematicsError> {
        let distance = Self::distance(point)?;
        Ok(self.across(point[0] / distance, point[2] / distance))
    }

    pub(super) fn height<S: Scalar>(&self, point: [S; 3]) -> Result<S, KinematicsError> {
        let (_, cosine) = self.sine_cosine();
        Ok((Self::distance(point)? - self.radius(point[1])) * cosine)
    }
}
