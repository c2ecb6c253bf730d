//! The stiffness of a belt, after source 003 sec. 4.5.

/// What a belt is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Belt {
    /// Modulus of elasticity of its cords or its leather [N/m²]. // E
    pub modulus: f64,
    /// Cross-section that carries the load [m²]. // S
    pub section: f64,
}

impl Belt {
    /// Of one span of `length` [m] [N/m].
    pub fn span_stiffness(&self, length: f64) -> f64 {
        self.modulus * self.section / length
    }

    /// Of a closed belt between pulley and carriage, whose two spans are `lengths` [m] long [N/m].
    ///
    /// Both are preloaded, so that a load stretches the one by what it slackens the other: they
    /// stand side by side. It is least with the carriage in the middle.
    pub fn stiffness(&self, lengths: [f64; 2]) -> f64 {
        lengths.into_iter().map(|length| self.span_stiffness(length)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::Belt;

    /// Source 003 table 4-2: leather of 0.5 cm², half of 0.95 m in each span, 15 N/mm printed.
    #[test]
    fn the_sources_belt_has_the_printed_stiffness() {
        let belt = Belt { modulus: 150e6, section: 0.5e-4 };
        let span = belt.span_stiffness(0.475);
        assert!((span / 15e3 - 1.0).abs() < 0.06, "{span} N/m");
        let middle = belt.stiffness([0.475, 0.475]);
        assert!((middle - 2.0 * span).abs() < 1e-9);
        assert!(belt.stiffness([0.2, 0.75]) > middle);
    }
}
