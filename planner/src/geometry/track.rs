//! One curve of a drawing taken by arc length.

use std::sync::Arc;

use machine::kinematics::KinematicsError;
use machine::surface::Surface;
use messages::math;
use nalgebra::Vector3;

use crate::drawing::Curve;
use crate::geometry::arc_length::{ByArcLength, Parametric};
use crate::geometry::cubic::Cubic;
use crate::geometry::jet::{Jet, larger};
use crate::geometry::projected::Projected;
use crate::geometry::spline::Spline;

/// Steps of the table for a whole turn of an ellipse, before it is refined.
const STEPS_PER_TURN: f64 = 64.0;

/// How far the two semi-axes of a circle may differ, and how far from perpendicular its helix
/// axis may be, before the arc is taken by a table [1].
const ROUND: f64 = 1e-12;

/// Looks along a curve on a surface, and along a cubic, for where it bends most: a top between two of them
/// is higher than both by less than [`BETWEEN`].
const PROJECTED_LOOKS: u32 = 1024;
const CUBIC_LOOKS: u32 = 128;
const BETWEEN: f64 = 1.001;

/// A curve by arc length.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Track {
    /// Straight.
    Line { from: Vector3<f64>, direction: Vector3<f64>, length: f64 },
    /// A circle or helix, whose angle goes evenly with arc length.
    Circle { arc: Arc<Ellipse>, length: f64 },
    /// Any other arc.
    Ellipse(Arc<ByArcLength<Ellipse>>),
    /// A flat curve on a surface.
    Projected(Arc<ByArcLength<Projected>>),
    /// A cubic between two points of a smooth curve.
    Cubic(Arc<ByArcLength<Cubic>>),
    /// A smooth curve through a dense polyline, and the vertices that it stands for.
    Spline { spline: Arc<Spline>, vertices: Arc<[Vector3<f64>]> },
    /// A stretch of another curve from this distance on.
    Part { of: Box<Self>, from: f64, length: f64 },
}

/// An arc of a [`Curve`] by the angle from its start, which is positive whatever its sense.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ellipse {
    centre: Vector3<f64>,
    major: Vector3<f64>,
    minor: Vector3<f64>,
    start: f64,
    sense: f64,
    sweep: f64,
    rise: Vector3<f64>,
}

/// The largest curvature [1/m] and the largest third derivative by arc length [1/m²].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Bend {
    pub(crate) curvature: f64,
    pub(crate) third: f64,
}

impl Parametric for Ellipse {
    fn end(&self) -> f64 {
        self.sweep
    }

    fn jet(&self, parameter: f64) -> Jet {
        let (sine, cosine) = math::sin_cos(self.start + self.sense * parameter);
        let out = self.major * cosine + self.minor * sine;
        let onward = (self.minor * cosine - self.major * sine) * self.sense;
        Jet {
            point: self.centre + out + self.rise * parameter,
            first: onward + self.rise,
            second: -out,
            third: -onward,
        }
    }
}

impl Ellipse {
    /// The largest value on the arc of a function of a point and its derivatives by arc length.
    ///
    /// By angle the sharp ends of a flat ellipse are as wide as the rest; the best of even samples
    /// is refined between its neighbours.
    fn largest(&self, of: impl Fn(&Jet) -> f64) -> f64 {
        const SAMPLES_PER_TURN: f64 = 256.0;
        const REFINEMENTS: usize = 24;
        let value = |angle: f64| of(&self.jet(angle).by_arc_length());
        let count = (self.sweep / math::TURN * SAMPLES_PER_TURN).ceil().max(16.0) as usize;
        let step = self.sweep / count as f64;
        let (mut best, mut most) = (0.0, 0.0);
        for index in 0..=count {
            let found = value(step * index as f64);
            if found > most {
                (best, most) = (step * index as f64, found);
            }
        }
        // Ternary search: the function has one top between the neighbours of the best sample.
        let (mut low, mut high) = ((best - step).max(0.0), (best + step).min(self.sweep));
        for _ in 0..REFINEMENTS {
            let (left, right) = ((2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0);
            let (at_left, at_right) = (value(left), value(right));
            most = most.max(at_left).max(at_right);
            if at_left < at_right {
                low = left;
            } else {
                high = right;
            }
        }
        most
    }
}

impl Track {
    /// How much memory it takes, about, in vertices: 1 for a curve by itself.
    pub(crate) fn weight(&self) -> usize {
        match self {
            Self::Spline { vertices, .. } => vertices.len().max(1),
            Self::Part { of, .. } => of.weight(),
            _ => 1,
        }
    }

