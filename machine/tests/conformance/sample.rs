//! Repeatable states and motions, and the differences that check derivatives.

use machine::kinematics::{Attitude, Joints, TaskSpace, ToolMotion};
use machine::{Mechanism, Pose};
use messages::random::SplitMix64;
use nalgebra::{SVector, Vector3};

/// Repeatable numbers from -1 to 1.
pub(crate) struct Random(SplitMix64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    pub(crate) fn next(&mut self) -> f64 {
        self.0.between(-1.0, 1.0)
    }

    pub(crate) fn vector(&mut self, scale: f64) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next()) * scale
    }

    /// Joints evenly within `ranges`, each lower then upper.
    pub(crate) fn joints<const N: usize>(&mut self, ranges: [[f64; 2]; N]) -> Joints<N> {
        Joints::from_fn(|joint, _| {
            let [lower, upper] = ranges[joint];
            lower + (upper - lower) * (self.next() + 1.0) / 2.0
        })
    }

    /// A lively motion through `pose`, as far as `freedom` lets the tool move.
    pub(crate) fn motion(&mut self, pose: &Pose, task_space: TaskSpace) -> ToolMotion {
        let flat = |vector: Vector3<f64>| match task_space {
            TaskSpace::Plane => Vector3::new(vector.x, vector.y, 0.0),
            _ => vector,
        };
        let turning = match task_space {
            TaskSpace::Plane | TaskSpace::Space => 0.0,
            TaskSpace::Axis | TaskSpace::Pose => 1.0,
        };
        ToolMotion {
            position: pose.position,
            velocity: flat(self.vector(0.25)),
            acceleration: flat(self.vector(10.0)),
            jerk: flat(self.vector(500.0)),
            attitude: Attitude {
                rotation: pose.rotation,
                velocity: self.vector(turning),
                acceleration: self.vector(20.0 * turning),
                jerk: self.vector(500.0 * turning),
            },
        }
    }
}

/// `tool` a time `t` later, its jerks constant.
pub(crate) fn later(tool: &ToolMotion, t: f64) -> ToolMotion {
    let turn = &tool.attitude;
    let spin = |t: f64| turn.velocity + turn.acceleration * t + turn.jerk * (t * t / 2.0);
    // R′ = ω×R by one step of Runge and Kutta, for times so short that its fifth-order error is
    // far below rounding.
    let rate = |t: f64, rotation| spin(t).cross_matrix() * rotation;
    let first = rate(0.0, turn.rotation);
    let second = rate(t / 2.0, turn.rotation + first * (t / 2.0));
    let third = rate(t / 2.0, turn.rotation + second * (t / 2.0));
    let fourth = rate(t, turn.rotation + third * t);
    let rotation = turn.rotation + (first + (second + third) * 2.0 + fourth) * (t / 6.0);
    ToolMotion {
        position: tool.position
            + tool.velocity * t
            + tool.acceleration * (t * t / 2.0)
            + tool.jerk * (t * t * t / 6.0),
        velocity: tool.velocity + tool.acceleration * t + tool.jerk * (t * t / 2.0),
        acceleration: tool.acceleration + tool.jerk * t,
        jerk: tool.jerk,
        attitude: Attitude {
            rotation,
            velocity: spin(t),
            acceleration: turn.acceleration + turn.jerk * t,
            jerk: turn.jerk,
        },
    }
}

/// Derivative at 0 by a central difference of fourth order.
pub(crate) fn slope<const D: usize>(
    step: f64,
    function: impl Fn(f64) -> SVector<f64, D>,
) -> SVector<f64, D> {
    let pair = |times: f64| function(times * step) - function(-times * step);
    (pair(1.0) * 8.0 - pair(2.0)) / (12.0 * step)
}

/// The part of a vector that turns the tool as `freedom` counts it.
pub(crate) fn counted(task_space: TaskSpace, pose: &Pose, turning: &Vector3<f64>) -> Vector3<f64> {
    let axis = pose.rotation.column(2).into_owned();
    match task_space {
        TaskSpace::Plane | TaskSpace::Space => Vector3::zeros(),
        TaskSpace::Axis => turning - axis * axis.dot(turning),
        TaskSpace::Pose => *turning,
    }
}

/// How far `found` is from `wanted` in what the freedom counts [m or rad].
pub(crate) fn distance(task_space: TaskSpace, found: &Pose, wanted: &Pose) -> f64 {
    let turned = found.rotation - wanted.rotation;
    let turned = match task_space {
        TaskSpace::Plane | TaskSpace::Space => 0.0,
        TaskSpace::Axis => turned.column(2).amax(),
        TaskSpace::Pose => turned.amax(),
    };
    (found.position - wanted.position).norm().max(turned)
}

/// The numbers of a pose that a mechanism can choose.
pub(crate) fn rows(task_space: TaskSpace) -> usize {
    match task_space {
        TaskSpace::Plane => 2,
        TaskSpace::Space => 3,
        TaskSpace::Axis => 5,
        TaskSpace::Pose => 6,
    }
}

/// Whether every margin of the solved chain is at least `times` what it must keep.
pub(crate) fn clear<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    chain: &M::ChainState,
    times: f64,
) -> bool {
    mechanism.margins(chain).iter().all(|margin| margin.value > times * margin.limit)
}

/// `found` against `expected`, as a share of the larger of `scale` and 1.
#[track_caller]
pub(crate) fn near(found: f64, expected: f64, tolerance: f64, scale: f64, context: &str) {
    let error = (found - expected).abs();
    assert!(
        error <= tolerance * scale.max(1.0),
        "{found} against {expected} (off by {error:e}, scale {scale:e}), {context}"
    );
}
