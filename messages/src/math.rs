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

/// Value and slope at `at` in 0..1 of the cubic with these values and slopes at 0 and 1.
pub fn hermite(from: f64, from_slope: f64, to: f64, to_slope: f64, at: f64) -> (f64, f64) {
    let rise = to - from;
    let square = 3.0 * rise - 2.0 * from_slope - to_slope;
    let cube = from_slope + to_slope - 2.0 * rise;
    (
        from + at * (from_slope + at * (square + at * cube)),
        from_slope + at * (2.0 * square + at * 3.0 * cube),
    )
}

#[cfg(test)]
mod tests {
    use super::{TURN, nearest_turn};

    #[test]
    fn the_nearest_turn_is_within_half_a_turn_and_the_same_angle() {
        let mut reference = -40.0;
        while reference < 40.0 {
            for angle in [-7.0, -3.2, -0.1, 0.0, 1.0, 3.1, 6.0, 100.0] {
                let nearest = nearest_turn(angle, reference);
                let off = (nearest - reference).abs();
                assert!(off <= TURN / 2.0 + 1e-12, "{angle} near {reference}: {nearest}");
                let turns = (nearest - angle) / TURN;
                assert!(
                    (turns - turns.round()).abs() < 1e-12,
                    "{angle} near {reference}: {nearest}"
                );
            }
            reference += 0.37;
        }
    }

    #[test]
    fn an_angle_near_its_reference_stays_to_the_bit() {
        assert_eq!(nearest_turn(1.25, 0.75), 1.25);
        assert!(nearest_turn(f64::NAN, 0.0).is_nan());
    }
}
