//! A symmetric positive definite system of band width seven with three right-hand sides.

use nalgebra::Vector3;

/// Diagonals kept: the main one and three below it.
pub(crate) const BAND: usize = 4;

/// The normal equations of a cubic spline: unknown `i` meets only unknowns `i − 3` to `i + 3`.
#[derive(Debug, Default)]
pub(crate) struct Banded {
    /// Row `i` holds the entries (i, i), (i, i−1), (i, i−2), (i, i−3).
    rows: Vec<[f64; BAND]>,
    /// One point a row.
    right: Vec<Vector3<f64>>,
}

impl Banded {
    /// Empties the system for `size` unknowns.
    pub(crate) fn clear(&mut self, size: usize) {
        self.rows.clear();
        self.rows.resize(size, [0.0; BAND]);
        self.right.clear();
        self.right.resize(size, Vector3::zeros());
    }

    /// Adds `weight`·(Σ bₖ·x₍first+k₎ − target)² to the sum to be made least.
    #[inline]
    pub(crate) fn add(
        &mut self,
        first: usize,
        basis: &[f64; BAND],
        weight: f64,
        target: Vector3<f64>,
    ) {
        for i in 0..BAND {
            let scaled = weight * basis[i];
            let row = &mut self.rows[first + i];
            for (k, entry) in row.iter_mut().enumerate().take(i + 1) {
                *entry += scaled * basis[i - k];
            }
            self.right[first + i] += target * scaled;
        }
    }

    /// Makes unknown `at` equal to `value`.
    pub(crate) fn fix(&mut self, at: usize, value: Vector3<f64>) {
        for k in 1..BAND {
            if at >= k {
                let entry = self.rows[at][k];
                self.right[at - k] -= value * entry;
            }
            if at + k < self.rows.len() {
                let entry = self.rows[at + k][k];
                self.right[at + k] -= value * entry;
                self.rows[at + k][k] = 0.0;
            }
        }
        self.rows[at] = [1.0, 0.0, 0.0, 0.0];
        self.right[at] = value;
    }

    /// Solves in place by LDLᵀ and gives the unknowns; `None` if the matrix is not positive definite.
    pub(crate) fn solve(&mut self) -> Option<&[Vector3<f64>]> {
        self.factor()?;
        let size = self.rows.len();
        for i in 0..size {
            let mut value = self.right[i];
            for k in 1..BAND.min(i + 1) {
                value -= self.right[i - k] * self.rows[i][k];
            }
            self.right[i] = value;
        }
        for i in (0..size).rev() {
            let mut value = self.right[i] / self.rows[i][0];
            for k in 1..BAND.min(size - i) {
                value -= self.right[i + k] * self.rows[i + k][k];
            }
            self.right[i] = value;
        }
        Some(&self.right)
    }

    /// Turns the rows into the factors L (below the diagonal) and D (on it).
    fn factor(&mut self) -> Option<()> {
        for i in 0..self.rows.len() {
            let mut row = self.rows[i];
            for k in (1..BAND.min(i + 1)).rev() {
                // The entry (i, j), j = i − k, less what the columns before j have taken.
                let above = self.rows[i - k];
                for m in (k + 1)..BAND.min(i + 1) {
                    row[k] -= row[m] * above[m - k];
                }
            }
            for k in 1..BAND.min(i + 1) {
                let scaled = row[k] / self.rows[i - k][0];
                row[0] -= row[k] * scaled;
                row[k] = scaled;
            }
            if row[0].is_nan() || row[0] <= 0.0 {
                return None;
            }
            self.rows[i] = row;
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A well-conditioned system of `size` unknowns and its solution.
    fn system(size: usize) -> (Banded, Vec<Vector3<f64>>) {
        let truth: Vec<_> = (0..size)
            .map(|i| Vector3::new(i as f64, 1.0 - i as f64 * 0.5, (i % 3) as f64))
            .collect();
        let mut banded = Banded::default();
        banded.clear(size);
        for i in 0..size - 3 {
            for shift in 0..3 {
                let basis = [0.1, 0.5 + 0.1 * shift as f64, 0.3, 0.2 - 0.1 * shift as f64];
                let target = (0..4).map(|k| truth[i + k] * basis[k]).sum();
                banded.add(i, &basis, 1.0 + i as f64, target);
            }
        }
        banded.fix(0, truth[0]);
        banded.fix(size - 1, truth[size - 1]);
        (banded, truth)
    }

    #[test]
    fn the_solution_meets_what_made_the_equations() {
        let (mut banded, truth) = system(12);
        let solution = banded.solve().expect("a solution");
        for (found, expected) in solution.iter().zip(&truth) {
            assert!((found - expected).norm() < 1e-9, "{found} {expected}");
        }
    }

    #[test]
    fn an_empty_matrix_has_no_solution() {
        let mut banded = Banded::default();
        banded.clear(5);
        assert!(banded.solve().is_none());
    }
}
