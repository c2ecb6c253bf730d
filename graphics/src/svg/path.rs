//! Path data, in the unit of the file: its arcs stay arcs, and nothing is rounded.

use kurbo::{Point, Vec2};
use svgtypes::{PathParser, PathSegment, PointsParser};

use crate::read::arcs::{EndpointArc, between};
use crate::read::pen::Pen;
use crate::shape::Contour;

/// What path data draws.
#[derive(Debug, Default)]
pub(super) struct Drawn {
    /// Contours that have a length.
    pub(super) contours: Vec<Contour>,
    /// How many had none.
    pub(super) points: u64,
    /// Whether the data is at fault; it counts up to there, as the standard has it.
    pub(super) is_faulty: bool,
}

/// The contours of the attribute `d`.
pub(super) fn data(text: &str) -> Drawn {
    let mut tip = Tip::default();
    let mut is_faulty = false;
    for segment in PathParser::from(text) {
        match segment {
            Ok(segment) if tip.draw(segment) => {}
            _ => {
                is_faulty = true;
                break;
            }
        }
    }
    let contours = tip.pen.take();
    Drawn { contours, points: tip.pen.points, is_faulty }
}

/// The contours of the attribute `points`; of a polygon they are closed.
pub(super) fn points(text: &str, is_closed: bool) -> Drawn {
    let mut pen = Pen::default();
    for (number, (x, y)) in PointsParser::from(text).enumerate() {
        match number {
            0 => pen.move_to(Point::new(x, y)),
            _ => pen.line_to(Point::new(x, y)),
        }
    }
    if is_closed {
        pen.close();
    }
    Drawn { contours: pen.take(), points: pen.points, is_faulty: false }
}

/// The pen, and the last control point, which the next curve may mirror.
#[derive(Debug, Default)]
struct Tip {
    pen: Pen,
    mirror: Mirror,
}

#[derive(Debug, Default, Clone, Copy)]
enum Mirror {
    #[default]
    None,
    Cubic(Point),
    Quadratic(Point),
}

impl Tip {
    /// Whether the segment could be drawn: its numbers are finite.
    fn draw(&mut self, segment: PathSegment) -> bool {
        let pen = &mut self.pen;
        let at = pen.at();
        let place = |abs: bool, x: f64, y: f64| match abs {
            true => Point::new(x, y),
            false => Point::new(at.x + x, at.y + y),
        };
        let mut mirror = Mirror::None;
        match segment {
            PathSegment::MoveTo { abs, x, y } => pen.move_to(place(abs, x, y)),
            PathSegment::LineTo { abs, x, y } => pen.line_to(place(abs, x, y)),
            PathSegment::HorizontalLineTo { abs, x } => {
                pen.line_to(Point::new(place(abs, x, 0.0).x, at.y));
            }
            PathSegment::VerticalLineTo { abs, y } => {
                pen.line_to(Point::new(at.x, place(abs, 0.0, y).y));
            }
            PathSegment::CurveTo { abs, x1, y1, x2, y2, x, y } => {
                let second = place(abs, x2, y2);
                pen.cubic_to(place(abs, x1, y1), second, place(abs, x, y));
                mirror = Mirror::Cubic(second);
            }
            PathSegment::SmoothCurveTo { abs, x2, y2, x, y } => {
                let first = match self.mirror {
                    Mirror::Cubic(control) => at + (at - control),
                    _ => at,
                };
                let second = place(abs, x2, y2);
                pen.cubic_to(first, second, place(abs, x, y));
                mirror = Mirror::Cubic(second);
            }
            PathSegment::Quadratic { abs, x1, y1, x, y } => {
                let control = place(abs, x1, y1);
                pen.quadratic_to(control, place(abs, x, y));
                mirror = Mirror::Quadratic(control);
            }
            PathSegment::SmoothQuadratic { abs, x, y } => {
                let control = match self.mirror {
                    Mirror::Quadratic(control) => at + (at - control),
                    _ => at,
                };
                pen.quadratic_to(control, place(abs, x, y));
                mirror = Mirror::Quadratic(control);
            }
            PathSegment::EllipticalArc {
                abs,
                rx,
                ry,
                x_axis_rotation,
                large_arc,
                sweep,
                x,
                y,
                ..
            } => {
                let to = place(abs, x, y);
                let given = EndpointArc {
                    radii: Vec2::new(rx, ry),
                    rotation: x_axis_rotation.to_radians(),
                    is_large: large_arc,
                    is_positive: sweep,
                };
                match between(at, to, given) {
                    Some(arc) => pen.arc_to(arc, to),
                    None => pen.line_to(to),
                }
            }
            PathSegment::ClosePath { .. } => pen.close(),
        }
        self.mirror = mirror;
        self.pen.at().is_finite()
    }
}

#[cfg(test)]
mod tests {
    use kurbo::Point;

    use super::{data, points};
    use crate::shape::Segment;

    #[test]
    fn relative_smooth_and_short_commands_are_resolved() {
        let drawn = data("m10 20 h5 v-5 l1 1 H0 V0 c1 0 2 1 2 2 s1 2 2 2 q1 0 1 1 t1 1 z");
        assert!(!drawn.is_faulty);
        let [contour] = drawn.contours.as_slice() else { panic!("{drawn:?}") };
        assert!(contour.is_closed);
        assert_eq!(contour.start, Point::new(10.0, 20.0));
        let ends: Vec<(f64, f64)> =
            contour.segments.iter().map(|segment| (segment.end().x, segment.end().y)).collect();
        let expected = [
            (15.0, 20.0),
            (15.0, 15.0),
            (16.0, 16.0),
            (0.0, 16.0),
            (0.0, 0.0),
            (2.0, 2.0),
            (4.0, 4.0),
            (5.0, 5.0),
            (6.0, 6.0),
            (10.0, 20.0),
        ];
        assert_eq!(ends, expected);
        // The mirror of (2, 1) at (2, 2) is (2, 3).
        let smooth =
            Segment::Cubic(Point::new(2.0, 3.0), Point::new(3.0, 4.0), Point::new(4.0, 4.0));
        assert_eq!(contour.segments[6], smooth);
    }

    #[test]
    fn what_follows_a_close_begins_where_the_loop_began() {
        let drawn = data("M1 1L2 1L2 2ZL0 0");
        assert_eq!(drawn.contours.len(), 2);
        assert_eq!(drawn.contours[1].start, Point::new(1.0, 1.0));
    }

    #[test]
    fn faulty_data_counts_up_to_its_fault() {
        let drawn = data("M0 0L1 1L2 x");
        assert!(drawn.is_faulty);
        assert_eq!(drawn.contours[0].segments.len(), 1);
        assert!(data("M0 0L1e999 1").is_faulty || data("M0 0L1e999 1").contours.is_empty());
        assert_eq!(data("M5 5z").points, 1);
    }

    #[test]
    fn an_arc_stays_an_arc() {
        let drawn = data("M100 0A100 100 0 1 1 -100 0A100 100 0 1 1 100 0Z");
        let [contour] = drawn.contours.as_slice() else { panic!("{drawn:?}") };
        assert_eq!(contour.segments.len(), 2);
        for segment in &contour.segments {
            let Segment::Arc(arc) = segment else { panic!("{segment:?}") };
            assert!((arc.major.hypot() - 100.0).abs() < 1e-12);
        }
    }

    #[test]
    fn polygons_are_closed_and_polylines_are_not() {
        assert!(points("0,0 1,0 1,1", true).contours[0].is_closed);
        assert!(!points("0 0 1 0 1 1", false).contours[0].is_closed);
        assert!(points("7 7", false).contours.is_empty());
    }
}
