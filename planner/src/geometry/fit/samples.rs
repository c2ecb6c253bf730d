//! The points of a polyline that a smooth curve must come near.

use nalgebra::Vector3;

use crate::geometry::jet::Jet;

/// The weight of the places along a chord against that of its vertices.
const CHORD_WEIGHT: f64 = 0.7;

/// The least weight in the tolerance: vertices in one place still count.
const LEAST_WEIGHT: f64 = 1e-3;

/// Where a curve begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Start {
    /// In a point, with any direction.
    Point(Vector3<f64>),
    /// With this value and these first two derivatives.
    Jet(Jet),
}

impl Start {
    /// [m].
    pub(crate) fn point(&self) -> Vector3<f64> {
        match self {
            Start::Point(point) => *point,
            Start::Jet(jet) => jet.point,
        }
    }
}

/// A stretch of a polyline to be smoothed.
#[derive(Debug)]
pub(crate) struct Stretch<'a> {
    /// At least two [m].
    pub(crate) vertices: &'a [Vector3<f64>],
    /// Numbers of the vertices that are bends, the first and the last vertex with them.
    pub(crate) bends: &'a [usize],
    /// Replaces the first vertex.
    pub(crate) start: Start,
    /// Whether the curve must end in the last vertex; else it only passes it by.
    pub(crate) ends: bool,
    /// [m].
    pub(crate) tolerance: f64,
}

impl Stretch<'_> {
    /// The place of a vertex [m]; of the first, where the curve starts.
    pub(crate) fn vertex(&self, at: usize) -> Vector3<f64> {
        if at == 0 { self.start.point() } else { self.vertices[at] }
    }
}

/// A point the curve must come near.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    /// [m].
    pub(crate) point: Vector3<f64>,
    /// Parameter of the nearest place on the curve [m].
    pub(crate) u: f64,
    /// [m].
    pub(crate) weight: f64,
    /// The weight at first [m].
    pub(crate) least: f64,
    /// From the curve [m].
    pub(crate) distance: f64,
    /// Whether the point is a vertex, not a place along a chord.
    pub(crate) vertex: bool,
}

/// The samples of a stretch: its vertices, and places along chords that are long against the distance between
/// the `knots` [m]. `bends` holds the parameters of the bends [m]. `samples` is emptied first.
pub(crate) fn lay(stretch: &Stretch<'_>, bends: &[f64], knots: &[f64], samples: &mut Vec<Sample>) {
    samples.clear();
    samples.push(sample(stretch.vertex(0), 0.0, true));
    let (mut interval, mut u) = (0, 0.0);
    for (ends, places) in stretch.bends.windows(2).zip(bends.windows(2)) {
        let (from, to) = (stretch.vertex(ends[0]), stretch.vertex(ends[1]));
        let along = (to - from) / (places[1] - places[0]).max(f64::MIN_POSITIVE);
        for at in ends[0] + 1..=ends[1] {
            let (before, vertex) = (stretch.vertex(at - 1), stretch.vertex(at));
            let next = (places[0] + (vertex - from).dot(&along)).max(u).min(places[1]).max(u);
            while interval + 2 < knots.len() && knots[interval + 1] <= u {
                interval += 1;
            }
            add_along(before, vertex, u, next, &knots[interval..], samples);
            samples.push(sample(vertex, next, true));
            u = next;
        }
    }
    weigh(samples, LEAST_WEIGHT * stretch.tolerance);
}

/// Adds places along a chord with these parameters at its ends [m]; the `knots` [m] from its start on.
fn add_along(
    before: Vector3<f64>,
    after: Vector3<f64>,
    from: f64,
    to: f64,
    knots: &[f64],
    samples: &mut Vec<Sample>,
) {
    for ends in knots.windows(2) {
        let (start, end) = (ends[0].max(from), ends[1].min(to));
        if start >= to {
            break;
        }
        // An odd number, so that one lies in the middle of a chord that fills an interval.
        let share = (end - start) / (ends[1] - ends[0]);
        let count = usize::from(share > 0.375) + 2 * usize::from(share > 0.9);
        for i in 0..count {
            let u = start + (end - start) * (i as f64 + 0.5) / count as f64;
            let part = (u - from) / (to - from);
            samples.push(sample(before + (after - before) * part, u, false));
        }
    }
}

/// A sample without weight.
fn sample(point: Vector3<f64>, u: f64, vertex: bool) -> Sample {
    Sample { point, u, weight: 0.0, least: 0.0, distance: 0.0, vertex }
}

/// Gives every vertex the weight of half its chords, at least `least` [m], and places along a chord together a
/// part of the chord's.
fn weigh(samples: &mut [Sample], least: f64) {
    let mut from = 0;
    for to in 1..samples.len() {
        if !samples[to].vertex {
            continue;
        }
        let chord = (samples[to].u - samples[from].u).max(least);
        let place = CHORD_WEIGHT * chord / (to - from) as f64;
        samples[from + 1..to].iter_mut().for_each(|sample| sample.least = place);
        samples[from].least += chord / 2.0;
        samples[to].least += chord / 2.0;
        from = to;
    }
    samples.iter_mut().for_each(|sample| sample.weight = sample.least);
}
