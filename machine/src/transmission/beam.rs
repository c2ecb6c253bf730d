//! An arm as a beam: how far it sags, and how it swings by itself.
//!
//! [`super::link`] gives the spring that stands for such an arm at its joint; a beam of Euler and
//! Bernoulli has mass along its length, and more than one mode.

use core::f64::consts::{PI, TAU};

use messages::math;

/// An arm of constant section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// Its length [m]. // L
    pub length: f64,
    /// Its flexural rigidity, E·J [N·m²].
    pub rigidity: f64,
    /// Its mass, spread evenly [kg]. // m
    pub mass: f64,
}

/// How a beam is held, and what it carries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Support {
    /// Hinges at both ends, as the links of a closed chain have.
    Hinges,
    /// Clamped at one end, with a body fixed to its tip.
    Clamped {
        /// Mass of the body [kg]; 0 for none.
        tip_mass: f64,
        /// Its inertia about the tip, across the beam [kg·m²].
        tip_inertia: f64,
    },
}

impl Support {
    /// Clamped at one end, the other free.
    pub const FREE: Self = Self::Clamped { tip_mass: 0.0, tip_inertia: 0.0 };
}

/// Steps of the search for roots [rad]; they are far farther apart.
const STEP: f64 = 1e-2;

/// Halvings of a step: to the last digit of a root.
const HALVINGS: usize = 60;

impl Beam {
    /// Force at the tip per deflection there, clamped at the other end [N/m]: 3·E·J/L³.
    pub fn tip_stiffness(&self) -> f64 {
        3.0 * self.rigidity / (self.length * self.length * self.length)
    }

    /// How far the tip sinks, clamped at the other end, under `tip_force` [N] and the beam's own
    /// weight with `gravity` across it [m/s²], in m.
    pub fn sag(&self, tip_force: f64, gravity: f64) -> f64 {
        // An even load counts at the tip as 3/8 of it.
        (tip_force + 0.375 * self.mass * gravity) / self.tip_stiffness()
    }

    /// The first `count` natural frequencies [Hz], the lowest first: β²/2π·√(E·J/(m·L³)).
    pub fn frequencies(&self, support: Support, count: usize) -> Vec<f64> {
        let cube = self.length * self.length * self.length;
        let scale = (self.rigidity / (self.mass * cube)).sqrt() / TAU;
        self.roots(support, count).into_iter().map(|root| root * root * scale).collect()
    }

    /// The first `count` roots β of the frequency equation.
    fn roots(&self, support: Support, count: usize) -> Vec<f64> {
        match support {
            Support::Hinges => (1..=count).map(|mode| mode as f64 * PI).collect(),
            Support::Clamped { tip_mass, tip_inertia } => {
                let mass = tip_mass / self.mass;
                let inertia = tip_inertia / (self.mass * self.length * self.length);
                roots(|root| clamped(root, mass, inertia), count)
            }
        }
    }
}

/// The frequency equation of a clamped beam whose tip bears `mass` and `inertia` in units of the
/// beam's own, over cosh β.
fn clamped(root: f64, mass: f64, inertia: f64) -> f64 {
    let (sine, cosine) = math::sin_cos(root);
    let tanh = math::tanh(root);
    // 1/cosh β, which for a large β is nothing.
    let small = (1.0 - tanh * tanh).max(0.0).sqrt();
    let square = root * root;
    small + cosine + mass * root * (cosine * tanh - sine)
        - inertia * root * square * (sine + cosine * tanh)
        + mass * inertia * square * square * (small - cosine)
}

