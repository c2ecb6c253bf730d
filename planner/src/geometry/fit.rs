//! Smooth curves through dense polylines.

mod banded;
pub(super) mod basis;
mod corners;
mod knots;
mod samples;
mod smoothing;

use std::{collections::VecDeque, ops::RangeInclusive};

use nalgebra::Vector3;

use crate::geometry::fit::corners::{Bends, corner_distance, farthest};
use crate::geometry::fit::samples::{Start, Stretch};
use crate::geometry::fit::smoothing::{SHARE, Smoother};
use crate::geometry::spline::Spline;

/// Bends from which on a stretch without a corner is smoothed without waiting for its end.
const WINDOW_BENDS: usize = 128;

/// Vertices from which on a stretch without a corner is smoothed without waiting for its end.
const WINDOW_VERTICES: usize = 1 << 14;

/// The smallest tolerance [m].
const LEAST_TOLERANCE: f64 = 1e-9;

/// Vertices closer than this part of the tolerance to the one before are passed over.
const PASSED_OVER: f64 = 1.0 / 64.0;

/// A piece of the fitted path.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Part {
    /// A straight line.
    Line {
        /// [m].
        from: Vector3<f64>,
        /// [m].
        to: Vector3<f64>,
    },
    /// A smooth curve.
    Curve(Spline),
}

/// A part with the vertices it stands for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fitted {
    /// The shape.
    pub part: Part,
    /// Numbers of the first and the last vertex; the next part starts with the last.
    pub vertices: RangeInclusive<usize>,
    /// How far polyline and part are apart at most [m]: 0.6 of the tolerance, or up to 0.9 in a curve through
    /// noise of that size.
    pub distance: f64,
    /// Whether the next part goes on with the same value, first and second derivative; else a corner
    /// follows, or the end.
    pub goes_on: bool,
}

/// Fits curves to a polyline that comes vertex by vertex. Its memory does not grow with the polyline.
#[derive(Debug)]
pub(crate) struct Fitter {
    /// [m].
    tolerance: f64,
    /// Vertices since the start of the stretch at hand [m].
    vertices: Vec<Vector3<f64>>,
    /// Their numbers.
    numbers: Vec<usize>,
    /// Bends of the stretch at hand, its first vertex with them.
    bends: Vec<usize>,
    /// Looks for the next bend.
    finder: Bends,
    /// How the stretch at hand begins.
    start: Start,
    /// The number of the next vertex.
    count: usize,
    /// The last vertex, if it was passed over.
    passed: Option<(Vector3<f64>, usize)>,
    /// Smooths stretches.
    smoother: Smoother,
    /// Parts that are certain; the last only if a part came after it.
    done: VecDeque<Fitted>,
    /// Whether no more vertices come.
    finished: bool,
}

impl Fitter {
    /// With a tolerance [m].
    pub(crate) fn new(tolerance: f64) -> Self {
        let tolerance = if tolerance > LEAST_TOLERANCE { tolerance } else { LEAST_TOLERANCE };
        Self {
            tolerance,
            vertices: Vec::new(),
            numbers: Vec::new(),
            bends: vec![0],
            finder: Bends::new(tolerance),
            start: Start::Point(Vector3::zeros()),
            count: 0,
            passed: None,
            smoother: Smoother::default(),
            done: VecDeque::new(),
            finished: false,
        }
    }

    /// Takes the next vertex [m].
    pub(crate) fn push(&mut self, vertex: Vector3<f64>) {
        let number = self.count;
        self.count += 1;
        if !vertex.iter().all(|value| value.is_finite()) {
            return;
        }
        if let Some(last) = self.vertices.last()
            && (vertex - last).norm() <= PASSED_OVER * self.tolerance
        {
            self.passed = (vertex != *last).then_some((vertex, number));
            return;
        }
        self.add(vertex, number);
    }

    /// Ends the polyline.
    pub(crate) fn finish(&mut self) {
        if let Some((vertex, number)) = self.passed.take() {
            self.add(vertex, number);
        }
        self.advance(true);
        if self.vertices.len() > 1 {
            let last = self.vertices.len() - 1;
            if self.bends[self.bends.len() - 1] != last {
                self.bend(last);
            }
            let last = self.vertices.len() - 1;
            self.close(last);
        }
        self.finished = true;
    }

    /// The next part, if one is certain.
    pub(crate) fn part(&mut self) -> Option<Fitted> {
        if self.done.len() > 1 || self.finished { self.done.pop_front() } else { None }
    }

    /// Takes a vertex in.
    fn add(&mut self, vertex: Vector3<f64>, number: usize) {
        self.passed = None;
        if self.vertices.is_empty() {
            self.start = Start::Point(vertex);
        }
        self.vertices.push(vertex);
        self.numbers.push(number);
        self.advance(false);
    }

    /// Looks for bends among the vertices there are.
    fn advance(&mut self, all: bool) {
        while let Some(at) = self.finder.next(&self.vertices, all) {
            self.bend(at);
        }
    }

    /// Takes the next bend in, which decides whether the one before is a corner.
    fn bend(&mut self, mut at: usize) {
        if let [.., before, corner] = self.bends[..] {
            let (one, two) = (
                self.vertices[corner] - self.vertices[before],
                self.vertices[at] - self.vertices[corner],
            );
            if corner_distance(one, two) > self.tolerance {
                self.close(corner);
                at -= corner;
            } else if self.bends.len() > WINDOW_BENDS || corner > WINDOW_VERTICES {
                at -= self.commit();
            }
        }
        self.bends.push(at);
    }

