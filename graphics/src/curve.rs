//! What the modules that work on contours need of their curves: points along them, chords, ways round.

use kurbo::{Point, Rect};

use crate::{Arc, Contour, Segment};

/// More chords than this are never made of one segment.
const MOST_CHORDS: f64 = 4096.0;

impl Segment {
    /// The point at the fraction `t`, 0 to 1, of the segment that begins at `start` [m].
    pub fn point(&self, start: Point, t: f64) -> Point {
        match *self {
            Self::Line(end) => start.lerp(end, t),
            Self::Cubic(first, second, end) => {
                let u = 1.0 - t;
                let (a, b, c, d) = (u * u * u, 3.0 * u * u * t, 3.0 * u * t * t, t * t * t);
                Point::new(
                    a * start.x + b * first.x + c * second.x + d * end.x,
                    a * start.y + b * first.y + c * second.y + d * end.y,
                )
            }
            Self::Arc(arc) => arc.point(arc.start + arc.sweep * t),
        }
    }

    /// The segment gone along from its end to `start` [m], which is where it begins.
    #[must_use]
    pub fn reversed(&self, start: Point) -> Self {
        match *self {
            Self::Line(_) => Self::Line(start),
            Self::Cubic(first, second, _) => Self::Cubic(second, first, start),
            Self::Arc(arc) => {
                Self::Arc(Arc { start: arc.start + arc.sweep, sweep: -arc.sweep, ..arc })
            }
        }
    }

    /// The part from the fraction `from` to the fraction `to`, with where it begins; gone along backwards
    /// where `to` is less.
    pub(crate) fn part(&self, start: Point, from: f64, to: f64) -> (Point, Self) {
        let (begin, end) = (self.point(start, from), self.point(start, to));
        let part = match *self {
            Self::Line(_) => Self::Line(end),
            Self::Cubic(first, second, last) => {
                // The polar form of the cubic: its arguments are two of one end and one of the other.
                let polar = |a: f64, b: f64, c: f64| {
                    let step = |t: f64, p: [Point; 4]| {
                        [p[0].lerp(p[1], t), p[1].lerp(p[2], t), p[2].lerp(p[3], t), p[3]]
                    };
                    step(c, step(b, step(a, [start, first, second, last])))[0]
                };
                Self::Cubic(polar(from, from, to), polar(from, to, to), end)
            }
            Self::Arc(arc) => Self::Arc(Arc {
                start: arc.start + arc.sweep * from,
                sweep: arc.sweep * (to - from),
                ..arc
            }),
        };
        (begin, part)
    }

    /// Whether every number in it is finite.
    pub(crate) fn is_finite(&self) -> bool {
        match self {
            Self::Line(end) => end.is_finite(),
            Self::Cubic(first, second, end) => {
                first.is_finite() && second.is_finite() && end.is_finite()
            }
            Self::Arc(arc) => {
                arc.centre.is_finite()
                    && arc.major.is_finite()
                    && arc.minor.is_finite()
                    && arc.start.is_finite()
                    && arc.sweep.is_finite()
            }
        }
    }

    /// How many chords of equal parameter leave the curve nowhere farther than `tolerance` [m].
    pub(crate) fn chords(&self, start: Point, tolerance: f64) -> usize {
        // A chord over a step h of the parameter errs by at most h²·max|p″|/8.
        let bend = match *self {
            Self::Line(_) => 0.0,
            Self::Cubic(first, second, end) => {
                let one = (start.to_vec2() - 2.0 * first.to_vec2() + second.to_vec2()).hypot();
                let two = (first.to_vec2() - 2.0 * second.to_vec2() + end.to_vec2()).hypot();
                6.0 * one.max(two)
            }
            Self::Arc(arc) => {
                (arc.major.hypot2() + arc.minor.hypot2()).sqrt() * arc.sweep * arc.sweep
            }
        };
        // A number that is not finite ends as 1.
        (bend / (8.0 * tolerance)).sqrt().ceil().clamp(1.0, MOST_CHORDS) as usize
    }
}

impl Contour {
    /// Segments with the points where they begin [m].
    pub fn pieces(&self) -> impl Iterator<Item = (Point, &Segment)> {
        let starts = core::iter::once(self.start).chain(self.segments.iter().map(Segment::end));
        starts.zip(&self.segments)
    }

    /// The same curve gone along the other way; a loop begins where it began.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let mut segments: Vec<Segment> =
            self.pieces().map(|(start, segment)| segment.reversed(start)).collect();
        segments.reverse();
        Self { start: self.end(), segments, is_closed: self.is_closed }
    }

    /// The loop begun with its segment `first`, from 0. An open contour, and a number that is not
    /// that of a segment, change nothing.
    #[must_use]
    pub fn begun_at(&self, first: usize) -> Self {
        if !self.is_closed || first == 0 || first >= self.segments.len() {
            return self.clone();
        }
        let mut segments = self.segments.clone();
        segments.rotate_left(first);
        let start = self.segments[first - 1].end();
        Self { start, segments, is_closed: true }
    }

    /// Points along the contour, its start and every end of a segment among them, whose chords leave
    /// it nowhere farther than `tolerance` [m].
    pub fn flattened(&self, tolerance: f64) -> Vec<Point> {
        let mut points = vec![self.start];
        for (start, segment) in self.pieces() {
            let chords = segment.chords(start, tolerance);
            for chord in 1..chords {
                points.push(segment.point(start, chord as f64 / chords as f64));
            }
            points.push(segment.end());
        }
        points
    }

    /// Whether every number in it is finite.
    pub(crate) fn is_finite(&self) -> bool {
        self.start.is_finite() && self.segments.iter().all(Segment::is_finite)
    }
}

