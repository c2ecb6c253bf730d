//! The way from rest into a stroke, and out of it.
//!
//! At the stroke's start the tool must have the stroke's speed V along its tangent and, where the
//! stroke starts curved, its lateral acceleration V²κ at once. The start point of the run-in is
//! free. Along the tangent the tool takes the [`Ramp`] of the thesis; across it a swing, which
//! ends without lateral velocity:
//!
//! ```text
//! along   rest ───────► V           jerk ±J·cos α, acceleration ≤ A_t
//! across  rest ─(back)─ V²κ         jerk −J·sin α for τ, then +J·sin α for (1 + √2)·τ
//! ```
//!
//! Both end at the same instant. The split α of the jerk, and A_t, are those of the shortest time
//! with |a| ≤ A and |j| ≤ J as vectors. A run-out is a run-in backwards in time.

use core::f64::consts::{FRAC_PI_2, SQRT_2};

use machine::PathLimits;
use machine::kinematics::{Attitude, ToolMotion};
use messages::math;
use nalgebra::Vector3;

use crate::geometry::jet::Jet;
use crate::law::profile::{Along, Ramp};

/// Lateral acceleration below which a stroke starts straight [m/s²].
const STRAIGHT: f64 = 1e-9;

/// From rest to an acceleration without velocity, by going back first.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Swing {
    jerk: f64,
    /// Duration of the first phase, with −jerk [s].
    back: f64,
}

/// The motion from rest to the start of a stroke.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RunIn {
    point: Vector3<f64>,
    tangent: Vector3<f64>,
    normal: Vector3<f64>,
    ramp: Ramp,
    swing: Swing,
    duration: f64,
}

impl Swing {
    /// To `acceleration` with `jerk`.
    fn new(acceleration: f64, jerk: f64) -> Self {
        // −J·τ₁ + J·τ₂ = a and ∫a = 0 give τ₂ = (1 + √2)·τ₁, a = √2·J·τ₁.
        Self { jerk, back: acceleration / (SQRT_2 * jerk) }
    }

    fn duration(&self) -> f64 {
        (2.0 + SQRT_2) * self.back
    }

    fn at(&self, time: f64) -> Along {
        let Self { jerk, back } = *self;
        if time <= 0.0 || back == 0.0 {
            let jerk = if time < 0.0 || back == 0.0 { 0.0 } else { -jerk };
            return Along { jerk, ..Along::default() };
        }
        if time < back {
            let acceleration = -jerk * time;
            let velocity = acceleration * time / 2.0;
            return Along { position: velocity * time / 3.0, velocity, acceleration, jerk: -jerk };
        }
        // From the end backwards, where the velocity is exactly 0.
        let left = self.duration() - time;
        let last = SQRT_2 * jerk * back;
        Along {
            position: self.position() + (last / 2.0 - jerk * left / 6.0) * left * left,
            velocity: -(last - jerk * left / 2.0) * left,
            acceleration: last - jerk * left,
            jerk,
        }
    }

    /// Where it ends [m].
    fn position(&self) -> f64 {
        let Self { jerk, back } = *self;
        let second = (1.0 + SQRT_2) * back;
        let last = SQRT_2 * jerk * back;
        // Continuous with the first phase at its end.
        -jerk * back * back * back / 6.0 - (last / 2.0 - jerk * second / 6.0) * second * second
    }

    /// Instants at which the jerk changes.
    fn breaks(&self) -> [f64; 3] {
        [0.0, self.back, self.duration()]
    }
}

/// Instants at which the jerk of a ramp changes.
fn breaks(ramp: &Ramp) -> [f64; 4] {
    [0.0, ramp.rise, ramp.rise + ramp.hold, ramp.duration()]
}

/// Whether ramp and swing, ending together, keep |a| within `acceleration`.
///
/// Both accelerations are piecewise linear, so the square of the norm is convex between breaks, and
/// looking at the breaks is enough.
fn keeps(ramp: &Ramp, swing: &Swing, acceleration: f64) -> bool {
    let (end, other) = (ramp.duration(), swing.duration());
    let limit = acceleration * acceleration * (1.0 + 1e-9);
    let fits = |left: f64| {
        let along = ramp.at(end - left).acceleration;
        let across = swing.at(other - left).acceleration;
        along * along + across * across <= limit
    };
    breaks(ramp).into_iter().all(|time| fits(end - time))
        && swing.breaks().into_iter().all(|time| fits(other - time))
}

/// The quickest ramp to `speed` with `jerk` that leaves `swing` its share of `acceleration`.
fn beside(swing: &Swing, speed: f64, acceleration: f64, jerk: f64) -> Ramp {
    let full = Ramp::to_speed(speed, acceleration, jerk);
    if keeps(&full, swing, acceleration) {
        return full;
    }
    let (mut low, mut high) = (0.0, full.acceleration());
    for _ in 0..30 {
        let middle = (low + high) / 2.0;
        if keeps(&Ramp::to_speed(speed, middle, jerk), swing, acceleration) {
            low = middle;
        } else {
            high = middle;
        }
    }
    // A hundredth of the acceleration would already be a poor but sound run-in.
    Ramp::to_speed(speed, low.max(acceleration * 1e-3), jerk)
}

