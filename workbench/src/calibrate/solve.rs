//! Least squares by Gauss and Newton.

use machine::mechanisms::tri_planar::TriPlanar;
use nalgebra::{DMatrix, DVector, SVD, Vector3};

use super::Measurement;
use super::model::{Part, count, moved, row, slopes};
use super::start::start;

/// Steps before it is given up; from drawn lengths four are usual.
const STEPS: usize = 50;

/// A step below this is rounding [m].
const ROUNDING: f64 = 1e-12;

/// Halvings of a step that makes the residuals larger.
const HALVINGS: usize = 12;

/// A step that changes no more than this share of the residuals has found the least.
const SETTLED: f64 = 1e-6;

/// A direction whose singular value is below this share of the largest is not determined by the poses: noise
/// of an instrument must not pass for a spread of them.
const DETERMINED: f64 = 1e-4;

/// The same where the measurements have next to no noise.
const FINELY_DETERMINED: f64 = 1e-7;

/// Directions that are only finely determined count if they bring the residuals below this share.
const EXPLAINED: f64 = 0.5;

/// What was found.
#[derive(Debug, Clone)]
pub(super) struct Solution {
    /// The machine as identified.
    pub(super) mechanism: TriPlanar,
    /// How much each strut is too long with the machine file's numbers, and with the identified ones [m].
    pub(super) before: Vec<f64>,
    pub(super) after: Vec<f64>,
    /// Whether no step makes the residuals smaller.
    pub(super) is_settled: bool,
    /// Directions of the printed numbers that the poses do not determine, unit vectors at right angles to
    /// each other, turns as lengths.
    pub(super) open: Vec<Vec<f64>>,
    /// Standard deviation of each printed number, turns as lengths [m]; `None` where it is not determined.
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
    let coarse = within(STEPS, DETERMINED, mechanism, measurements, free)?;
    let size = |solution: &Solution| DVector::from_column_slice(&solution.after).norm();
    let fine = within(STEPS, FINELY_DETERMINED, mechanism, measurements, free)
        .filter(|fine| fine.is_settled && size(fine) < EXPLAINED * size(&coarse));
    Some(fine.unwrap_or(coarse))
}

/// The same in so many steps at most, determined directions having `least` as their least singular value, as
/// a share of the largest.
pub(super) fn within(
    steps: usize,
    least: f64,
    mechanism: &TriPlanar,
    measurements: &[Measurement],
    free: &[Part],
) -> Option<Solution> {
    let norm = |residuals: &[f64]| residuals.iter().map(|r| r * r).sum::<f64>();
    let before = residuals(mechanism, measurements);
    let mut here = start(mechanism, measurements, free);
    let mut left = residuals(&here, measurements);
    let mut is_settled = false;
    for _ in 0..steps {
        let matrix = jacobian(&here, measurements, free);
        let (triangle, seen) = decomposed(matrix.clone(), &left)?;
        let threshold = least * triangle.singular_values.max();
        let step = -triangle.solve(&seen, threshold).ok()?;
        let rounding = ROUNDING * (left.len() as f64).sqrt();
        is_settled = (matrix * &step).norm() <= SETTLED * norm(&left).sqrt() + rounding;
        let mut part = 1.0;
        let mut found = None;
        for _ in 0..HALVINGS {
            let step: Vec<f64> = step.iter().map(|by| by * part).collect();
            let next = moved(&here, free, &step);
            let residuals = residuals(&next, measurements);
            if norm(&residuals) <= norm(&left) {
                found = Some((next, residuals));
                break;
            }
            part /= 2.0;
        }
        let is_there = step.amax() < ROUNDING;
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
    let threshold = least * values.max();
    let (seen, unseen): (Vec<usize>, Vec<usize>) =
        (0..values.len()).partition(|index| values[*index] > threshold);
    let freedom = (left.len() - seen.len()).max(1) as f64;
    let variance = norm(&left) / freedom;
    // From the steps, which are in each frame's own axes, to the numbers that are printed.
    let slopes = slopes(&here, free);
    let carried = |index: usize| &slopes * vectors.row(index).transpose();
    let mut open = DMatrix::zeros(count(free), unseen.len());
    for (column, index) in unseen.iter().enumerate() {
        open.set_column(column, &carried(*index));
    }
    if !unseen.is_empty() {
        open = open.qr().q();
    }
    /// A number that has more than this part in an open direction is not determined.
    const PART: f64 = 1e-3;
    let squares = seen.iter().fold(DVector::zeros(count(free)), |sum: DVector<f64>, index| {
        let part = carried(*index) / values[*index];
        sum + part.component_mul(&part)
    });
    let deviations = (0..count(free))
        .map(|number| {
            let is_determined = open.row(number).iter().all(|part| part.abs() < PART);
            is_determined.then(|| (variance * squares[number]).sqrt())
        })
        .collect();
    let open = open.column_iter().map(|direction| direction.iter().copied().collect()).collect();
    Some(Solution { mechanism: here, before, after: left, is_settled, open, deviations })
}
