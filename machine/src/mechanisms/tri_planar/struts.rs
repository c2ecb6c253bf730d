//! The six struts between feet and corners, all a side long as drawn, closed by Newton's method.

use messages::math;
use nalgebra::{Matrix3, Quaternion, SMatrix, SVector, UnitQuaternion, Vector2, Vector3};

use super::{CORNERS, HINGES, Legs, OUTWARD, TriPlanar};
use crate::kinematics::Joints;

/// A pose in the iteration, its position counted from the centroid of the feet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct State {
    pub(super) position: Vector3<f64>,
    pub(super) attitude: UnitQuaternion<f64>,
}

/// Largest residual of a closed strut, as a share of its length: forty units in the last place.
/// One more step then brings it down to rounding.
pub(super) const CLOSED: f64 = 1e-14;

/// Steps before a start is given up; from ±0.1 a and 0.15 rad Newton's method takes five.
const STEPS: usize = 12;

/// Largest step, in sides and radians: further, the linear equations say nothing.
const STRIDE: f64 = 0.6;

impl TriPlanar {
    /// From the centroid to the corners, in the machine frame [m].
    #[inline]
    pub(super) fn arms(&self, rotation: &Matrix3<f64>) -> [Vector3<f64>; 3] {
        let arm = |corner: usize| {
            let [x, y] = CORNERS[corner];
            (rotation.column(0) * x + rotation.column(1) * y) * self.side
        };
        [arm(0), arm(1), arm(2)]
    }
}

/// The six struts as forces on the platform, row by row `[l/a, (r×l)/a²]`: l from the foot to the
/// corner, r from the centroid to the corner.
pub(super) fn struts(
    mechanism: &TriPlanar,
    arms: &[Vector3<f64>; 3],
    position: &Vector3<f64>,
    feet: &Joints<6>,
) -> SMatrix<f64, 6, 6> {
    let scale = 1.0 / mechanism.side;
    let mut matrix = SMatrix::zeros();
    for (leg, hinges) in HINGES.iter().enumerate() {
        let foot = Vector3::new(feet[2 * leg], feet[2 * leg + 1], 0.0);
        let from_foot = position - foot;
        for (end, &corner) in hinges.iter().enumerate() {
            let arm = arms[corner] * scale;
            let strut = from_foot * scale + arm;
            let moment = arm.cross(&strut);
            for axis in 0..3 {
                matrix[(2 * leg + end, axis)] = strut[axis];
                matrix[(2 * leg + end, 3 + axis)] = moment[axis];
            }
        }
    }
    matrix
}

/// The equations of one set of feet, which are counted from their centroid.
pub(super) struct Struts<'a> {
    pub(super) mechanism: &'a TriPlanar,
    pub(super) feet: Joints<6>,
}

