//! The load side of the joints during a substep: inertia, its inverse, and the bias efforts.
//!
//! Where the mass matrix is the same everywhere, so is all of this. Elsewhere the mechanism's chain
//! is solved once in each substep, where the load is expected half-way through it, whatever number
//! of stages and events the substep has. In between, mass matrix and bias are taken as the parabola
//! through the middles of this substep and of the two before, so that their slope and curvature
//! along the motion count too: what is left is of third order in the substep, and where the motion
//! starts anew or friction changes it suddenly, of second order for two substeps. Mass matrix and
//! its inverse follow a parabola each; their product is the identity to that same order.
//!
//! The place half-way is extrapolated with the acceleration at the end of the substep before and
//! with its change since the one before that.

use machine::Mechanism;
use machine::kinematics::{Joints, KinematicsError};
use nalgebra::SMatrix;

/// Solutions behind the newest one that the parabola goes through.
const EARLIER: usize = 2;

/// By the number of those, what the newest and they add to a line's slope and to half its
/// curvature, per substep.
const PARABOLA: [[[f64; 1 + EARLIER]; 2]; 1 + EARLIER] = [
    [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
    [[1.0, -1.0, 0.0], [0.0, 0.0, 0.0]],
    [[1.5, -2.0, 0.5], [0.5, -1.0, 0.5]],
];

/// Why the equations of motion cannot be solved where the load is.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Unsolvable {
    /// The chain cannot close.
    #[error("the chain cannot close: {0}")]
    Chain(#[from] KinematicsError),
    /// The mass matrix is not positive definite, at a singular position.
    #[error("the mass matrix of the load is singular")]
    Mass,
}

/// How the load answers to efforts at one instant.
#[derive(Debug, Clone, Copy)]
pub(super) struct Response<const N: usize> {
    /// Inverse of the inertia in joint coordinates, with the rotors behind a rigid transmission
    /// [1/kg or 1/(kg·m²)].
    pub(super) mobility: SMatrix<f64, N, N>,
    /// Coriolis, centrifugal and gravity efforts [N or N·m].
    pub(super) bias: Joints<N>,
}

/// The load side where the chain was solved.
#[derive(Debug, Clone, Copy)]
struct Solution<const N: usize> {
    inertia: SMatrix<f64, N, N>,
    response: Response<N>,
}

/// How the load side depends on where the load is.
#[derive(Debug, Clone)]
pub(super) struct Coupling<const N: usize, M: Mechanism<N>> {
    law: Law,
    /// The chain at the newest position that it was solved at.
    chain: M::ChainState,
    /// Inertia of the rotors that is the load's own, zero behind an elastic transmission.
    rotors: SMatrix<f64, N, N>,
    /// Half-way through the substeps: the newest at `newest`, and from there on those before it.
    solutions: [Solution<N>; 1 + EARLIER],
    newest: usize,
    /// How many of those before belong to the newest one's motion.
    order: usize,
    /// How many solutions, but for the oldest, a motion that goes on finds.
    known: usize,
    /// Change of the newest response over one substep, and half the change of that.
    slope: Response<N>,
    curvature: Response<N>,
    /// Where the last substep ended, and its length [s]: a motion that goes on begins there.
    load: Joints<N>,
    load_speed: Joints<N>,
    step: f64,
    /// Accelerations of the load at the ends of the last two substeps.
    acceleration: Joints<N>,
    acceleration_before: Joints<N>,
}

/// What the load side depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Law {
    Constant,
    /// Position and velocity.
    Varying,
}

impl<const N: usize, M: Mechanism<N>> Coupling<N, M> {
    /// At rest at `home`, the inertia of `rotors` added to the load's.
    ///
    /// # Errors
    /// If the mass matrix cannot be inverted there.
    pub(super) fn new(
        mechanism: &M,
        home: M::ChainState,
        rotors: Option<SMatrix<f64, N, N>>,
    ) -> Result<Self, Unsolvable> {
        let law = if mechanism.has_constant_mass() { Law::Constant } else { Law::Varying };
        let mut inertia = mechanism.mass_matrix(&home);
        if let Some(rotors) = rotors {
            inertia += rotors;
        }
        let response = Response {
            mobility: inertia.try_inverse().ok_or(Unsolvable::Mass)?,
            bias: mechanism.bias(&home, &Joints::zeros()),
        };
        Ok(Self {
            law,
            chain: home,
            rotors: rotors.unwrap_or_else(SMatrix::zeros),
            solutions: [Solution { inertia, response }; 1 + EARLIER],
            newest: 0,
            order: 0,
            known: 0,
            slope: Response::zero(),
            curvature: Response::zero(),
            load: Joints::zeros(),
            load_speed: Joints::zeros(),
            step: 0.0,
            acceleration: Joints::zeros(),
            acceleration_before: Joints::zeros(),
        })
    }

