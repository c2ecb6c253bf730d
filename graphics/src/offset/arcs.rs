//! Contours as polylines of lines and circular arcs, and back.
//!
//! Units of the polylines are millimetres: their library compares positions within 1e-5 of a unit.

use cavalier_contours::polyline::{PlineSource, PlineSourceMut, PlineVertex, Polyline};
use kurbo::{Point, Vec2};
use messages::math;

use crate::{Arc, Contour, Segment};

/// Arcs that replace a curve leave it nowhere farther than this [m].
const TOLERANCE: f64 = 1e-6;
/// Millimetres in a metre.
const SCALE: f64 = 1e3;
/// Points nearer than this are one [mm].
const SAME: f64 = 1e-5;
/// How often a curve is halved at most.
const DEEPEST: usize = 16;
/// Where arcs are compared with their curve.
const COMPARED: usize = 8;

/// A closed contour as a polyline; circular arcs stay, other curves become pairs of arcs.
pub(super) fn polyline(contour: &Contour) -> Polyline<f64> {
    let mut arcs = Bulges(Vec::new());
    for (start, segment) in contour.pieces() {
        match *segment {
            Segment::Line(end) => arcs.push(start, end, 0.0),
            Segment::Arc(arc) if is_circular(&arc) => {
                let parts = (arc.sweep.abs() / (math::TURN / 3.0)).ceil().clamp(1.0, 8.0);
                let turned = arc.major.cross(arc.minor).signum();
                let bulge = turned * math::tan(arc.sweep / parts / 4.0);
                let at = |part: f64| segment.point(start, part / parts);
                (0..parts as usize).for_each(|part| {
                    arcs.push(at(part as f64), at(part as f64 + 1.0), bulge);
                });
            }
            _ => arcs.push_curve(segment, start, 0.0, 1.0, DEEPEST),
        }
    }
    if (contour.end() - contour.start).hypot() * SCALE > SAME {
        arcs.push(contour.end(), contour.start, 0.0);
    }
    let mut line = Polyline::new_closed();
    for (start, bulge) in arcs.0 {
        line.add(start.x * SCALE, start.y * SCALE, bulge);
    }
    line.remove_repeat_pos(SAME).unwrap_or(line)
}

/// A closed polyline as a contour.
pub(super) fn contour(line: &Polyline<f64>) -> Option<Contour> {
    let point = |vertex: &PlineVertex<f64>| Point::new(vertex.x / SCALE, vertex.y / SCALE);
    let vertices: Vec<PlineVertex<f64>> = line.iter_vertexes().collect();
    let start = point(vertices.first()?);
    let next = vertices.iter().skip(1).chain(vertices.first());
    let segments = vertices.iter().zip(next).map(|(from, to)| {
        let (from, to, bulge) = (point(from), point(to), from.bulge);
        if bulge == 0.0 {
            return Segment::Line(to);
        }
        let chord = to - from;
        let left = Vec2::new(-chord.y, chord.x);
        let centre = from.midpoint(to) + left * ((1.0 - bulge * bulge) / (4.0 * bulge));
        let major = from - centre;
        let sweep = 4.0 * math::atan(bulge);
        Segment::Arc(Arc { centre, major, minor: Vec2::new(-major.y, major.x), start: 0.0, sweep })
    });
    Some(Contour { start, segments: segments.collect(), is_closed: true })
}

/// Whether an arc is part of a circle.
fn is_circular(arc: &Arc) -> bool {
    let (major, minor) = (arc.major.hypot(), arc.minor.hypot());
    (major - minor).abs() < 1e-9 * major && arc.major.dot(arc.minor).abs() < 1e-9 * major * minor
}

/// Points and the bulge from each to the next: the tangent of a quarter of the arc's angle.
struct Bulges(Vec<(Point, f64)>);

impl Bulges {
    fn push(&mut self, from: Point, to: Point, bulge: f64) {
        if (to - from).hypot() * SCALE > SAME {
            self.0.push((from, bulge));
        }
    }

