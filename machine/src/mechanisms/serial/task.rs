//! What a chain's freedom asks of its joints: the rows that the inverse has to meet.
//!
//! Lengths are divided by the chain's reach, of rows and of sliding joints alike, so that metres and
//! radians can stand in one norm.

use messages::math;
use nalgebra::{Matrix3, Matrix6, Vector3};

use super::frame::{Frame, Vector, cross, difference, dot};
use super::{JointKind, Serial};
use crate::kinematics::{Pose, TaskSpace};
use crate::mechanisms::spectrum::smallest_eigenvalue;
use crate::taylor::Scalar;

/// Most rows that a task has.
pub(super) const ROWS: usize = 6;

/// The chain at one joint position.
pub(super) struct Chain<S, const N: usize> {
    /// The links' frames; joint `i` moves along or about the z axis of frame `i`.
    pub(super) links: [Frame<S>; N],
    pub(super) tool: Frame<S>,
}

/// Rates of the tool per joint rate: linear in the machine frame, angular in the tool's own.
pub(super) struct Rows<S, const N: usize> {
    pub(super) entries: [[S; N]; ROWS],
    pub(super) count: usize,
}

/// The rows that a freedom has: of position, and of rotation about the tool's own axes.
pub(super) fn rows_of(task_space: TaskSpace) -> (usize, usize) {
    match task_space {
        TaskSpace::Plane => (2, 0),
        TaskSpace::Space => (3, 0),
        TaskSpace::Axis => (3, 2),
        TaskSpace::Pose => (3, 3),
    }
}

impl<const N: usize> Serial<N> {
    /// Every link's frame with the joints at `q`.
    pub(super) fn chain<S: Scalar>(&self, q: &[S; N]) -> Chain<S, N> {
        let mut last = Frame::at(&self.base);
        let links = core::array::from_fn(|link| {
            last = last.onward(&self.links[link], q[link]);
            last
        });
        Chain { links, tool: last.carrying(&self.tool) }
    }

    /// The most that the tool can be away from the base [m].
    pub(super) fn reach(&self) -> f64 {
        let links: f64 = self
            .links
            .iter()
            .map(|link| {
                let travel = match link.kind {
                    JointKind::Revolute => 0.0,
                    JointKind::Prismatic => link.lower.abs().max(link.upper.abs()),
                };
                link.length.abs() + link.offset.abs() + travel
            })
            .sum();
        let reach = links + self.tool.position.norm();
        // A chain that turns in one point has no length of its own.
        if reach > 0.0 && reach.is_finite() { reach } else { 1.0 }
    }

    /// The rows of the task at `chain`.
    pub(super) fn rows<S: Scalar>(&self, chain: &Chain<S, N>, reach: f64) -> Rows<S, N> {
        let (linear, angular) = rows_of(self.task_space);
        let mut entries = [[S::from(0.0); N]; ROWS];
        for (joint, (link, frame)) in self.links.iter().zip(&chain.links).enumerate() {
            let axis = &frame.axes[2];
            match link.kind {
                JointKind::Revolute => {
                    let swing = cross(axis, &difference(&chain.tool.origin, &frame.origin));
                    for row in 0..linear {
                        entries[row][joint] = swing[row] / reach;
                    }
                    for row in 0..angular {
                        entries[linear + row][joint] = dot(&chain.tool.axes[row], axis);
                    }
                }
                // One over the reach for the row, times the reach for the joint.
                JointKind::Prismatic => {
                    for row in 0..linear {
                        entries[row][joint] = axis[row];
                    }
                }
            }
        }
        Rows { entries, count: linear + angular }
    }

    /// A tool's velocity as the rows of the task.
    pub(super) fn velocity_rows<S: Scalar>(
        &self,
        chain: &Chain<S, N>,
        reach: f64,
        linear: &Vector<S>,
        angular: &Vector<S>,
    ) -> [S; ROWS] {
        let (positions, _) = rows_of(self.task_space);
        core::array::from_fn(|row| {
            if row < positions {
                linear[row] / reach
            } else {
                dot(&chain.tool.axes[(row - positions).min(2)], angular)
            }
        })
    }

