//! The barrier of a programme to second order, for one Newton step.

use super::band::Band;
use super::cone::{Cone, FREE, dot};

/// The gradient and the matrix of one Newton step.
pub(super) struct Model<const D: usize, const W: usize, const R: usize> {
    /// Second derivative by the coefficients.
    pub matrix: Band<W, R>,
    /// By the coefficients.
    pub gradient: [f64; R],
    /// Derivative of the gradient by the share.
    pub mixed: [f64; R],
    /// First and second derivative by the share.
    pub share: [f64; 2],
}

impl<const D: usize, const W: usize, const R: usize> Model<D, W, R> {
    /// Of `price` × share − Σ ln(radius² − |x|²).
    pub(super) fn new(cones: &[Cone<D>], share: f64, price: f64) -> Self {
        let mut model =
            Self { matrix: Band::new(), gradient: [0.0; R], mixed: [0.0; R], share: [price, 0.0] };
        for cone in cones {
            model.add(cone, share);
        }
        model
    }

    /// Adds the barrier of `cone`.
    fn add(&mut self, cone: &Cone<D>, share: f64) {
        let radius = cone.radius(share);
        let inverse = 2.0 / (radius * radius - dot(&cone.at, &cone.at));
        let square = inverse * inverse;
        self.share[0] -= cone.slope * radius * inverse;
        self.share[1] += cone.slope * cone.slope * (radius * radius * square - inverse);
        let block: [[f64; D]; D] = core::array::from_fn(|row| {
            core::array::from_fn(|column| {
                square * cone.at[row] * cone.at[column] + inverse * cone.holds(row, column)
            })
        });
        let mixed = cone.slope * radius * square;
        for (first, factor) in cone.factors.iter().enumerate() {
            let index = (cone.first + first).wrapping_sub(1);
            if index >= FREE || *factor == 0.0 {
                continue;
            }
            for row in 0..D {
                self.gradient[index * D + row] += factor * inverse * cone.at[row];
                self.mixed[index * D + row] -= factor * mixed * cone.at[row];
            }
            self.couple(cone, first, index, &block);
        }
    }

    /// Adds `block` between the coefficient `index` of `cone` and those not after it.
    fn couple(&mut self, cone: &Cone<D>, last: usize, index: usize, block: &[[f64; D]; D]) {
        for other in 0..=last {
            let before = (cone.first + other).wrapping_sub(1);
            if before >= FREE {
                continue;
            }
            let factor = cone.factors[last] * cone.factors[other];
            for (row, values) in block.iter().enumerate() {
                let columns = if before == index { row + 1 } else { D };
                for (column, value) in values[..columns].iter().enumerate() {
                    self.matrix.add(index * D + row, before * D + column, factor * value);
                }
            }
        }
    }
}