    /// Fits the stretch up to the vertex `end`, where a corner is, and forgets it.
    fn close(&mut self, end: usize) {
        let (mut from, mut ends) = (0, vec![end]);
        while let Some(&to) = ends.last() {
            match self.fit(from, to) {
                Ok(part) => {
                    self.give(part, from, to, false);
                    self.start = Start::Point(self.vertices[to]);
                    from = to;
                    ends.pop();
                }
                Err(cut) if to > from + 1 => ends.push(cut.clamp(from + 1, to - 1)),
                Err(_) => self.break_off(),
            }
        }
        self.forget(end);
    }

    /// The part between two vertices, or where it must be cut in two.
    fn fit(&mut self, from: usize, to: usize) -> Result<Part, usize> {
        let vertices = &self.vertices[from..=to];
        if let Start::Point(point) = self.start
            && farthest(vertices).distance <= SHARE * self.tolerance
        {
            return Ok(Part::Line { from: point, to: vertices[to - from] });
        }
        self.smooth(from, to, true).map_err(|cut| from + cut)?;
        let mut spline = self.spline(from, to, self.smoother.length());
        spline.end_in(self.vertices[to]);
        Ok(Part::Curve(spline))
    }

    /// Smooths the stretch between two vertices; else the vertex after the first where it must be cut.
    fn smooth(&mut self, from: usize, to: usize, ends: bool) -> Result<(), usize> {
        let inner = self.bends.iter().filter(|&&bend| bend > from && bend < to);
        let bends: Vec<usize> =
            [0].into_iter().chain(inner.map(|bend| bend - from)).chain([to - from]).collect();
        self.smoother.smooth(&Stretch {
            vertices: &self.vertices[from..=to],
            bends: &bends,
            start: self.start,
            ends,
            tolerance: self.tolerance,
        })
    }

    /// The smoother's curve up to parameter `length` [m], which stands for the vertices between two.
    fn spline(&self, from: usize, to: usize, length: f64) -> Spline {
        let places = self.numbers[from..=to].iter().copied().zip(self.smoother.parameters());
        let knots = self.smoother.knots();
        let pieces = knots.partition_point(|&knot| knot < length).max(1);
        let borders = knots[..pieces].iter().copied().chain([length]).collect();
        Spline::new(borders, self.smoother.jets()[..pieces].to_vec(), places.collect())
    }

    /// Fits the stretch up to the last bend, which is no corner, and gives out its first half; how many
    /// vertices it forgets.
    fn commit(&mut self) -> usize {
        let last = self.bends[self.bends.len() - 1];
        let half = self.bends[self.bends.len() / 2];
        let cut = match self.smooth(0, last, false) {
            Ok(()) => {
                let length = self.smoother.parameters().nth(half).unwrap_or(0.0);
                if length > self.tolerance {
                    let spline = self.spline(0, half, length);
                    self.start = Start::Jet(spline.at(length));
                    self.give(Part::Curve(spline), 0, half, true);
                    self.forget(half);
                    return half;
                }
                half
            }
            Err(cut) => cut.clamp(1, last - 1),
        };
        self.close(cut);
        cut
    }

    /// Makes the start of the stretch at hand a corner although the part before was to go on into it.
    fn break_off(&mut self) {
        self.start = Start::Point(self.start.point());
        if let Some(fitted) = self.done.back_mut() {
            fitted.goes_on = false;
        }
    }

    /// Gives out a part.
    fn give(&mut self, part: Part, from: usize, to: usize, goes_on: bool) {
        let vertices = self.numbers[from]..=self.numbers[to];
        let distance = match part {
            Part::Line { .. } => farthest(&self.vertices[from..=to]).distance,
            Part::Curve(_) => self.smoother.distance(),
        };
        self.done.push_back(Fitted { part, vertices, distance, goes_on });
    }

    /// Forgets the first `count` vertices.
    fn forget(&mut self, count: usize) {
        self.vertices.drain(..count);
        self.numbers.drain(..count);
        self.finder.shift(count);
        self.bends.retain(|&bend| bend > count);
        self.bends.iter_mut().for_each(|bend| *bend -= count);
        self.bends.insert(0, 0);
    }
}

/// Fits curves to a polyline [m] within `tolerance` [m]: lines and curves in order, with the numbers of the
/// first and last vertex each stands for. Where one part ends and the next begins is a corner.
pub(crate) fn fit(vertices: &[Vector3<f64>], tolerance: f64) -> Vec<(Part, RangeInclusive<usize>)> {
    let mut fitter = Fitter::new(tolerance);
    vertices.iter().for_each(|vertex| fitter.push(*vertex));
    fitter.finish();
    let mut parts: Vec<(Part, RangeInclusive<usize>)> = Vec::new();
    let mut goes_on = false;
    while let Some(fitted) = fitter.part() {
        match (fitted.part, parts.last_mut()) {
            (Part::Curve(next), Some((Part::Curve(curve), range))) if goes_on => {
                curve.append(next);
                *range = *range.start()..=*fitted.vertices.end();
            }
            (part, _) => parts.push((part, fitted.vertices)),
        }
        goes_on = fitted.goes_on;
    }
    parts
}

#[cfg(test)]
mod tests;
