//! The line of one stroke, by arc length: where along it a marked point belongs.

use messages::artwork::Stroke;
use nalgebra::Vector3;

/// The foot of a perpendicular on a stroke's line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// Arc length from the stroke's start [m]; below 0 or above the length on the straight
    /// extension beyond an end.
    pub at: f64,
    /// Distance of the point from the line, or from its extension beyond an end [m].
    pub distance: f64,
}

/// A place at which a stroke's line passes a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passage {
    /// The foot there.
    pub foot: Foot,
    /// Which way the line goes there; of no particular length.
    pub direction: Vector3<f64>,
}

/// How much further along the line than the tolerance two feet may be apart and be of one passage.
const ONE_PASSAGE: f64 = 10.0;

/// The polyline of a stroke with the arc length of each of its points.
#[derive(Debug, Clone)]
pub struct Line {
    points: Vec<Vector3<f64>>,
    along: Vec<f64>,
}

/// Weight of the distance from the expected arc length against the distance from the line, both
/// squared. It only chooses between branches of the line that pass close to each other.
const EXPECTATION: f64 = 0.01;

impl Line {
    /// The line of a stroke; points that repeat the one before are left out.
    pub fn new(stroke: &Stroke) -> Self {
        let count = stroke.points.len();
        let mut line = Self { points: Vec::with_capacity(count), along: Vec::with_capacity(count) };
        line.extend(stroke);
        line
    }

    /// Goes on along `stroke`, which begins where the line ends.
    pub fn extend(&mut self, stroke: &Stroke) {
        let mut length = self.length();
        for point in stroke.points.iter().map(|&point| Vector3::from(point)) {
            if let Some(last) = self.points.last() {
                let step = (point - last).norm();
                if step == 0.0 {
                    continue;
                }
                length += step;
            }
            self.points.push(point);
            self.along.push(length);
        }
    }

    /// Length of the line [m]; 0 for a dot.
    pub fn length(&self) -> f64 {
        self.along.last().copied().unwrap_or(0.0)
    }

    /// The foot of `point` within `reach` [m] of the arc length `near`, where it is `expected`.
    ///
    /// Only this stretch is looked at, so that other parts of the stroke that pass by the same
    /// place, or its own end where it is closed, are not mistaken for it.
    pub fn foot(&self, point: &Vector3<f64>, near: f64, expected: f64, reach: f64) -> Foot {
        let length = self.length();
        let low = (near - reach).clamp(0.0, length);
        let high = (near + reach).clamp(0.0, length);
        let first = self.along.partition_point(|&at| at < low).saturating_sub(1);
        let last = self.along.partition_point(|&at| at <= high);
        let cost = |foot: &Foot| {
            let surprise = foot.at - expected;
            foot.distance * foot.distance + EXPECTATION * surprise * surprise
        };
        let best = (first..last.max(first + 1))
            .filter_map(|index| Some((index, self.foot_on(index, point)?)))
            .min_by(|(_, a), (_, b)| cost(a).total_cmp(&cost(b)));
        match best {
            Some((index, foot)) => self.descend(index, foot, point),
            None => Foot { at: 0.0, distance: self.distance_from_dot(point) },
        }
    }

    /// The foot nearest to `point` anywhere on the line.
    pub fn nearest(&self, point: &Vector3<f64>) -> Foot {
        (0..self.points.len())
            .filter_map(|index| self.foot_on(index, point))
            .min_by(|a, b| a.distance.total_cmp(&b.distance))
            .unwrap_or_else(|| Foot { at: 0.0, distance: self.distance_from_dot(point) })
    }

    /// Every place on the line that `point` may belong to, in order of arc length: where the line
    /// passes it within `tolerance` [m] of its nearest distance, once for each passage.
    pub fn passages(&self, point: &Vector3<f64>, tolerance: f64) -> Vec<Passage> {
        let most = self.nearest(point).distance + tolerance;
        let mut passages: Vec<Passage> = Vec::new();
        for index in 0..self.points.len() {
            let Some(foot) = self.foot_on(index, point) else { break };
            if foot.distance > most {
                continue;
            }
            let found = Passage { foot, direction: self.direction(index) };
            match passages.last_mut() {
                // Segments that meet near the point are one passage.
                Some(last) if foot.at - last.foot.at <= ONE_PASSAGE * tolerance => {
                    if foot.distance < last.foot.distance {
                        *last = found;
                    }
                }
                _ => passages.push(found),
            }
        }
        passages
    }

    fn direction(&self, index: usize) -> Vector3<f64> {
        match (self.points.get(index), self.points.get(index + 1)) {
            (Some(from), Some(to)) => to - from,
            _ => Vector3::zeros(),
        }
    }

