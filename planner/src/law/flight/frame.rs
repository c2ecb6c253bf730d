//! The directions that a flight moves in.

use nalgebra::Vector3;

use super::State;

/// Orthonormal directions in which all vectors of a flight lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    axes: [Vector3<f64>; 3],
    /// Whether two of them are enough.
    pub flat: bool,
}

/// The longest of `vectors`.
fn longest(vectors: &[Vector3<f64>]) -> Vector3<f64> {
    let mut found = Vector3::zeros();
    for vector in vectors {
        if vector.norm_squared() > found.norm_squared() {
            found = *vector;
        }
    }
    found
}

impl Frame {
    /// For the way from `from` to `to`.
    pub(super) fn new(from: &State, to: &State) -> Self {
        let way = to.position - from.position;
        // In parts of what is lost to rounding anyway.
        let size = (way.norm() + from.position.norm()) * 1e-15 + super::ROUNDING;
        let mut rest = [
            way / size,
            from.velocity / (1e-13 + 1e-15 * from.velocity.norm()),
            to.velocity / (1e-13 + 1e-15 * to.velocity.norm()),
            from.acceleration / (1e-10 + 1e-15 * from.acceleration.norm()),
            to.acceleration / (1e-10 + 1e-15 * to.acceleration.norm()),
        ];
        let mut axes = [Vector3::zeros(); 3];
        for index in 0..2 {
            let axis = longest(&rest);
            let made = axes[..index].iter().fold(axis, |axis, made| axis - made * made.dot(&axis));
            axes[index] = made.try_normalize(1.0).unwrap_or_else(|| spare(&axes[..index]));
            for vector in &mut rest {
                *vector -= axes[index] * axes[index].dot(vector);
            }
        }
        axes[2] = axes[0].cross(&axes[1]);
        Self { axes, flat: longest(&rest).norm() <= 1.0 }
    }

    /// `vector` by the first `D` directions.
    pub(super) fn down<const D: usize>(&self, vector: &Vector3<f64>) -> [f64; D] {
        core::array::from_fn(|axis| self.axes[axis].dot(vector))
    }

    /// The vector with these `parts`.
    pub(super) fn up<const D: usize>(&self, parts: &[f64; D]) -> Vector3<f64> {
        let pairs = parts.iter().zip(&self.axes);
        pairs.fold(Vector3::zeros(), |sum, (part, axis)| sum + axis * *part)
    }
}

/// Any direction across `axes`, of which there is at most one.
fn spare(axes: &[Vector3<f64>]) -> Vector3<f64> {
    let axis = axes.first().copied().unwrap_or_else(Vector3::zeros);
    let across = Vector3::ith(axis.iamin(), 1.0);
    (across - axis * axis.dot(&across)).normalize()
}
