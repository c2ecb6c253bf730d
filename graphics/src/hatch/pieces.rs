//! Contours cut into pieces that only rise or only fall, and where those cross a horizontal line.

use kurbo::Point;
use messages::math;

use crate::{Contour, Segment};

/// A piece is solved to this height [m].
const SOLVED: f64 = 1e-13;
/// Steps of the solver; halving alone needs 53.
const STEPS: usize = 80;

/// A part of a segment along which y only rises or only falls.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    /// Index of its area.
    pub(super) area: u32,
    /// First piece of its contour, and the piece after the contour's last one.
    pub(super) contour: (u32, u32),
    /// Segment and where that begins.
    segment: Segment,
    start: Point,
    /// Fractions of the segment between which it lies.
    from: f64,
    to: f64,
    /// Heights at its ends, the same bits as those of its neighbours [m].
    heights: (f64, f64),
}

impl Piece {
    /// Height of its start [m].
    pub(super) fn first(&self) -> f64 {
        self.heights.0
    }

    /// Height of its end [m].
    pub(super) fn last(&self) -> f64 {
        self.heights.1
    }

    /// Whether it crosses a height: begins at or below it and ends above, or the other way. A contour
    /// so crosses every height as often upwards as downwards.
    pub(super) fn crosses(&self, y: f64) -> bool {
        (self.first() > y) != (self.last() > y)
    }

    /// Fraction of the segment at which the piece is at a height that it crosses.
    pub(super) fn solve(&self, y: f64) -> f64 {
        match self.segment {
            Segment::Line(end) => {
                let t = (y - self.start.y) / (end.y - self.start.y);
                t.clamp(0.0, 1.0)
            }
            _ => self.solve_curve(y),
        }
    }

    /// Newton's method within a bracket that halves where it does not help.
    fn solve_curve(&self, y: f64) -> f64 {
        let (mut low, mut high) =
            if self.first() < self.last() { (self.from, self.to) } else { (self.to, self.from) };
        let mut t = low + (high - low) * 0.5;
        for _ in 0..STEPS {
            let (height, rate) = height_and_rate(&self.segment, self.start, t);
            let off = height - y;
            if off.abs() <= SOLVED {
                break;
            }
            *(if off > 0.0 { &mut high } else { &mut low }) = t;
            let newton = t - off / rate;
            let is_within = (low.min(high)..=low.max(high)).contains(&newton);
            let next = if is_within { newton } else { low + (high - low) * 0.5 };
            if next == t {
                break;
            }
            t = next;
        }
        t
    }

    /// The point at a fraction of the segment [m].
    pub(super) fn point(&self, t: f64) -> Point {
        self.segment.point(self.start, t)
    }

    /// The curve from one fraction of the segment to another.
    pub(super) fn part(&self, from: f64, to: f64) -> Segment {
        self.segment.part(self.start, from, to).1
    }

    /// Fraction of the segment at its start, or at its end.
    pub(super) fn fraction(&self, at_end: bool) -> f64 {
        if at_end { self.to } else { self.from }
    }
}

/// Height of a curve at a fraction [m], and its derivative.
fn height_and_rate(segment: &Segment, start: Point, t: f64) -> (f64, f64) {
    match *segment {
        Segment::Line(end) => (start.y + (end.y - start.y) * t, end.y - start.y),
        Segment::Cubic(first, second, end) => {
            let u = 1.0 - t;
            let rate = 3.0
                * (u * u * (first.y - start.y)
                    + 2.0 * u * t * (second.y - first.y)
                    + t * t * (end.y - second.y));
            (segment.point(start, t).y, rate)
        }
        Segment::Arc(arc) => {
            let (sine, cosine) = math::sin_cos(arc.start + arc.sweep * t);
            let height = arc.centre.y + arc.major.y * cosine + arc.minor.y * sine;
            (height, arc.sweep * (arc.minor.y * cosine - arc.major.y * sine))
        }
    }
}

