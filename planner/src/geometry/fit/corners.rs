//! The shape of a polyline at the scale of a tolerance: where it bends, and where it has true corners.
//!
//! A sleeve is laid along the polyline as far as every vertex stays within the tolerance of the chord from
//! the sleeve's first vertex to its last. Where that ends, the vertex farthest from the chord is a *bend*,
//! and the next sleeve starts there. Noise within the tolerance makes no bends; a corner is always one.

use nalgebra::Vector3;

/// A sleeve of more vertices than this ends in a bend even if they are straight.
const LONGEST: usize = 1024;

/// The tangent of half the turn from which on a turn counts as a full reversal.
const SHARPEST: f64 = 4.0;

/// The vertex of a stretch that is farthest from the chord between the stretch's ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Farthest {
    /// Number of the vertex within the stretch.
    pub(crate) at: usize,
    /// Its distance from the chord, or the way the polyline goes back along the chord after it [m].
    pub(crate) distance: f64,
}

/// The farthest vertex of a stretch of at least two vertices from the chord between its ends.
pub(crate) fn farthest(stretch: &[Vector3<f64>]) -> Farthest {
    let (first, last) = (stretch[0], stretch[stretch.len() - 1]);
    let chord = last - first;
    let length = chord.norm();
    let along = if length > 0.0 { chord / length } else { Vector3::zeros() };
    let mut result = Farthest { at: 0, distance: 0.0 };
    let mut squared = 0.0;
    let (mut foremost, mut foremost_at) = (0.0, 0);
    for (at, vertex) in stretch.iter().enumerate().skip(1) {
        let offset = vertex - first;
        let ahead = offset.dot(&along);
        let beside = offset.norm_squared() - ahead * ahead;
        let beyond = ahead - ahead.clamp(0.0, length);
        let apart = beside + beyond * beyond;
        if apart > squared && at + 1 < stretch.len() {
            squared = apart;
            result.at = at;
        }
        if ahead > foremost {
            (foremost, foremost_at) = (ahead, at);
        } else if (foremost - ahead) * (foremost - ahead) > squared && foremost_at > 0 {
            squared = (foremost - ahead) * (foremost - ahead);
            result.at = foremost_at;
        }
    }
    result.distance = squared.sqrt();
    result
}

/// How far a curve must leave the corner between two chords to take it smoothly [m].
pub(crate) fn corner_distance(before: Vector3<f64>, after: Vector3<f64>) -> f64 {
    let (one, two) = (before.norm(), after.norm());
    if one == 0.0 || two == 0.0 {
        return 0.0;
    }
    let (one_along, two_along) = (before / one, after / two);
    let (sum, difference) = ((one_along + two_along).norm(), (one_along - two_along).norm());
    let tangent = if sum * SHARPEST > difference { difference / sum } else { SHARPEST };
    one.min(two) * tangent / 4.0
}

/// Finds the bends of a polyline one after the other.
#[derive(Debug)]
pub(crate) struct Bends {
    /// [m].
    tolerance: f64,
    /// The vertex the sleeve starts from.
    anchor: usize,
    /// Vertices from the anchor on that are known to lie in the sleeve, itself included.
    inside: usize,
}

impl Bends {
    /// Of a polyline that starts with vertex 0.
    pub(crate) fn new(tolerance: f64) -> Self {
        Self { tolerance, anchor: 0, inside: 2 }
    }

    /// The next bend, if the vertices there are so far tell; `all` if no more will come.
    pub(crate) fn next(&mut self, vertices: &[Vector3<f64>], all: bool) -> Option<usize> {
        loop {
            let there = vertices.len() - self.anchor;
            let mut size = self.inside + self.inside / 2;
            if size > there {
                if !all || self.inside >= there {
                    return None;
                }
                size = there;
            }
            let sleeve = &vertices[self.anchor..self.anchor + size];
            if farthest(sleeve).distance > self.tolerance {
                return Some(self.bend(sleeve));
            }
            self.inside = size;
            if size > LONGEST {
                return Some(self.start_from(size - 1));
            }
        }
    }

    /// The bend in a stretch that is known not to lie in a sleeve as a whole.
    fn bend(&mut self, stretch: &[Vector3<f64>]) -> usize {
        let (mut inside, mut outside) = (self.inside, stretch.len());
        while outside - inside > 1 {
            let middle = (inside + outside) / 2;
            if farthest(&stretch[..middle]).distance > self.tolerance {
                outside = middle;
            } else {
                inside = middle;
            }
        }
        let at = farthest(&stretch[..outside]).at.max(1);
        self.start_from(at)
    }

    /// Starts the next sleeve at the vertex so many after the anchor.
    fn start_from(&mut self, count: usize) -> usize {
        self.anchor += count;
        self.inside = 2;
        self.anchor
    }

    /// Forgets the first `count` vertices.
    pub(crate) fn shift(&mut self, count: usize) {
        self.anchor = self.anchor.saturating_sub(count);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vertex_before_a_way_back_is_the_farthest() {
        let stretch = [0.0, 80.0, 20.0, 100.0].map(|x| Vector3::new(x, 0.0, 0.0));
        assert_eq!(farthest(&stretch), Farthest { at: 1, distance: 60.0 });
    }

    #[test]
    fn a_circle_in_chords_has_the_corner_distance_of_its_sagitta() {
        let at = |angle: f64| {
            Vector3::new(messages::math::cos(angle), messages::math::sin(angle), 0.0) * 0.02
        };
        let (one, two) = (at(0.05) - at(0.0), at(0.1) - at(0.05));
        assert!((corner_distance(one, two) - 6.25e-6).abs() < 1e-8);
    }

    #[test]
    fn a_way_back_shorter_than_the_tolerance_is_no_corner() {
        let spike = Vector3::new(9e-6, 0.0, 0.0);
        assert!(corner_distance(spike, -spike) <= 1e-5);
        assert!(corner_distance(spike * 2.0, -spike * 2.0) > 1e-5);
    }

    #[test]
    fn the_bend_of_two_lines_in_short_chords_is_their_corner() {
        let line =
            |i: usize| Vector3::new(i.min(50) as f64, i.saturating_sub(50) as f64, 0.0) * 1e-4;
        let vertices: Vec<_> = (0..100).map(line).collect();
        let mut bends = Bends::new(1e-5);
        assert_eq!(bends.next(&vertices, true), Some(50));
        assert_eq!(bends.next(&vertices, true), None);
    }
}
