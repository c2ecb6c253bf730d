//! A point of a curve with its first three derivatives, and the change to arc length.

use machine::kinematics::{Attitude, ToolMotion};
use nalgebra::Vector3;

/// A point and its derivatives by some parameter of the curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jet {
    /// [m].
    pub point: Vector3<f64>,
    /// By arc length: the unit tangent.
    pub first: Vector3<f64>,
    /// By arc length: the curvature vector [1/m].
    pub second: Vector3<f64>,
    /// By arc length [1/m²].
    pub third: Vector3<f64>,
}

/// A parameter of a curve and its derivatives by arc length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Progress {
    pub(crate) first: f64,
    pub(crate) second: f64,
    pub(crate) third: f64,
}

/// The larger of both, and not a number where one of them is not: [`f64::max`] takes the other one then.
pub(crate) fn larger(one: f64, other: f64) -> f64 {
    if one > other || one.is_nan() { one } else { other }
}

impl Jet {
    /// How the parameter that this jet is taken by goes on with arc length.
    pub(crate) fn progress(&self) -> Progress {
        // ds/du = |p′|; the higher ones by differentiating u′ = (p′·p′)^(−½) along the curve.
        let square = self.first.norm_squared();
        let along = self.first.dot(&self.second);
        let change = self.second.norm_squared() + self.first.dot(&self.third);
        let first = 1.0 / square.sqrt();
        let second = -along / (square * square);
        let third =
            first * (4.0 * along * along / (square * square * square) - change / (square * square));
        Progress { first, second, third }
    }

    /// The same point with its derivatives by arc length.
    pub(crate) fn by_arc_length(&self) -> Self {
        let Progress { first, second, third } = self.progress();
        Self {
            point: self.point,
            first: self.first * first,
            second: self.second * (first * first) + self.first * second,
            third: self.third * (first * first * first)
                + self.second * (3.0 * first * second)
                + self.first * third,
        }
    }

    /// The tool's motion along a curve taken by arc length, when it is here with `velocity`,
    /// `acceleration` and `jerk` along the curve; level, since a curve turns nothing.
    #[inline]
    pub fn motion(&self, [velocity, acceleration, jerk]: [f64; 3]) -> ToolMotion {
        ToolMotion {
            position: self.point,
            velocity: self.first * velocity,
            acceleration: self.second * (velocity * velocity) + self.first * acceleration,
            jerk: self.third * (velocity * velocity * velocity)
                + self.second * (3.0 * velocity * acceleration)
                + self.first * jerk,
            attitude: Attitude::LEVEL,
        }
    }
}
