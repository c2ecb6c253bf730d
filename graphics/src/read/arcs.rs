//! Arcs by what files give of them.

use core::f64::consts::{PI, TAU};

use kurbo::{Point, Vec2};
use messages::math;

use crate::shape::Arc;

#[cfg(test)]
/// An arc of a circle: angles counterclockwise from x [rad].
pub(crate) fn circular(centre: Point, radius: f64, start: f64, sweep: f64) -> Arc {
    let (major, minor) = (Vec2::new(radius, 0.0), Vec2::new(0.0, radius));
    Arc { centre, major, minor, start, sweep: sweep.clamp(-TAU, TAU) }
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
pub(crate) fn holds(arc: &Arc, angle: f64) -> bool {
    let forward = (angle - arc.start) * arc.sweep.signum();
    forward.rem_euclid(TAU) <= arc.sweep.abs() + PI * 1e-12
}

#[cfg(test)]
mod tests {
    use core::f64::consts::{FRAC_PI_2, PI};

    use kurbo::{Point, Vec2};
    use messages::random::SplitMix64;

    use super::{EndpointArc, between, circular, holds};

    fn near(found: Point, expected: Point, tolerance: f64) {
        let off = (found - expected).hypot();
        assert!(off <= tolerance, "{found:?} and not {expected:?}");
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