    /// The chain at the newest position that it was solved at.
    pub(super) fn chain(&self) -> &M::ChainState {
        &self.chain
    }

    /// Inverse of the inertia half-way through the newest substep.
    pub(super) fn mobility(&self) -> &SMatrix<f64, N, N> {
        &self.solutions[self.newest].response.mobility
    }

    /// Solves for a substep of `step` [s] from `load` on, which moves at `load_speed`.
    ///
    /// # Errors
    /// If the chain cannot close half-way through it, or is singular there.
    pub(super) fn begin(
        &mut self,
        mechanism: &M,
        load: &Joints<N>,
        load_speed: &Joints<N>,
        step: f64,
    ) -> Result<(), Unsolvable> {
        if self.law == Law::Constant {
            return Ok(());
        }
        if self.load != *load || self.load_speed != *load_speed || self.step != step {
            self.known = 0;
            self.step = step;
            (self.acceleration, self.acceleration_before) = (Joints::zeros(), Joints::zeros());
        }
        let half = 0.5 * step;
        let growth = match self.known {
            0 | 1 => Joints::zeros(),
            _ => (self.acceleration - self.acceleration_before) / step,
        };
        let speed = load_speed + (self.acceleration + growth * (half / 2.0)) * half;
        let place =
            load + (load_speed + (self.acceleration / 2.0 + growth * (half / 6.0)) * half) * half;

        // The chain of another motion is no place to start from: it may lie on another branch.
        let near = (self.known > 0).then_some(&self.chain);
        match mechanism.solve(&place, mechanism.branch(), near) {
            Ok(chain) => self.chain = chain,
            Err(error) => return Err(error.into()),
        }
        let inertia = mechanism.mass_matrix(&self.chain) + self.rotors;
        let Some(mobility) = positive_inverse(&inertia) else {
            self.known = 0;
            return Err(Unsolvable::Mass);
        };
        let bias = mechanism.bias(&self.chain, &speed);
        // In the place of the oldest.
        self.newest = (self.newest + EARLIER) % self.solutions.len();
        self.solutions[self.newest] = Solution { inertia, response: Response { mobility, bias } };
        self.order = self.known;
        let [own, first, second] = by_age(&self.solutions, self.newest).map(|one| &one.response);
        let [slope, curvature] = PARABOLA[self.order];
        self.slope = own.combine(slope[0], first, slope[1], second, slope[2]);
        self.curvature = own.combine(curvature[0], first, curvature[1], second, curvature[2]);
        self.known = (self.known + 1).min(EARLIER);
        Ok(())
    }

    /// How the load answers at the share `at` of the substep begun.
    #[inline(always)] // Called in every stage.
    pub(super) fn at(&self, at: f64) -> Response<N> {
        let middle = &self.solutions[self.newest].response;
        if self.law == Law::Constant {
            return *middle;
        }
        let from = at - 0.5;
        middle.combine(1.0, &self.slope, from, &self.curvature, from * from)
    }

    /// The inertia at the share `at` of the substep begun [kg or kg·m²].
    pub(super) fn inertia(&self, at: f64) -> SMatrix<f64, N, N> {
        let [own, first, second] = by_age(&self.solutions, self.newest).map(|one| &one.inertia);
        let [slope, curvature] = PARABOLA[self.order];
        let from = at - 0.5;
        let weight = |age: usize| slope[age] * from + curvature[age] * from * from;
        own * (1.0 + weight(0)) + first * weight(1) + second * weight(2)
    }

