//! Any smooth curve taken by its arc length, in a table that is exact to rounding.
//!
//! The table holds the parameter and its first two derivatives at even steps of arc length, and a
//! quintic between them gives the parameter anywhere; position and derivatives are then the
//! curve's own at that parameter. Steps are halved until the middle of every step is off by less
//! than [`PRECISION`].

use nalgebra::Vector3;

use crate::geometry::jet::{Jet, larger};

/// Largest error of the parameter anywhere in a table, as a distance along the curve [m].
const PRECISION: f64 = 1e-12;

/// The most steps of a table; beyond, a curve is too sharp to be marked anyway.
const MOST_STEPS: usize = 4096;

/// Nodes and weights of Gauss–Legendre quadrature with eight points on −1..1.
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// A curve over a parameter from 0 to [`Parametric::end`], smooth in between.
pub(crate) trait Parametric {
    /// The parameter at the end.
    fn end(&self) -> f64;

    /// The point and its derivatives by the parameter.
    fn jet(&self, parameter: f64) -> Jet;

    /// The derivative of the point alone, for quadrature.
    fn velocity(&self, parameter: f64) -> Vector3<f64> {
        self.jet(parameter).first
    }
}

/// A curve by arc length.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ByArcLength<C> {
    curve: C,
    length: f64,
    /// Parameter, first and second derivative by arc length, at even steps.
    nodes: Vec<[f64; 3]>,
}

impl<C: Parametric> ByArcLength<C> {
    /// Builds the table, with at least `steps` steps.
    pub(crate) fn new(curve: C, steps: usize) -> Self {
        let mut steps = steps.max(2);
        loop {
            let table = Self::with_steps(&curve, steps);
            if steps >= MOST_STEPS || table.error(&curve) <= PRECISION {
                let (length, nodes) = (table.length, table.nodes);
                return Self { curve, length, nodes };
            }
            steps *= 2;
        }
    }

    fn with_steps(curve: &C, steps: usize) -> ByArcLength<()> {
        let end = curve.end();
        let parameter = |index: usize| end * index as f64 / steps as f64;
        let mut lengths = Vec::with_capacity(steps + 1);
        let mut length = 0.0;
        lengths.push(length);
        for index in 0..steps {
            length += arc_length(curve, parameter(index), parameter(index + 1));
            lengths.push(length);
        }
        let mut nodes = Vec::with_capacity(steps + 1);
        let mut panel = 0;
        for index in 0..=steps {
            let wanted = length * index as f64 / steps as f64;
            while panel + 1 < steps && lengths[panel + 1] < wanted {
                panel += 1;
            }
            let at = if index == steps {
                end
            } else {
                let (from, to) = (parameter(panel), parameter(panel + 1));
                let share = (wanted - lengths[panel]) / (lengths[panel + 1] - lengths[panel]);
                // Newton on a function whose slope is never 0; from a linear guess inside one
                // short panel four steps reach rounding.
                let mut at = from + (to - from) * share;
                for _ in 0..4 {
                    let off = lengths[panel] + arc_length(curve, from, at) - wanted;
                    at -= off / curve.velocity(at).norm();
                }
                at
            };
            let progress = curve.jet(at).progress();
            nodes.push([at, progress.first, progress.second]);
        }
        ByArcLength { curve: (), length, nodes }
    }

    /// The point and its derivatives by arc length at `distance` from the start [m].
    pub(crate) fn at(&self, distance: f64) -> Jet {
        self.curve.jet(parameter_at(&self.nodes, self.length, distance)).by_arc_length()
    }

    /// [m].
    pub(crate) fn length(&self) -> f64 {
        self.length
    }

    /// The curve itself.
    pub(crate) fn curve(&self) -> &C {
        &self.curve
    }
}

impl ByArcLength<()> {
    /// Largest distance along the curve between where the table says the middle of a step is, and
    /// where it is [m]; not a number where one of them is not.
    fn error<C: Parametric>(&self, curve: &C) -> f64 {
        let steps = self.nodes.len() - 1;
        let step = self.length / steps as f64;
        let mut worst: f64 = 0.0;
        for index in 0..steps {
            let middle = parameter_at(&self.nodes, self.length, step * (index as f64 + 0.5));
            let off = arc_length(curve, self.nodes[index][0], middle) - step / 2.0;
            worst = larger(worst, off.abs());
        }
        worst
    }
}

/// The quintic through two nodes and their derivatives.
fn parameter_at(nodes: &[[f64; 3]], length: f64, distance: f64) -> f64 {
    let steps = nodes.len() - 1;
    let position = distance / length * steps as f64;
    let index = (position.max(0.0) as usize).min(steps - 1);
    let step = length / steps as f64;
    let x = position - index as f64;
    let ([u0, v0, a0], [u1, v1, a1]) = (nodes[index], nodes[index + 1]);
    let (v0, v1) = (v0 * step, v1 * step);
    let (a0, a1) = (a0 * step * step, a1 * step * step);
    let rise = u1 - u0;
    let c3 = 10.0 * rise - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1;
    let c4 = -15.0 * rise + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1;
    let c5 = 6.0 * rise - 3.0 * v0 - 3.0 * v1 - 0.5 * a0 + 0.5 * a1;
    u0 + x * (v0 + x * (a0 / 2.0 + x * (c3 + x * (c4 + x * c5))))
}

/// Length of a short piece of a curve [m].
fn arc_length<C: Parametric>(curve: &C, from: f64, to: f64) -> f64 {
    let (middle, half) = ((from + to) / 2.0, (to - from) / 2.0);
    let sum: f64 = GAUSS
        .iter()
        .map(|&(node, weight)| {
            let offset = half * node;
            weight
                * (curve.velocity(middle + offset).norm() + curve.velocity(middle - offset).norm())
        })
        .sum();
    sum * half
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A curve that stands still at its start.
    struct Cusp;

    impl Parametric for Cusp {
        fn end(&self) -> f64 {
            1.0
        }

        fn jet(&self, u: f64) -> Jet {
            Jet {
                point: Vector3::new(u * u, u * u * u, 0.0),
                first: Vector3::new(2.0 * u, 3.0 * u * u, 0.0),
                second: Vector3::new(2.0, 6.0 * u, 0.0),
                third: Vector3::new(0.0, 6.0, 0.0),
            }
        }
    }

    #[test]
    fn a_table_that_is_no_number_at_its_start_is_not_exact() {
        assert!(ByArcLength::with_steps(&Cusp, 8).error(&Cusp).is_nan());
    }
}
