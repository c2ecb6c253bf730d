//! The equation of motion at one joint position, as matrices.

use nalgebra::SMatrix;

use crate::kinematics::{Joints, Mechanism};

/// `τ = M·q̈ + V + G`, with `V = C·(q̇ⱼ²) + B·(q̇ⱼ·q̇ₖ)`: the load alone, without friction.
// Source 000 eq. 7.18, where C and B have each other's names.
#[derive(Debug, Clone, PartialEq)]
pub struct EquationOfMotion<const N: usize> {
    /// M, symmetric and positive definite [kg or kg·m², mixed kg·m].
    pub mass: SMatrix<f64, N, N>,
    /// V, what Coriolis and centrifugal effects take at the joint rates asked for [N or N·m].
    pub velocity: Joints<N>,
    /// G, what gravity takes [N or N·m].
    pub gravity: Joints<N>,
    /// C: centrifugal efforts, a column for the square of each joint rate.
    pub centrifugal: SMatrix<f64, N, N>,
    /// B: Coriolis efforts, a column for the product of each pair of joint rates, in the order
    /// (0, 1), (0, 2), …, (1, 2), ….
    pub coriolis: Vec<Joints<N>>,
}

/// The pairs of `count` joints in the order of the columns of [`EquationOfMotion::coriolis`].
fn pairs(count: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..count).flat_map(move |first| (first + 1..count).map(move |second| (first, second)))
}

impl<const N: usize> EquationOfMotion<N> {
    /// That of `mechanism` with its chain solved, its joints moving at `velocity` [m/s or rad/s].
    pub fn of<M: Mechanism<N>>(mechanism: &M, chain: &M::ChainState, velocity: &Joints<N>) -> Self {
        let gravity = mechanism.gravity(chain);
        // A quadratic form of the rates, so its values at unit rates are its coefficients.
        let form = |rates: &Joints<N>| mechanism.bias(chain, rates) - gravity;
        let unit = |joint: usize| Joints::<N>::from_fn(|row, _| f64::from(u8::from(row == joint)));
        let mut centrifugal = SMatrix::<f64, N, N>::zeros();
        for joint in 0..N {
            centrifugal.set_column(joint, &form(&unit(joint)));
        }
        let coriolis = pairs(N)
            .map(|(one, other)| {
                form(&(unit(one) + unit(other)))
                    - centrifugal.column(one)
                    - centrifugal.column(other)
            })
            .collect();
        let mass = mechanism.mass_matrix(chain);
        Self { mass, velocity: form(velocity), gravity, centrifugal, coriolis }
    }

    /// The same for coordinates of which `ratios` joint units go to one each, such as motor angles;
    /// `inertias` turn with them [kg·m²].
    #[must_use]
    pub fn through(mut self, ratios: &Joints<N>, inertias: &Joints<N>) -> Self {
        for row in 0..N {
            for column in 0..N {
                self.mass[(row, column)] *= ratios[row] * ratios[column];
                self.centrifugal[(row, column)] *= ratios[row] * ratios[column] * ratios[column];
            }
            self.mass[(row, row)] += inertias[row];
        }
        for (column, (one, other)) in self.coriolis.iter_mut().zip(pairs(N)) {
            column.component_mul_assign(&(ratios * (ratios[one] * ratios[other])));
        }
        self.velocity.component_mul_assign(ratios);
        self.gravity.component_mul_assign(ratios);
        self
    }
}