impl RunIn {
    /// To the start of a stroke, `start` by arc length, at `speed`, in the shortest time of its
    /// kind; `speed` must be one at which the stroke itself keeps `limits`.
    pub(crate) fn new(start: &Jet, speed: f64, limits: &PathLimits) -> Self {
        let lateral = start.second * (speed * speed);
        let wanted = lateral.norm();
        let (acceleration, jerk) = (limits.acceleration, limits.jerk);
        let straight = Self {
            point: start.point,
            tangent: start.first,
            normal: Vector3::zeros(),
            ramp: Ramp::to_speed(speed, acceleration, jerk),
            swing: Swing::default(),
            duration: 0.0,
        };
        if wanted <= STRAIGHT {
            return Self { duration: straight.ramp.duration(), ..straight };
        }
        let split = |angle: f64| {
            let (sine, cosine) = math::sin_cos(angle);
            let swing = Swing::new(wanted, jerk * sine);
            (beside(&swing, speed, acceleration, jerk * cosine), swing)
        };
        // More jerk across shortens the swing and lengthens the ramp: the best split is where both
        // take the same time.
        let (mut low, mut high) = (1e-6, FRAC_PI_2 - 1e-6);
        for _ in 0..40 {
            let middle = (low + high) / 2.0;
            let (ramp, swing) = split(middle);
            if swing.duration() > ramp.duration() {
                low = middle;
            } else {
                high = middle;
            }
        }
        let (ramp, swing) = split(high);
        Self {
            normal: lateral / wanted,
            ramp,
            swing,
            duration: ramp.duration().max(swing.duration()),
            ..straight
        }
    }

    /// [s].
    pub(crate) fn duration(&self) -> f64 {
        self.duration
    }

    /// Where it starts from rest [m].
    pub(crate) fn from(&self) -> Vector3<f64> {
        self.at(0.0).position
    }

    /// The tool's motion at `time` since the start [s].
    pub(crate) fn at(&self, time: f64) -> ToolMotion {
        let left = self.duration - time;
        let along = self.ramp.at(self.ramp.duration() - left);
        let across = self.swing.at(self.swing.duration() - left);
        let join = |along: f64, across: f64| self.tangent * along + self.normal * across;
        ToolMotion {
            position: self.point
                + join(
                    along.position - self.ramp.length(),
                    across.position - self.swing.position(),
                ),
            velocity: join(along.velocity, across.velocity),
            acceleration: join(along.acceleration, across.acceleration),
            jerk: join(along.jerk, across.jerk),
            attitude: Attitude::LEVEL,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::logarithmic;
    use messages::random::SplitMix64;

    const LIMITS: PathLimits =
        PathLimits { speed: 0.25, rapid: 0.25, acceleration: 10.0, jerk: 500.0, tolerance: 5e-6 };

    fn start(curvature: f64) -> Jet {
        Jet {
            point: Vector3::new(0.01, 0.02, 0.0),
            first: Vector3::y(),
            second: Vector3::x() * -curvature,
            third: Vector3::zeros(),
        }
    }

    #[test]
    fn a_straight_run_in_is_the_thesis_ramp() {
        let run_in = RunIn::new(&start(0.0), 0.25, &LIMITS);
        // Golden trajectory.json, V 0.25: T 0.045 s, L 5.625 mm.
        assert!((run_in.duration() - 0.045).abs() < 1e-12);
        let off = run_in.from() - Vector3::new(0.01, 0.02 - 0.005_625, 0.0);
        assert!(off.norm() < 1e-12, "{off}");
    }

    #[test]
    fn random_curved_run_ins_arrive_and_keep_their_limits() {
        let mut random = SplitMix64::new(2);
        for _ in 0..400 {
            let speed = logarithmic(&mut random, 1e-3, 0.25);
            let top = (10.0 / (speed * speed)).min((500.0 / (speed * speed * speed)).sqrt());
            let jet = start(top * logarithmic(&mut random, 1e-4, 1.0));
            let case = format!("speed {speed:e} curvature {:e}", jet.second.norm());
            let run_in = RunIn::new(&jet, speed, &LIMITS);
            let end = run_in.at(run_in.duration());
            assert!((end.position - jet.point).norm() < 1e-15, "{case}");
            assert!((end.velocity - jet.first * speed).norm() < 1e-12, "{case}");
            assert!((end.acceleration - jet.second * speed * speed).norm() < 1e-9, "{case}");
            let rest = run_in.at(0.0);
            assert!(rest.velocity.norm() < 1e-12 && rest.acceleration.norm() < 1e-9, "{case}");
            let steps = 2000;
            let step = run_in.duration() / f64::from(steps);
            let mut before = rest;
            for index in 1..=steps {
                let now = run_in.at(step * f64::from(index));
                assert!(now.acceleration.norm() <= 10.0 * (1.0 + 1e-8), "{case}");
                assert!(now.jerk.norm() <= 500.0 * (1.0 + 1e-8), "{case}");
                // The velocity is the derivative of the position: trapezoid, error J·h³/12.
                let off = (before.velocity + now.velocity) * (step / 2.0)
                    - (now.position - before.position);
                assert!(off.norm() <= 500.0 * step * step * step + 1e-15, "{case} {off}");
                let off = (before.acceleration + now.acceleration) * (step / 2.0)
                    - (now.velocity - before.velocity);
                assert!(off.norm() <= 500.0 * step * step + 1e-12, "{case} {off}");
                before = now;
            }
        }
    }
}