    /// Two arcs that meet smoothly (K. Bolton, "Biarc curves", 1975), of halves where that is too far off.
    fn push_curve(&mut self, segment: &Segment, start: Point, from: f64, to: f64, depth: usize) {
        let (begin, end) = (segment.point(start, from), segment.point(start, to));
        let tangents = direction(segment, start, from, to).zip(direction(segment, start, to, from));
        let arcs = tangents.and_then(|(first, last)| biarc(begin, first, end, -last));
        let inner = |step: usize| from + (to - from) * step as f64 / COMPARED as f64;
        match arcs {
            Some((middle, one, other))
                if depth == 0
                    || (1..COMPARED).all(|step| {
                        let point = segment.point(start, inner(step));
                        let away = away(begin, middle, one, point);
                        away.min(self::away(middle, end, other, point)) < TOLERANCE
                    }) =>
            {
                self.push(begin, middle, one);
                self.push(middle, end, other);
            }
            None if depth == 0 => self.push(begin, end, 0.0),
            _ => {
                let middle = from + (to - from) * 0.5;
                self.push_curve(segment, start, from, middle, depth - 1);
                self.push_curve(segment, start, middle, to, depth - 1);
            }
        }
    }
}

/// Unit vector along a curve at the fraction `at`, towards `to`; `None` where it stands still.
fn direction(segment: &Segment, start: Point, at: f64, to: f64) -> Option<Vec2> {
    // The chord of a short part errs by its angle, which is as short: the comparison with the curve
    // decides whether that is good enough.
    let derivative = match *segment {
        Segment::Line(end) => end - start,
        Segment::Cubic(first, second, end) => {
            let u = 1.0 - at;
            (first - start) * (u * u)
                + (second - first) * (2.0 * u * at)
                + (end - second) * (at * at)
        }
        Segment::Arc(arc) => {
            let (sine, cosine) = math::sin_cos(arc.start + arc.sweep * at);
            (arc.minor * cosine - arc.major * sine) * arc.sweep
        }
    };
    let step = 1e-4 * (to - at);
    let short = segment.point(start, at + step) - segment.point(start, at);
    let vector = if derivative.hypot() > 1e-9 { derivative * (to - at).signum() } else { short };
    let length = vector.hypot();
    (length > 0.0 && length.is_finite()).then(|| vector / length)
}

/// Where two arcs between ends with unit tangents meet, and their bulges; `None` where the ends are one
/// point or an arc would be more than half a turn.
fn biarc(begin: Point, first: Vec2, end: Point, last: Vec2) -> Option<(Point, f64, f64)> {
    let chord = end - begin;
    let sum = first + last;
    let apart = 2.0 * (1.0 - first.dot(last));
    // Both tangents reach as far: |chord − d·sum| = 2d.
    let along = chord.dot(sum);
    let reach = if apart > 1e-9 {
        (-along + (along * along + apart * chord.hypot2()).sqrt()) / apart
    } else {
        chord.hypot2() / (2.0 * along)
    };
    if !(reach > 0.0 && reach.is_finite()) {
        return None;
    }
    let middle = begin.midpoint(end) + (first - last) * (reach / 2.0);
    // The tangent of half the angle from a tangent to its chord.
    let bulge = |tangent: Vec2, chord: Vec2| {
        let length = chord.hypot() + tangent.dot(chord);
        (length > 0.0).then(|| tangent.cross(chord) / length).filter(|bulge| bulge.abs() < 1.0)
    };
    Some((middle, bulge(first, middle - begin)?, -bulge(-last, middle - end)?))
}

/// Distance of a point from the circle or line that an arc is part of [m].
fn away(from: Point, to: Point, bulge: f64, point: Point) -> f64 {
    let chord = to - from;
    if bulge.abs() < 1e-9 {
        return (chord.cross(point - from) / chord.hypot()).abs();
    }
    let left = Vec2::new(-chord.y, chord.x);
    let centre = from.midpoint(to) + left * ((1.0 - bulge * bulge) / (4.0 * bulge));
    ((point - centre).hypot() - (from - centre).hypot()).abs()
}