/// Fractions between 0 and 1 at which a segment turns from rising to falling or back, in order.
fn turns(segment: &Segment, start: Point) -> Vec<f64> {
    let mut turns = Vec::new();
    match *segment {
        Segment::Line(_) => {}
        Segment::Cubic(first, second, end) => {
            // The derivative by a third: a·(1−t)² + 2b·(1−t)·t + c·t².
            let (a, b, c) = (first.y - start.y, second.y - first.y, end.y - second.y);
            let square = b * b - a * c;
            if square >= 0.0 {
                // Both roots without cancellation, each as a ratio t : 1−t.
                let root = b + if b < 0.0 { -square.sqrt() } else { square.sqrt() };
                // With s = t/(1−t): c·s² + 2b·s + a = 0, whose roots are −root/c and −a/root.
                turns.extend([(-root, c), (-a, root)].map(|(t, u)| t / (t + u)));
            }
        }
        Segment::Arc(arc) => {
            let highest = math::atan2(arc.minor.y, arc.major.y);
            let half = math::TURN / 2.0;
            let (low, high) =
                (arc.start.min(arc.start + arc.sweep), arc.start.max(arc.start + arc.sweep));
            let first = ((low - highest) / half).floor();
            // At most a turn: four half turns lie around it.
            turns.extend(
                (0..4)
                    .map(|step| highest + half * (first + f64::from(step)))
                    .filter(|angle| (low..=high).contains(angle))
                    .map(|angle| (angle - arc.start) / arc.sweep),
            );
        }
    }
    turns.retain(|t| *t > 0.0 && *t < 1.0);
    turns.sort_by(f64::total_cmp);
    turns.dedup();
    turns
}

/// The pieces of a contour, closed by a line where it is not; none where it has no height.
pub(super) fn cut(contour: &Contour, area: u32, pieces: &mut Vec<Piece>) {
    let begin = pieces.len() as u32;
    let closing = Segment::Line(contour.start);
    let gap = (contour.end() != contour.start).then_some((contour.end(), &closing));
    for (start, segment) in contour.pieces().chain(gap) {
        let mut from = (0.0, start.y);
        let turns = turns(segment, start);
        let ends = turns.iter().map(|t| (*t, segment.point(start, *t).y));
        for to in ends.chain([(1.0, segment.end().y)]) {
            pieces.push(Piece {
                area,
                contour: (begin, begin),
                segment: *segment,
                start,
                from: from.0,
                to: to.0,
                heights: (from.1, to.1),
            });
            from = to;
        }
    }
    let end = pieces.len() as u32;
    pieces[begin as usize..].iter_mut().for_each(|piece| piece.contour.1 = end);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use kurbo::Vec2;

    #[test]
    fn pieces_of_random_curves_only_rise_or_only_fall_and_are_solved_exactly() {
        let mut random = Random::new(7);
        for round in 0..2_000 {
            let mut point = || Point::new(random.unit(), (random.unit() * 8.0).round() / 8.0);
            let start = point();
            let cubic = Segment::Cubic(point(), point(), point());
            let arc = crate::Arc {
                centre: point(),
                major: point().to_vec2(),
                minor: point().to_vec2() - Vec2::new(0.5, 0.5),
                start: random.unit() * 20.0 - 10.0,
                sweep: (random.unit() - 0.5) * 2.0 * math::TURN,
            };
            let contour = if round % 2 == 0 {
                Contour { start, segments: vec![cubic], is_closed: false }
            } else {
                let start = arc.point(arc.start);
                Contour { start, segments: vec![Segment::Arc(arc)], is_closed: false }
            };
            let mut pieces = Vec::new();
            cut(&contour, 0, &mut pieces);
            for piece in pieces {
                let mut before = piece.first();
                let sign = (piece.last() - piece.first()).signum();
                for step in 0..=50 {
                    let t = piece.from + (piece.to - piece.from) * f64::from(step) / 50.0;
                    let y = piece.point(t).y;
                    assert!((y - before) * sign >= -1e-12, "{piece:?} at {t}");
                    before = y;
                }
                let y = piece.first() + (piece.last() - piece.first()) * random.unit();
                if piece.crosses(y) {
                    let t = piece.solve(y);
                    assert!((piece.point(t).y - y).abs() < 1e-12, "{piece:?} at {y}");
                    let range = piece.from.min(piece.to)..=piece.from.max(piece.to);
                    assert!(range.contains(&t), "{piece:?} at {t}");
                }
            }
        }
    }
}
