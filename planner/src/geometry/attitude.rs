//! How the tool is turned along a path: a function of where it is.

use machine::kinematics::{Attitude, KinematicsError, ToolMotion};
use machine::surface::Surface;
use machine::taylor::{Scalar, Taylor};
use nalgebra::{Matrix3, Vector3};

/// The rule that a job's tool is turned by.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum AttitudeLaw {
    /// Straight down.
    #[default]
    Level,
    /// As the path says: at a place of it, on the way to it and from it.
    AlongPath,
    /// Turned by this rotation all the time.
    Fixed(Matrix3<f64>),
    /// The beam against the normal of a surface, on it and beside it.
    Normal(Surface),
    /// Turned by [`Self::Fixed`]'s rotation `base`, then leaning the more the farther the tool is
    /// from `center`: the rotation vector is `gradient · (z × (position − center))`.
    Following {
        /// Where it does not lean [m].
        center: Vector3<f64>,
        /// Lean per distance across z, away from the centre where above 0 [rad/m].
        gradient: f64,
        /// The rotation at the centre.
        base: Matrix3<f64>,
    },
}

impl AttitudeLaw {
    /// `tool` with the attitude that its motion asks for, up to angular jerk: the normal is a function
    /// of the position, so the position's series is put into it.
    ///
    /// # Errors
    /// Where the surface has no normal, such as in the axis of a cone.
    #[inline]
    pub fn apply(&self, tool: &ToolMotion) -> Result<ToolMotion, KinematicsError> {
        match self {
            Self::Level | Self::AlongPath => Ok(*tool),
            Self::Fixed(rotation) => {
                Ok(ToolMotion { attitude: Attitude::fixed(*rotation), ..*tool })
            }
            Self::Normal(surface) => {
                let normal = surface.normal_beside(tool.series())?;
                Ok(ToolMotion { attitude: moving(&facing(normal)), ..*tool })
            }
            Self::Following { center, gradient, base } => {
                let [x, y, _] = tool.series();
                let lean =
                    [(y - center.y) * -gradient, (x - center.x) * *gradient, Taylor::from(0.0)];
                Ok(ToolMotion { attitude: moving(&times(&exponential(lean), base)), ..*tool })
            }
        }
    }
}

/// A matrix, row by row.
pub(super) type Rows<S> = [[S; 3]; 3];

/// The attitude whose rotation is this series: R′ = ω × R, so that [ω] = R′·Rᵀ.
pub(super) fn moving(rotation: &Rows<Taylor>) -> Attitude {
    let spin = |row: usize, column: usize| {
        let term = |k: usize| rotation[row][k].derivative() * rotation[column][k];
        term(0) + term(1) + term(2)
    };
    // A derivative has no third of its own, and the product needs none.
    let turn = [spin(2, 1), spin(0, 2), spin(1, 0)];
    let part = |of: fn(&Taylor) -> f64| Vector3::from(turn.each_ref().map(of));
    Attitude {
        rotation: Matrix3::from_fn(|row, column| rotation[row][column].value),
        velocity: part(|rate| rate.value),
        acceleration: part(|rate| rate.first),
        jerk: part(|rate| rate.second),
    }
}

/// `1 + first·[v] + second·[v]²`, with [v] the matrix of the cross product with v.
fn about<S: Scalar>(vector: [S; 3], first: S, second: S) -> Rows<S> {
    let [x, y, z] = vector;
    let zero = S::from(0.0);
    let cross = [[zero, -z, y], [z, zero, -x], [-y, x, zero]];
    let square = x * x + y * y + z * z;
    core::array::from_fn(|row| {
        core::array::from_fn(|column| {
            // [v]² = v·vᵀ − |v|².
            let outer = vector[row] * vector[column];
            let entry = cross[row][column] * first;
            if row == column {
                entry + (outer - square) * second + 1.0
            } else {
                entry + outer * second
            }
        })
    })
}

/// The rotation by the length of `vector` [rad] about it (Rodrigues).
pub(super) fn exponential<S: Scalar>(vector: [S; 3]) -> Rows<S> {
    /// Terms of the power series of sin θ/θ and (1 − cos θ)/θ² in θ², which unlike the closed forms
    /// have derivatives at 0: the next is below rounding for all θ up to half a turn.
    const TERMS: u32 = 16;
    let [x, y, z] = vector;
    let square = x * x + y * y + z * z;
    let (mut sine, mut cosine) = (S::from(1.0), S::from(1.0));
    for term in (1..=TERMS).rev() {
        let twice = f64::from(2 * term);
        sine = -(square * sine) / (twice * (twice + 1.0)) + 1.0;
        cosine = -(square * cosine) / ((twice + 1.0) * (twice + 2.0)) + 1.0;
    }
    about(vector, sine, cosine * 0.5)
}

/// A rotation of the tool whose z is the unit vector `normal`, as [`machine::surface::facing`] gives
/// it, at all orders.
fn facing<S: Scalar>(normal: [S; 3]) -> Rows<S> {
    let [x, y, z] = normal;
    let below = z.value() < 0.0;
    let sign = if below { -1.0 } else { 1.0 };
    // Rodrigues with sin·axis = ±z × normal, cos = |z|.
    let lean = [y * -sign, x * sign, S::from(0.0)];
    let one = S::from(1.0);
    let turn = about(lean, one, one / (z * sign + 1.0));
    let upside_down = [1.0, sign, sign];
    turn.map(|row| core::array::from_fn(|column| row[column] * upside_down[column]))
}

