//! The board's two clocks, and registers of which each instance of a module has one.

use messages::Nanoseconds;

/// One of the clocks that modules count by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// 100 MHz: most modules.
    Low,
    /// 200 MHz: the PWM generators.
    High,
}

impl Clock {
    /// Its frequency [Hz].
    pub const fn hertz(self) -> u32 {
        match self {
            Self::Low => 100_000_000,
            Self::High => 200_000_000,
        }
    }

    /// Its tag in a module descriptor.
    pub const fn tag(self) -> u8 {
        match self {
            Self::Low => 1,
            Self::High => 2,
        }
    }

    /// Whole ticks from power-on to `at`.
    pub const fn ticks(self, at: Nanoseconds) -> i64 {
        // Both clocks tick a whole number of times in 10 ns, and a board is not on for 100 years.
        at.0 / 10 * (self.hertz() / 100_000_000) as i64
    }

    /// How long `ticks` take.
    pub const fn time(self, ticks: i64) -> Nanoseconds {
        Nanoseconds(ticks.saturating_mul(10) / (self.hertz() / 100_000_000) as i64)
    }
}

/// A register of which each of `N` instances has one; a place that is not there reads 0 and takes nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bank<const N: usize>([u32; N]);

impl<const N: usize> Default for Bank<N> {
    fn default() -> Self {
        Self([0; N])
    }
}

impl<const N: usize> Bank<N> {
    /// The register of `instance`.
    pub fn get(&self, instance: usize) -> u32 {
        self.0.get(instance).copied().unwrap_or(0)
    }

    /// Sets the register of `instance`.
    pub fn set(&mut self, instance: usize, value: u32) {
        if let Some(register) = self.0.get_mut(instance) {
            *register = value;
        }
    }

    /// All of them.
    pub fn all(&self) -> &[u32; N] {
        &self.0
    }
}
