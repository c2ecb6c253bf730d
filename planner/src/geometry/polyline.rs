//! Straight moves that follow each other, gathered until it is known what they draw: a line in
//! pieces, a curve in chords, or corners.

use std::ops::RangeInclusive;

use nalgebra::Vector3;

use crate::drawing::Curve;
use crate::geometry::contour::{CORNER, Demand, GAP};
use crate::geometry::fit::{Fitted, Fitter, Part, fit};
use crate::geometry::track::Track;
use crate::light::Policy;

/// Cosine of two directions that are one, to rounding of a double.
const SAME: f64 = 1.0 - 1e-14;

/// One straight move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Chord {
    /// Where it ends [m].
    pub(crate) to: Vector3<f64>,
    /// What is asked for along it; its `from` says nothing.
    pub(crate) demand: Demand,
    /// What its light asks for; `None` in the dark.
    pub(crate) policy: Option<Policy>,
    /// Whether it is a free move, which belongs to the path only as long as that goes straight on.
    pub(crate) is_free: bool,
}

/// Moves from which on a polyline is handed on before its end is known, and how many more come then
/// before it is looked at again.
const LONG: usize = 1 << 15;
const MORE: usize = 1 << 9;

/// Straight moves from a start on.
#[derive(Debug, Default)]
pub(crate) struct Polyline {
    vertices: Vec<Vector3<f64>>,
    chords: Vec<Chord>,
    policy: Option<Policy>,
    /// Whether it is taken from curves, whose vertices have no digits to be rounded.
    is_trace: bool,
    /// What fits a polyline that is long, and how many vertices it has taken of those that are still
    /// here.
    fitter: Option<(Fitter, usize)>,
    /// The number of the first vertex that is still here.
    first: usize,
    /// How many moves there must be before it is looked at whether a part is certain.
    look: usize,
}

/// A curve of a polyline, and what is asked for along it.
pub(crate) type Drawn = (Track, Vec<Demand>);

impl Polyline {
    pub(crate) fn is_empty(&self) -> bool {
        self.chords.is_empty() && self.fitter.is_none()
    }

    /// Goes on from `from`, where the polyline ends or begins.
    pub(crate) fn push(&mut self, from: Vector3<f64>, chord: Chord) {
        if self.vertices.is_empty() {
            self.vertices.push(from);
        }
        self.policy = chord.policy.or(self.policy);
        self.vertices.push(chord.to);
        self.chords.push(chord);
    }

    /// Goes on with a chord of a curve.
    pub(crate) fn push_trace(&mut self, from: Vector3<f64>, chord: Chord) {
        self.is_trace = true;
        self.push(from, chord);
    }

    /// Whether it is taken from curves.
    pub(crate) fn is_trace(&self) -> bool {
        self.is_trace && !self.is_empty()
    }

    /// Whether it is drawn in straight moves.
    pub(crate) fn is_of_chords(&self) -> bool {
        !self.is_trace && !self.is_empty()
    }

    /// The last move.
    pub(crate) fn last(&self) -> Option<&Chord> {
        self.chords.last()
    }

    /// Takes the last move off again.
    pub(crate) fn pop(&mut self) -> Option<Chord> {
        self.vertices.pop();
        let last = self.chords.pop();
        if self.is_empty() {
            // What comes next begins anywhere.
            self.vertices.clear();
        }
        last
    }

    /// The policy of its light; `None` where all is dark so far.
    pub(crate) fn policy(&self) -> Option<Policy> {
        self.policy
    }

    /// Whether a move from its end to `to` goes straight on.
    pub(crate) fn goes_straight_to(&self, to: &Vector3<f64>) -> bool {
        let [.., before, last] = self.vertices.as_slice() else { return false };
        goes_straight(&(last - before), &(to - last))
    }

    /// The curves that it draws, and empties it. With a `tolerance` [m] curves in chords become
    /// curves again; without, only what lies on one line is put together.
    pub(crate) fn take(&mut self, tolerance: Option<f64>) -> Vec<Drawn> {
        let mut found = Vec::new();
        if let Some((fitter, fed)) = &mut self.fitter {
            self.vertices[*fed..].iter().for_each(|vertex| fitter.push(*vertex));
            *fed = self.vertices.len();
            fitter.finish();
            found = self.certain();
            (self.fitter, self.first) = (None, 0);
        }
        self.look = 0;
        self.policy = None;
        let is_trace = core::mem::take(&mut self.is_trace);
        let vertices = core::mem::take(&mut self.vertices);
        let chords = core::mem::take(&mut self.chords);
        let digits = if is_trace { 0.0 } else { rounding(&vertices) };
        match tolerance {
            _ if chords.is_empty() => {}
            Some(tolerance) if chords.len() > 1 => {
                for (part, covers) in fit(&vertices, tolerance + digits) {
                    let (first, last) = (*covers.start(), *covers.end());
                    found.push(drawn(&part, &vertices[first..=last], &chords[first..last], first));
                }
            }
            _ => found.extend(lines(&vertices, &chords)),
        }
        found
    }

    /// Of a polyline that is long, the curves that nothing which comes after changes.
    pub(crate) fn take_certain(&mut self, tolerance: Option<f64>) -> Vec<Drawn> {
        let is_long = self.fitter.is_some() || self.chords.len() >= LONG;
        if !is_long || self.chords.len() < self.look {
            return Vec::new();
        }
        self.look = self.chords.len() + MORE;
        let Some(tolerance) = tolerance else { return self.certain_lines() };
        let digits = if self.is_trace { 0.0 } else { rounding(&self.vertices) };
        let (fitter, fed) = self.fitter.get_or_insert_with(|| (Fitter::new(tolerance + digits), 0));
        // The last move may be taken off again.
        let known = self.vertices.len() - 1;
        self.vertices[*fed..known].iter().for_each(|vertex| fitter.push(*vertex));
        *fed = known;
        self.certain()
    }

