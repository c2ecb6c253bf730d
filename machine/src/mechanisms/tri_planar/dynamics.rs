//! Masses in motion: the platform, three hinged legs and three planar motors.
//!
//! Everything is gathered at the platform's twist and then seen from the feet through the
//! Jacobian. With the platform's twist V, a leg turns at `turn·V` about its hinge besides.

use nalgebra::{SMatrix, SVector, Vector3};

use super::{TriPlanar, TriPlanarAssembly};
use crate::kinematics::Joints;
use crate::kinematics::STANDARD_GRAVITY;

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

/// Mass matrix and efforts of gravity, in joint coordinates.
pub(super) fn inertia_and_gravity(
    mechanism: &TriPlanar,
    assembly: &TriPlanarAssembly,
) -> (SMatrix<f64, 6, 6>, Joints<6>) {
    let third = mechanism.height() / 3.0;
    let plate = mechanism.leg_inertia();
    let up = Vector3::new(0.0, 0.0, 1.0);

    let total = mechanism.platform_mass + 3.0 * mechanism.leg_mass;
    let mut weight = twist(&(up * mechanism.platform_mass), &Vector3::zeros());
    // Sums over the legs of m·d and, as a matrix, of m·(d·d − d·dᵀ): what moves with the platform.
    let mut moment = Vector3::zeros();
    let [x, y, z] = mechanism.platform_inertia;
    let axes = assembly.rotation;
    let mut angular =
        axes * nalgebra::Matrix3::from_diagonal(&Vector3::new(x, y, z)) * axes.transpose();
    let mut mass = SMatrix::<f64, 6, 6>::zeros();
    for leg in &assembly.legs {
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

        weight +=
            wrench(&(up * mechanism.leg_mass), &center) + leg.turn * (swing.z * mechanism.leg_mass);
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

    let jacobian = &assembly.jacobian;
    let mut seen = seen_from_feet(&mass, jacobian);
    for column in 0..6 {
        seen[(column, column)] += mechanism.inductor_mass;
    }
    (seen, jacobian.tr_mul(&weight) * STANDARD_GRAVITY)
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

/// Coriolis, centrifugal and gravity efforts with the feet moving at `velocity` [N].
pub(super) fn bias(
    mechanism: &TriPlanar,
    assembly: &TriPlanarAssembly,
    velocity: &Joints<6>,
) -> Joints<6> {
    let third = mechanism.height() / 3.0;
    let plate = mechanism.leg_inertia();
    let platform = assembly.jacobian * velocity;
    let spin = platform.fixed_rows::<3>(3).into_owned();

    let local = assembly.rotation.tr_mul(&spin);
    let momentum = local.component_mul(&Vector3::from(mechanism.platform_inertia));
    let gyroscopic = assembly.rotation * local.cross(&momentum);
    // Wrench that keeps the platform's twist as it is, and what the feet then accelerate by.
    let mut effort = twist(&Vector3::zeros(), &gyroscopic);
    let mut drift = Joints::zeros();
    for (index, leg) in assembly.legs.iter().enumerate() {
        let rate = leg.turn.dot(&platform);
        let turning = spin + leg.hinge * rate;
        let carried = spin.cross(&leg.hinge) * rate;
        // Acceleration of the hinge's middle, and of the shank's unit vector.
        let middle = spin.cross(&spin.cross(&leg.middle));
        let shank = carried.cross(&leg.shank) + turning.cross(&turning.cross(&leg.shank));
        let foot = middle + shank * (3.0 * third);
        let swing = leg.normal * (3.0 * third);
        // The foot stays in the plane.
        let turn = -foot.z / swing.z;
        drift[2 * index] = foot.x + swing.x * turn;
        drift[2 * index + 1] = foot.y + swing.y * turn;

        let center = leg.middle + leg.shank * third;
        let acceleration = middle + shank * third + leg.normal * (third * turn);
        let force = acceleration * mechanism.leg_mass;
        let angular = leg.hinge * turn + carried;
        let about_normal = turning.dot(&leg.normal);
        let torque = (angular
            + leg.normal * leg.normal.dot(&angular)
            + turning.cross(&leg.normal) * about_normal)
            * plate;
        effort += wrench(&force, &center)
            + twist(&Vector3::zeros(), &torque)
            + leg.turn * (third * leg.normal.dot(&force) + leg.hinge.dot(&torque));
    }
    // The feet must not accelerate: the platform does, against the drift. The planar motors'
    // own mass has no part in it.
    let against = assembly.mass * drift - drift * mechanism.inductor_mass;
    assembly.jacobian.tr_mul(&effort) - against + assembly.gravity
}