    /// Takes `curve` by arc length.
    pub(crate) fn new(curve: &Curve) -> Self {
        match *curve {
            Curve::Line { from, to } => {
                let length = (to - from).norm();
                let direction = if length > 0.0 { (to - from) / length } else { Vector3::zeros() };
                Self::Line { from, direction, length }
            }
            Curve::Arc { centre, major, minor, start, sweep, rise } => {
                let rise = rise / sweep.abs();
                let sense = sweep.signum();
                let arc = Ellipse { centre, major, minor, start, sense, sweep: sweep.abs(), rise };
                let (square, other) = (major.norm_squared(), minor.norm_squared());
                let scale = square.max(other);
                let round = (square - other).abs() <= ROUND * scale
                    && major.dot(&minor).abs() <= ROUND * scale
                    && rise.dot(&major).abs() <= ROUND * scale
                    && rise.dot(&minor).abs() <= ROUND * scale;
                if round {
                    let length = (square + rise.norm_squared()).sqrt() * arc.sweep;
                    return Self::Circle { arc: Arc::new(arc), length };
                }
                let steps = (arc.sweep / math::TURN * STEPS_PER_TURN).ceil() as usize;
                Self::Ellipse(Arc::new(ByArcLength::new(arc, steps)))
            }
        }
    }

    /// Takes `curve` as it lies on `surface`, or as it is drawn.
    ///
    /// # Errors
    /// Where it goes beyond an edge of the surface.
    pub(crate) fn on(curve: &Curve, surface: Option<&Surface>) -> Result<Self, KinematicsError> {
        let Some(surface) = surface else { return Ok(Self::new(curve)) };
        let projected = Projected::new(curve, surface)?;
        Ok(Self::Projected(Arc::new(ByArcLength::new(projected, STEPS_PER_TURN as usize))))
    }

    /// [m].
    pub(crate) fn length(&self) -> f64 {
        match self {
            Self::Line { length, .. } | Self::Circle { length, .. } | Self::Part { length, .. } => {
                *length
            }
            Self::Ellipse(table) => table.length(),
            Self::Projected(table) => table.length(),
            Self::Cubic(table) => table.length(),
            Self::Spline { spline, .. } => spline.length(),
        }
    }

    /// The point and its derivatives at `distance` from the start [m].
    pub(crate) fn at(&self, distance: f64) -> Jet {
        self.at_near(distance, &mut 0)
    }

    /// The same, with the number of a spline's piece looked for from `near` on.
    #[inline]
    pub(crate) fn at_near(&self, distance: f64, near: &mut usize) -> Jet {
        match self {
            Self::Line { from, direction, .. } => Jet {
                point: from + direction * distance,
                first: *direction,
                second: Vector3::zeros(),
                third: Vector3::zeros(),
            },
            Self::Circle { arc, length } => {
                let rate = arc.sweep / length;
                let jet = arc.jet(distance * rate);
                Jet {
                    point: jet.point,
                    first: jet.first * rate,
                    second: jet.second * (rate * rate),
                    third: jet.third * (rate * rate * rate),
                }
            }
            Self::Ellipse(table) => table.at(distance),
            Self::Projected(table) => table.at(distance),
            Self::Cubic(table) => table.at(distance),
            Self::Spline { spline, .. } => spline.at_near(distance, near),
            Self::Part { of, from, .. } => of.at_near(from + distance, near),
        }
    }

    /// As [`Self::at`], just before `distance`, where the third derivative may jump.
    pub(crate) fn before(&self, distance: f64, near: &mut usize) -> Jet {
        match self {
            Self::Spline { spline, .. } => spline.before(distance, near),
            Self::Part { of, from, .. } => of.before(from + distance, near),
            _ => self.at(distance),
        }
    }

    /// Where its third derivative jumps, from a little before `start` on [m], growing.
    pub(crate) fn knots(&self, start: f64) -> Box<dyn Iterator<Item = f64> + '_> {
        /// More than rounding makes of a place on a path [m].
        const ROUNDING: f64 = 1e-9;
        match self {
            Self::Spline { spline, .. } => {
                let first = spline.knots().partition_point(|knot| *knot < start - ROUNDING);
                Box::new(spline.knots()[first..].iter().copied())
            }
            Self::Part { of, from, .. } => {
                Box::new(of.knots(from + start).map(move |knot| knot - from))
            }
            _ => Box::new(core::iter::empty()),
        }
    }