    /// What is missing from the tool of `chain` to `target`, as the rows of the task; rows beyond
    /// the task's are 0.
    pub(super) fn missing(&self, chain: &Chain<f64, N>, reach: f64, target: &Pose) -> [f64; ROWS] {
        let (positions, _) = rows_of(self.task_space);
        let mut missing = [0.0; ROWS];
        let away = target.position - Vector3::from(chain.tool.origin);
        for (value, part) in missing.iter_mut().zip(away.iter()).take(positions) {
            *value = part / reach;
        }
        let turn = chain.tool.rotation().transpose() * target.rotation;
        let rotation = match self.task_space {
            TaskSpace::Plane | TaskSpace::Space => return missing,
            TaskSpace::Axis => swing_to(&turn.column(2).into_owned()),
            TaskSpace::Pose => rotation_vector(&turn),
        };
        for (row, value) in rotation.iter().enumerate() {
            missing[positions + row] = *value;
        }
        missing
    }

    /// Unit of a joint's column: sliding joints are counted in reaches.
    pub(super) fn unit(&self, joint: usize, reach: f64) -> f64 {
        match self.links[joint].kind {
            JointKind::Revolute => 1.0,
            JointKind::Prismatic => reach,
        }
    }
}

impl<const N: usize> Rows<f64, N> {
    /// Smallest singular value: the least that the tool moves for a unit of joint motion, or where
    /// there are fewer joints than rows, the least that a unit of joint motion moves the tool.
    pub(super) fn smallest_singular_value(&self) -> f64 {
        let (size, matrix) = self.normal(0.0);
        // Beyond the task its diagonal is what no smallest eigenvalue exceeds: the square of a row of
        // six entries of at most 1.
        let padded = Matrix6::from_fn(|row, column| {
            if row < size && column < size {
                matrix[row][column]
            } else if row == column {
                ROWS as f64
            } else {
                0.0
            }
        });
        smallest_eigenvalue(padded).max(0.0).sqrt()
    }
}

impl<S: Scalar, const N: usize> Rows<S, N> {
    /// `J·Jᵀ`, or `Jᵀ·J` where there are fewer joints than rows, with `damping` on its diagonal.
    pub(super) fn normal(&self, damping: f64) -> (usize, [[S; ROWS]; ROWS]) {
        let size = self.count.min(N);
        let wide = self.count <= N;
        let mut matrix = [[S::from(0.0); ROWS]; ROWS];
        for row in 0..size {
            for column in 0..=row {
                let mut sum = S::from(if row == column { damping } else { 0.0 });
                if wide {
                    for joint in 0..N {
                        sum = sum + self.entries[row][joint] * self.entries[column][joint];
                    }
                } else {
                    for line in &self.entries[..self.count] {
                        sum = sum + line[row] * line[column];
                    }
                }
                matrix[row][column] = sum;
                matrix[column][row] = sum;
            }
        }
        (size, matrix)
    }

    /// `Jᵀ·right`.
    pub(super) fn transposed(&self, right: &[S; ROWS]) -> [S; N] {
        core::array::from_fn(|joint| {
            let mut sum = S::from(0.0);
            for (line, value) in self.entries[..self.count].iter().zip(right) {
                sum = sum + line[joint] * *value;
            }
            sum
        })
    }

    /// The least joint motion whose tool motion is nearest to `right`, kept small by `damping`.
    pub(super) fn solve(&self, right: &[S; ROWS], damping: f64) -> [S; N] {
        if self.count == N && damping == 0.0 {
            let mut matrix = [[S::from(0.0); ROWS]; ROWS];
            for (line, entries) in matrix.iter_mut().zip(&self.entries) {
                line[..N].copy_from_slice(entries);
            }
            let solution = eliminate(N, matrix, *right);
            return core::array::from_fn(|joint| solution[joint]);
        }
        let (size, matrix) = self.normal(damping);
        if self.count <= N {
            self.transposed(&eliminate(size, matrix, *right))
        } else {
            let mut projected = [S::from(0.0); ROWS];
            projected[..N].copy_from_slice(&self.transposed(right));
            let solution = eliminate(size, matrix, projected);
            core::array::from_fn(|joint| solution[joint])
        }
    }
}

