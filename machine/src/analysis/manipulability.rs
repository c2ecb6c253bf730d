//! How velocities and forces of the joints come to the tool: the Jacobian's singular values.

use nalgebra::{DMatrix, SVD};

use super::principal::{MOST_TURNS, direction};
use super::{Place, Principal};

/// The velocity ellipse of the tool, and what follows from it. Joint rates and efforts of length 1 are
/// taken together, so that joints of different units are weighed by their numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Manipulability {
    /// Semi-axes of the velocity ellipse, the largest first: singular values of the Jacobian [1, or m
    /// per rad].
    pub velocity: Vec<Principal>,
}

impl Manipulability {
    /// The product of the semi-axes: how far from a singularity.
    pub fn value(&self) -> f64 {
        self.velocity.iter().map(|axis| axis.value).product()
    }

    /// The least semi-axis by the largest, 0 to 1; 1 where all directions are alike.
    pub fn isotropy(&self) -> f64 {
        match (self.velocity.first(), self.velocity.last()) {
            (Some(largest), Some(least)) if largest.value > 0.0 => least.value / largest.value,
            _ => 0.0,
        }
    }

    /// Semi-axes of the force ellipse, the largest first (source 003 eq. 5.13, 5.14): the inverse of
    /// those of the velocity, in the same directions. `None` where the tool cannot move in one of them.
    pub fn force(&self) -> Option<Vec<Principal>> {
        let inverse = self.velocity.iter().rev();
        let axes: Vec<Principal> =
            inverse.map(|axis| Principal { value: 1.0 / axis.value, ..*axis }).collect();
        axes.iter().all(|axis| axis.value.is_finite()).then_some(axes)
    }
}

impl Place {
    /// How velocities of the joints come to the tool, in all directions that it moves in; `None` where they
    /// have no numbers.
    pub fn manipulability(&self) -> Option<Manipulability> {
        manipulability(self.linear.clone())
    }

    /// The same in x and y alone, whatever the tool does in z meanwhile.
    pub fn manipulability_in_plane(&self) -> Option<Manipulability> {
        manipulability(self.linear.rows(0, 2).into_owned())
    }

    /// The determinant of the Jacobian over the tool's directions, with its sign; `None` where there are
    /// more joints than directions.
    pub fn determinant(&self) -> Option<f64> {
        self.linear.is_square().then(|| self.linear.clone().lu().determinant())
    }
}

fn manipulability(jacobian: DMatrix<f64>) -> Option<Manipulability> {
    let svd = SVD::try_new_unordered(jacobian, true, false, 5.0 * f64::EPSILON, MOST_TURNS)?;
    let along = svd.u?;
    let mut velocity: Vec<Principal> = (svd.singular_values.iter())
        .zip(along.column_iter())
        .map(|(value, along)| Principal { value: *value, direction: direction(along.iter()) })
        .collect();
    velocity.sort_by(|one, other| other.value.total_cmp(&one.value));
    velocity.iter().all(|axis| axis.value.is_finite()).then_some(Manipulability { velocity })
}
