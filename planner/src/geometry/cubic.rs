//! A smooth curve through points: cubics that go over into each other with the same direction and
//! curvature.

use nalgebra::Vector3;

use crate::geometry::arc_length::Parametric;
use crate::geometry::jet::Jet;

/// A cubic from one point to the next, by a parameter near the arc length [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cubic {
    /// The point and its first three derivatives at the start.
    start: [Vector3<f64>; 4],
    span: f64,
}

impl Parametric for Cubic {
    fn end(&self) -> f64 {
        self.span
    }

    fn jet(&self, parameter: f64) -> Jet {
        let [point, first, second, third] = self.start;
        let u = parameter;
        Jet {
            point: point + (first + (second / 2.0 + third * (u / 6.0)) * u) * u,
            first: first + (second + third * (u / 2.0)) * u,
            second: second + third * u,
            third,
        }
    }
}

/// The cubics through `points`, one fewer than there are, no two that follow each other the same. It is
/// straight at both ends.
pub(crate) fn through(points: &[Vector3<f64>]) -> Vec<Cubic> {
    let spans: Vec<f64> = points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect();
    let slopes: Vec<Vector3<f64>> =
        points.windows(2).zip(&spans).map(|(pair, span)| (pair[1] - pair[0]) / *span).collect();
    let bends = bends(&spans, &slopes);
    spans
        .iter()
        .enumerate()
        .map(|(index, &span)| {
            let [here, next] = [bends[index], bends[index + 1]];
            let first = slopes[index] - (here * 2.0 + next) * (span / 6.0);
            Cubic { start: [points[index], first, here, (next - here) / span], span }
        })
        .collect()
}

/// The indices of the points at which the curve turns back on itself, growing: there or in a span beside it
/// the curve all but stands still by its parameter, and has no direction.
pub(crate) fn reversals(cubics: &[Cubic]) -> Vec<usize> {
    /// The least |r′|; about 1 where the points lead on, cos ½φ where even spans turn by φ.
    const LEAST: f64 = 0.05;
    /// Looks along a span: |r′| changes by less than `LEAST` from one to the next.
    const LOOKS: u32 = 256;
    let mut points: Vec<usize> = Vec::new();
    for (index, cubic) in cubics.iter().enumerate() {
        for look in 0..=LOOKS {
            let progress = cubic.velocity(cubic.span * f64::from(look) / f64::from(LOOKS)).norm();
            if progress < LEAST || progress.is_nan() {
                points.push(index + usize::from(look > LOOKS / 2));
            }
        }
    }
    points.dedup();
    points
}

/// The second derivatives at the points, none at the ends, by elimination along the diagonal.
fn bends(spans: &[f64], slopes: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut bends = vec![Vector3::zeros(); spans.len() + 1];
    // h₀·b₀ + 2(h₀ + h₁)·b₁ + h₁·b₂ = 6(s₁ − s₀), of which b₀ is known: b₁ = right − factor·b₂.
    let mut factors = vec![0.0; spans.len()];
    for index in 1..spans.len() {
        let (before, after) = (spans[index - 1], spans[index]);
        let pivot = 2.0 * (before + after) - before * factors[index - 1];
        factors[index] = after / pivot;
        let right = (slopes[index] - slopes[index - 1]) * 6.0 - bends[index - 1] * before;
        bends[index] = right / pivot;
    }
    for index in (1..spans.len()).rev() {
        let next = bends[index + 1];
        bends[index] -= next * factors[index];
    }
    bends
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_pass_their_points_and_go_on_into_each_other() {
        let points = [
            Vector3::new(0.0, 0.0, 0.0),
            Vector3::new(0.01, 0.002, 0.0),
            Vector3::new(0.013, 0.012, 0.001),
            Vector3::new(0.02, 0.01, -0.002),
            Vector3::new(0.04, 0.0, 0.0),
        ];
        let cubics = through(&points);
        assert_eq!(cubics.len(), 4);
        assert_eq!(cubics[0].jet(0.0).second, Vector3::zeros());
        assert!(cubics[3].jet(cubics[3].end()).second.amax() < 1e-9);
        for (index, cubic) in cubics.iter().enumerate() {
            let end = cubic.jet(cubic.end());
            assert!((end.point - points[index + 1]).amax() < 1e-15);
            if let Some(next) = cubics.get(index + 1) {
                let start = next.jet(0.0);
                assert!((end.first - start.first).amax() < 1e-12);
                assert!((end.second - start.second).amax() < 1e-9);
            }
        }
        assert!(reversals(&cubics).is_empty());
    }

    #[test]
    fn a_curve_turns_back_on_itself_where_its_points_do() {
        let found = |points: &[[f64; 2]]| {
            let points: Vec<_> = points.iter().map(|[x, y]| Vector3::new(*x, *y, 0.0)).collect();
            reversals(&through(&points))
        };
        assert_eq!(found(&[[0.0, 0.0], [0.01, 0.0], [0.0, 0.0]]), [1]);
        // Within a span: the curve goes beyond the point that it turns at.
        assert_eq!(found(&[[0.0, 0.0], [0.01, 0.0], [0.005, 0.0]]), [1]);
        assert_eq!(found(&[[0.0, 0.0], [0.005, 0.0], [-0.005, 0.0]]), [1]);
        assert_eq!(found(&[[0.0, 0.0], [0.01, 0.0], [0.0, 0.0], [0.01, 0.0]]), [1, 2]);
        assert_eq!(found(&[[0.0, 0.0], [0.01, 0.0], [0.0, 0.0001]]), [1]);
        assert_eq!(found(&[[0.0, 0.0], [0.01, 0.0], [0.0, 0.002]]), [0; 0]);
        assert_eq!(found(&[[0.0, 0.0], [0.01, 0.0], [0.01, 0.001], [0.0, 0.001]]), [0; 0]);
    }
}
