//! Deterministic mathematics: the same bits on every platform.
//!
//! The standard library leaves the precision of these functions to the platform, so a run could
//! not be repeated elsewhere. `clippy.toml` forbids the standard ones across the workspace.

pub use libm::{
    acos, asin, atan, atan2, cbrt, cos, exp, hypot, log as ln, pow, sin, sincos as sin_cos, tan,
    tanh,
};

/// A full turn [rad].
pub const TURN: f64 = core::f64::consts::TAU;

/// The angle equal to `angle` modulo a turn that lies nearest to `reference` [rad].
pub fn nearest_turn(angle: f64, reference: f64) -> f64 {
    angle + TURN * ((reference - angle) / TURN).round()
}
