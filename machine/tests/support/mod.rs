//! What tests of several mechanisms share: golden files, and what every mechanism must do.

// Each test takes a part of it, and is a crate of its own.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used)]

pub mod loads;

use machine::kinematics::{Attitude, Joints, KinematicsError, ToolMotion};
use machine::{Mechanism, Pose};
use messages::random::SplitMix64;
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;

pub fn golden(name: &str) -> Value {
    let path = format!("{}/../tests/golden/{name}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[track_caller]
pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

#[track_caller]
pub fn array<const N: usize>(value: &Value) -> [f64; N] {
    assert_eq!(value.as_array().unwrap().len(), N, "{value}");
    core::array::from_fn(|row| number(&value[row]))
}

#[track_caller]
pub fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from(array(value))
}

#[track_caller]
pub fn near(found: f64, expected: f64, tolerance: f64, context: &str) {
    let error = (found - expected).abs();
    assert!(error <= tolerance, "{found} against {expected} (off by {error:e}), {context}");
}

#[track_caller]
pub fn code_of<T: core::fmt::Debug>(result: Result<T, KinematicsError>) -> &'static str {
    result.unwrap_err().code
}

/// Repeatable numbers from -1 to 1.
pub struct Random(SplitMix64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    pub fn next(&mut self) -> f64 {
        self.0.between(-1.0, 1.0)
    }

    pub fn vector(&mut self, scale: f64) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next()) * scale
    }
}

/// The rotation that an angular velocity gives in `time`, its rates being those of `attitude`;
/// exact to time³.
pub fn later(tool: &ToolMotion, time: f64) -> ToolMotion {
    let Attitude { rotation, velocity, acceleration, jerk } = tool.attitude;
    let [first, second, third] = tool.attitude.rates();
    let turned =
        rotation + first * time + second * (time * time / 2.0) + third * (time * time * time / 6.0);
    // The nearest rotation; Newton's step of the polar decomposition is quadratic.
    let nearest = |matrix: Matrix3<f64>| (matrix + matrix.try_inverse().unwrap().transpose()) / 2.0;
    ToolMotion {
        position: tool.position
            + tool.velocity * time
            + tool.acceleration * (time * time / 2.0)
            + tool.jerk * (time * time * time / 6.0),
        velocity: tool.velocity + tool.acceleration * time + tool.jerk * (time * time / 2.0),
        acceleration: tool.acceleration + tool.jerk * time,
        jerk: tool.jerk,
        attitude: Attitude {
            rotation: nearest(nearest(turned)),
            velocity: velocity + acceleration * time + jerk * (time * time / 2.0),
            acceleration: acceleration + jerk * time,
            jerk,
        },
    }
}

/// Seeded motions: the joints' derivatives against differences, the Jacobian against differences
/// of the pose, and the dynamics against the energy.
pub fn conforms<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    branch: M::Branch,
    mut draw: impl FnMut(&mut Random) -> ToolMotion,
) {
    let mut random = Random::new(0x9e37_79b9_7f4a_7c15);
    for case in 0..300 {
        let tool = draw(&mut random);
        let context = format!("{} case {case}: {tool:?}", mechanism.name());
        let q = mechanism.inverse(&tool.pose(), branch, &Joints::zeros()).unwrap();
        let back = mechanism.forward(&q, branch).unwrap();
        near((back.position - tool.position).norm(), 0.0, 1e-14, &context);
        jacobian(mechanism, branch, &q, &context);

        let motion = mechanism.joint_motion(&tool, branch, &q).unwrap();
        near((motion.position - q).amax(), 0.0, 1e-12, &context);
        let step = 1e-5;
        let at = |time| mechanism.joint_motion(&later(&tool, time), branch, &q).unwrap();
        let (ahead, behind) = (at(step), at(-step));
        for (found, low, high) in [
            (motion.velocity, behind.position, ahead.position),
            (motion.acceleration, behind.velocity, ahead.velocity),
            (motion.jerk, behind.acceleration, ahead.acceleration),
        ] {
            let difference = (high - low) / (2.0 * step);
            let error = (found - difference).amax();
            // Truncation is the derivative two orders up times h²/6.
            let scale = 1.0 + motion.jerk.amax() + found.amax();
            assert!(error <= 1e-5 * scale, "{error:e}: {found} {difference}, {context}");
        }
        dynamics(mechanism, branch, [q, motion.velocity, motion.acceleration], &context);
    }
}