    /// Goes on to neighbouring segments while that brings the foot nearer.
    fn descend(&self, start: usize, foot: Foot, point: &Vector3<f64>) -> Foot {
        let mut best = foot;
        for forward in [true, false] {
            let mut index = start;
            loop {
                let next = if forward { Some(index + 1) } else { index.checked_sub(1) };
                let Some((next, foot)) =
                    next.and_then(|next| Some((next, self.foot_on(next, point)?)))
                else {
                    break;
                };
                if foot.distance >= best.distance {
                    break;
                }
                (index, best) = (next, foot);
            }
        }
        best
    }

    /// The foot on segment `index`; the first and the last reach beyond their ends.
    fn foot_on(&self, index: usize, point: &Vector3<f64>) -> Option<Foot> {
        let (from, to) = (self.points.get(index)?, self.points.get(index + 1)?);
        let (start, end) = (self.along.get(index)?, self.along.get(index + 1)?);
        let chord = to - from;
        let mut part = (point - from).dot(&chord) / chord.norm_squared();
        if index > 0 {
            part = part.max(0.0);
        }
        if index + 2 < self.points.len() {
            part = part.min(1.0);
        }
        let distance = (point - (from + chord * part)).norm();
        Some(Foot { at: start + (end - start) * part, distance })
    }

    fn distance_from_dot(&self, point: &Vector3<f64>) -> f64 {
        self.points.first().map_or(0.0, |dot| (point - dot).norm())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(points: &[[f64; 3]]) -> Line {
        Line::new(&Stroke { points: points.to_vec(), line: 0 })
    }

    #[test]
    fn beyond_the_ends_the_foot_is_on_the_extension() {
        let line = line(&[[0.0; 3], [0.01, 0.0, 0.0], [0.02, 0.0, 0.0]]);
        let foot = line.foot(&Vector3::new(-5e-5, 3e-6, 0.0), 0.0, 0.0, 1e-3);
        assert!((foot.at + 5e-5).abs() < 1e-15 && (foot.distance - 3e-6).abs() < 1e-15);
        let foot = line.foot(&Vector3::new(0.02005, 0.0, 4e-6), 0.02, 0.02, 1e-3);
        assert!((foot.at - 0.02005).abs() < 1e-15 && (foot.distance - 4e-6).abs() < 1e-15);
    }

    #[test]
    fn a_branch_that_passes_by_is_told_apart_by_arc_length() {
        // There and back, 20 µm apart: a point half-way across belongs to the branch expected.
        let line = line(&[[0.0; 3], [0.01, 0.0, 0.0], [0.01, 2e-5, 0.0], [0.0, 2e-5, 0.0]]);
        let point = Vector3::new(0.0099, 1.1e-5, 0.0);
        let there = line.foot(&point, 0.0098, 0.0099, 4e-4);
        assert!((there.at - 0.0099).abs() < 1e-12, "{there:?}");
        let back = line.foot(&point, 0.0101, 0.01012, 4e-4);
        assert!((back.at - 0.01012).abs() < 1e-9, "{back:?}");
    }

    #[test]
    fn a_line_passes_a_point_as_often_as_it_comes_by() {
        // There, and back over the same places; then across.
        let line = line(&[
            [0.0; 3],
            [0.01, 0.0, 0.0],
            [0.004, 0.0, 0.0],
            [0.002, 0.002, 0.0],
            [0.002, -0.002, 0.0],
        ]);
        let at = |x: f64| {
            let passages = line.passages(&Vector3::new(x, 0.0, 0.0), 5e-6);
            passages.iter().map(|passage| passage.foot.at).collect::<Vec<_>>()
        };
        assert_eq!(at(0.001), [0.001]);
        let found = at(0.007);
        assert!(found.len() == 2 && (found[1] - 0.013).abs() < 1e-12, "{found:?}");
        assert_eq!(at(0.002).len(), 2);
        // At the turn there and back are one, and so are the segments at a corner.
        assert_eq!((at(0.01).len(), at(0.004).len()), (1, 2));
        let direction =
            |index: usize| line.passages(&Vector3::new(0.007, 0.0, 0.0), 5e-6)[index].direction;
        assert!(direction(0).x > 0.0 && direction(1).x < 0.0);
    }

    #[test]
    fn a_dot_measures_distance() {
        let line = line(&[[0.01, 0.0, 0.0], [0.01, 0.0, 0.0]]);
        assert_eq!(line.length(), 0.0);
        let foot = line.foot(&Vector3::new(0.01, 3e-6, 0.0), 0.0, 0.0, 1e-3);
        assert_eq!((foot.at, foot.distance), (0.0, 3e-6));
    }
}
