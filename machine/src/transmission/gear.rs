//! A gear's losses and loads, after source 003 sec. 5.2.1.

/// How hard a motor's gear is used, by the load's inertia beside the rotor's. Source 003 eq. 5.17.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoadClass {
    /// Up to 0.3.
    Uniform,
    /// Up to 3.
    Medium,
    /// Up to 10.
    Heavy,
    /// More than gears are made for without asking.
    Extreme,
}

impl LoadClass {
    /// For a load with `ratio` times the rotor's inertia, seen at the shaft. // f_a
    pub fn of(ratio: f64) -> Self {
        match ratio {
            _ if ratio <= 0.3 => Self::Uniform,
            _ if ratio <= 3.0 => Self::Medium,
            _ if ratio <= 10.0 => Self::Heavy,
            _ => Self::Extreme,
        }
    }
}

/// Shares of the power that come through gear and screw or belt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Efficiency {
    /// In steady motion, after running in; above 0 and up to 1. // R_d
    pub dynamic: f64,
    /// What of that is left from standstill; 1 for planetary gears. // R_s
    pub at_start: f64,
}

impl Efficiency {
    /// Nothing is lost.
    pub const LOSSLESS: Self = Self { dynamic: 1.0, at_start: 1.0 };

    /// What the motor must give for `load` [N·m at the shaft] while it turns at `speed` [rad/s].
    ///
    /// A motor that drives its load gives the losses too; one that is driven by it is helped by
    /// them. From standstill it must overcome them, whichever way it starts. Source 003 eq. 5.16.
    pub fn torque(&self, load: f64, speed: f64) -> f64 {
        if speed == 0.0 {
            load / (self.dynamic * self.at_start)
        } else if load * speed >= 0.0 {
            load / self.dynamic
        } else {
            load * self.dynamic
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn losses_are_the_motors_when_it_drives_and_the_loads_when_it_is_driven() {
        let gear = Efficiency { dynamic: 0.8, at_start: 0.5 };
        assert_eq!(gear.torque(4.0, 10.0), 5.0);
        assert_eq!(gear.torque(-4.0, 10.0), -3.2);
        assert_eq!(gear.torque(-4.0, 0.0), -10.0);
        assert_eq!(Efficiency::LOSSLESS.torque(4.0, -1.0), 4.0);
    }

    #[test]
    fn classes_are_the_sources() {
        let classes = [0.3, 3.0, 10.0, 10.1].map(LoadClass::of);
        use LoadClass::{Extreme, Heavy, Medium, Uniform};
        assert_eq!(classes, [Uniform, Medium, Heavy, Extreme]);
    }
}