/// A fixed rotation, row by row.
pub(super) fn rows<S: Scalar>(rotation: &Matrix3<f64>) -> Rows<S> {
    core::array::from_fn(|row| core::array::from_fn(|column| S::from(rotation[(row, column)])))
}

/// `one` after `other`.
pub(super) fn product<S: Scalar>(one: &Rows<S>, other: &Rows<S>) -> Rows<S> {
    one.map(|[x, y, z]| {
        core::array::from_fn(|column| {
            x * other[0][column] + y * other[1][column] + z * other[2][column]
        })
    })
}

/// `rows` after `base`.
fn times<S: Scalar>(rows: &Rows<S>, base: &Matrix3<f64>) -> Rows<S> {
    rows.map(|[x, y, z]| {
        core::array::from_fn(|column| {
            x * base[(0, column)] + y * base[(1, column)] + z * base[(2, column)]
        })
    })
}

/// The rotation by `roll` about x, then `pitch` about y, then `yaw` about z [rad], all of the
/// machine's frame.
pub fn turned(roll: f64, pitch: f64, yaw: f64) -> Matrix3<f64> {
    let rows = |angle: f64| messages::math::sin_cos(angle);
    let ((sr, cr), (sp, cp), (sy, cy)) = (rows(roll), rows(pitch), rows(yaw));
    let about_x = Matrix3::new(1.0, 0.0, 0.0, 0.0, cr, -sr, 0.0, sr, cr);
    let about_y = Matrix3::new(cp, 0.0, sp, 0.0, 1.0, 0.0, -sp, 0.0, cp);
    let about_z = Matrix3::new(cy, -sy, 0.0, sy, cy, 0.0, 0.0, 0.0, 1.0);
    about_z * about_y * about_x
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use machine::surface::{Cone, Placement, Projection, Shape};

    /// A motion that bends in all directions, `time` [s] after one instant of it.
    fn tool(time: f64) -> ToolMotion {
        let [p, v, a, j] = [
            Vector3::new(0.011, -0.007, 0.06),
            Vector3::new(0.05, 0.08, -0.02),
            Vector3::new(-0.4, 0.3, 0.2),
            Vector3::new(3.0, -5.0, 2.0),
        ];
        ToolMotion {
            position: p + (v + (a / 2.0 + j * (time / 6.0)) * time) * time,
            velocity: v + (a + j * (time / 2.0)) * time,
            acceleration: a + j * time,
            jerk: j,
            attitude: Attitude::LEVEL,
        }
    }

    /// Rates against central differences of rotations, and a rotation that is one.
    #[track_caller]
    fn check(law: &AttitudeLaw) -> Attitude {
        let step = 1e-5;
        let at = |time: f64| law.apply(&tool(time)).unwrap().attitude;
        let (behind, here, ahead) = (at(-step), at(0.0), at(step));
        let rotation = here.rotation;
        assert!((rotation * rotation.transpose() - Matrix3::identity()).amax() < 1e-14);
        assert!((rotation.determinant() - 1.0).abs() < 1e-14);
        let spin = (ahead.rotation - behind.rotation) / (2.0 * step) * rotation.transpose();
        let expected = Vector3::new(spin[(2, 1)], spin[(0, 2)], spin[(1, 0)]);
        assert!((here.velocity - expected).amax() < 1e-6, "{} {expected}", here.velocity);
        let expected = (ahead.velocity - behind.velocity) / (2.0 * step);
        assert!((here.acceleration - expected).amax() < 1e-5, "{} {expected}", here.acceleration);
        let expected = (ahead.acceleration - behind.acceleration) / (2.0 * step);
        let most = 1e-5 * (1.0 + here.jerk.amax());
        assert!((here.jerk - expected).amax() < most, "{} {expected}", here.jerk);
        here
    }

    #[test]
    fn an_attitude_that_follows_the_position_has_its_rates() {
        let base = turned(0.2, -0.1, 0.4);
        for (center, gradient) in
            [(Vector3::zeros(), 8.0), (Vector3::new(0.011, -0.007, 0.0), -6.0)]
        {
            let found = check(&AttitudeLaw::Following { center, gradient, base });
            let off = tool(0.0).position - center;
            // Leaning away by gradient · distance: the angle between the base's axis and the tool's.
            let turn = found.rotation * base.transpose();
            let up = turn.column(2).into_owned();
            let lean = messages::math::atan2(up.xy().norm(), up.z);
            assert!((lean - (gradient * off.xy().norm()).abs()).abs() < 1e-14, "{lean}");
            assert!(up.xy().dot(&off.xy()) * gradient >= 0.0);
        }
    }

    #[test]
    fn an_attitude_against_a_surface_has_the_rates_of_its_whole_frame() {
        let cone =
            Cone { bottom: 0.05, top: 0.03, length: 0.08, projection: Projection::Developed };
        for (roll, sign) in [(0.3, 1.0), (3.3, -1.0)] {
            let placement = Placement {
                rotation: turned(roll, 0.2, 0.1),
                translation: Vector3::new(0.0, 0.0, 0.06 - 0.05 * sign),
            };
            let surface = Surface { shape: Shape::Cone(cone), placement };
            let found = check(&AttitudeLaw::Normal(surface));
            let normal = surface.normal_beside(tool(0.0).position.into()).unwrap();
            let expected = machine::surface::facing(&Vector3::from(normal));
            assert!((found.rotation - expected).amax() < 1e-14);
        }
    }
}
