//! Eigenvalues of small symmetric matrices, without their vectors and without memory of its own.

use nalgebra::SMatrix;

/// Turns of one eigenvalue before it is given up; two are usual.
const TURNS: usize = 50;

/// The largest eigenvalue of a symmetric matrix, of which the lower half is read, to a few units in
/// the last place of itself; not a number where the matrix has none.
pub(crate) fn largest_eigenvalue<const N: usize>(matrix: SMatrix<f64, N, N>) -> f64 {
    eigenvalues(matrix).into_iter().fold(f64::NAN, f64::max)
}

/// The smallest eigenvalue, to a few units in the last place of the largest one.
pub(crate) fn smallest_eigenvalue<const N: usize>(matrix: SMatrix<f64, N, N>) -> f64 {
    eigenvalues(matrix).into_iter().fold(f64::NAN, f64::min)
}

/// All eigenvalues in no order.
fn eigenvalues<const N: usize>(matrix: SMatrix<f64, N, N>) -> [f64; N] {
    let (mut diagonal, mut beside) = tridiagonal(matrix);
    // The implicit QL method (Numerical Recipes, sec. 11.3), from the last row upwards.
    for first in 0..N {
        for _ in 0..TURNS {
            let mut last = first;
            while last + 1 < N {
                let scale = diagonal[last].abs() + diagonal[last + 1].abs();
                if beside[last].abs() <= f64::EPSILON * scale {
                    break;
                }
                last += 1;
            }
            if last == first {
                break;
            }
            let half = (diagonal[first + 1] - diagonal[first]) / (2.0 * beside[first]);
            let root = (half * half + 1.0).sqrt().copysign(half);
            let mut ahead = diagonal[last] - diagonal[first] + beside[first] / (half + root);
            let (mut sine, mut cosine, mut shift) = (1.0, 1.0, 0.0);
            let mut split = false;
            for row in (first..last).rev() {
                let (f, b) = (sine * beside[row], cosine * beside[row]);
                let length = (f * f + ahead * ahead).sqrt();
                beside[row + 1] = length;
                if length == 0.0 {
                    diagonal[row + 1] -= shift;
                    beside[last] = 0.0;
                    split = true;
                    break;
                }
                (sine, cosine) = (f / length, ahead / length);
                let base = diagonal[row + 1] - shift;
                let turn = (diagonal[row] - base) * sine + 2.0 * cosine * b;
                shift = sine * turn;
                diagonal[row + 1] = base + shift;
                ahead = cosine * turn - b;
            }
            if !split {
                diagonal[first] -= shift;
                beside[first] = ahead;
                beside[last] = 0.0;
            }
        }
    }
    diagonal
}

/// The diagonal of a similar tridiagonal matrix, and what stands beside it, by Householder's
/// reflections.
fn tridiagonal<const N: usize>(mut matrix: SMatrix<f64, N, N>) -> ([f64; N], [f64; N]) {
    let mut beside = [0.0; N];
    for column in 0..N {
        let next = column + 1;
        if next >= N {
            break;
        }
        let below: f64 =
            (next + 1..N).map(|row| matrix[(row, column)] * matrix[(row, column)]).sum();
        let head = matrix[(next, column)];
        if below == 0.0 {
            beside[column] = head;
            continue;
        }
        let length = (head * head + below).sqrt().copysign(head);
        beside[column] = -length;
        // The reflection 1 − v·vᵀ·scale, v in its column's place.
        matrix[(next, column)] = head + length;
        let scale = 1.0 / (length * (head + length));
        let mut image = [0.0; N];
        for (row, image) in image.iter_mut().enumerate().skip(next) {
            let mut sum = 0.0;
            for across in next..N {
                let entry = if across <= row { (row, across) } else { (across, row) };
                sum += matrix[entry] * matrix[(across, column)];
            }
            *image = sum * scale;
        }
        let mut along = 0.0;
        for row in next..N {
            along += image[row] * matrix[(row, column)];
        }
        for row in next..N {
            image[row] -= 0.5 * scale * along * matrix[(row, column)];
        }
        for row in next..N {
            for across in next..=row {
                let change =
                    matrix[(row, column)] * image[across] + image[row] * matrix[(across, column)];
                matrix[(row, across)] -= change;
            }
        }
    }
    (core::array::from_fn(|row| matrix[(row, row)]), beside)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix6, Rotation3, Vector3, Vector6};

    use super::{largest_eigenvalue, smallest_eigenvalue};

    /// A rotation in six dimensions, of three in turn.
    fn turned(values: [f64; 6]) -> Matrix6<f64> {
        let mut turn = Matrix6::<f64>::identity();
        for (index, angle) in [0.3, -1.1, 2.0, 0.7, 1.9].into_iter().enumerate() {
            let plane = Rotation3::new(Vector3::new(angle, 0.5, -angle * angle)).into_inner();
            let mut next = Matrix6::<f64>::identity();
            let at = [0, 3, 1, 2, 3][index];
            next.fixed_view_mut::<3, 3>(at, at).copy_from(&plane);
            turn *= next;
        }
        turn * Matrix6::from_diagonal(&Vector6::from(values)) * turn.transpose()
    }

    #[test]
    fn they_are_those_that_a_matrix_was_made_of() {
        for values in [
            [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
            [3.0, 3.0, 3.0, 3.0, 3.0, 3.0],
            [1e-6, 1e-6, 0.5, 0.5, 2.0, 2.0],
            [-4.0, 1e-9, 0.0, 0.0, 7.0, 7.0],
            [0.0; 6],
        ] {
            let matrix = turned(values);
            let (least, most) = (values.iter().copied(), values.iter().copied());
            let (least, most) =
                (least.fold(f64::INFINITY, f64::min), most.fold(f64::NEG_INFINITY, f64::max));
            let scale = 4e-15 * most.abs().max(least.abs());
            let found = (smallest_eigenvalue(matrix), largest_eigenvalue(matrix));
            assert!((found.0 - least).abs() <= scale, "{values:?}: {found:?}");
            assert!((found.1 - most).abs() <= scale, "{values:?}: {found:?}");
            let own = Matrix6::from_diagonal(&Vector6::from(values));
            assert_eq!((smallest_eigenvalue(own), largest_eigenvalue(own)), (least, most));
        }
    }

    #[test]
    fn a_matrix_without_numbers_has_no_eigenvalues() {
        assert!(largest_eigenvalue(Matrix6::repeat(f64::NAN)).is_nan());
        assert!(smallest_eigenvalue(Matrix6::repeat(f64::NAN)).is_nan());
    }
}
