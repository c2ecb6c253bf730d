//! The stiffness of a ball screw, after source 003 sec. 3.5 and ISO 3408-4.

use core::f64::consts::PI;

use super::in_series;

/// The loaded part of a screw and its nut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScrewShaft {
    /// Diameter of its core, under the balls' thread [m]. // d_c
    pub core_diameter: f64,
    /// Bore of a hollow shaft, 0 for a solid one [m]. // d_bo
    pub bore: f64,
    /// From the fixed bearing, where the torque enters too, to the nut [m]. // l_s
    pub length: f64,
    /// Modulus of elasticity [N/m²]. // E
    pub modulus: f64,
    /// Shear modulus [N/m²]. // G
    pub shear_modulus: f64,
    /// Axial stiffness of the nut with its balls [N/m]; infinite for one that does not yield. // R_nu
    pub nut_stiffness: f64,
    /// What of that is left after tolerances, above 0 and up to 1. // f_ar
    pub nut_accuracy: f64,
}

impl ScrewShaft {
    /// Of the shaft along its axis, the nut left out [N/m]. Source 003 eq. 3.25.
    pub fn shaft_stiffness(&self) -> f64 {
        let [core, bore] = [self.core_diameter, self.bore].map(|diameter| diameter * diameter);
        let section = PI * (core - bore) / 4.0;
        section * self.modulus / self.length
    }

    /// Of shaft and nut along the axis [N/m]. Source 003 eq. 3.24 and 3.28.
    pub fn axial_stiffness(&self) -> f64 {
        in_series([self.shaft_stiffness(), self.nut_accuracy * self.nut_stiffness])
    }

    /// Of the shaft in torsion [N·m/rad]. Source 003 eq. 3.29, for a hollow shaft too.
    pub fn torsional_stiffness(&self) -> f64 {
        let [core, bore] = [self.core_diameter, self.bore].map(|diameter| diameter * diameter);
        let section = PI * (core * core - bore * bore) / 32.0;
        section * self.shear_modulus / self.length
    }

    /// Of all of it in a row, seen in rotation of a screw of `lead` [m/rad] [N·m/rad].
    pub fn stiffness(&self, lead: f64) -> f64 {
        in_series([self.axial_stiffness() * lead * lead, self.torsional_stiffness()])
    }
}

/// A `torsional` stiffness [N·m/rad] of a screw of `lead` [m/rad], seen at the nut [N/m].
///
/// Source 003 sec. 3.5, `K_a′ = K_a·(P/2π)²`, the other way round.
pub fn at_nut(torsional: f64, lead: f64) -> f64 {
    torsional / (lead * lead)
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    /// A steel shaft of 12 mm, 0.3 m long, with a nut that keeps 60 % of 150 N/µm.
    const SHAFT: ScrewShaft = ScrewShaft {
        core_diameter: 12e-3,
        bore: 0.0,
        length: 0.3,
        modulus: 210e9,
        shear_modulus: 80e9,
        nut_stiffness: 150e6,
        nut_accuracy: 0.6,
    };

    /// By what it gives way: Hooke's law for the shaft, its twist, and the nut's own.
    #[test]
    fn a_screw_gives_way_by_the_sum_of_its_parts() {
        let (force, lead) = (50.0, 5e-3 / TAU);
        let area = PI * 6e-3 * 6e-3;
        let stretch = force * 0.3 / (210e9 * area);
        let nut = force / 90e6;
        // The torque that holds this force twists the shaft, and each radian is a lead.
        let polar = PI * 6e-3 * 6e-3 * 6e-3 * 6e-3 / 2.0;
        let twist = force * lead * 0.3 / (80e9 * polar) * lead;
        let found = force / at_nut(SHAFT.stiffness(lead), lead);
        assert!((found / (stretch + nut + twist) - 1.0).abs() < 1e-12, "{found}");
    }

    /// A tube is the shaft without its core.
    #[test]
    fn a_bore_takes_its_own_stiffness_away() {
        let core = ScrewShaft { core_diameter: 5e-3, ..SHAFT };
        let tube = ScrewShaft { bore: 5e-3, ..SHAFT };
        let parts = tube.shaft_stiffness() + core.shaft_stiffness();
        assert!((parts / SHAFT.shaft_stiffness() - 1.0).abs() < 1e-12);
        let parts = tube.torsional_stiffness() + core.torsional_stiffness();
        assert!((parts / SHAFT.torsional_stiffness() - 1.0).abs() < 1e-12);
    }
}
