//! What the polar machine's motors must move, and hold (source 000 sec. 7).

/// Masses and inertias, in the source's frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolarLoad {
    /// Mass of the arm, m₁ [kg].
    pub arm_mass: f64,
    /// Distance of the arm's centre of mass from its pivot, a_c [m].
    pub arm_center: f64,
    /// Inertia of the arm about the vertical through its centre of mass, Izz₁ [kg·m²].
    pub arm_inertia: f64,
    /// Mass of the head, m₂ [kg].
    pub head_mass: f64,
    /// Distance of the head's centre of mass from the arm's pivot, r_c2 [m]; by source 000 eq. 3.3
    /// near a₁, where eq. 7.6 prints 2·a₁.
    pub head_center: f64,
    /// Inertia of the head about the vertical through its centre of mass, Izz₂ [kg·m²].
    pub head_inertia: f64,
    /// Inertia of the table about its axis, I_t [kg·m²].
    pub table_inertia: f64,
    /// Mass of the workpiece, m_w [kg].
    pub workpiece_mass: f64,
    /// Distance of the workpiece's centre of mass from the table's axis, r_w [m].
    pub workpiece_center: f64,
    /// Inertia of the workpiece about the vertical through its centre of mass, I_w [kg·m²].
    pub workpiece_inertia: f64,
    /// Force of the counterbalance on the head, upwards, F_cb [N].
    pub counterbalance: f64,
    /// Acceleration of gravity [m/s²].
    pub gravity: f64,
}

impl PolarLoad {
    /// Inertia that each joint moves [kg·m² or kg].
    // Source 000 eq. 7.12, with r_c2 for 2·a₁ and without cos + sin: J_vᵀ·J_v is 1.
    pub(super) fn inertia(&self) -> [f64; 3] {
        let about = |mass: f64, radius: f64, inertia: f64| mass * radius * radius + inertia;
        [
            about(self.arm_mass, self.arm_center, self.arm_inertia)
                + about(self.head_mass, self.head_center, self.head_inertia),
            self.table_inertia
                + about(self.workpiece_mass, self.workpiece_center, self.workpiece_inertia),
            self.head_mass,
        ]
    }

    /// What the vertical axis holds at rest [N].
    // Source 000 eq. 7.25.
    pub(super) fn weight(&self) -> f64 {
        self.head_mass * self.gravity - self.counterbalance
    }
}