impl Struts<'_> {
    /// How much each strut is too long, `(l² − d²)/2a²`, d being its length as measured.
    pub(super) fn residual(&self, state: &State) -> SVector<f64, 6> {
        let arms = self.mechanism.arms(state.attitude.to_rotation_matrix().matrix());
        let square = self.mechanism.side * self.mechanism.side;
        let mut residual = SVector::zeros();
        for (leg, hinges) in HINGES.iter().enumerate() {
            let foot = Vector3::new(self.feet[2 * leg], self.feet[2 * leg + 1], 0.0);
            let from_foot = state.position - foot;
            for (end, &corner) in hinges.iter().enumerate() {
                let length = (from_foot + arms[corner]).norm_squared();
                let strut = self.mechanism.struts[leg][end];
                residual[2 * leg + end] = (length / square - strut * strut / square) / 2.0;
            }
        }
        residual
    }

    fn loosened(&self, state: &State) -> Option<SMatrix<f64, 6, 6>> {
        let arms = self.mechanism.arms(state.attitude.to_rotation_matrix().matrix());
        invert(struts(self.mechanism, &arms, &state.position, &self.feet))
    }

    fn step(
        &self,
        state: &State,
        loosened: &SMatrix<f64, 6, 6>,
        residual: &SVector<f64, 6>,
    ) -> State {
        let step = loosened * residual;
        let length = step.amax();
        let step = if length > STRIDE { step * (STRIDE / length) } else { step };
        let linear = step.fixed_rows::<3>(0) * self.mechanism.side;
        let angular = step.fixed_rows::<3>(3) * 0.5;
        // A quaternion, made a unit again in every step, cannot drift from a rotation.
        let turn = Quaternion::from_parts(1.0, -angular);
        State {
            position: state.position - linear,
            attitude: UnitQuaternion::new_normalize(turn * state.attitude.into_inner()),
        }
    }

    /// With the matrix of a solution near by, which saves solving anew: the error falls by the
    /// distance, in sides, with every step.
    pub(super) fn follow(&self, mut state: State, loosened: &SMatrix<f64, 6, 6>) -> Option<State> {
        let mut before = f64::INFINITY;
        for _ in 0..STEPS {
            let residual = self.residual(&state);
            let size = residual.amax();
            if size <= CLOSED {
                return Some(self.step(&state, loosened, &residual));
            }
            let contracts = size < before * 0.1;
            if !contracts {
                return None;
            }
            before = size;
            state = self.step(&state, loosened, &residual);
        }
        None
    }

    pub(super) fn solve(&self, mut state: State) -> Option<State> {
        for _ in 0..STEPS {
            let residual = self.residual(&state);
            let loosened = self.loosened(&state)?;
            state = self.step(&state, &loosened, &residual);
            let size = residual.amax();
            if size <= CLOSED {
                return Some(state);
            }
        }
        None
    }

    /// The level platform at `level` heights of the triangle whose feet fit best.
    pub(super) fn level(&self, level: f64, branch: Legs) -> State {
        let height = self.mechanism.height();
        let reach = (1.0 - level * level).sqrt();
        let mut radii = [0.0; 3];
        for (radius, fold) in radii.iter_mut().zip(branch.0) {
            *radius = height * (fold.sign() * reach + 1.0 / 3.0);
        }
        let place = |leg: usize| Vector2::from(OUTWARD[leg]) * radii[leg];
        let center = (place(0) + place(1) + place(2)) / 3.0;
        let (mut along, mut across) = (0.0, 0.0);
        for leg in 0..3 {
            let from = place(leg) - center;
            let to = Vector2::new(self.feet[2 * leg], self.feet[2 * leg + 1]);
            along += from.dot(&to);
            across += from.perp(&to);
        }
        let (sine, cosine) = math::sin_cos(math::atan2(across, along) / 2.0);
        let attitude = Quaternion::new(cosine, 0.0, 0.0, sine);
        let attitude = UnitQuaternion::new_normalize(attitude);
        let offset = attitude * Vector3::new(center.x, center.y, 0.0);
        State { position: Vector3::new(-offset.x, -offset.y, level * height), attitude }
    }
}

/// Inverse by elimination in place with row pivots; `None` where a pivot vanishes.
pub(super) fn invert(mut matrix: SMatrix<f64, 6, 6>) -> Option<SMatrix<f64, 6, 6>> {
    let mut order = [0; 6];
    for pivot in 0..6 {
        let mut best = pivot;
        for row in pivot + 1..6 {
            if matrix[(row, pivot)].abs() > matrix[(best, pivot)].abs() {
                best = row;
            }
        }
        order[pivot] = best;
        if best != pivot {
            matrix.swap_rows(best, pivot);
        }
        let head = matrix[(pivot, pivot)];
        if !head.is_finite() || head == 0.0 {
            return None;
        }
        let scale = 1.0 / head;
        matrix[(pivot, pivot)] = 1.0;
        let mut factors = [0.0; 6];
        for row in 0..6 {
            if row != pivot {
                factors[row] = matrix[(row, pivot)];
                matrix[(row, pivot)] = 0.0;
            }
        }
        for column in 0..6 {
            let value = matrix[(pivot, column)] * scale;
            for row in 0..6 {
                matrix[(row, column)] -= factors[row] * value;
            }
            matrix[(pivot, column)] = value;
        }
    }
    // Rows exchanged on the way are columns of the inverse, exchanged back in reverse.
    for pivot in (0..6).rev() {
        if order[pivot] != pivot {
            matrix.swap_columns(order[pivot], pivot);
        }
    }
    Some(matrix)
}
