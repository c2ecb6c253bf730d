//! Masses in motion: the platform, three hinged legs and three planar motors.
//!
//! Everything is gathered at the platform's twist and then seen from the feet through the
//! Jacobian. With the platform's twist V, a leg turns at `turn·V` about its hinge besides. The mass
//! matrix is that of the composite body; the bias is Newton's and Euler's, body by body. Legs that are
//! not quite as drawn keep their thin triangles, and a base that leans its vertical.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::{TriPlanar, TriPlanarChainState};
use crate::kinematics::{Joints, STANDARD_GRAVITY};

type Twist = SVector<f64, 6>;

impl TriPlanar {
    /// Inertia of a leg about an axis in its plane through its centroid, a uniform equilateral
    /// triangle: `m·a²/24`, and twice that about its normal [kg·m²].
    fn leg_inertia(&self) -> f64 {
        self.leg_mass * self.side * self.side / 24.0
    }
}

fn twist(linear: &Vector3<f64>, angular: &Vector3<f64>) -> Twist {
    Twist::from([linear.x, linear.y, linear.z, angular.x, angular.y, angular.z])
}

/// A wrench about the platform's centroid of `force` that acts `arm` away from it.
fn wrench(force: &Vector3<f64>, arm: &Vector3<f64>) -> Twist {
    twist(force, &arm.cross(force))
}

/// Adds `a·bᵀ + b·aᵀ`, below and on the diagonal.
fn add_product(matrix: &mut SMatrix<f64, 6, 6>, a: &Twist, b: &Twist) {
    for column in 0..6 {
        for row in column..6 {
            matrix[(row, column)] += a[row] * b[column] + b[row] * a[column];
        }
    }
}

/// Mass matrix, in joint coordinates [kg].
pub(super) fn mass_matrix(
    mechanism: &TriPlanar,
    chain: &TriPlanarChainState,
) -> SMatrix<f64, 6, 6> {
    let plate = mechanism.leg_inertia();
    let rotation = &chain.rotation;

    let total = mechanism.platform_mass + 3.0 * mechanism.leg_mass;
    // Sums over the legs of m·d and, as a matrix, of m·(d·d − d·dᵀ): what moves with the platform.
    let mut moment = Vector3::zeros();
    let [x, y, z] = mechanism.platform_inertia;
    let mut angular =
        rotation * Matrix3::from_diagonal(&Vector3::new(x, y, z)) * rotation.transpose();
    let mut mass = SMatrix::<f64, 6, 6>::zeros();
    for leg in &chain.legs {
        let third = leg.height / 3.0;
        let center = leg.middle + leg.shank * third;
        let lever = center * mechanism.leg_mass;
        moment += lever;
        let spread = center.dot(&lever) + plate;
        angular += leg.normal * leg.normal.transpose() * plate - lever * center.transpose();
        for axis in 0..3 {
            angular[(axis, axis)] += spread;
        }
        // What the turn about the hinge adds: across with the platform's motion, and squared.
        let swing = leg.normal * third;
        let across = wrench(&(swing * mechanism.leg_mass), &center)
            + twist(&Vector3::zeros(), &(leg.hinge * plate));
        let square = third * third * mechanism.leg_mass + plate;
        add_product(&mut mass, &leg.turn, &(across + leg.turn * (square / 2.0)));
    }
    for axis in 0..3 {
        mass[(axis, axis)] += total;
        for column in 0..=axis {
            mass[(3 + axis, 3 + column)] += angular[(axis, column)];
        }
    }
    let lever = moment.cross_matrix();
    for row in 0..3 {
        for column in 0..3 {
            mass[(3 + row, column)] += lever[(row, column)];
        }
    }
    mass.fill_upper_triangle_with_lower_triangle();

    let mut seen = seen_from_feet(&mass, &chain.jacobian);
    for column in 0..6 {
        seen[(column, column)] += mechanism.inductor_mass;
    }
    seen
}

