//! Arcs by what files give of them.

use core::f64::consts::TAU;

use kurbo::{Point, Vec2};
use messages::math;

use crate::shape::Arc;

/// An arc of a circle: angles counterclockwise from x [rad].
pub(crate) fn circular(centre: Point, radius: f64, start: f64, sweep: f64) -> Arc {
    let (major, minor) = (Vec2::new(radius, 0.0), Vec2::new(0.0, radius));
    Arc { centre, major, minor, start, sweep: sweep.clamp(-TAU, TAU) }
}

/// The arc of a circle from one point to another with a bulge, the tangent of a quarter of its sweep:
/// positive is counterclockwise. `None` where it is straight.
pub(crate) fn bulged(from: Point, to: Point, bulge: f64) -> Option<Arc> {
    let chord = to - from;
    let length = chord.hypot();
    // Where the arc's height over its chord is below rounding, it is a line.
    if !(bulge.abs() > 1e-12 && bulge.abs() < 1e9 && length > 0.0) {
        return None;
    }
    let sweep = 4.0 * math::atan(bulge);
    let radius = length * (1.0 + bulge * bulge) / (4.0 * bulge.abs());
    // From the middle of the chord to the centre, positive to the left of the chord.
    let height = length * (1.0 - bulge * bulge) / (4.0 * bulge);
    let left = Vec2::new(-chord.y, chord.x) / length;
    let centre = from.midpoint(to) + left * height;
    let out = from - centre;
    Some(circular(centre, radius, math::atan2(out.y, out.x), sweep))
}

/// Flags and radii of an arc in SVG path data.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EndpointArc {
    pub(crate) radii: Vec2,
    /// Of the first radius from x [rad].
    pub(crate) rotation: f64,
    pub(crate) is_large: bool,
    /// In the direction from x to y.
    pub(crate) is_positive: bool,
}

/// The arc between two points (SVG 2, appendix B.2.4 and B.2.5). `None` where it is a straight line.
pub(crate) fn between(from: Point, to: Point, given: EndpointArc) -> Option<Arc> {
    let (mut rx, mut ry) = (given.radii.x.abs(), given.radii.y.abs());
    let usable = rx > 0.0 && ry > 0.0 && rx.is_finite() && ry.is_finite();
    if !usable || from == to {
        return None;
    }
    let (sine, cosine) = math::sin_cos(given.rotation);
    let half = (from - to) / 2.0;
    let (x, y) = (cosine * half.x + sine * half.y, cosine * half.y - sine * half.x);
    let reach = (x / rx) * (x / rx) + (y / ry) * (y / ry);
    let mut away = 0.0;
    if reach > 1.0 {
        // Radii that are too small for the distance grow until they reach.
        (rx, ry) = (rx * reach.sqrt(), ry * reach.sqrt());
    } else {
        away = (1.0 / reach - 1.0).max(0.0).sqrt();
    }
    let side = if given.is_large == given.is_positive { -1.0 } else { 1.0 };
    let (cx, cy) = (side * away * rx * y / ry, -side * away * ry * x / rx);
    let middle = from.midpoint(to);
    let centre = middle + Vec2::new(cosine * cx - sine * cy, sine * cx + cosine * cy);
    let start = math::atan2((y - cy) / ry, (x - cx) / rx);
    let end = math::atan2((-y - cy) / ry, (-x - cx) / rx);
    let mut sweep = end - start;
    if given.is_positive && sweep <= 0.0 {
        sweep += TAU;
    } else if !given.is_positive && sweep >= 0.0 {
        sweep -= TAU;
    }
    let major = Vec2::new(cosine, sine) * rx;
    let minor = Vec2::new(-sine, cosine) * ry;
    let arc = Arc { centre, major, minor, start, sweep };
    (centre.is_finite() && sweep.is_finite() && sweep != 0.0).then_some(arc)
}

/// Whether an angle [rad] is on an arc.
#[cfg(test)]
pub(crate) fn holds(arc: &Arc, angle: f64) -> bool {
    let forward = (angle - arc.start) * arc.sweep.signum();
    forward.rem_euclid(TAU) <= arc.sweep.abs() + TAU * 1e-12
}

#[cfg(test)]
mod tests {
    use core::f64::consts::{FRAC_PI_2, PI};

    use kurbo::{Point, Vec2};
    use messages::random::SplitMix64;

    use super::{EndpointArc, between, bulged, circular, holds};

    fn near(found: Point, expected: Point, tolerance: f64) {
        let off = (found - expected).hypot();
        assert!(off <= tolerance, "{found:?} and not {expected:?}");
    }

    #[test]
    fn a_bulge_of_one_is_half_a_circle_to_the_right_of_its_chord() {
        let arc = bulged(Point::new(0.0, 0.0), Point::new(2.0, 0.0), 1.0).expect("an arc");
        near(arc.centre, Point::new(1.0, 0.0), 1e-15);
        assert_eq!(arc.sweep, PI);
        near(arc.point(arc.start + arc.sweep / 2.0), Point::new(1.0, -1.0), 1e-15);
    }

    #[test]
    fn bulged_arcs_begin_and_end_where_they_should_and_rise_by_their_bulge() {
        let mut random = SplitMix64::new(7);
        for _ in 0..1000 {
            let mut point = || Point::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0));
            let (from, to) = (point(), point());
            let bulge = random.between(-3.0, 3.0);
            let arc = bulged(from, to, bulge).expect("an arc");
            near(arc.point(arc.start), from, 1e-9);
            near(arc.point(arc.start + arc.sweep), to, 1e-9);
            let chord = to - from;
            let right = Vec2::new(chord.y, -chord.x);
            let top = from.midpoint(to) + right * (bulge / 2.0);
            near(arc.point(arc.start + arc.sweep / 2.0), top, 1e-9);
        }
        assert!(bulged(Point::ORIGIN, Point::ORIGIN, 1.0).is_none());
        assert!(bulged(Point::ORIGIN, Point::new(1.0, 0.0), 0.0).is_none());
        assert!(bulged(Point::ORIGIN, Point::new(1.0, 0.0), f64::NAN).is_none());
    }

    #[test]
    fn arcs_between_two_points_begin_and_end_there_with_the_flags() {
        let mut random = SplitMix64::new(8);
        for _ in 0..1000 {
            let mut point = || Point::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0));
            let (from, to) = (point(), point());
            let given = EndpointArc {
                radii: Vec2::new(random.between(0.01, 3.0), random.between(0.01, 3.0)),
                rotation: random.between(-4.0, 4.0),
                is_large: random.below(2) == 1,
                is_positive: random.below(2) == 1,
            };
            let arc = between(from, to, given).expect("an arc");
            near(arc.point(arc.start), from, 1e-7);
            near(arc.point(arc.start + arc.sweep), to, 1e-7);
            assert_eq!(arc.sweep > 0.0, given.is_positive);
            if arc.major.hypot() <= given.radii.x * 1.000_001 {
                assert_eq!(arc.sweep.abs() > PI, given.is_large, "{arc:?}");
            }
        }
    }

    #[test]
    fn a_quarter_holds_its_angles_only() {
        let arc = circular(Point::ORIGIN, 1.0, FRAC_PI_2, -FRAC_PI_2);
        assert!(holds(&arc, 0.0) && holds(&arc, FRAC_PI_2) && holds(&arc, 1.0));
        assert!(!holds(&arc, PI) && !holds(&arc, -0.1));
    }
}
