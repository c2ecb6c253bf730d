//! PWM generators: the mean of their pulses. Single pulses are not emulated, nobody here is that quick.

use super::clock::Bank;
use super::layout::PWMGENS;

/// All of them.
#[derive(Debug, Clone, Default)]
pub struct Pwmgens {
    value: Bank<PWMGENS>,
    mode: Bank<PWMGENS>,
    /// Rate of the PWM counter, as a fraction of 2¹⁶ of the clock.
    rate: u32,
    density_rate: u32,
    /// One bit each.
    enable: u32,
}

impl Pwmgens {
    /// The register `index` of `instance`.
    pub fn read(&self, index: u16, instance: usize) -> u32 {
        match index {
            0 => self.value.get(instance),
            1 => self.mode.get(instance),
            2 => self.rate,
            3 => self.density_rate,
            4 => self.enable,
            _ => 0,
        }
    }

    /// Writes the register `index` of `instance`.
    pub fn write(&mut self, index: u16, instance: usize, value: u32) {
        match index {
            0 => self.value.set(instance, value),
            1 => self.mode.set(instance, value),
            2 => self.rate = value,
            3 => self.density_rate = value,
            4 => self.enable = value,
            _ => {}
        }
    }

    /// Whether `instance` is enabled; its enable pin is low then.
    pub fn enabled(&self, instance: usize) -> bool {
        instance < PWMGENS && self.enable & 1 << instance != 0
    }

    /// What it puts out in the mean, −1..=1, the sign by its direction pin.
    ///
    /// Bits 1–0 of its mode tell how many bits count, 9 to 12; bits 4–3 the kind of output, 3 being pulse
    /// density with 12 bits. The value stands in the upper half of its register, with 4 bits behind the
    /// point; bit 31 is the direction.
    pub fn duty(&self, instance: usize) -> f64 {
        let (value, mode) = (self.value.get(instance), self.mode.get(instance));
        let density = mode >> 3 & 3 == 3;
        let rate = if density { self.density_rate } else { self.rate };
        let bits = if density { 12 } else { 9 + (mode & 3) };
        if rate == 0 {
            return 0.0;
        }
        // The largest value is one less than the count: a pulse that never ends.
        let full = f64::from((1_u32 << bits) - 1);
        let magnitude = f64::from((value & 0x7fff_ffff) >> 12) / 16.0;
        let duty = (magnitude / full).min(1.0);
        if value & 0x8000_0000 == 0 { duty } else { -duty }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_value_is_a_fraction_of_what_the_bits_count() {
        let mut pwmgens = Pwmgens::default();
        pwmgens.write(0, 1, 2047 << 16);
        pwmgens.write(1, 1, 3);
        assert_eq!(pwmgens.duty(1), 0.0, "no rate");
        pwmgens.write(2, 0, 26_843);
        assert!((pwmgens.duty(1) - 2047.0 / 4095.0).abs() < 1e-12);
        pwmgens.write(0, 1, 511 << 16 | 0x8000_0000);
        pwmgens.write(1, 1, 0);
        assert_eq!(pwmgens.duty(1), -1.0);
        assert!(!pwmgens.enabled(1));
        pwmgens.write(4, 0, 2);
        assert!(pwmgens.enabled(1) && !pwmgens.enabled(0));
    }
}