    /// Ends the substep with the load at `load`, moving at `load_speed`, accelerated by
    /// `acceleration`.
    pub(super) fn end(
        &mut self,
        load: &Joints<N>,
        load_speed: &Joints<N>,
        acceleration: &Joints<N>,
    ) {
        if self.law == Law::Constant {
            return;
        }
        (self.load, self.load_speed) = (*load, *load_speed);
        (self.acceleration_before, self.acceleration) = (self.acceleration, *acceleration);
    }
}

/// The newest of `solutions`, which is at `newest`, and those before it.
fn by_age<T>(solutions: &[T; 1 + EARLIER], newest: usize) -> [&T; 1 + EARLIER] {
    core::array::from_fn(|age| &solutions[(newest + age) % solutions.len()])
}

impl<const N: usize> Response<N> {
    fn zero() -> Self {
        Self { mobility: SMatrix::zeros(), bias: Joints::zeros() }
    }

    /// A weighted sum of three.
    #[inline(always)] // By value through memory it costs as much as the sum.
    fn combine(&self, own: f64, first: &Self, one: f64, second: &Self, two: f64) -> Self {
        Self {
            mobility: self.mobility * own + first.mobility * one + second.mobility * two,
            bias: self.bias * own + first.bias * one + second.bias * two,
        }
    }
}

/// The inverse of a positive definite matrix; `None` for one that is not, or holds no numbers.
///
/// Cholesky's factor is inverted in its place, and multiplied with itself: nalgebra solves for one
/// column of the identity after the other, zeros and all, which takes five times as long.
pub(super) fn positive_inverse<const N: usize>(
    matrix: &SMatrix<f64, N, N>,
) -> Option<SMatrix<f64, N, N>> {
    let mut factor = [[0.0; N]; N];
    let mut scale = [0.0; N];
    for row in 0..N {
        for column in 0..=row {
            let mut rest = matrix[(row, column)];
            for (own, other) in factor[row].iter().zip(&factor[column]).take(column) {
                rest -= own * other;
            }
            if column < row {
                factor[row][column] = rest * scale[column];
            } else {
                // False for what is not a number too.
                let positive = rest > 0.0 && rest.is_finite();
                if !positive {
                    return None;
                }
                scale[row] = 1.0 / rest.sqrt();
            }
        }
    }
    // L·K = 1, below and on the diagonal.
    let mut inverse = [[0.0; N]; N];
    for column in 0..N {
        inverse[column][column] = scale[column];
        for row in column + 1..N {
            let mut sum = 0.0;
            for between in column..row {
                sum += factor[row][between] * inverse[between][column];
            }
            inverse[row][column] = -sum * scale[row];
        }
    }
    let mut product = SMatrix::zeros();
    let mut finite = true;
    for column in 0..N {
        for row in column..N {
            let mut sum = 0.0;
            for line in &inverse[row..] {
                sum += line[row] * line[column];
            }
            finite &= sum.is_finite();
            product[(row, column)] = sum;
            product[(column, row)] = sum;
        }
    }
    finite.then_some(product)
}

#[cfg(test)]
mod tests {
    use super::positive_inverse;
    use nalgebra::{Matrix3, SMatrix};

    #[test]
    fn a_positive_matrix_times_its_inverse_is_the_identity() {
        // A·Aᵀ of a matrix with no structure, and the identity to keep it away from singular.
        let a = SMatrix::<f64, 6, 6>::from_fn(|row, column| {
            f64::from(((row * 7 + column * 11 + row * column * 5) % 13) as u8) / 6.0 - 1.0
        });
        let matrix = a * a.transpose() + SMatrix::identity() * 0.1;
        let inverse = positive_inverse(&matrix).unwrap_or_default();
        let off = matrix * inverse - SMatrix::<f64, 6, 6>::identity();
        assert!(off.amax() < 1e-12, "{off}");
        assert_eq!(inverse, inverse.transpose());
    }

    #[test]
    fn what_is_not_positive_definite_has_no_inverse() {
        let singular = Matrix3::new(1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 2.0);
        let turned = Matrix3::new(1.0, 2.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 2.0);
        let nowhere = Matrix3::identity() * f64::NAN;
        let endless = Matrix3::identity() * f64::INFINITY;
        for matrix in [singular, turned, nowhere, endless, -Matrix3::identity()] {
            assert_eq!(positive_inverse(&matrix), None, "{matrix}");
        }
    }
}
