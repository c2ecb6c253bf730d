//! Paths through the centre of the table.
//!
//! There the distance ρ from the centre has a kink and the direction of the tool a jump of half a
//! turn. A signed distance σ along a direction ψ that does not jump, `p = σ·(cos ψ, sin ψ)`, is
//! smooth: σ changes its sign, and θ₁ with it, while θ₂ goes on. Near the centre the rates of
//! `atan2(y, x)` are rounding divided by ρ, so ψ is taken from where the path is going, not from
//! where it is.

use messages::math;
use nalgebra::Vector2;

use super::CENTER_TOLERANCE;
use crate::kinematics::ToolMotion;
use crate::taylor::{Scalar, Taylor};

/// A velocity [m/s], an acceleration [m/s²] and a jerk [m/s³] below which a path has none of it:
/// each would need minutes to move the tool by an encoder's count.
const STILL: [f64; 3] = [1e-9, 1e-7, 1e-5];

/// Sine of an angle between derivatives of a path up to which it is straight: rounding.
const STRAIGHT: f64 = 1e-12;

/// How far from the centre [m] a curve may pass, by what its three derivatives say. Rounding of a
/// position: farther out the curve's fourth derivative costs more than the division by ρ.
const CURVE_TOLERANCE: f64 = 1e-15;

/// Signed distance from the centre [m] and its direction [rad] for a path that passes the centre;
/// `None` where it does not, or has no direction.
pub(in crate::mechanisms) fn through(tool: &ToolMotion) -> Option<[Taylor; 2]> {
    straight(tool).or_else(|| curved(tool))
}

/// On a line through the centre the direction stands still.
fn straight(tool: &ToolMotion) -> Option<[Taylor; 2]> {
    let rates = [tool.velocity.xy(), tool.acceleration.xy(), tool.jerk.xy()];
    let first = (0..3).find(|order| rates[*order].norm() > STILL[*order])?;
    let along = rates[first].normalize();
    let misses = along.perp(&tool.position.xy()).abs() > CENTER_TOLERANCE;
    let bends = |rate: &Vector2<f64>, still| {
        along.perp(rate).abs() > f64::max(STRAIGHT * rate.norm(), still)
    };
    if misses || (0..3).any(|order| bends(&rates[order], STILL[order] * STRAIGHT)) {
        return None;
    }
    let [x, y, _] = tool.series();
    let distance = x * along.x + y * along.y;
    Some([distance, math::atan2(along.y, along.x).into()])
}

/// On a curve the path is a polynomial in the time s since it crosses the centre, and
/// `p/s = v + a·s/2 + j·s²/6` has the direction of p without a division by ρ. The fourth derivative
/// of the path, which is not given, is left out.
fn curved(tool: &ToolMotion) -> Option<[Taylor; 2]> {
    let (velocity, acceleration, jerk) =
        (tool.velocity.xy(), tool.acceleration.xy(), tool.jerk.xy());
    let at = |time: f64| {
        let place = tool.position.xy()
            + (velocity + (acceleration / 2.0 + jerk * (time / 6.0)) * time) * time;
        let rate = velocity + (acceleration + jerk * (time / 2.0)) * time;
        (place, rate)
    };
    if velocity.norm() <= STILL[0] {
        return None;
    }
    // Newton's steps to the time of the least distance; quadratic, from a start that is right for a
    // steady speed. Too few for a path that does not pass the centre, which then is not near it.
    let mut time = 0.0;
    for _ in 0..6 {
        let (place, rate) = at(time);
        time -= place.dot(&rate) / rate.norm_squared();
    }
    let (place, rate) = at(time);
    // False for a time that is not a number too.
    let crosses = place.norm() <= CURVE_TOLERANCE && rate.norm() > velocity.norm() / 2.0;
    if !crosses {
        return None;
    }
    let since = -time;
    let bend = acceleration + jerk * time;
    let component = |axis: usize| {
        Taylor::new(
            rate[axis] + (bend[axis] / 2.0 + jerk[axis] * (since / 6.0)) * since,
            bend[axis] / 2.0 + jerk[axis] * (since / 3.0),
            jerk[axis] / 3.0,
            0.0,
        )
    };
    let direction = component(1).atan2(component(0));
    let (sine, cosine) = direction.sin_cos();
    let [x, y, _] = tool.series();
    Some([x * cosine + y * sine, direction])
}
