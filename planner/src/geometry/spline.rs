//! A smooth curve of cubic pieces, two times continuously differentiable.

use crate::geometry::fit::basis::taylor;
use crate::geometry::jet::Jet;
use crate::search::partition_near;

/// A curve of cubic pieces that runs through, or within tolerance of, a run of vertices. Its parameter is
/// near the arc length; value, first and second derivative are continuous.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Spline {
    /// Borders of the pieces [m], rising from 0; one more than there are pieces.
    knots: Vec<f64>,
    /// The jet at the start of every piece, and the one at the end of the curve.
    jets: Vec<Jet>,
    /// Vertices by number and the parameter at which each lies [m]; a vertex not listed lies where the last
    /// one listed before it does.
    vertices: Vec<(usize, f64)>,
}

impl Spline {
    /// A curve of pieces that start with `jets` at the `knots` [m] but the last; `vertices` with their
    /// parameters, both rising, the first at 0.
    pub(crate) fn new(knots: Vec<f64>, mut jets: Vec<Jet>, vertices: Vec<(usize, f64)>) -> Self {
        let pieces = knots.len() - 1;
        jets.truncate(pieces);
        jets.push(taylor(&jets[pieces - 1], knots[pieces] - knots[pieces - 1]));
        Self { knots, jets, vertices }
    }

    /// The range of the parameter [m]: from 0 to this, near the length of the curve.
    pub(crate) fn length(&self) -> f64 {
        self.knots[self.knots.len() - 1]
    }

    /// Point and derivatives at parameter `u` [m], taken into the curve's range.
    pub(crate) fn at(&self, u: f64) -> Jet {
        self.at_near(u, &mut 0)
    }

    /// The same, with the number of the piece looked for from `near` on.
    #[inline]
    pub(crate) fn at_near(&self, u: f64, near: &mut usize) -> Jet {
        let piece = partition_near(&self.knots, near, |&knot| knot <= u).saturating_sub(1);
        let start = &self.jets[piece];
        if piece + 1 == self.jets.len() {
            return *start;
        }
        taylor(start, (u - self.knots[piece]).max(0.0))
    }

    /// As [`Self::at`], from the piece that ends at `u` where one does [m].
    pub(crate) fn before(&self, u: f64, near: &mut usize) -> Jet {
        let piece = partition_near(&self.knots, near, |&knot| knot < u).saturating_sub(1);
        let piece = piece.min(self.jets.len() - 2);
        taylor(&self.jets[piece], (u - self.knots[piece]).max(0.0))
    }

    /// Borders of the pieces [m], rising from 0 to the length.
    pub(crate) fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// The jet at the start of every piece and, last, the one at the end of the curve.
    pub(crate) fn jets(&self) -> &[Jet] {
        &self.jets
    }

    /// The parameter [m] of the point of the curve that stands for a vertex, by its number among those
    /// handed to the fit; vertices outside the curve count as its ends.
    pub(crate) fn parameter_of(&self, vertex: usize) -> f64 {
        let after = self.vertices.partition_point(|&(number, _)| number <= vertex);
        self.vertices[after.saturating_sub(1)].1
    }

    /// Makes the curve end exactly in `point`.
    pub(crate) fn end_in(&mut self, point: nalgebra::Vector3<f64>) {
        let last = self.jets.len() - 1;
        self.jets[last].point = point;
    }

    /// Appends a curve that goes on from the end of this one with the same value and first two derivatives.
    pub(crate) fn append(&mut self, next: Spline) {
        let length = self.length();
        self.jets.pop();
        self.jets.extend(next.jets);
        self.knots.extend(next.knots.iter().skip(1).map(|knot| length + knot));
        self.vertices.extend(next.vertices.iter().skip(1).map(|&(number, u)| (number, length + u)));
    }
}
