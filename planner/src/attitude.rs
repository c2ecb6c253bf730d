//! How the tool is turned along a path: a function of where it is.

use machine::kinematics::{Attitude, KinematicsError, ToolMotion};
use machine::surface::{Spot, Surface};
use nalgebra::Matrix3;

/// The rule that a job's tool is turned by.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum AttitudeLaw {
    /// Straight down.
    #[default]
    Level,
    /// Turned by this rotation all the time.
    Fixed(Matrix3<f64>),
    /// The beam against the normal of a surface, on it and beside it.
    Normal(Surface),
}

impl AttitudeLaw {
    /// `tool` with the attitude that its motion asks for, up to angular jerk: the normal is a function
    /// of the position, so the position's series is put into it.
    ///
    /// # Errors
    /// Where the surface has no normal, such as in the axis of a cone.
    pub fn apply(&self, tool: &ToolMotion) -> Result<ToolMotion, KinematicsError> {
        match self {
            Self::Level => Ok(*tool),
            Self::Fixed(rotation) => {
                Ok(ToolMotion { attitude: Attitude::fixed(*rotation), ..*tool })
            }
            Self::Normal(surface) => {
                let point = tool.series();
                let normal = surface.normal_beside(point)?;
                Ok(ToolMotion { attitude: Spot { point, normal }.tool().attitude, ..*tool })
            }
        }
    }
}

/// The rotation by `roll` about x, then `pitch` about y, then `yaw` about z [rad], all of the
/// machine's frame.
pub fn turned(roll: f64, pitch: f64, yaw: f64) -> Matrix3<f64> {
    let rows = |angle: f64| signals::math::sin_cos(angle);
    let ((sr, cr), (sp, cp), (sy, cy)) = (rows(roll), rows(pitch), rows(yaw));
    let about_x = Matrix3::new(1.0, 0.0, 0.0, 0.0, cr, -sr, 0.0, sr, cr);
    let about_y = Matrix3::new(cp, 0.0, sp, 0.0, 1.0, 0.0, -sp, 0.0, cp);
    let about_z = Matrix3::new(cy, -sy, 0.0, sy, cy, 0.0, 0.0, 0.0, 1.0);
    about_z * about_y * about_x
}
