//! B-splines as Bézier curves and arcs, exact where those can be.

use kurbo::{Point, Vec2};
use messages::math;

use crate::read::pen::Pen;
use crate::shape::Arc;

/// How far a cubic curve may be from a rational one, or one of a higher degree [m].
const TOLERANCE: f64 = 0.1e-6;

/// How often such a curve is halved at most.
const MOST_HALVINGS: u32 = 12;

/// The highest degree: that of the files' writers.
const MOST_DEGREE: usize = 25;

/// A B-spline in the plane.
#[derive(Debug, Clone, Default)]
pub(super) struct Spline {
    pub(super) degree: usize,
    /// Not descending; as many as control points, and the degree and 1 more.
    pub(super) knots: Vec<f64>,
    /// Places and weights of the control points [m].
    pub(super) controls: Vec<(Point, f64)>,
}

/// A place times its weight, and the weight.
#[derive(Debug, Clone, Copy)]
struct Weighted {
    at: Vec2,
    weight: f64,
}

impl Weighted {
    fn mix(self, other: Self, share: f64) -> Self {
        Self {
            at: self.at * (1.0 - share) + other.at * share,
            weight: self.weight * (1.0 - share) + other.weight * share,
        }
    }

    fn point(self) -> Point {
        (self.at / self.weight).to_point()
    }
}

impl Spline {
    /// Draws the spline; `false` where its numbers do not fit each other.
    pub(super) fn draw(&self, pen: &mut Pen) -> bool {
        let (degree, count) = (self.degree, self.controls.len());
        let fits = (1..=MOST_DEGREE).contains(&degree)
            && count > degree
            && self.knots.len() == count + degree + 1
            && self.knots.is_sorted()
            && self.controls.iter().all(|&(at, weight)| weight > 0.0 && at.is_finite())
            && self.knots[degree] < self.knots[count];
        if !fits {
            return false;
        }
        let weights = self.controls.iter().map(|&(_, weight)| weight);
        let (least, most) = weights
            .fold((f64::INFINITY, 0.0_f64), |(least, most), it| (least.min(it), most.max(it)));
        let is_rational = most - least > 1e-12 * most;
        let mut is_begun = false;
        for span in degree..count {
            if self.knots[span] < self.knots[span + 1] {
                let curve = self.bezier(span);
                if !is_begun {
                    pen.move_to(curve[0].point());
                    is_begun = true;
                }
                draw_bezier(&curve, is_rational, pen);
            }
        }
        true
    }

    /// The Bézier curve between two knots: its control points are the polar form at those knots (Ramshaw,
    /// "Blossoming: a connect-the-dots approach to splines", DEC SRC report 19, 1987).
    fn bezier(&self, span: usize) -> Vec<Weighted> {
        let (from, to) = (self.knots[span], self.knots[span + 1]);
        (0..=self.degree)
            .map(|second| {
                let argument =
                    |number: usize| if number < self.degree - second { from } else { to };
                self.blossom(span, argument)
            })
            .collect()
    }

    fn blossom(&self, span: usize, argument: impl Fn(usize) -> f64) -> Weighted {
        let degree = self.degree;
        let controls = &self.controls[span - degree..=span];
        let mut points: Vec<Weighted> = controls
            .iter()
            .map(|&(at, weight)| Weighted { at: at.to_vec2() * weight, weight })
            .collect();
        for round in 1..=degree {
            let value = argument(round - 1);
            for index in (round..=degree).rev() {
                let knot = span - degree + index;
                let (low, high) = (self.knots[knot], self.knots[knot + degree + 1 - round]);
                let share = (value - low) / (high - low);
                points[index] = points[index - 1].mix(points[index], share);
            }
        }
        points[degree]
    }
}

fn draw_bezier(curve: &[Weighted], is_rational: bool, pen: &mut Pen) {
    match (curve, is_rational) {
        (&[_, end], _) => pen.line_to(end.point()),
        (&[_, middle, end], false) => pen.quadratic_to(middle.point(), end.point()),
        (&[_, first, second, end], false) => {
            pen.cubic_to(first.point(), second.point(), end.point());
        }
        (&[start, middle, end], true) => match conic(start, middle, end) {
            Some(arc) => pen.arc_to(arc, end.point()),
            None => approximate(curve, MOST_HALVINGS, pen),
        },
        _ => approximate(curve, MOST_HALVINGS, pen),
    }
}

/// The arc of an ellipse that a rational quadratic curve is; `None` where it is a parabola or a hyperbola.
///
/// With its weights as 1, cos θ, 1, the curve is the image of the unit circle's arc from −θ to θ, whose tangents
/// meet at 1/cos θ: centre and semi-diameters follow from ends and middle control point.
fn conic(start: Weighted, middle: Weighted, end: Weighted) -> Option<Arc> {
    let scale = (start.weight * end.weight).sqrt();
    let cosine = middle.weight / scale;
    if cosine > 1.0 - 1e-9 {
        return None;
    }
    let half = math::acos(cosine);
    let sine = math::sin(half);
    let (from, to) = (start.point(), end.point());
    let centre_of_chord = from.midpoint(to).to_vec2();
    let major = (middle.at / scale - centre_of_chord * cosine) / (sine * sine);
    let centre = (centre_of_chord - major * cosine).to_point();
    let minor = (to - from) / (2.0 * sine);
    let arc = Arc { centre, major, minor, start: -half, sweep: 2.0 * half };
    (centre.is_finite() && major.is_finite() && minor.is_finite()).then_some(arc)
}

