//! The brushed permanent-magnet motor.

/// A permanent-magnet DC motor (source 003 sec. 3.3): `V = R·i + L·i′ + k·ω`, torque `k·i`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DcMotor {
    /// Winding resistance [Ω].
    pub resistance: f64,
    /// Winding inductance [H].
    pub inductance: f64,
    /// Torque constant [N·m/A], equal to the back-EMF constant [V·s/rad].
    pub torque_constant: f64,
    /// Inertia at the shaft on the motor's side of the transmission's spring [kg·m²]: the rotor,
    /// and what turns with it stiffly, such as a screw through its gear (`J_screw/i²`).
    pub rotor_inertia: f64,
    /// Largest voltage that the supply can apply [V].
    pub voltage: f64,
    /// Largest current that the power stage may command [A].
    pub current: f64,
    /// Current that the winding bears for ever [A]; `None` where the file does not say.
    pub continuous_current: Option<f64>,
}

impl DcMotor {
    /// The voltage that drives `current` [A], changing by `current_rate` [A/s], at `speed` of the shaft
    /// [rad/s], in V: `R·i + L·i′ + k·ω`. Means over a time give the mean voltage over it.
    #[inline]
    pub fn voltage(&self, current: f64, current_rate: f64, speed: f64) -> f64 {
        self.resistance * current + self.inductance * current_rate + self.torque_constant * speed
    }

    /// How fast `current` [A] changes under `voltage` [V] at `speed` of the shaft [rad/s], in A/s: the
    /// inverse of [`Self::voltage`].
    #[inline]
    pub fn current_rate(&self, voltage: f64, current: f64, speed: f64) -> f64 {
        (voltage - self.voltage(current, 0.0, speed)) / self.inductance
    }

    /// The current at which the winding settles under an even `voltage` [V] at an even `speed` of the
    /// shaft [rad/s], in A.
    #[inline]
    pub fn settled_current(&self, voltage: f64, speed: f64) -> f64 {
        (voltage - self.torque_constant * speed) / self.resistance
    }

    /// Speed at which the back-EMF takes the whole supply [rad/s].
    pub fn no_load_speed(&self) -> f64 {
        self.voltage / self.torque_constant
    }

    /// Torque at the power stage's largest current [N·m].
    pub fn largest_torque(&self) -> f64 {
        self.torque_constant * self.current
    }

    /// Torque at standstill: what the power stage's current gives, or what the supply drives
    /// through the winding, whichever is less [N·m].
    pub fn stall_torque(&self) -> f64 {
        self.torque_constant * self.current.min(self.settled_current(self.voltage, 0.0))
    }

    /// Time over which the heating of a winding is averaged [s]; short against a real winding's.
    pub const HEATING_TIME: f64 = 5.0;

    /// The winding's mean square current [A²] after `step` [s] at `current` [A], from `mean_square`
    /// before it, averaged over `time` [s]: the I²t measure of its heating.
    pub fn heated(mean_square: f64, current: f64, step: f64, time: f64) -> f64 {
        mean_square + (current * current - mean_square) * (step / time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// EC035.120 of source 003.
    const MOTOR: DcMotor = DcMotor {
        resistance: 2.3,
        inductance: 2.3e-3,
        torque_constant: 0.021,
        rotor_inertia: 2e-6,
        voltage: 12.0,
        current: 5.2,
        continuous_current: None,
    };

    #[test]
    fn supply_and_power_stage_bound_torque_and_speed() {
        assert!((MOTOR.no_load_speed() - 571.428_571).abs() < 1e-6);
        // 12 V across 2.3 Ω drive 5.217 A, above the 5.2 A of the power stage.
        assert!((MOTOR.stall_torque() - 0.1092).abs() < 1e-12);
    }

    #[test]
    fn voltage_and_current_are_inverses() {
        // 2.3 Ω·2 A + 2.3 mH·1000 A/s + 0.021 V·s/rad·100 rad/s.
        let voltage = MOTOR.voltage(2.0, 1000.0, 100.0);
        assert!((voltage - (4.6 + 2.3 + 2.1)).abs() < 1e-12, "{voltage}");
        assert!((MOTOR.current_rate(voltage, 2.0, 100.0) - 1000.0).abs() < 1e-9);
        let even = MOTOR.voltage(2.0, 0.0, 100.0);
        assert!((MOTOR.settled_current(even, 100.0) - 2.0).abs() < 1e-12);
        assert!(MOTOR.settled_current(12.0, MOTOR.no_load_speed()).abs() < 1e-12);
    }

    #[test]
    fn heating_tends_to_the_square_of_the_current() {
        let mut heat = 0.0;
        for _ in 0..5000 {
            heat = DcMotor::heated(heat, 2.0, 1e-3, 5.0);
        }
        // One time constant: 1 − (1 − T/τ)^5000.
        assert!((heat / 4.0 - (1.0 - messages::math::exp(-1.0))).abs() < 1e-4, "{heat}");
    }
}