    /// The stretch between two distances from the start [m].
    pub(crate) fn part(&self, from: f64, to: f64) -> Self {
        let length = to - from;
        if from <= 0.0 && to >= self.length() {
            return self.clone();
        }
        match self {
            Self::Line { direction, .. } => {
                Self::Line { from: self.at(from).point, direction: *direction, length }
            }
            Self::Part { of, from: before, .. } => {
                Self::Part { of: of.clone(), from: before + from, length }
            }
            _ => Self::Part { of: Box::new(self.clone()), from, length },
        }
    }

    /// How sharply it bends at most.
    pub(crate) fn bend(&self) -> Bend {
        match self {
            Self::Line { .. } => Bend::default(),
            Self::Circle { .. } => Bend::of(&self.at(0.0)),
            Self::Ellipse(table) => Bend {
                curvature: table.curve().largest(|jet| jet.second.norm()),
                third: table.curve().largest(|jet| jet.third.norm()),
            },
            Self::Projected(table) => table.bend(PROJECTED_LOOKS),
            Self::Cubic(table) => table.bend(CUBIC_LOOKS),
            Self::Spline { spline, .. } => spline
                .jets()
                .iter()
                .map(|jet| Bend::of(&jet.by_arc_length()))
                .fold(Bend::default(), Bend::or),
            Self::Part { of, .. } => of.bend(),
        }
    }

    /// Points on the curve from its start (left out) to its end such that no chord is farther
    /// than `chord_error` from it.
    pub(crate) fn sample(&self, chord_error: f64, points: &mut Vec<[f64; 3]>) {
        self.visit(chord_error, &mut |point| {
            points.push(point);
            true
        });
    }

    /// Hands the points of [`Self::sample`] to `take` as long as it wants more. Says whether it took all.
    pub(crate) fn visit(&self, chord_error: f64, take: &mut dyn FnMut([f64; 3]) -> bool) -> bool {
        if let Self::Spline { vertices, .. } = self {
            return vertices.iter().skip(1).all(|vertex| take(<[f64; 3]>::from(*vertex)));
        }
        let curvature = self.bend().curvature;
        // Sagitta of a chord of length c on curvature κ: κ·c²/8.
        let chord =
            if curvature > 0.0 { (8.0 * chord_error / curvature).sqrt() } else { f64::INFINITY };
        let count = ((self.length() / chord).ceil() as usize).max(1);
        (1..=count).all(|index| {
            let point = self.at(self.length() * index as f64 / count as f64).point;
            take([point.x, point.y, point.z])
        })
    }
}

impl<C: Parametric> ByArcLength<C> {
    /// How sharply it bends at most, as found at so many places.
    fn bend(&self, looks: u32) -> Bend {
        let curve = self.curve();
        let looks = (0..=looks).map(|look| curve.end() * f64::from(look) / f64::from(looks));
        let bend = looks
            .map(|parameter| Bend::of(&curve.jet(parameter).by_arc_length()))
            .fold(Bend::default(), Bend::or);
        Bend { curvature: bend.curvature * BETWEEN, third: bend.third * BETWEEN }
    }
}

impl Bend {
    /// That of one point.
    pub(crate) fn of(jet: &Jet) -> Self {
        Self { curvature: jet.second.norm(), third: jet.third.norm() }
    }

    /// The larger of both.
    pub(crate) fn or(self, other: Self) -> Self {
        Self {
            curvature: larger(self.curvature, other.curvature),
            third: larger(self.third, other.third),
        }
    }

    /// The largest constant speed within `acceleration` and `jerk`: V²κ ≤ A and V³|p‴| ≤ J; 0 where it is
    /// not known how sharply the curve bends.
    pub(crate) fn speed(&self, acceleration: f64, jerk: f64) -> f64 {
        if self.curvature.is_nan() || self.third.is_nan() {
            return 0.0;
        }
        let lateral = (acceleration / self.curvature).sqrt();
        lateral.min(math::cbrt(jerk / self.third))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bend_that_is_no_number_allows_no_speed_whatever_is_beside_it() {
        let known = Bend { curvature: 100.0, third: 1e4 };
        assert!(known.speed(1.0, 10.0) > 0.0);
        for unknown in [Bend { curvature: f64::NAN, ..known }, Bend { third: f64::NAN, ..known }] {
            for bend in [known.or(unknown), unknown.or(known)] {
                assert_eq!(bend.speed(1.0, 10.0), 0.0, "{bend:?}");
            }
        }
    }
}
