//! Arcs of G2 and G3: from what a program writes to centre, semi-axes, sweep and rise.

use core::f64::consts::{FRAC_PI_2, PI, SQRT_2, TAU};

use messages::math;
use nalgebra::Vector3;

use super::codes::{INCH, MILLIMETRE, Plane};
use crate::drawing::Curve;

/// Below this two points are one [m].
pub(super) const SAME_POINT: f64 = 1e-9;

/// Below this a gap is the arithmetic's own, and a circle stays a circle [m].
const ROUND_OFF: f64 = 1e-12;

// The two radii of an arc may differ by what rounding in a file leaves, as in LinuxCNC and Grbl, so
// that a file which runs there is read here.
/// Difference of the radii that is never accepted [m].
const MISMATCH: f64 = 0.5e-3;
/// Difference relative to the radius that is accepted up to there.
const RELATIVE: f64 = 1e-3;

/// Difference of the radii that is always accepted [m]: what centre and end leave when they are
/// rounded to 0.01 mm or 0.001 in, in the worst direction.
pub(super) fn rounding(unit: f64) -> f64 {
    let last_digit = if unit == INCH { 1e-3 } else { 1e-2 };
    2.0 * SQRT_2 * last_digit * unit
}

/// How a program says where an arc's centre is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Form {
    /// I, J, K, resolved: the centre in the machine frame [m]; its part along the plane's normal
    /// is not looked at.
    Centre(Vector3<f64>),
    /// R: the radius, negative for the longer way round [m].
    Radius(f64),
}

/// Why there is no such arc; lengths in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum NoArc {
    /// The centre is the start.
    ZeroRadius,
    /// The radii at start and end, and what they may differ by.
    Radii(f64, f64, f64),
    /// R, and half the distance between the ends.
    TooFar(f64, f64),
    /// R with both ends in one point.
    ClosedRadius,
}

impl NoArc {
    /// Message and advice.
    pub(super) fn explain(self) -> (String, String) {
        let millimetres = |length: f64| length / MILLIMETRE;
        match self {
            Self::ZeroRadius => (
                "the centre of the arc is its start: the radius is 0".to_owned(),
                "I, J and K lead from the start to the centre (G91.1), or are the centre (G90.1)"
                    .to_owned(),
            ),
            Self::Radii(start, end, allowed) => (
                format!(
                    "the arc's radius is {:.6} mm at its start and {:.6} mm at its end",
                    millimetres(start),
                    millimetres(end)
                ),
                format!(
                    "they may differ by {:.3} mm: is the centre incremental (G91.1) or absolute \
                     (G90.1)?",
                    millimetres(allowed)
                ),
            ),
            Self::TooFar(radius, half) => (
                format!(
                    "the arc's radius of {:.6} mm cannot reach an end {:.6} mm away",
                    millimetres(radius),
                    2.0 * millimetres(half)
                ),
                format!("R must be at least {:.6} mm", millimetres(half)),
            ),
            Self::ClosedRadius => (
                "an arc with R ends where it starts: its centre could be anywhere".to_owned(),
                "write a full circle with I, J or K".to_owned(),
            ),
        }
    }
}

/// An arc that starts at φ = 0: `p(φ) = centre + major·cos φ + minor·sin φ + rise·φ/sweep`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Arc {
    pub(super) centre: Vector3<f64>,
    pub(super) major: Vector3<f64>,
    pub(super) minor: Vector3<f64>,
    pub(super) sweep: f64,
    pub(super) rise: Vector3<f64>,
}

/// Axes of a plane: the two in it and its normal, right-handed.
pub(super) fn axes(plane: Plane) -> [usize; 3] {
    match plane {
        Plane::Xy => [0, 1, 2],
        Plane::Zx => [2, 0, 1],
        Plane::Yz => [1, 2, 0],
    }
}

