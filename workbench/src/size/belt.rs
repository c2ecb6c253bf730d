//! The preload of a belt, after source 003 eq. 4.11 to 4.13.

/// Preload of both strands together, per force that the belt passes on. // q = T + t = 4·F
pub const PRELOAD: f64 = 4.0;

/// Forces in the tight and the slack strand, per force that the belt passes on.
pub const STRANDS: [f64; 2] = [2.5, 1.5];

/// What a belt needs to pass a force on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Preload {
    /// Of both strands together [N].
    pub preload: f64,
    /// In the tight and the slack strand [N].
    pub strands: [f64; 2],
}

/// What a belt that passes on `force` [N] needs.
pub fn preload(force: f64) -> Preload {
    Preload { preload: PRELOAD * force, strands: STRANDS.map(|share| share * force) }
}

/// Coefficient of friction times angle of wrap [rad] that keeps a flat belt under that preload from
/// slipping: `f·α ≥ ln(T/t)`. A toothed belt does not slip.
pub fn least_grip() -> f64 {
    messages::math::ln(STRANDS[0] / STRANDS[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_belt_is_preloaded_as_the_source_has_it() {
        let preload = preload(20.0);
        assert_eq!((preload.preload, preload.strands), (80.0, [50.0, 30.0]));
        assert!((least_grip() - 0.510_825_6).abs() < 1e-6);
        // Wrapped by 140°, a belt needs a coefficient of friction of 0.209.
        assert!((least_grip() / 140_f64.to_radians() - 0.209_058).abs() < 1e-5);
    }
}