/// `Jᵀ·M·J`, of which both halves are the same.
fn seen_from_feet(mass: &SMatrix<f64, 6, 6>, jacobian: &SMatrix<f64, 6, 6>) -> SMatrix<f64, 6, 6> {
    let mut seen = SMatrix::<f64, 6, 6>::zeros();
    for column in 0..6 {
        let mut momentum = Twist::zeros();
        for (axis, rate) in jacobian.column(column).iter().enumerate() {
            for row in 0..6 {
                momentum[row] += mass[(row, axis)] * rate;
            }
        }
        for row in column..6 {
            let mut sum = 0.0;
            for axis in 0..6 {
                sum += jacobian[(axis, row)] * momentum[axis];
            }
            seen[(row, column)] = sum;
            seen[(column, row)] = sum;
        }
    }
    seen
}

/// How a leg goes on with the platform's twist and the foot's velocity as they are.
struct Carried {
    /// Angular velocity, and what of the angular acceleration is not about the hinge.
    turning: Vector3<f64>,
    carried: Vector3<f64>,
    /// Acceleration of the hinge's middle, and of the shank's unit vector.
    middle: Vector3<f64>,
    shank: Vector3<f64>,
    /// Angular acceleration about the hinge with which the foot stays in the stator plane.
    turn: f64,
}

/// Coriolis, centrifugal and gravity efforts with the feet moving at `velocity` [N]: what the
/// bodies' own inertia and weight ask for while the feet do not accelerate.
pub(super) fn bias(
    mechanism: &TriPlanar,
    chain: &TriPlanarChainState,
    velocity: &Joints<6>,
) -> Joints<6> {
    let plate = mechanism.leg_inertia();
    let platform = chain.jacobian * velocity;
    let spin = platform.fixed_rows::<3>(3).into_owned();

    // With the platform's twist as it is, the feet would accelerate by the drift.
    let mut drift = Joints::zeros();
    let mut carry = |index: usize| {
        let leg = &chain.legs[index];
        let third = leg.height / 3.0;
        let rate = leg.turn.dot(&platform);
        let turning = spin + leg.hinge * rate;
        let carried = spin.cross(&leg.hinge) * rate;
        let middle = spin.cross(&spin.cross(&leg.middle));
        let shank = carried.cross(&leg.shank) + turning.cross(&turning.cross(&leg.shank));
        let foot = middle + shank * (3.0 * third);
        let swing = leg.normal * (3.0 * third);
        let turn = -foot.z / swing.z;
        drift[2 * index] = foot.x + swing.x * turn;
        drift[2 * index + 1] = foot.y + swing.y * turn;
        Carried { turning, carried, middle, shank, turn }
    };
    let carried = [carry(0), carry(1), carry(2)];
    let platform = chain.jacobian * -drift;
    let linear = platform.fixed_rows::<3>(0) + Vector3::new(0.0, 0.0, STANDARD_GRAVITY);
    let angular = platform.fixed_rows::<3>(3).into_owned();

    let inertia = Vector3::from(mechanism.platform_inertia);
    let local = chain.rotation.tr_mul(&spin);
    let torque = chain.rotation.tr_mul(&angular).component_mul(&inertia)
        + local.cross(&local.component_mul(&inertia));
    let mut effort = twist(&(linear * mechanism.platform_mass), &(chain.rotation * torque));
    for (leg, own) in chain.legs.iter().zip(&carried) {
        let third = leg.height / 3.0;
        let turn = own.turn + leg.turn.dot(&platform);
        let center = leg.middle + leg.shank * third;
        let acceleration = linear
            + angular.cross(&center)
            + own.middle
            + own.shank * third
            + leg.normal * (third * turn);
        let force = acceleration * mechanism.leg_mass;
        let angular = angular + own.carried + leg.hinge * turn;
        let torque = (angular
            + leg.normal * leg.normal.dot(&angular)
            + own.turning.cross(&leg.normal) * own.turning.dot(&leg.normal))
            * plate;
        effort += wrench(&force, &center)
            + twist(&Vector3::zeros(), &torque)
            + leg.turn * (third * leg.normal.dot(&force) + leg.hinge.dot(&torque));
    }
    chain.jacobian.tr_mul(&effort)
}