/// Gauss's elimination with the largest pivot of each column. A singular matrix gives numbers that
/// are not finite.
fn eliminate<S: Scalar>(
    size: usize,
    mut matrix: [[S; ROWS]; ROWS],
    mut right: [S; ROWS],
) -> [S; ROWS] {
    for column in 0..size {
        let mut pivot = column;
        for row in column + 1..size {
            if matrix[row][column].value().abs() > matrix[pivot][column].value().abs() {
                pivot = row;
            }
        }
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        for row in column + 1..size {
            let factor = matrix[row][column] / matrix[column][column];
            let upper = matrix[column];
            for (entry, above) in matrix[row].iter_mut().zip(upper).skip(column + 1) {
                *entry = *entry - factor * above;
            }
            right[row] = right[row] - factor * right[column];
        }
    }
    for row in (0..size).rev() {
        for across in row + 1..size {
            right[row] = right[row] - matrix[row][across] * right[across];
        }
        right[row] = right[row] / matrix[row][row];
    }
    right
}

/// The shortest turn that brings the z axis to `direction`, about x and y, then 0 [rad].
fn swing_to(direction: &Vector3<f64>) -> Vector3<f64> {
    let across = math::hypot(direction.x, direction.y);
    let angle = math::atan2(across, direction.z);
    if across > 0.0 {
        Vector3::new(-direction.y, direction.x, 0.0) * (angle / across)
    } else {
        // Straight on, or straight back: about x, as good as any.
        Vector3::new(angle, 0.0, 0.0)
    }
}

/// The axis of a rotation times its angle [rad].
fn rotation_vector(rotation: &Matrix3<f64>) -> Vector3<f64> {
    let twice = Vector3::new(
        rotation[(2, 1)] - rotation[(1, 2)],
        rotation[(0, 2)] - rotation[(2, 0)],
        rotation[(1, 0)] - rotation[(0, 1)],
    );
    let sine = twice.norm() / 2.0;
    let cosine = (rotation.trace() - 1.0) / 2.0;
    let angle = math::atan2(sine, cosine);
    // A small turn is its own sine.
    if cosine > 0.0 && sine < 1e-9 {
        return twice / 2.0;
    }
    if cosine > 0.0 || sine > 1e-6 {
        return twice * (angle / (2.0 * sine));
    }
    // Near half a turn the sine has few digits left, but a·aᵀ = (R + Rᵀ + 2·I)/4 there.
    let outer = (rotation + rotation.transpose()) / 4.0 + Matrix3::identity() / 2.0;
    let largest = outer.diagonal().imax();
    let axis = outer.column(largest).into_owned();
    let axis = axis / axis.norm();
    let sign = if axis.dot(&twice) < 0.0 { -1.0 } else { 1.0 };
    axis * (angle * sign)
}

#[cfg(test)]
mod tests {
    use core::f64::consts::PI;

    use nalgebra::{Matrix3, Rotation3, Vector3};

    use super::{rotation_vector, swing_to};

    #[test]
    fn a_rotation_vector_turns_as_its_matrix_does() {
        let axis = Vector3::new(0.6, -0.48, 0.64);
        for angle in [0.0, 1e-12, 1e-9, 3e-8, 1e-5, 0.3, 1.7, 3.0, PI - 1e-7, PI - 1e-9] {
            let rotation = Rotation3::new(axis * angle).into_inner();
            let back = Rotation3::new(rotation_vector(&rotation)).into_inner();
            assert!((back - rotation).amax() < 1e-12, "{angle}: {back} {rotation}");
        }
        let half = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, -1.0));
        assert!((rotation_vector(&half) - Vector3::y() * PI).norm() < 1e-15);
    }

    #[test]
    fn a_swing_brings_the_axis_there() {
        for (x, y, z) in [(0.3, -0.4, 0.7), (1e-9, 0.0, 1.0), (0.0, 0.0, -1.0), (0.8, 0.1, -2.0)] {
            let direction = Vector3::new(x, y, z).normalize();
            let swing = swing_to(&direction);
            let there = Rotation3::new(swing) * Vector3::z();
            assert!((there - direction).norm() < 1e-14 && swing.z == 0.0, "{there} {direction}");
        }
    }
}
