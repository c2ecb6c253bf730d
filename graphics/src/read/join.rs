//! Contours of pieces that touch end to end.

use std::collections::{HashMap, VecDeque};

use kurbo::{Affine, Point, Vec2};

use crate::shape::{Arc, Contour, Segment};

/// How far apart two ends may be to be one place [m].
pub(crate) const TOUCHING: f64 = 1e-6;

/// How many ends within some µm are tried: a heap of more of them stays apart.
const MOST_LOOKED_AT: usize = 1000;

/// Joins open contours whose ends touch, each turned as it fits, and closes them where they close. Contours
/// stay in the order of their first piece; with each comes the index of that piece.
pub(crate) fn join(contours: Vec<Contour>) -> Vec<(usize, Contour)> {
    let mut ends = Ends::default();
    for (index, contour) in contours.iter().enumerate().filter(|(_, contour)| is_open(contour)) {
        ends.add(contour.start, (index, false));
        ends.add(contour.end(), (index, true));
    }
    let mut pieces: Vec<Option<Contour>> = contours.into_iter().map(Some).collect();
    let mut joined = Vec::new();
    for first in 0..pieces.len() {
        let Some(mut contour) = pieces[first].take() else { continue };
        if is_open(&contour) {
            extend(&mut contour, &mut pieces, &mut ends);
            if is_open(&contour) {
                // What comes before the first piece.
                let mut turned = reversed(&contour);
                extend(&mut turned, &mut pieces, &mut ends);
                contour = reversed(&turned);
            }
        }
        joined.push((first, contour));
    }
    joined
}

fn is_open(contour: &Contour) -> bool {
    !contour.is_closed
}

fn touch(one: Point, other: Point) -> bool {
    (one - other).hypot() <= TOUCHING
}

/// Puts pieces at the end of a contour until none fits, or it is back at its start.
fn extend(contour: &mut Contour, pieces: &mut [Option<Contour>], ends: &mut Ends) {
    loop {
        let at = contour.end();
        if touch(at, contour.start) && length_exceeds(contour) {
            contour.is_closed = true;
            if let Some(segment) = contour.segments.pop() {
                let from = contour.end();
                contour.segments.push(ending(segment, from, contour.start));
            }
            return;
        }
        let Some((index, is_end)) = ends.near(at, pieces) else { return };
        let Some(piece) = pieces[index].take() else { return };
        let piece = if is_end { reversed(&piece) } else { piece };
        let mut segments = piece.segments.into_iter();
        if let Some(first) = segments.next() {
            contour.segments.push(beginning(first, piece.start, at));
        }
        contour.segments.extend(segments);
    }
}

/// Whether a contour goes farther than its ends may be apart: one that does not is no loop.
fn length_exceeds(contour: &Contour) -> bool {
    let mut at = contour.start;
    contour.segments.iter().any(|segment| {
        let (from, end) = (at, segment.end());
        at = end;
        match *segment {
            Segment::Line(end) => !touch(from, end),
            Segment::Cubic(first, second, end) => {
                [first, second, end].iter().any(|&it| !touch(from, it))
            }
            Segment::Arc(arc) => {
                !touch(from, end)
                    || (arc.major.hypot() + arc.minor.hypot()) * arc.sweep.abs() > TOUCHING
            }
        }
    })
}

/// The contour the other way round.
pub(crate) fn reversed(contour: &Contour) -> Contour {
    let mut starts = vec![contour.start];
    starts.extend(contour.segments.iter().map(Segment::end));
    let segments =
        contour.segments.iter().zip(&starts).rev().map(|(segment, &from)| match *segment {
            Segment::Line(_) => Segment::Line(from),
            Segment::Cubic(first, second, _) => Segment::Cubic(second, first, from),
            Segment::Arc(arc) => {
                Segment::Arc(Arc { start: arc.start + arc.sweep, sweep: -arc.sweep, ..arc })
            }
        });
    Contour { start: contour.end(), segments: segments.collect(), is_closed: contour.is_closed }
}

/// A segment moved by less than [`TOUCHING`] at its beginning.
fn beginning(segment: Segment, from: Point, to: Point) -> Segment {
    match segment {
        Segment::Line(end) => Segment::Line(end),
        Segment::Cubic(first, second, end) => Segment::Cubic(first + (to - from), second, end),
        Segment::Arc(arc) => Segment::Arc(turned(arc, segment.end(), from, to)),
    }
}

/// A segment moved by less than [`TOUCHING`] at its end; `from` is where it begins.
fn ending(segment: Segment, from: Point, to: Point) -> Segment {
    let end = segment.end();
    match segment {
        Segment::Line(_) => Segment::Line(to),
        Segment::Cubic(first, second, _) => Segment::Cubic(first, second + (to - end), to),
        Segment::Arc(arc) => Segment::Arc(turned(arc, from, end, to)),
    }
}

/// The arc turned and scaled about a point so that another point of it comes to a third: a circle stays one.
fn turned(arc: Arc, about: Point, from: Point, to: Point) -> Arc {
    let (old, new) = (from - about, to - about);
    let square = old.hypot2();
    if from == to {
        return arc;
    }
    if square < 1e4 * TOUCHING * TOUCHING {
        return Arc { centre: arc.centre + (to - from), ..arc };
    }
    // The quotient of the two as complex numbers.
    let (real, imaginary) = (old.dot(new) / square, old.cross(new) / square);
    let turn = Affine::new([real, imaginary, -imaginary, real, 0.0, 0.0]);
    let by = Affine::translate(about.to_vec2()) * turn * Affine::translate(-about.to_vec2());
    arc.transformed(by)
}