/// Cubic curves with the ends and the derivatives of the curve, halved until they are close to it.
fn approximate(curve: &[Weighted], halvings: u32, pen: &mut Pen) {
    let degree = (curve.len() - 1) as f64;
    let (start, end) = (curve[0], curve[curve.len() - 1]);
    let (from, to) = (start.point(), end.point());
    let leaving = curve[1].at - from.to_vec2() * curve[1].weight;
    let before = curve[curve.len() - 2];
    let arriving = to.to_vec2() * before.weight - before.at;
    let first = from + leaving * (degree / 3.0 / start.weight);
    let second = to - arriving * (degree / 3.0 / end.weight);
    let cubic =
        [from, first, second, to].map(|point| Weighted { at: point.to_vec2(), weight: 1.0 });
    let off = [0.2, 0.35, 0.5, 0.65, 0.8]
        .map(|share| (split(curve, share).2 - split(&cubic, share).2).hypot());
    if halvings == 0 || off.iter().all(|&off| off <= TOLERANCE) {
        pen.cubic_to(first, second, to);
        return;
    }
    let (left, right, _) = split(curve, 0.5);
    approximate(&left, halvings - 1, pen);
    approximate(&right, halvings - 1, pen);
}

/// The two parts of a curve, and the point between them (de Casteljau).
fn split(curve: &[Weighted], share: f64) -> (Vec<Weighted>, Vec<Weighted>, Point) {
    let mut points = curve.to_vec();
    let (mut left, mut right) = (vec![points[0]], vec![points[points.len() - 1]]);
    while points.len() > 1 {
        points = points.windows(2).map(|pair| pair[0].mix(pair[1], share)).collect();
        left.push(points[0]);
        right.push(points[points.len() - 1]);
    }
    right.reverse();
    let between = points[0].point();
    (left, right, between)
}

/// The cubic spline through points, its second derivative continuous over the lengths of the chords, with the
/// given tangents at its ends or none bent there (de Boor, "A practical guide to splines", 1978, chapter IV).
pub(super) fn through(points: &[Point], tangents: [Option<Vec2>; 2], pen: &mut Pen) {
    let mut kept: Vec<Point> = Vec::with_capacity(points.len());
    for &point in points {
        if kept.last().is_none_or(|&last| (last - point).hypot() > 1e-12) {
            kept.push(point);
        }
    }
    let [first, .., _] = kept.as_slice() else { return };
    pen.move_to(*first);
    let chords: Vec<f64> = kept.windows(2).map(|pair| (pair[1] - pair[0]).hypot()).collect();
    let slopes = derivatives(&kept, &chords, tangents);
    for (index, pair) in kept.windows(2).enumerate() {
        let third = chords[index] / 3.0;
        pen.cubic_to(pair[0] + slopes[index] * third, pair[1] - slopes[index + 1] * third, pair[1]);
    }
}

/// The derivatives at the points, by elimination in the tridiagonal system.
fn derivatives(points: &[Point], chords: &[f64], tangents: [Option<Vec2>; 2]) -> Vec<Vec2> {
    let last = points.len() - 1;
    let secant = |index: usize| (points[index + 1] - points[index]) / chords[index];
    let row = |index: usize| -> (f64, f64, f64, Vec2) {
        match index {
            0 => match tangents[0] {
                Some(tangent) => (0.0, 1.0, 0.0, tangent),
                None => (0.0, 2.0, 1.0, secant(0) * 3.0),
            },
            index if index == last => match tangents[1] {
                Some(tangent) => (0.0, 1.0, 0.0, tangent),
                None => (1.0, 2.0, 0.0, secant(last - 1) * 3.0),
            },
            _ => {
                let (before, after) = (chords[index - 1], chords[index]);
                let right = (secant(index - 1) * after + secant(index) * before) * 3.0;
                (after, 2.0 * (before + after), before, right)
            }
        }
    };
    let mut upper = Vec::with_capacity(points.len());
    let mut values: Vec<Vec2> = Vec::with_capacity(points.len());
    for index in 0..=last {
        let (below, diagonal, above, right) = row(index);
        let (before, value) = match index {
            0 => (0.0, Vec2::ZERO),
            _ => (upper[index - 1], values[index - 1]),
        };
        let pivot = diagonal - below * before;
        upper.push(above / pivot);
        values.push((right - value * below) / pivot);
    }
    for index in (0..last).rev() {
        values[index] = values[index] - values[index + 1] * upper[index];
    }
    values
}

#[cfg(test)]
mod tests {
    use kurbo::{ParamCurve as _, Point};

    use super::{Spline, through};
    use crate::read::pen::Pen;
    use crate::shape::Segment;

