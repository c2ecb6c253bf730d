//! Circles, ellipses and rounded rectangles: `usvg` gives them as Bézier curves, which stray from them by up
//! to 0.1 px (26 µm). The ends of its curves are exact, and give the arcs back.

use core::f64::consts::FRAC_PI_2;

use kurbo::{BezPath, PathEl, Point, Rect, Vec2};

use crate::read::pen::Pen;
use crate::shape::{Arc, Contour};

/// How far from the ellipse, in its radii, the ends of curves may be: single precision.
const ON_ELLIPSE: f64 = 1e-4;

/// The contours of a path that `usvg` made of a basic shape, with true arcs. `None` where it is another path.
pub(super) fn arcs(path: &BezPath) -> Option<Vec<Contour>> {
    let closed = matches!(path.elements().last(), Some(PathEl::ClosePath));
    let curves = path.elements().iter().any(|element| matches!(element, PathEl::CurveTo(..)));
    if !closed || !curves {
        return None;
    }
    let mut ends = Vec::with_capacity(path.elements().len());
    for element in path.elements() {
        match *element {
            PathEl::MoveTo(to) if ends.is_empty() => ends.push((to, false)),
            PathEl::LineTo(to) => ends.push((to, false)),
            PathEl::CurveTo(_, _, to) => ends.push((to, true)),
            PathEl::ClosePath => {}
            _ => return None,
        }
    }
    let start = ends.first()?.0;
    let bounds = hull(&ends);
    match ends.iter().skip(1).all(|&(_, is_curve)| is_curve) {
        true => ellipse(start, bounds, &ends),
        false => rounded(start, bounds, &ends),
    }
}

/// The rectangle around the ends of the curves: they include the extreme points of a basic shape.
fn hull(ends: &[(Point, bool)]) -> Rect {
    let first = ends.first().map_or(Point::ORIGIN, |end| end.0);
    ends.iter().fold(Rect::from_points(first, first), |hull, end| hull.union_pt(end.0))
}

fn is_on(point: Point, centre: Point, radii: Vec2) -> bool {
    let out = point - centre;
    let reach = Vec2::new(out.x / radii.x, out.y / radii.y).hypot();
    (reach - 1.0).abs() < ON_ELLIPSE
}

fn ellipse(start: Point, bounds: Rect, ends: &[(Point, bool)]) -> Option<Vec<Contour>> {
    let (centre, radii) = (bounds.center(), bounds.size().to_vec2() / 2.0);
    let begins = (start - Point::new(bounds.x1, centre.y)).hypot() <= ON_ELLIPSE * radii.hypot();
    if !begins || !ends.iter().all(|end| is_on(end.0, centre, radii)) {
        return None;
    }
    let mut pen = Pen::default();
    let start = Point::new(bounds.x1, centre.y);
    pen.move_to(start);
    pen.arc_to(quarters(centre, radii, 0.0, 4.0), start);
    pen.close_here();
    Some(pen.take())
}

