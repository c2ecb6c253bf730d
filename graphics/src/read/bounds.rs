//! The rectangle around contours.

use core::f64::consts::PI;

use kurbo::{CubicBez, Point, Rect, Shape as _, Vec2};
use messages::math;

use crate::read::arcs::holds;
use crate::shape::{Arc, Contour, Segment};

/// The rectangle around contours, to rounding [m]; `None` around none.
pub(crate) fn bounds(contours: &[Contour]) -> Option<Rect> {
    contours.iter().map(of_contour).reduce(|all, one| all.union(one))
}

fn of_contour(contour: &Contour) -> Rect {
    let mut at = contour.start;
    let mut all = Rect::from_points(at, at);
    for segment in &contour.segments {
        all = match *segment {
            Segment::Line(end) => all.union_pt(end),
            Segment::Cubic(first, second, end) => {
                all.union(CubicBez::new(at, first, second, end).bounding_box())
            }
            Segment::Arc(arc) => extremes(&arc).into_iter().fold(all, |all, to| all.union_pt(to)),
        };
        at = segment.end();
    }
    all
}

/// The ends of an arc and the places where it goes along x or y.
fn extremes(arc: &Arc) -> Vec<Point> {
    let mut points = vec![arc.point(arc.start), arc.point(arc.start + arc.sweep)];
    for axis in [Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0)] {
        // The derivative −major·sin φ + minor·cos φ has no part along the axis.
        let angle = math::atan2(arc.minor.dot(axis), arc.major.dot(axis));
        for angle in [angle, angle + PI] {
            if holds(arc, angle) {
                points.push(arc.point(angle));
            }
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use core::f64::consts::{FRAC_PI_2, TAU};

    use kurbo::{Affine, Point, Rect};

    use super::bounds;
    use crate::read::arcs::circular;
    use crate::shape::{Contour, Segment};

    fn of(start: Point, segment: Segment) -> Rect {
        bounds(&[Contour { start, segments: vec![segment], is_closed: false }]).expect("one")
    }

    #[test]
    fn a_circle_and_its_quarters_are_bounded_by_what_they_reach() {
        let whole = Segment::Arc(circular(Point::new(3.0, 4.0), 2.0, 0.3, -TAU));
        let start = Point::new(3.0, 4.0) + kurbo::Vec2::from_angle(0.3) * 2.0;
        let found = of(start, whole);
        for (found, expected) in
            [(found.x0, 1.0), (found.x1, 5.0), (found.y0, 2.0), (found.y1, 6.0)]
        {
            assert!((found - expected).abs() < 1e-12, "{found}");
        }
        let quarter = Segment::Arc(circular(Point::ORIGIN, 1.0, FRAC_PI_2 / 2.0, FRAC_PI_2));
        let root = 0.5_f64.sqrt();
        let found = of(Point::new(root, root), quarter);
        assert!((found.y1 - 1.0).abs() < 1e-12 && (found.y0 - root).abs() < 1e-12);
        assert!((found.x0 + root).abs() < 1e-12 && (found.x1 - root).abs() < 1e-12);
    }

    #[test]
    fn a_sheared_circle_reaches_as_far_as_its_samples() {
        let by = Affine::new([1.0, 0.4, -0.7, 2.0, 5.0, 6.0]);
        let arc = circular(Point::new(1.0, 2.0), 3.0, 1.0, 4.0).transformed(by);
        let found = of(arc.point(arc.start), Segment::Arc(arc));
        let sampled = (0..=10_000)
            .map(|step| arc.point(arc.start + arc.sweep * f64::from(step) / 10_000.0))
            .fold(Rect::from_points(arc.point(1.0), arc.point(1.0)), |all, at| all.union_pt(at));
        assert!((found.x0 - sampled.x0).abs() < 1e-5 && (found.x1 - sampled.x1).abs() < 1e-5);
        assert!((found.y0 - sampled.y0).abs() < 1e-5 && (found.y1 - sampled.y1).abs() < 1e-5);
    }
}