    fn drawn(spline: &Spline) -> Vec<Segment> {
        let mut pen = Pen::default();
        assert!(spline.draw(&mut pen));
        pen.take().remove(0).segments
    }

    fn spline(degree: usize, knots: &[f64], controls: &[(f64, f64, f64)]) -> Spline {
        let controls = controls.iter().map(|&(x, y, weight)| (Point::new(x, y), weight)).collect();
        Spline { degree, knots: knots.to_vec(), controls }
    }

    #[test]
    fn a_circle_of_nine_control_points_is_four_true_arcs() {
        let root = 0.5_f64.sqrt();
        let controls = [
            (1.0, 0.0, 1.0),
            (1.0, 1.0, root),
            (0.0, 1.0, 1.0),
            (-1.0, 1.0, root),
            (-1.0, 0.0, 1.0),
            (-1.0, -1.0, root),
            (0.0, -1.0, 1.0),
            (1.0, -1.0, root),
            (1.0, 0.0, 1.0),
        ];
        let knots = [0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0, 4.0];
        let segments = drawn(&spline(2, &knots, &controls));
        assert_eq!(segments.len(), 4);
        for segment in segments {
            let Segment::Arc(arc) = segment else { panic!("{segment:?}") };
            for step in 0..=20 {
                let at = arc.point(arc.start + arc.sweep * f64::from(step) / 20.0);
                assert!((at.to_vec2().hypot() - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_uniform_cubic_spline_without_end_knots_is_its_known_curve() {
        // The first point of a uniform cubic B-spline is (p0 + 4 p1 + p2) / 6.
        let knots: Vec<f64> = (0..8).map(f64::from).collect();
        let controls = [(0.0, 0.0, 1.0), (6.0, 0.0, 1.0), (6.0, 6.0, 1.0), (0.0, 6.0, 1.0)];
        let mut pen = Pen::default();
        assert!(spline(3, &knots, &controls).draw(&mut pen));
        let contour = pen.take().remove(0);
        assert!((contour.start - Point::new(5.0, 1.0)).hypot() < 1e-12);
        let Segment::Cubic(first, second, end) = contour.segments[0] else { panic!() };
        assert!((first - Point::new(6.0, 2.0)).hypot() < 1e-12);
        assert!((second - Point::new(6.0, 4.0)).hypot() < 1e-12);
        assert!((end - Point::new(5.0, 5.0)).hypot() < 1e-12);
    }

    #[test]
    fn a_rational_cubic_is_met_within_its_tolerance() {
        // A quarter of a circle of 0.1 m, its degree raised from 2 to 3.
        let root = 0.5_f64.sqrt();
        let weight = (1.0 + 2.0 * root) / 3.0;
        let off = 2.0 * root / 3.0 / weight * 0.1;
        let controls = [(0.1, 0.0, 1.0), (0.1, off, weight), (off, 0.1, weight), (0.0, 0.1, 1.0)];
        let knots = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
        // Raised exactly: the second control point is (P0 + 2 w P1) / (1 + 2 w).
        let mut at = Point::new(0.1, 0.0);
        let segments = drawn(&spline(3, &knots, &controls));
        assert!(segments.len() > 1 && segments.len() < 20);
        for segment in segments {
            let Segment::Cubic(first, second, end) = segment else { panic!("{segment:?}") };
            let curve = kurbo::CubicBez::new(at, first, second, end);
            for step in 0..=20 {
                let out = curve.eval(f64::from(step) / 20.0).to_vec2().hypot();
                assert!((out - 0.1).abs() < 0.1e-6, "{out}");
            }
            at = end;
        }
    }

    #[test]
    fn a_spline_through_points_of_a_line_is_the_line_and_meets_all_points() {
        let points = [(0.0, 0.0), (1.0, 1.0), (3.0, 3.0), (4.0, 4.0)].map(Point::from);
        let mut pen = Pen::default();
        through(&points, [None, None], &mut pen);
        let contour = pen.take().remove(0);
        let mut at = contour.start;
        for (segment, expected) in contour.segments.iter().zip(&points[1..]) {
            assert_eq!(segment.end(), *expected);
            let Segment::Cubic(first, second, end) = *segment else { panic!() };
            let middle = kurbo::CubicBez::new(at, first, second, end).eval(0.4);
            assert!((middle.x - middle.y).abs() < 1e-12);
            at = end;
        }
    }

    #[test]
    fn numbers_that_do_not_fit_are_refused() {
        let controls = [(0.0, 0.0, 1.0), (1.0, 0.0, 1.0)];
        for (degree, knots) in [
            (1, &[0.0, 0.0, 1.0][..]),
            (1, &[0.0, 1.0, 0.5, 2.0]),
            (1, &[0.0, 0.0, 0.0, 0.0]),
            (0, &[0.0, 0.0, 1.0]),
            (9, &[0.0, 0.0, 1.0, 1.0]),
            (1, &[0.0, f64::NAN, 1.0, 1.0]),
        ] {
            assert!(!spline(degree, knots, &controls).draw(&mut Pen::default()));
        }
    }
}
