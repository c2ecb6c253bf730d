//! Least squares by Gauss and Newton.

use machine::mechanisms::tri_planar::TriPlanar;
use nalgebra::{DMatrix, DVector, SVD, Vector3};

use super::Measurement;
use super::model::{Part, count, moved, row};

/// Steps before it is given up; from drawn lengths four are usual.
const STEPS: usize = 50;

/// A step below this is rounding [m].
const ROUNDING: f64 = 1e-12;

/// Halvings of a step that makes the residuals larger.
const HALVINGS: usize = 12;

/// A direction whose singular value is below this share of the largest is not told by the poses.
const TOLD: f64 = 1e-7;

/// What was found.
#[derive(Debug, Clone)]
pub(super) struct Solution {
    /// The machine as identified.
    pub(super) mechanism: TriPlanar,
    /// How much each strut is too long with the machine file's numbers, and with the identified ones [m].
    pub(super) before: Vec<f64>,
    pub(super) after: Vec<f64>,
    /// Directions of the unknowns that the poses do not tell, unit vectors.
    pub(super) untold: Vec<Vec<f64>>,
    /// Standard deviation of each unknown, turns as lengths [m]; `None` where it is not told.
    pub(super) deviations: Vec<Option<f64>>,
}

/// How much each strut is too long [m].
pub(super) fn residuals(mechanism: &TriPlanar, measurements: &[Measurement]) -> Vec<f64> {
    let of = |measurement: &Measurement| {
        let found = mechanism.measured_struts(&measurement.pose, &measurement.feet);
        let due = mechanism.struts;
        (0..6).map(move |number| found[number / 2][number % 2] - due[number / 2][number % 2])
    };
    measurements.iter().flat_map(of).collect()
}

fn jacobian(mechanism: &TriPlanar, measurements: &[Measurement], free: &[Part]) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(6 * measurements.len(), count(free));
    let corners = mechanism.hinge_corners();
    for (index, measurement) in measurements.iter().enumerate() {
        let struts = mechanism.strut_vectors(&measurement.pose, &measurement.feet);
        for number in 0..6 {
            let (leg, end) = (number / 2, number % 2);
            let foot = Vector3::new(measurement.feet[2 * leg], measurement.feet[2 * leg + 1], 0.0);
            let strut = (number, &struts[leg][end], &foot, &corners[leg][end]);
            let values = row(mechanism, free, &measurement.pose, strut);
            for (column, value) in values.into_iter().enumerate() {
                matrix[(6 * index + number, column)] = value;
            }
        }
    }
    matrix
}

/// The singular values and vectors of the triangle of `matrix`, and what of `right` it sees.
fn decomposed(
    matrix: DMatrix<f64>,
    right: &[f64],
) -> Option<(SVD<f64, nalgebra::Dyn, nalgebra::Dyn>, DVector<f64>)> {
    let unknowns = matrix.ncols();
    let split = matrix.qr();
    let mut seen = DVector::from_column_slice(right);
    split.q_tr_mul(&mut seen);
    let seen = seen.rows(0, unknowns).into_owned();
    /// Turns of the iteration before it is given up.
    const MOST_TURNS: usize = 1000;
    let triangle = SVD::try_new(split.r(), true, true, 5.0 * f64::EPSILON, MOST_TURNS)?;
    Some((triangle, seen))
}

/// The least squares over the `free` unknowns; `None` where no numbers are found.
pub(super) fn solve(
    mechanism: &TriPlanar,
    measurements: &[Measurement],
    free: &[Part],
) -> Option<Solution> {
    let norm = |residuals: &[f64]| residuals.iter().map(|r| r * r).sum::<f64>();
    let before = residuals(mechanism, measurements);
    let (mut here, mut left) = (*mechanism, before.clone());
    for _ in 0..STEPS {
        let (triangle, seen) = decomposed(jacobian(&here, measurements, free), &left)?;
        let threshold = TOLD * triangle.singular_values.max();
        let step = -triangle.solve(&seen, threshold).ok()?;
        let mut share = 1.0;
        let mut found = None;
        for _ in 0..HALVINGS {
            let step: Vec<f64> = step.iter().map(|part| part * share).collect();
            let next = moved(&here, free, &step);
            let residuals = residuals(&next, measurements);
            if norm(&residuals) <= norm(&left) {
                found = Some((next, residuals));
                break;
            }
            share /= 2.0;
        }
        let is_there = step.amax() < ROUNDING;
        // What no shorter step betters is the least.
        let Some((next, residuals)) = found else { break };
        (here, left) = (next, residuals);
        if is_there {
            break;
        }
    }
    if left.iter().any(|residual| !residual.is_finite()) {
        return None;
    }
    let (triangle, _) = decomposed(jacobian(&here, measurements, free), &left)?;
    let vectors = triangle.v_t.as_ref()?;
    let values = &triangle.singular_values;
    let threshold = TOLD * values.max();
    let told = |index: usize| values[index] > threshold;
    let rank = (0..values.len()).filter(|index| told(*index)).count();
    let untold: Vec<Vec<f64>> = (0..values.len())
        .filter(|index| !told(*index))
        .map(|index| vectors.row(index).iter().copied().collect())
        .collect();
    let freedom = (left.len() - rank).max(1) as f64;
    let variance = norm(&left) / freedom;
    /// A number that has more than this part in a direction that is not told is not told itself.
    const PART: f64 = 1e-3;
    let deviations = (0..count(free))
        .map(|unknown| {
            let is_told = untold.iter().all(|direction| direction[unknown].abs() < PART);
            is_told.then(|| {
                let sum: f64 = (0..values.len())
                    .filter(|index| told(*index))
                    .map(|index| vectors[(index, unknown)] / values[index])
                    .map(|part| part * part)
                    .sum();
                (variance * sum).sqrt()
            })
        })
        .collect();
    Some(Solution { mechanism: here, before, after: left, untold, deviations })
}
