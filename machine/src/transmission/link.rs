//! The stiffness of an arm that bends, as a torsion spring at the joint that turns it.
//!
//! Source 003 eq. 5.20 to 5.24 prints `2·E·J/L`, which is not this.

/// Of an arm of `length` [m] and flexural `rigidity` E·J [N·m²] that is pushed at its tip, as one
/// is whose tip is a hinge [N·m/rad].
///
/// A force F bends the tip by F·L³/(3·E·J), which is a turn of the arm by F·L²/(3·E·J) under the
/// torque F·L. Source 003 has a spring at mid-link in mind: 3·E·J/(4·L) there bends as much.
pub fn pushed_at_tip(rigidity: f64, length: f64) -> f64 {
    3.0 * rigidity / length
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The deflection of a clamped beam of 0.2 m and 45 N·m² whose bending moment is `moment(x)`: its
    /// curvature summed in 20,000 pieces.
    fn bent(moment: impl Fn(f64) -> f64) -> f64 {
        let pieces = 20_000;
        let piece = 0.2 / f64::from(pieces);
        let (mut slope, mut off) = (0.0, 0.0);
        for index in 0..pieces {
            let curvature = moment((f64::from(index) + 0.5) * piece) / 45.0;
            off += (slope + curvature * piece / 2.0) * piece;
            slope += curvature * piece;
        }
        off
    }

    #[test]
    fn an_arm_bends_as_a_clamped_beam_does() {
        let force = 7.0;
        let off = bent(|x| force * (0.2 - x));
        let turn = force * 0.2 / pushed_at_tip(45.0, 0.2);
        assert!((turn * 0.2 / off - 1.0).abs() < 1e-8, "{off}");
        // The spring at mid-link: half the moment, half the arm.
        let middle = 3.0 * 45.0 / (4.0 * 0.2);
        assert!((force * 0.1 / middle * 0.1 / off - 1.0).abs() < 1e-8);
    }
}
