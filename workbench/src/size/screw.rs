//! The critical speed of a screw: at which it whips like a string.

use crate::catalogue::Screw;
use crate::catalogue::table::Support;
use core::f64::consts::PI;

/// What of its critical speed a screw may turn with.
pub const SHARE: f64 = 0.8;

impl Support {
    /// The first root λ of the beam's equation of frequencies with these ends.
    pub fn root(self) -> f64 {
        match self {
            Self::FixedFree => 1.875_104_068_711_961,
            Self::Supported => PI,
            Self::FixedSupported => 3.926_602_312_047_919,
            Self::FixedFixed => 4.730_040_744_862_704,
        }
    }
}

/// Speed at which the screw whips [rad/s]: its first bending frequency,
/// `λ²/L²·(d/4)·√(E/ρ)·√(1 + (bore/d)²)`.
pub fn critical_speed(screw: &Screw) -> f64 {
    let Screw { diameter, bore, length, support, modulus, density, .. } = screw;
    let root = support.root() / length;
    let gyration = (diameter * diameter + bore * bore).sqrt() / 4.0;
    root * root * gyration * (modulus / density).sqrt()
}

/// Moment of inertia of a solid or hollow shaft about its axis [kg·m²]: `m/2·(r² + r_bore²)`, source 003
/// eq. 3.32.
pub fn inertia(diameter: f64, bore: f64, length: f64, density: f64) -> f64 {
    let [outer, inner] = [diameter, bore].map(|diameter| diameter * diameter / 4.0);
    density * PI * (outer - inner) * length * (outer + inner) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    /// The screw of source 003, 14 mm and 250 or 400 mm, of its material.
    #[test]
    fn the_sources_screw_whips_far_above_its_1100_turns_a_minute() {
        let supports =
            [Support::FixedFree, Support::Supported, Support::FixedSupported, Support::FixedFixed];
        for (length, turns) in
            [(0.25, [166.4, 467.2, 729.8, 1059.0]), (0.4, [65.0, 182.5, 285.1, 413.7])]
        {
            for (support, turns) in supports.into_iter().zip(turns) {
                let screw = Screw {
                    axis: "x".to_owned(),
                    diameter: 14e-3,
                    bore: 0.0,
                    length,
                    support,
                    modulus: 22e10,
                    density: 7800.0,
                };
                let found = critical_speed(&screw) / TAU;
                assert!((found / turns - 1.0).abs() < 1e-3, "{support:?}: {found} {turns}");
            }
        }
    }

    #[test]
    fn a_screws_inertia_is_that_of_its_cylinder() {
        assert!((inertia(14e-3, 0.0, 0.25, 7850.0) / 7.401_5e-6 - 1.0).abs() < 1e-4);
        // The printed mass of 0.264 kg gives what the machine file has.
        let printed: f64 = 0.5 * 0.264 * 7e-3 * 7e-3;
        assert!((printed / 6.468e-6 - 1.0).abs() < 1e-4);
        let tube = inertia(14e-3, 6e-3, 0.25, 7850.0);
        let parts = inertia(14e-3, 0.0, 0.25, 7850.0) - inertia(6e-3, 0.0, 0.25, 7850.0);
        assert!((tube / parts - 1.0).abs() < 1e-12);
    }
}
