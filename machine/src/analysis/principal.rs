//! Principal axes of symmetric matrices.

use nalgebra::{DMatrix, SymmetricEigen, Vector3};

/// Turns of the iterations behind eigenvalues and singular values before they are given up; a matrix
/// of six rows takes about a dozen.
pub(super) const MOST_TURNS: usize = 1000;

/// One principal axis of something that depends on the direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Principal {
    /// What it is in that direction, in the unit of the whole.
    pub value: f64,
    /// The direction, of length 1, in the frame of the tool's positions; its sense means nothing.
    pub direction: Vector3<f64>,
}

impl Principal {
    /// Angle of the direction in the x-y plane, above −π/2 up to π/2 [rad].
    pub fn angle(&self) -> f64 {
        let right = core::f64::consts::FRAC_PI_2;
        let angle = messages::math::atan2(self.direction.y, self.direction.x);
        if angle > right {
            angle - 2.0 * right
        } else if angle <= -right {
            angle + 2.0 * right
        } else {
            angle
        }
    }
}

/// The first rows of a vector as a direction, what it has not 0.
pub(super) fn direction<'a>(values: impl IntoIterator<Item = &'a f64>) -> Vector3<f64> {
    let mut direction = Vector3::zeros();
    for (row, value) in direction.iter_mut().zip(values) {
        *row = *value;
    }
    direction
}

/// Principal axes of a symmetric matrix of up to three rows, the largest value first; `None` where it
/// has no numbers.
pub(super) fn principal_axes(matrix: DMatrix<f64>) -> Option<Vec<Principal>> {
    let eigen = SymmetricEigen::try_new(matrix, f64::EPSILON, MOST_TURNS)?;
    let mut axes: Vec<Principal> = (eigen.eigenvalues.iter())
        .zip(eigen.eigenvectors.column_iter())
        .map(|(value, along)| Principal { value: *value, direction: direction(along.iter()) })
        .collect();
    axes.sort_by(|one, other| other.value.total_cmp(&one.value));
    axes.iter().all(|axis| axis.value.is_finite()).then_some(axes)
}
