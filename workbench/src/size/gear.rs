//! What a gear's output bears beside its torque, after source 003 sec. 5.2.1.

/// By what a toothed wheel or pulley on the shaft makes the radial force larger than the force along the
/// circumference. Source 003 sec. 5.2.1. // k_r
pub const RADIAL: f64 = 1.1;

/// Axial force as a share of the radial one. Source 003 eq. 5.19.
pub const AXIAL: f64 = 0.2;

/// Radial force [N] of a `torque` [N·m] on a wheel of `diameter` [m].
///
/// Source 003 eq. 5.18, `F_R = 2000·M·k_r/d` with d in mm.
pub fn radial_force(torque: f64, diameter: f64) -> f64 {
    2.0 * torque * RADIAL / diameter
}

/// Axial force [N] that comes with a `radial` one [N]. Source 003 eq. 5.19.
pub fn axial_force(radial: f64) -> f64 {
    AXIAL * radial
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_at_the_output_are_the_sources() {
        let radial = radial_force(3.0, 20e-3);
        assert!((radial - 330.0).abs() < 1e-9, "{radial}");
        assert!((axial_force(radial) - 66.0).abs() < 1e-9);
    }
}