/// A contour, and whether it is its last point.
type End = (usize, bool);

/// The ends of contours by place.
#[derive(Debug, Default)]
struct Ends {
    cells: HashMap<(i64, i64), VecDeque<(Point, End)>>,
}

impl Ends {
    fn cell(at: Point) -> (i64, i64) {
        ((at.x / (2.0 * TOUCHING)).floor() as i64, (at.y / (2.0 * TOUCHING)).floor() as i64)
    }

    fn add(&mut self, at: Point, end: End) {
        self.cells.entry(Self::cell(at)).or_default().push_back((at, end));
    }

    /// An end of an unused piece that touches a place, the first one in the same cell before others.
    fn near(&mut self, at: Point, pieces: &[Option<Contour>]) -> Option<End> {
        for x in [0.0, 1.0, -1.0] {
            for y in [0.0, 1.0, -1.0] {
                let cell = Self::cell(at + Vec2::new(x, y) * (2.0 * TOUCHING));
                let Some(ends) = self.cells.get_mut(&cell) else { continue };
                // So that thousands of lines from one point do not pass over all used ones each time.
                while ends.front().is_some_and(|&(_, (index, _))| pieces[index].is_none()) {
                    ends.pop_front();
                }
                let mut looked_at = ends.iter().take(MOST_LOOKED_AT);
                let found = looked_at
                    .find(|(place, (index, _))| touch(*place, at) && pieces[*index].is_some());
                if let Some(&(_, end)) = found {
                    return Some(end);
                }
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::PI;

    use kurbo::Point;

    use super::{join, reversed};
    use crate::read::arcs::circular;
    use crate::shape::{Contour, Segment};

    fn line(from: (f64, f64), to: (f64, f64)) -> Contour {
        let segments = vec![Segment::Line(to.into())];
        Contour { start: from.into(), segments, is_closed: false }
    }

    #[test]
    fn pieces_in_any_order_and_direction_become_a_loop() {
        let pieces = vec![
            line((0.0, 0.0), (1.0, 0.0)),
            line((0.0, 1.0), (1.0, 1.0)),
            line((1.0, 0.0), (1.0 + 4e-7, 1.0)),
            line((5.0, 5.0), (6.0, 6.0)),
            line((0.0, 1.0), (0.0, 3e-7)),
        ];
        let joined = join(pieces);
        assert_eq!(joined.len(), 2);
        assert_eq!((joined[0].0, joined[1].0), (0, 3));
        let square = &joined[0].1;
        assert!(square.is_closed && square.segments.len() == 4);
        assert_eq!(square.end(), square.start);
        assert!(!joined[1].1.is_closed);
    }

    #[test]
    fn what_comes_before_the_first_piece_is_put_before_it() {
        let joined = join(vec![line((1.0, 0.0), (2.0, 0.0)), line((0.0, 0.0), (1.0, 0.0))]);
        assert_eq!(joined.len(), 1);
        assert_eq!(joined[0].1.start, Point::new(0.0, 0.0));
        assert_eq!(joined[0].1.end(), Point::new(2.0, 0.0));
    }

    #[test]
    fn a_stadium_of_lines_and_arcs_closes_without_a_gap() {
        let arc = |x: f64, start: f64| {
            let arc = circular(Point::new(x, 0.5), 0.5, start, PI);
            let segments = vec![Segment::Arc(arc)];
            Contour { start: arc.point(arc.start), segments, is_closed: false }
        };
        let pieces = vec![
            line((0.0, 0.0), (2.0, 5e-7)),
            arc(0.0, PI / 2.0),
            line((0.0, 1.0), (2.0, 1.0)),
            arc(2.0, -PI / 2.0),
        ];
        let joined = join(pieces);
        assert_eq!(joined.len(), 1);
        let contour = &joined[0].1;
        assert!(contour.is_closed);
        let mut at = contour.start;
        for segment in &contour.segments {
            if let Segment::Arc(arc) = segment {
                assert!((arc.point(arc.start) - at).hypot() < 1e-12);
                assert!((arc.major.hypot() - 0.5).abs() < 1e-6);
                assert!((arc.minor.hypot() - arc.major.hypot()).abs() < 1e-12);
            }
            at = segment.end();
        }
        assert!((at - contour.start).hypot() < 1e-12);
    }

    #[test]
    fn a_star_of_many_lines_is_joined_in_pairs() {
        let rays = 100_000;
        let ray = |number: u32| line((0.0, 0.0), (1.0, f64::from(number)));
        let joined = join((0..rays).map(ray).collect());
        assert_eq!(joined.len(), rays as usize / 2);
        assert!(joined.iter().all(|(_, contour)| contour.segments.len() == 2));
    }

    #[test]
    fn a_reversed_contour_goes_the_same_way_back() {
        let mut contour = line((0.0, 0.0), (1.0, 0.0));
        contour.segments.push(Segment::Cubic(
            (2.0, 0.0).into(),
            (2.0, 1.0).into(),
            (3.0, 1.0).into(),
        ));
        let back = reversed(&contour);
        assert_eq!(back.start, Point::new(3.0, 1.0));
        assert_eq!(back.end(), Point::new(0.0, 0.0));
        assert_eq!(reversed(&back), contour);
    }
}
