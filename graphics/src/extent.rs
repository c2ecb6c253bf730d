//! How large things are: the smallest upright rectangle around a curve, exact to rounding.

use kurbo::{CubicBez, Point, Rect, Shape as _};
use messages::math;

use crate::{Arc, Contour, Graphic, Raster, Segment};

impl Segment {
    /// The smallest upright rectangle around the segment that begins at `start` [m].
    pub fn bounds(&self, start: Point) -> Rect {
        match *self {
            Self::Line(end) => Rect::from_points(start, end),
            Self::Cubic(first, second, end) => {
                CubicBez::new(start, first, second, end).bounding_box()
            }
            Self::Arc(arc) => arc.bounds(),
        }
    }
}

impl Arc {
    /// The smallest upright rectangle around the arc [m].
    pub fn bounds(&self) -> Rect {
        let ends = [self.point(self.start), self.point(self.start + self.sweep)];
        // x and y are outermost where their derivatives by φ vanish: tan φ = minor/major of each.
        let tops =
            [math::atan2(self.minor.x, self.major.x), math::atan2(self.minor.y, self.major.y)];
        let half = math::TURN / 2.0;
        let opposite = tops.into_iter().flat_map(|angle| [angle, angle + half]);
        let inside = opposite.filter(|angle| self.passes(*angle)).map(|angle| self.point(angle));
        inside.fold(Rect::from_points(ends[0], ends[1]), |rect, point| rect.union_pt(point))
    }

    /// Whether it passes φ, give or take whole turns [rad].
    fn passes(&self, angle: f64) -> bool {
        let way = (angle - self.start) * self.sweep.signum();
        let turns = (way / math::TURN).floor();
        way - turns * math::TURN <= self.sweep.abs()
    }
}

impl Contour {
    /// The smallest upright rectangle around the contour [m].
    pub fn bounds(&self) -> Rect {
        let mut rect = Rect::from_points(self.start, self.start);
        let mut start = self.start;
        for segment in &self.segments {
            rect = rect.union(segment.bounds(start));
            start = segment.end();
        }
        rect
    }
}

impl Raster {
    /// The smallest upright rectangle around the image [m].
    pub fn bounds(&self) -> Rect {
        let size = Rect::new(0.0, 0.0, self.columns as f64, self.rows as f64);
        self.placement.transform_rect_bbox(size)
    }
}

impl Graphic {
    /// The smallest upright rectangle around all that is drawn [m]; `None` where nothing is.
    pub fn bounds(&self) -> Option<Rect> {
        let contours = self.shapes.iter().flat_map(|shape| &shape.contours).map(Contour::bounds);
        contours.chain(self.images.iter().map(Raster::bounds)).reduce(|one, other| one.union(other))
    }
}

#[cfg(test)]
mod tests {
    use kurbo::Vec2;

    use super::*;

    fn close(one: Rect, other: Rect) {
        let (one, other) =
            ([one.x0, one.y0, one.x1, one.y1], [other.x0, other.y0, other.x1, other.y1]);
        for (left, right) in one.iter().zip(other) {
            assert!((left - right).abs() < 1e-12, "{one:?} {other:?}");
        }
    }

    #[test]
    fn an_arc_is_as_large_as_what_it_passes() {
        let circle = |start: f64, sweep: f64| Arc {
            centre: Point::new(1.0, 2.0),
            major: Vec2::new(3.0, 0.0),
            minor: Vec2::new(0.0, 3.0),
            start,
            sweep,
        };
        let quarter = core::f64::consts::FRAC_PI_2;
        close(circle(0.0, quarter).bounds(), Rect::new(1.0, 2.0, 4.0, 5.0));
        close(circle(quarter, -quarter).bounds(), Rect::new(1.0, 2.0, 4.0, 5.0));
        close(circle(0.5, 4.0 * quarter).bounds(), Rect::new(-2.0, -1.0, 4.0, 5.0));
        close(circle(quarter / 2.0, quarter).bounds().intersect(Rect::new(-9.0, 4.5, 9.0, 9.0)), {
            let half = 3.0 * core::f64::consts::FRAC_1_SQRT_2;
            Rect::new(1.0 - half, 4.5, 1.0 + half, 5.0)
        });
    }

    #[test]
    fn a_sheared_ellipse_is_as_large_as_its_points() {
        let arc = Arc {
            centre: Point::new(-0.3, 0.1),
            major: Vec2::new(2.0, 0.7),
            minor: Vec2::new(0.4, 1.1),
            start: 0.3,
            sweep: -5.1,
        };
        let points = (0..=200_000).map(|index| arc.point(0.3 - 5.1 * f64::from(index) / 200_000.0));
        let rect = points.fold(Rect::from_points(arc.point(0.3), arc.point(0.3)), |rect, point| {
            rect.union_pt(point)
        });
        let found = arc.bounds();
        assert!((found.x0 - rect.x0).abs() < 1e-9 && (found.y1 - rect.y1).abs() < 1e-9);
        assert!((found.x1 - rect.x1).abs() < 1e-9 && (found.y0 - rect.y0).abs() < 1e-9);
    }
}