/// The first `count` places where `function` changes its sign above 0.
fn roots(function: impl Fn(f64) -> f64, count: usize) -> Vec<f64> {
    let mut found = Vec::with_capacity(count);
    // Each mode has its root within π of the one before.
    let most = (count as f64 + 2.0) * PI;
    let mut from = 0.0;
    while found.len() < count && from < most {
        let to = from + STEP;
        if (function(from) > 0.0) != (function(to) > 0.0) {
            let (mut low, mut high) = (from, to);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if (function(middle) > 0.0) == (function(low) > 0.0) {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            found.push(0.5 * (low + high));
        }
        from = to;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix4;

    /// The arm of the source's five-bar: 0.2 m, 10 by 10 mm, 22e10 N/m².
    const ARM: Beam = Beam { length: 0.2, rigidity: 22e10 * 1e-8 / 12.0, mass: 0.156 };
    const FOREARM: Beam = Beam { length: 0.25, mass: 0.195, ..ARM };
    const LINK: Beam = Beam { length: 0.3, mass: 0.234, ..ARM };

    #[test]
    fn a_free_arm_and_a_hinged_one_have_the_roots_of_the_books() {
        let free = ARM.roots(Support::FREE, 5);
        let expected = [1.875_104_068_711_961, 4.694_091_132_974_175, 7.854_757_438_237_613];
        for (found, expected) in free.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} for {expected}");
        }
        // From there on an odd number of quarter turns.
        assert!((free[4] - 4.5 * PI).abs() < 1e-5);
        assert_eq!(ARM.roots(Support::Hinges, 2), [PI, 2.0 * PI]);
    }

    #[test]
    fn the_sources_links_have_these_first_modes() {
        for (beam, hinged, clamped) in [
            (FOREARM, 385.312_657, 137.266_412),
            (ARM, 602.051_027, 214.478_769),
            (LINK, 267.578_234, 95.323_897),
        ] {
            let of = |support| beam.frequencies(support, 1)[0];
            assert!((of(Support::Hinges) / hinged - 1.0).abs() < 1e-8, "{}", of(Support::Hinges));
            assert!((of(Support::FREE) / clamped - 1.0).abs() < 1e-8, "{}", of(Support::FREE));
        }
    }

    /// The boundary conditions as they stand: w and w′ are 0 at the clamp; at the tip the moment turns
    /// the body and the shear moves it.
    fn determinant(root: f64, mass: f64, inertia: f64) -> f64 {
        let (s, c) = math::sin_cos(root);
        let (up, down) = (math::exp(root), math::exp(-root));
        let (sh, ch) = (0.5 * (up - down), 0.5 * (up + down));
        let b = root;
        // w = A·cos + B·sin + C·cosh + D·sinh of β·x/L.
        let value = [c, s, ch, sh];
        let slope = [-s, c, sh, ch];
        let moment = [-c, -s, ch, sh];
        let shear = [s, -c, sh, ch];
        Matrix4::from_fn(|row, column| match row {
            0 => [1.0, 0.0, 1.0, 0.0][column],
            1 => [0.0, 1.0, 0.0, 1.0][column],
            2 => moment[column] - inertia * b * b * b * slope[column],
            _ => shear[column] + mass * b * value[column],
        })
        .determinant()
    }

    #[test]
    fn a_body_at_the_tip_fulfils_the_boundary_conditions() {
        for (tip_mass, tip_inertia) in
            [(0.05, 0.0), (0.33, 0.0), (3.0, 0.0), (0.33, 1e-4), (1.2, 2e-3), (0.0, 1e-3)]
        {
            let beam = ARM;
            let ratios =
                (tip_mass / beam.mass, tip_inertia / (beam.mass * beam.length * beam.length));
            let found = beam.roots(Support::Clamped { tip_mass, tip_inertia }, 4);
            assert_eq!(found.len(), 4);
            for root in found {
                let sides = [-1e-6, 1e-6].map(|by| determinant(root + by, ratios.0, ratios.1));
                assert!(sides[0] * sides[1] < 0.0, "{tip_mass} kg, {tip_inertia} kg m²: {root}");
            }
        }
    }

    /// A heavy body on a light beam is a mass on a spring, and the beam's own mass counts as 33/140.
    #[test]
    fn a_heavy_tip_swings_as_on_a_spring() {
        let tip_mass = 10.0;
        let found = ARM.frequencies(Support::Clamped { tip_mass, tip_inertia: 0.0 }, 1)[0];
        let moved = tip_mass + 33.0 / 140.0 * ARM.mass;
        let expected = (ARM.tip_stiffness() / moved).sqrt() / TAU;
        assert!((found / expected - 1.0).abs() < 1e-5, "{found} for {expected}");
    }

    #[test]
    fn an_arm_sags_under_its_tip_and_its_own_weight() {
        let inertia = 22e10 * 1e-8 / 12.0;
        let (force, weight) = (3.0, 0.156 * 9.81);
        let expected = force * 0.008 / (3.0 * inertia) + weight * 0.008 / (8.0 * inertia);
        assert!((ARM.sag(force, 9.81) / expected - 1.0).abs() < 1e-12);
        assert!((ARM.tip_stiffness() * 0.2 * 0.2 / (3.0 * inertia / 0.2) - 1.0).abs() < 1e-12);
    }
}