/// As `usvg` draws it: from the left end of the top side, in the direction from x to y.
fn rounded(start: Point, bounds: Rect, ends: &[(Point, bool)]) -> Option<Vec<Contour>> {
    let tolerance = ON_ELLIPSE * bounds.size().to_vec2().hypot();
    let left = ends.iter().skip(1).find(|end| (end.0.x - bounds.x0).abs() <= tolerance)?;
    let radii = Vec2::new(start.x - bounds.x0, bounds.y1 - left.0.y);
    let begins = (start.y - bounds.y0).abs() <= tolerance;
    if !begins || radii.x <= 0.0 || radii.y <= 0.0 {
        return None;
    }
    let inner = Rect::new(
        bounds.x0 + radii.x,
        bounds.y0 + radii.y,
        (bounds.x1 - radii.x).max(bounds.x0 + radii.x),
        (bounds.y1 - radii.y).max(bounds.y0 + radii.y),
    );
    let nearest = |point: Point| {
        let x = if point.x < bounds.center().x { inner.x0 } else { inner.x1 };
        let y = if point.y < bounds.center().y { inner.y0 } else { inner.y1 };
        Point::new(x, y)
    };
    if !ends.iter().all(|end| is_on(end.0, nearest(end.0), radii)) {
        return None;
    }
    let mut pen = Pen::default();
    let start = Point::new(inner.x0, bounds.y0);
    pen.move_to(start);
    let corners = [
        (Point::new(inner.x1, inner.y0), Vec2::new(0.0, -1.0), Vec2::new(1.0, 0.0)),
        (Point::new(inner.x1, inner.y1), Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0)),
        (Point::new(inner.x0, inner.y1), Vec2::new(0.0, 1.0), Vec2::new(-1.0, 0.0)),
        (Point::new(inner.x0, inner.y0), Vec2::new(-1.0, 0.0), Vec2::new(0.0, -1.0)),
    ];
    for (number, (centre, from, to)) in corners.into_iter().enumerate() {
        let at = |way: Vec2| centre + Vec2::new(way.x * radii.x, way.y * radii.y);
        pen.line_to(at(from));
        pen.arc_to(quarters(centre, radii, number as f64 - 1.0, 1.0), at(to));
    }
    pen.close_here();
    Some(pen.take())
}

/// An arc whose angles are in quarters of a turn.
fn quarters(centre: Point, radii: Vec2, start: f64, sweep: f64) -> Arc {
    Arc {
        centre,
        major: Vec2::new(radii.x, 0.0),
        minor: Vec2::new(0.0, radii.y),
        start: start * FRAC_PI_2,
        sweep: sweep * FRAC_PI_2,
    }
}

#[cfg(test)]
mod tests {
    use kurbo::{BezPath, Circle, Rect, Shape as _};

    use super::arcs;
    use crate::read::bounds;
    use crate::shape::{Contour, Segment};

    /// How far apart the rectangles around two paths are.
    fn apart(contours: &[Contour], path: &BezPath) -> f64 {
        let found = bounds(contours).expect("contours");
        let all = path.bounding_box();
        [found.x0 - all.x0, found.x1 - all.x1, found.y0 - all.y0, found.y1 - all.y1]
            .into_iter()
            .fold(0.0, |most, off| f64::max(most, off.abs()))
    }

    #[test]
    fn a_circle_of_curves_becomes_one_arc() {
        let path: BezPath = Circle::new((50.0, 40.0), 30.0).to_path(0.1);
        let contours = arcs(&path).expect("a circle");
        assert_eq!(contours[0].segments.len(), 1);
        assert!(apart(&contours, &path) < 0.1);
    }

    #[test]
    fn a_rounded_rectangle_has_four_arcs() {
        let path = BezPath::from_svg(
            "M15 20L95 20C97.76 20 100 23.13 100 27L100 53C100 56.87 97.76 60 95 60L15 60\
             C12.24 60 10 56.87 10 53L10 27C10 23.13 12.24 20 15 20Z",
        )
        .expect("a path");
        let contours = arcs(&path).expect("a rounded rectangle");
        let count =
            |is: fn(&Segment) -> bool| contours[0].segments.iter().filter(|s| is(s)).count();
        assert_eq!(count(|segment| matches!(segment, Segment::Arc(_))), 4);
        assert_eq!(count(|segment| matches!(segment, Segment::Line(_))), 4);
        assert!(apart(&contours, &path) < 1e-9);
    }

    #[test]
    fn other_paths_stay_as_they_are() {
        assert!(arcs(&Rect::new(0.0, 0.0, 1.0, 1.0).to_path(0.1)).is_none());
        let heart = BezPath::from_svg("M0 0C1 2 3 4 5 0C3 -3 2 -7 0 0Z").expect("a path");
        assert!(arcs(&heart).is_none());
    }
}
