//! A flat curve of a drawing on a surface.

use machine::kinematics::KinematicsError;
use machine::surface::Surface;
use machine::taylor::Taylor;
use nalgebra::Vector3;

use crate::drawing::Curve;
use crate::geometry::arc_length::Parametric;
use crate::geometry::jet::Jet;
use messages::math;

/// Looks along a curve before it is taken to lie on the surface.
const LOOKS: u32 = 256;

/// A flat curve, by the drawing's own parameter from 0 to 1, and the surface that it is put on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Projected {
    curve: Curve,
    surface: Surface,
}

impl Projected {
    /// Puts `curve` on `surface`.
    ///
    /// # Errors
    /// `off_surface` where it goes beyond an edge.
    pub(crate) fn new(curve: &Curve, surface: &Surface) -> Result<Self, KinematicsError> {
        let projected = Self { curve: *curve, surface: *surface };
        for look in 0..=LOOKS {
            let point = curve.point(f64::from(look) / f64::from(LOOKS));
            place(&point, surface)?;
        }
        Ok(projected)
    }

    /// The flat point and its derivatives by the parameter.
    fn flat(&self, parameter: f64) -> [Vector3<f64>; 4] {
        match self.curve {
            Curve::Line { from, to } => {
                let still = Vector3::zeros();
                [from + (to - from) * parameter, to - from, still, still]
            }
            Curve::Arc { centre, major, minor, start, sweep, rise } => {
                let (sine, cosine) = math::sin_cos(start + sweep * parameter);
                let out = major * cosine + minor * sine;
                let onward = (minor * cosine - major * sine) * sweep;
                let square = sweep * sweep;
                [centre + out + rise * parameter, onward + rise, out * -square, onward * -square]
            }
        }
    }
}

/// Where a flat point comes to lie [m]; the drawing's z is the height over the surface.
pub(crate) fn place(
    point: &Vector3<f64>,
    surface: &Surface,
) -> Result<Vector3<f64>, KinematicsError> {
    let spot = surface.spot(point.x, point.y)?;
    Ok(Vector3::from(spot.point) + Vector3::from(spot.normal) * point.z)
}

impl Parametric for Projected {
    fn end(&self) -> f64 {
        1.0
    }

    fn jet(&self, parameter: f64) -> Jet {
        let flat = self.flat(parameter);
        let [x, y, z] = [0, 1, 2]
            .map(|row| Taylor::new(flat[0][row], flat[1][row], flat[2][row], flat[3][row]));
        // A curve was looked along before it was put here; between the looks nothing leaves the
        // surface that the checker would not refuse as no number.
        let series = self.surface.spot(x, y).map_or([Taylor::from(f64::NAN); 3], |spot| {
            core::array::from_fn(|row| spot.point[row] + spot.normal[row] * z)
        });
        let of = |part: fn(&Taylor) -> f64| Vector3::from(series.each_ref().map(part));
        Jet {
            point: of(|series| series.value),
            first: of(|series| series.first),
            second: of(|series| series.second),
            third: of(|series| series.third),
        }
    }
}