fn jacobian<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    branch: M::Branch,
    q: &Joints<N>,
    context: &str,
) {
    let chain = mechanism.solve(q, branch, None).unwrap();
    let jacobian = mechanism.jacobian(&chain);
    let pose = mechanism.pose(&chain);
    let step = 1e-6;
    for column in 0..N {
        let at = |sign: f64| -> Pose {
            let mut there = *q;
            there[column] += sign * step;
            mechanism.forward(&there, branch).unwrap()
        };
        let (ahead, behind) = (at(1.0), at(-1.0));
        let linear = (ahead.position - behind.position) / (2.0 * step);
        // ω× = R′·Rᵀ.
        let turn = (ahead.rotation - behind.rotation) / (2.0 * step) * pose.rotation.transpose();
        let angular = [turn[(2, 1)], turn[(0, 2)], turn[(1, 0)]];
        for row in 0..3 {
            near(jacobian[(row, column)], linear[row], 1e-9, context);
            near(jacobian[(row + 3, column)], angular[row], 1e-9, context);
        }
    }
}

/// The mass matrix is symmetric and positive; effort and energy agree.
fn dynamics<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    branch: M::Branch,
    [q, velocity, acceleration]: [Joints<N>; 3],
    context: &str,
) {
    let at = |q: Joints<N>| mechanism.solve(&q, branch, None).unwrap();
    let chain = at(q);
    let mass = mechanism.mass_matrix(&chain);
    assert_eq!((mass - mass.transpose()).amax(), 0.0);
    assert!(mass.cholesky().is_some(), "the mass matrix is not positive: {context}");

    // The change of the kinetic energy and the work against gravity are the power. With q on its
    // parabola the difference is of second order in the step.
    let h = 1e-5;
    let energy = |time: f64| {
        let there = at(q + velocity * time + acceleration * (time * time / 2.0));
        let moving = velocity + acceleration * time;
        moving.dot(&(mechanism.mass_matrix(&there) * moving)) / 2.0
    };
    let change = (energy(h) - energy(-h)) / (2.0 * h);
    let effort = mechanism.inverse_dynamics(&chain, &velocity, &acceleration);
    let lifting = mechanism.gravity(&chain).dot(&velocity);
    let power = effort.dot(&velocity);
    near(power, change + lifting, 1e-7 * (1.0 + power.abs() + energy(0.0)), context);

    // Each effort by Lagrange, d/dt ∂T/∂q̇ − ∂T/∂q + G, the derivatives by differences.
    let momentum = |time: f64| {
        let there = at(q + velocity * time + acceleration * (time * time / 2.0));
        mechanism.mass_matrix(&there) * (velocity + acceleration * time)
    };
    let rate = (momentum(h) - momentum(-h)) / (2.0 * h);
    for axis in 0..N {
        let kinetic = |sign: f64| {
            let mut there = q;
            there[axis] += sign * h;
            velocity.dot(&(mechanism.mass_matrix(&at(there)) * velocity)) / 2.0
        };
        let slope = (kinetic(1.0) - kinetic(-1.0)) / (2.0 * h);
        let expected = rate[axis] - slope + mechanism.gravity(&chain)[axis];
        let scale = 1.0 + effort.amax() + energy(0.0) + rate.amax();
        near(effort[axis], expected, 1e-7 * scale, context);
    }
}
