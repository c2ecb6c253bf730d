//! Symmetric positive definite systems: a band matrix, factored in place, and small full ones.

/// `W` entries to a row, the diagonal first and then leftwards; `W` includes the diagonal.
#[derive(Debug, Clone)]
pub(super) struct Band<const W: usize, const R: usize> {
    rows: [[f64; W]; R],
}

impl<const W: usize, const R: usize> Band<W, R> {
    /// Nothing but zeros.
    pub(super) fn new() -> Self {
        Self { rows: [[0.0; W]; R] }
    }

    /// Adds `value` at `row` and `column`; `column` ≤ `row` < `column` + `W`.
    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) {
        self.rows[row][row - column] += value;
    }

    /// Cholesky's factor L with the inverse of its diagonal, in place.
    ///
    /// A pivot that rounding has made less than nothing is taken for a very stiff one: its unknown
    /// stays where it is.
    pub(super) fn factor(&mut self) {
        for row in 0..R {
            let (done, rest) = self.rows.split_at_mut(row);
            let current = &mut rest[0];
            for off in (1..W.min(row + 1)).rev() {
                let other = &done[row - off];
                let mut sum = current[off];
                for inner in off + 1..W {
                    sum -= current[inner] * other[inner - off];
                }
                current[off] = sum * other[0];
            }
            let mut pivot = current[0];
            for value in &current[1..] {
                pivot -= value * value;
            }
            let least = f64::EPSILON * current[0];
            current[0] = if pivot > least { 1.0 / pivot.sqrt() } else { 0.0 };
        }
    }

    /// Solves for all `C` columns of `right` at once, in place; after [`Self::factor`].
    pub(super) fn solve<const C: usize>(&self, right: &mut [[f64; C]; R]) {
        for row in 0..R {
            let mut sum = right[row];
            let start = (row + 1).saturating_sub(W);
            for (before, solved) in right[start..row].iter().enumerate() {
                let factor = self.rows[row][row - start - before];
                for (sum, solved) in sum.iter_mut().zip(solved) {
                    *sum -= factor * solved;
                }
            }
            right[row] = sum.map(|part| part * self.rows[row][0]);
        }
        for row in (0..R).rev() {
            let solved = right[row].map(|part| part * self.rows[row][0]);
            right[row] = solved;
            let start = (row + 1).saturating_sub(W);
            for (before, rest) in right[start..row].iter_mut().enumerate() {
                let factor = self.rows[row][row - start - before];
                for (rest, solved) in rest.iter_mut().zip(&solved) {
                    *rest -= factor * solved;
                }
            }
        }
    }
}

/// Solves a symmetric positive definite system of order `D`, by elimination.
pub(super) fn small<const D: usize>(mut matrix: [[f64; D]; D], mut right: [f64; D]) -> [f64; D] {
    for pivot in 0..D {
        let scale = if matrix[pivot][pivot] > 0.0 { 1.0 / matrix[pivot][pivot] } else { 0.0 };
        for row in pivot + 1..D {
            let factor = matrix[row][pivot] * scale;
            let reference = matrix[pivot];
            for (value, reference) in matrix[row].iter_mut().zip(&reference) {
                *value -= factor * reference;
            }
            right[row] -= factor * right[pivot];
        }
    }
    for row in (0..D).rev() {
        for column in row + 1..D {
            right[row] -= matrix[row][column] * right[column];
        }
        right[row] = if matrix[row][row] > 0.0 { right[row] / matrix[row][row] } else { 0.0 };
    }
    right
}
