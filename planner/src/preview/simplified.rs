//! Lines by a bounded number of points: the more there are, the coarser they become.

use std::collections::HashSet;

use nalgebra::Vector3;

use super::PreviewLine;

/// How far a line may be from what it stands for while there are few [m].
pub(super) const FINEST: f64 = 2e-6;

/// Lines that are simplified while they are gathered.
#[derive(Debug)]
pub(super) struct Simplified {
    lines: Vec<PreviewLine>,
    points: usize,
    /// The most points.
    most: usize,
    /// How far a line may be from what it stands for [m].
    tolerance: f64,
    /// The cells of as large a grid in which lines begin, are half done and end; a dot does all in one.
    covered: HashSet<[[i64; 3]; 3]>,
    /// Whether the last line that was pushed was left out.
    left_out: bool,
}

impl Simplified {
    /// None yet, of `most` points in all.
    pub(super) fn new(most: usize) -> Self {
        Self {
            lines: Vec::new(),
            points: 0,
            most: most.max(1),
            tolerance: FINEST,
            covered: HashSet::new(),
            left_out: false,
        }
    }

    pub(super) fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// Adds a line.
    pub(super) fn push(&mut self, line: PreviewLine) {
        self.keep(line);
        while self.points > self.most {
            // Half as many at least, so that it is seldom done.
            self.coarsen();
            while self.points > self.most / 2 {
                self.coarsen();
            }
        }
    }

    pub(super) fn take(self) -> Vec<PreviewLine> {
        self.lines
    }

    /// Twice the tolerance.
    fn coarsen(&mut self) {
        self.tolerance *= 2.0;
        self.points = 0;
        self.covered.clear();
        self.left_out = false;
        for line in core::mem::take(&mut self.lines) {
            self.keep(line);
        }
    }

    /// Keeps what the tolerance needs of a line: what is no longer than that is a dot, and lines and dots that would
    /// cover each other are one.
    fn keep(&mut self, line: PreviewLine) {
        let PreviewLine { mut points, power, goes_on } = line;
        let goes_on = goes_on && !self.left_out;
        let Some(first) = points.first().copied() else { return };
        let is_far = |point: &[f64; 3]| between(&first, point).norm() > self.tolerance;
        if points.len() > 1 && !points.iter().any(is_far) && self.tolerance > FINEST {
            points.truncate(1);
        }
        let points = simplified(&points, self.tolerance);
        let parts = [0, points.len() / 2, points.len() - 1].map(|index| self.cell(&points[index]));
        let may_cover = points.len() == 1 || self.tolerance > FINEST;
        self.left_out = may_cover && !self.covered.insert(parts);
        if self.left_out {
            return;
        }
        self.points += points.len();
        self.lines.push(PreviewLine { points, power, goes_on });
    }

    fn cell(&self, point: &[f64; 3]) -> [i64; 3] {
        point.map(|value| (value / self.tolerance).round() as i64)
    }
}

/// Those of the points from which no other is farther than `tolerance`, by Douglas and Peucker.
fn simplified(points: &[[f64; 3]], tolerance: f64) -> Vec<[f64; 3]> {
    if points.len() < 3 {
        return points.to_vec();
    }
    let mut is_kept = vec![false; points.len()];
    (is_kept[0], is_kept[points.len() - 1]) = (true, true);
    let mut open = vec![(0, points.len() - 1)];
    while let Some((first, last)) = open.pop() {
        let off = |index: usize| distance(&points[index], &points[first], &points[last]);
        let farthest = (first + 1..last).map(|index| (off(index), index));
        let farthest = farthest.max_by(|one, other| one.0.total_cmp(&other.0));
        if let Some((off, index)) = farthest
            && off > tolerance
        {
            is_kept[index] = true;
            open.extend([(first, index), (index, last)]);
        }
    }
    let kept = points.iter().zip(is_kept).filter(|(_, is_kept)| *is_kept);
    kept.map(|(point, _)| *point).collect()
}

/// How far a point is from a straight line between two others.
fn distance(point: &[f64; 3], from: &[f64; 3], to: &[f64; 3]) -> f64 {
    let (way, at) = (between(from, to), between(from, point));
    let square = way.norm_squared();
    let share = if square > 0.0 { (at.dot(&way) / square).clamp(0.0, 1.0) } else { 0.0 };
    (at - way * share).norm()
}

fn between(from: &[f64; 3], to: &[f64; 3]) -> Vector3<f64> {
    Vector3::from(*to) - Vector3::from(*from)
}
