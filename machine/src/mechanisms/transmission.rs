//! The spring and damper between motor and load, per direction of the tool or per carriage.

/// A linear spring and damper, both in translation, or both in torsion where the joint turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elasticity {
    /// [N/m or N·m/rad].
    pub stiffness: f64,
    /// [N·s/m or N·m·s/rad].
    pub damping: f64,
}

impl Elasticity {
    /// A spring of `stiffness` [N/m or N·m/rad] under `mass` [kg or kg·m²], damped by the share `damping_ratio` of
    /// critical damping.
    ///
    /// Source 003 eq. 3.35, `β = 2·ζ·√(K·I)`, here in translation: with `K` and `I` both divided
    /// by `(lead/2π)²` the same formula holds.
    pub fn damped(stiffness: f64, mass: f64, damping_ratio: f64) -> Self {
        Self { stiffness, damping: 2.0 * damping_ratio * (stiffness * mass).sqrt() }
    }

    /// A screw of torsional `stiffness` [N·m/rad] and `lead` [m/rad], seen at the nut.
    pub fn of_screw(stiffness: f64, lead: f64, mass: f64, damping_ratio: f64) -> Self {
        // Source 003 sec. 3.4: K_a′ = K_a·(P/2π)².
        Self::damped(stiffness / (lead * lead), mass, damping_ratio)
    }

    /// A link of `length` [m] and flexural rigidity `E·J` [N·m²] that turns about one end and carries
    /// `inertia` [kg·m²] at the other: its bending as a torsion spring at the joint.
    pub fn of_bending(rigidity: f64, length: f64, inertia: f64, damping_ratio: f64) -> Self {
        // A force F at the tip bends by F·L³/(3EJ), which is a turn by F·L²/(3EJ) under a torque of
        // F·L. Source 003 eq. 5.23 prints 2EJ/L for a spring at mid-link, an erratum: a spring of
        // 3EJ/(4L) there bends as much as this one.
        Self::damped(3.0 * rigidity / length, inertia, damping_ratio)
    }
}

#[cfg(test)]
mod tests {
    use super::Elasticity;

    /// A beam of 0.2 m that 7 N bend at the tip, by the cantilever's formula and through the spring.
    #[test]
    fn a_link_bends_as_a_cantilever_does() {
        let (rigidity, length, force) = (45.0, 0.2, 7.0);
        let spring = Elasticity::of_bending(rigidity, length, 0.01, 0.9);
        let bend = force * length * length * length / (3.0 * rigidity);
        assert!((force * length / spring.stiffness * length - bend).abs() < 1e-15);
        // The spring at mid-link: half the moment, half the arm.
        let middle = 3.0 * rigidity / (4.0 * length);
        assert!((force * length / 2.0 / middle * length / 2.0 - bend).abs() < 1e-15);
        assert!((spring.damping - 1.8 * (spring.stiffness * 0.01).sqrt()).abs() < 1e-12);
    }
}