impl Arc {
    /// The arc from `start` to `end` in `plane`, passing the end's angle `turns` times.
    ///
    /// It starts and ends exactly there, and whatever the two radii differ by is absorbed between.
    pub(super) fn new(
        plane: Plane,
        counterclockwise: bool,
        start: Vector3<f64>,
        end: Vector3<f64>,
        form: Form,
        turns: f64,
        rounding: f64,
    ) -> Result<Self, NoArc> {
        let [u, v, w] = axes(plane);
        let from = [start[u], start[v]];
        let to = [end[u], end[v]];
        let chord = [to[0] - from[0], to[1] - from[1]];
        let distance = math::hypot(chord[0], chord[1]);
        let closed = distance < SAME_POINT;
        let mut centre = match form {
            Form::Centre(centre) => [centre[u], centre[v]],
            Form::Radius(radius) => {
                by_radius(counterclockwise, from, chord, distance, radius, rounding)?
            }
        };
        let (radius, end_radius) = (span(centre, from), span(centre, to));
        if radius < SAME_POINT {
            return Err(NoArc::ZeroRadius);
        }
        let mismatch = (end_radius - radius).abs();
        let allowed = rounding.max((RELATIVE * radius).min(MISMATCH));
        if mismatch > allowed {
            return Err(NoArc::Radii(radius, end_radius, allowed));
        }
        let first = if closed { TAU } else { angle(centre, from, to, counterclockwise) };
        let extra = TAU * (turns - 1.0);
        let mut sweep = first + extra;
        let mut drift = [0.0; 2];
        // The centre of a true circle through both ends lies on the bisector of the chord. Going
        // there moves it along the chord by `slip`, which is of the order of the mismatch unless
        // the ends are close together; then the end is reached by a drift along the way instead.
        let slip = if closed {
            f64::INFINITY
        } else {
            let middle = [from[0] + 0.5 * chord[0], from[1] + 0.5 * chord[1]];
            dot([middle[0] - centre[0], middle[1] - centre[1]], chord) / distance
        };
        if sweep <= PI + FRAC_PI_2 && slip.abs() <= 0.5 * radius {
            centre =
                [centre[0] + slip * chord[0] / distance, centre[1] + slip * chord[1] / distance];
            sweep = angle(centre, from, to, counterclockwise) + extra;
        } else {
            let arm = [from[0] - centre[0], from[1] - centre[1]];
            let signed = if counterclockwise { sweep } else { -sweep };
            let (sine, cosine) = math::sin_cos(if closed { 0.0 } else { signed });
            drift = [
                to[0] - (centre[0] + arm[0] * cosine - arm[1] * sine),
                to[1] - (centre[1] + arm[0] * sine + arm[1] * cosine),
            ];
            if math::hypot(drift[0], drift[1]) < ROUND_OFF {
                drift = [0.0; 2];
            }
        }
        let arm = [from[0] - centre[0], from[1] - centre[1]];
        let place = |in_plane: [f64; 2], normal: f64| {
            let mut vector = Vector3::zeros();
            vector[u] = in_plane[0];
            vector[v] = in_plane[1];
            vector[w] = normal;
            vector
        };
        Ok(Self {
            centre: place(centre, start[w]),
            major: place(arm, 0.0),
            minor: place([-arm[1], arm[0]], 0.0),
            sweep: if counterclockwise { sweep } else { -sweep },
            rise: place(drift, end[w] - start[w]),
        })
    }

    /// The point at angle `phi` [m].
    pub(super) fn point(&self, phi: f64) -> Vector3<f64> {
        let (sine, cosine) = math::sin_cos(phi);
        self.centre + self.major * cosine + self.minor * sine + self.rise * (phi / self.sweep)
    }

    /// Its length as a helix [m]; a drift within the plane, some micrometres, is not counted.
    pub(super) fn length(&self) -> f64 {
        let normal = self.major.cross(&self.minor).normalize();
        math::hypot(self.major.norm() * self.sweep, self.rise.dot(&normal))
    }

    /// How far it lies from its chord [m]; infinite for half a turn and more.
    pub(super) fn sagitta(&self) -> f64 {
        if self.sweep.abs() < PI {
            let half = math::sin(0.25 * self.sweep);
            2.0 * self.major.norm() * half * half
        } else {
            f64::INFINITY
        }
    }

    /// The angles between start and end at which one of the three coordinates turns back.
    pub(super) fn turning_angles(&self, axis: usize) -> impl Iterator<Item = f64> + use<> {
        let (sweep, steps) = (self.sweep, (self.sweep.abs() / PI).ceil());
        let first = math::atan2(self.minor[axis], self.major[axis]);
        let offset = first - PI * (first / PI).floor();
        // `offset` is in 0..=π: counted upwards from the start, or downwards by its complement.
        let next = if sweep > 0.0 { offset } else { offset - PI };
        let step = if sweep > 0.0 { PI } else { -PI };
        (0..=steps as u64)
            .map(move |index| next + step * index as f64)
            .filter(move |&phi| phi != 0.0 && phi.abs() < sweep.abs())
    }

    /// It as a curve of a drawing.
    pub(super) fn curve(&self) -> Curve {
        Curve::Arc {
            centre: self.centre,
            major: self.major,
            minor: self.minor,
            start: 0.0,
            sweep: self.sweep,
            rise: self.rise,
        }
    }
}

/// The centre for R: left of the chord for the shorter way counterclockwise.
fn by_radius(
    counterclockwise: bool,
    from: [f64; 2],
    chord: [f64; 2],
    distance: f64,
    radius: f64,
    rounding: f64,
) -> Result<[f64; 2], NoArc> {
    if distance < SAME_POINT {
        return Err(NoArc::ClosedRadius);
    }
    let half = 0.5 * distance;
    let size = radius.abs();
    if half - size > rounding.max((RELATIVE * size).min(MISMATCH)) {
        return Err(NoArc::TooFar(size, half));
    }
    // Factored, so that a radius near half the chord keeps its digits.
    let height = ((size - half) * (size + half)).max(0.0).sqrt();
    let left = if counterclockwise == (radius > 0.0) { height } else { -height };
    Ok([
        from[0] + 0.5 * chord[0] - left * chord[1] / distance,
        from[1] + 0.5 * chord[1] + left * chord[0] / distance,
    ])
}

/// The angle from `from` to `to` around `centre` in the given direction, above 0 up to a turn.
fn angle(centre: [f64; 2], from: [f64; 2], to: [f64; 2], counterclockwise: bool) -> f64 {
    let a = [from[0] - centre[0], from[1] - centre[1]];
    let b = [to[0] - centre[0], to[1] - centre[1]];
    let cross = a[0] * b[1] - a[1] * b[0];
    let angle = math::atan2(if counterclockwise { cross } else { -cross }, dot(a, b));
    if angle > 0.0 { angle } else { angle + TAU }
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn span(a: [f64; 2], b: [f64; 2]) -> f64 {
    math::hypot(b[0] - a[0], b[1] - a[1])
}