    /// What the fitter is certain of.
    fn certain(&mut self) -> Vec<Drawn> {
        let mut found = Vec::new();
        while let Some((fitter, fed)) = &mut self.fitter {
            let Some(Fitted { part, vertices, .. }) = fitter.part() else { break };
            let [from, to] = [*vertices.start(), *vertices.end()].map(|number| number - self.first);
            found.push(drawn(
                &part,
                &self.vertices[from..=to],
                &self.chords[from..to],
                from + self.first,
            ));
            self.vertices.drain(..to);
            self.chords.drain(..to);
            self.first += to;
            *fed -= to;
            self.look = self.chords.len() + MORE;
        }
        found
    }

    /// The lines that no move to come can lengthen.
    fn certain_lines(&mut self) -> Vec<Drawn> {
        let mut runs = straight_runs(&self.vertices);
        // The last may go on, and its last move may be taken off again.
        runs.pop();
        runs.pop();
        let Some(last) = runs.last().map(|run| *run.end()) else {
            // One straight line so far: looked at again when it is twice as long.
            self.look = 2 * self.chords.len();
            return Vec::new();
        };
        let found = lines(&self.vertices[..=last], &self.chords[..last]);
        self.vertices.drain(..last);
        self.chords.drain(..last);
        found
    }
}

/// How far the digits of a dense polyline's coordinates may have moved its vertices [m]: half a
/// hundredth of a millimetre where all lie on such a grid, else nothing. A file cannot say more of the
/// curve that it was made from than its digits do.
fn rounding(vertices: &[Vector3<f64>]) -> f64 {
    /// The grid of two decimals of a millimetre [m], and how near a vertex lies to it.
    const GRID: f64 = 1e-5;
    const NEAR: f64 = 1e-3;
    /// Fewer vertices say nothing of their digits.
    const LEAST: usize = 12;
    let Some(first) = vertices.first() else { return 0.0 };
    let on_grid = |value: &f64| {
        let steps = value / GRID;
        (steps - steps.round()).abs() < NEAR
    };
    // From the first vertex, since the origin may lie anywhere.
    let is_rounded = vertices.len() >= LEAST
        && vertices.iter().all(|vertex| (vertex - first).iter().all(on_grid));
    if is_rounded { GRID / 2.0 } else { 0.0 }
}

/// Whether two directions are the same within the angle of a corner.
pub(crate) fn goes_straight(before: &Vector3<f64>, after: &Vector3<f64>) -> bool {
    before.dot(after) >= CORNER * before.norm() * after.norm()
}

/// One part of a fit with the demands of its chords; `first` is the number of its first vertex.
fn drawn(part: &Part, vertices: &[Vector3<f64>], chords: &[Chord], first: usize) -> Drawn {
    match part {
        Part::Line { from, to } => line(*from, *to, vertices, chords),
        Part::Curve(spline) => {
            let demands = chords.iter().enumerate().map(|(index, chord)| Demand {
                from: spline.parameter_of(first + index),
                ..chord.demand
            });
            let demands = merged(demands);
            let spline = std::sync::Arc::new(spline.clone());
            (Track::Spline { spline, vertices: vertices.into() }, demands)
        }
    }
}

/// A straight line with the demands of its chords, each where its start lies along the line.
fn line(
    from: Vector3<f64>,
    to: Vector3<f64>,
    vertices: &[Vector3<f64>],
    chords: &[Chord],
) -> Drawn {
    let track = Track::new(&Curve::Line { from, to });
    let length = track.length();
    let direction = if length > 0.0 { (to - from) / length } else { Vector3::zeros() };
    let mut farthest: f64 = 0.0;
    let demands = vertices.iter().zip(chords).map(|(vertex, chord)| {
        farthest = farthest.max((vertex - from).dot(&direction)).min(length);
        Demand { from: farthest, ..chord.demand }
    });
    let demands = merged(demands);
    (track, demands)
}

/// The demands without those that ask for what was asked for already, or for nothing at all.
fn merged(demands: impl Iterator<Item = Demand>) -> Vec<Demand> {
    let mut kept: Vec<Demand> = Vec::new();
    for demand in demands {
        match kept.last_mut() {
            Some(last) if demand.from - last.from <= GAP => {
                *last = Demand { from: last.from, ..demand }
            }
            Some(last) if last.power == demand.power && last.speed == demand.speed => {}
            _ => kept.push(demand),
        }
    }
    kept
}

/// The chords as lines, those on one line put together.
fn lines(vertices: &[Vector3<f64>], chords: &[Chord]) -> Vec<Drawn> {
    let runs = straight_runs(vertices).into_iter();
    runs.map(|run| {
        let (first, last) = (*run.start(), *run.end());
        let range = first..last;
        line(vertices[first], vertices[last], &vertices[range.clone()], &chords[range])
    })
    .collect()
}

/// The first and last vertices of what lies on one line.
fn straight_runs(vertices: &[Vector3<f64>]) -> Vec<RangeInclusive<usize>> {
    let mut found = Vec::new();
    let mut first = 0;
    for last in 1..vertices.len() {
        let goes_on = last + 1 < vertices.len() && {
            let (before, after) =
                (vertices[last] - vertices[first], vertices[last + 1] - vertices[last]);
            before.dot(&after) >= SAME * before.norm() * after.norm()
        };
        if !goes_on {
            found.push(first..=last);
            first = last;
        }
    }
    found
}
