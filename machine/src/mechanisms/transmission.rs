//! The spring and damper between motor and load, per direction of the tool or per carriage.

/// A linear spring and damper, both in translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elasticity {
    /// [N/m].
    pub stiffness: f64,
    /// [N·s/m].
    pub damping: f64,
}

impl Elasticity {
    /// A spring of `stiffness` [N/m] under `mass` [kg], damped by the share `damping_ratio` of
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
}