/// The smallest upright rectangle around points; `None` without points.
pub(crate) fn bounds(points: &[Point]) -> Option<Rect> {
    let (first, others) = points.split_first()?;
    let rect = Rect::from_points(*first, *first);
    Some(others.iter().fold(rect, |rect, point| rect.union_pt(*point)))
}

/// Area enclosed by a closed polyline, positive where it runs counterclockwise [m²].
pub(crate) fn signed_area(points: &[Point]) -> f64 {
    let Some(origin) = points.first() else { return 0.0 };
    let next = points.iter().cycle().skip(1);
    let doubled: f64 =
        points.iter().zip(next).map(|(a, b)| (*a - *origin).cross(*b - *origin)).sum();
    doubled / 2.0
}

/// The full circle, counterclockwise from its right side.
#[cfg(any(test, feature = "codes"))]
pub(crate) fn circle(centre: Point, radius: f64) -> Contour {
    let arc = Arc {
        centre,
        major: kurbo::Vec2::new(radius, 0.0),
        minor: kurbo::Vec2::new(0.0, radius),
        start: 0.0,
        sweep: messages::math::TURN,
    };
    Contour { start: arc.point(0.0), segments: vec![Segment::Arc(arc)], is_closed: true }
}

/// Contours for tests.
#[cfg(test)]
pub(crate) mod samples {
    use kurbo::Point;

    use crate::{Contour, Segment};

    pub(crate) use super::circle;

    /// The closed polygon through corners.
    pub(crate) fn polygon(corners: &[(f64, f64)]) -> Contour {
        let corners: Vec<Point> = corners.iter().map(|corner| Point::from(*corner)).collect();
        let mut segments: Vec<Segment> = corners[1..].iter().map(|c| Segment::Line(*c)).collect();
        segments.push(Segment::Line(corners[0]));
        Contour { start: corners[0], segments, is_closed: true }
    }
}

#[cfg(test)]
mod tests {
    use super::samples::circle;
    use super::*;
    use kurbo::Vec2;
    use messages::math;

    fn wavy() -> Contour {
        let arc = Arc {
            centre: Point::new(2.0, 0.0),
            major: Vec2::new(1.0, 0.0),
            minor: Vec2::new(0.2, 0.5),
            start: math::TURN / 2.0,
            sweep: -math::TURN / 2.0,
        };
        Contour {
            start: Point::ORIGIN,
            segments: vec![
                Segment::Line(Point::new(1.0, 0.0)),
                Segment::Arc(arc),
                Segment::Cubic(Point::new(4.0, 1.0), Point::new(4.0, 2.0), Point::new(0.0, 0.0)),
            ],
            is_closed: true,
        }
    }

    #[test]
    fn a_contour_reversed_passes_through_the_same_points() {
        let contour = wavy();
        let reversed = contour.reversed();
        let forwards: Vec<(Point, &Segment)> = contour.pieces().collect();
        let backwards: Vec<(Point, &Segment)> = reversed.pieces().collect();
        for (one, other) in forwards.iter().zip(backwards.iter().rev()) {
            for t in [0.0, 0.3, 1.0] {
                let off = one.1.point(one.0, t) - other.1.point(other.0, 1.0 - t);
                assert!(off.hypot() < 1e-12, "{off:?} at {t}");
            }
        }
    }

    #[test]
    fn a_loop_begun_elsewhere_is_the_same_loop() {
        let begun = wavy().begun_at(2);
        assert!((begun.start - Point::new(3.0, 0.0)).hypot() < 1e-12);
        assert!((begun.end() - begun.start).hypot() < 1e-12);
        assert_eq!(begun.segments.len(), 3);
        assert_eq!(wavy().begun_at(3), wavy());
    }

    #[test]
    fn a_part_passes_through_the_points_of_the_whole() {
        for (start, segment) in wavy().pieces() {
            for (from, to) in [(0.2, 0.7), (0.9, 0.1), (0.0, 1.0)] {
                let (begin, part) = segment.part(start, from, to);
                for t in [0.0, 0.4, 1.0] {
                    let off = part.point(begin, t) - segment.point(start, from + (to - from) * t);
                    assert!(off.hypot() < 1e-12, "{off:?} of {segment:?}");
                }
            }
        }
    }

    #[test]
    fn chords_stay_within_the_tolerance() {
        let tolerance = 1e-3;
        for (start, segment) in wavy().pieces() {
            let chords = segment.chords(start, tolerance);
            for chord in 0..chords {
                let at = |t: f64| segment.point(start, (chord as f64 + t) / chords as f64);
                let off = (at(0.5) - at(0.0).midpoint(at(1.0))).hypot();
                assert!(off <= tolerance, "{off} of {segment:?}");
            }
        }
    }

    #[test]
    fn the_area_of_a_circle_is_found() {
        let points = circle(Point::new(3.0, 4.0), 2.0).flattened(1e-6);
        assert!((signed_area(&points) - 2.0 * math::TURN).abs() < 1e-4);
        assert_eq!(bounds(&points).map(|rect| rect.center().round()), Some(Point::new(3.0, 4.0)));
    }
}
