//! The two-phase hybrid stepper motor, microstepped by a current-regulating driver.
//!
//! Its electrical angle turns `N_r` times a revolution, `N_r` = full steps / 4. The driver's two
//! currents, `I·cos` and `I·sin` of the commanded electrical angle, put the magnetic axis at the
//! commanded angle; the rotor feels a spring around it,
//!
//! ```text
//! torque = T·sin(N_r·δ) − T_d·sin(4·N_r·θ),   δ = magnetic axis − θ
//! ```
//!
//! with the detent torque `T_d` pulling to the full steps. Under torque the rotor so lags by the
//! load angle δ, at most a full step, `π/(2·N_r)`; two full steps behind, it falls out of step.
//!
//! A linear hybrid motor is the same thing unrolled: one tooth pitch is one electrical period. With
//! 4 full steps to a turn, a turn is a pitch and `N_r` is 1; the axis' ratio is `pitch/2π`, and the
//! holding torque is the holding force times that ratio.

use core::f64::consts::{FRAC_PI_2, TAU};

use messages::math;

/// Full steps in one electrical period of two phases.
const STEPS_PER_PERIOD: f64 = 4.0;

/// Full steps by which the rotor may be away from the magnetic axis before it falls to the next.
const STEPS_TO_STALL: f64 = 2.0;

/// A hybrid stepper motor with its driver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepperMotor {
    /// Full steps in a revolution, a multiple of 4.
    pub full_steps: f64,
    /// Pulses per full step.
    pub microsteps: f64,
    /// Largest torque with both phases at rated current, at standstill [N·m].
    pub holding_torque: f64,
    /// Torque of the unpowered motor towards its full steps [N·m].
    pub detent_torque: f64,
    /// Inertia at the shaft on the motor's side of the transmission's spring [kg·m²].
    pub rotor_inertia: f64,
    /// Peak current of a phase at which the holding torque is given [A].
    pub current: f64,
    /// Resistance of a phase [Ω].
    pub resistance: f64,
    /// Inductance of a phase [H].
    pub inductance: f64,
    /// Voltage of the supply [V].
    pub voltage: f64,
    /// Damping by the driver, against the speed relative to the magnetic axis [N·m·s/rad].
    pub damping: f64,
    /// Largest pulse rate of the driver [1/s].
    pub pulse_rate: f64,
}

/// A torque that the motor cannot give.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("a torque of {torque} N·m, and the motor gives {limit} N·m at this speed")]
pub struct BeyondTorque {
    /// What was asked for [N·m].
    pub torque: f64,
    /// What there is [N·m].
    pub limit: f64,
}

impl StepperMotor {
    /// Electrical periods in a revolution, `N_r`.
    #[inline]
    pub fn periods(&self) -> f64 {
        self.full_steps / STEPS_PER_PERIOD
    }

    /// Whether it is a linear or planar motor unrolled, a turn being one tooth pitch: nothing of it
    /// rotates.
    pub fn is_planar(&self) -> bool {
        self.full_steps == STEPS_PER_PERIOD
    }

    /// Pulses per radian of the shaft.
    pub fn pulses_per_radian(&self) -> f64 {
        self.pulses_per_turn() / TAU
    }

    /// Pulses in a revolution.
    pub fn pulses_per_turn(&self) -> f64 {
        self.full_steps * self.microsteps
    }

    /// Speed at the largest pulse rate, or where the pull-out torque has fallen to a tenth of the
    /// holding torque, whichever is lower [rad/s]: beyond it nothing is left to brake with.
    pub fn largest_speed(&self) -> f64 {
        /// Share of the holding torque that an axis must keep.
        const LEAST: f64 = 0.1;
        /// Bisections, to a part in 10¹² of the range.
        const BISECTIONS: u32 = 40;
        let most = self.pulse_rate / self.pulses_per_radian();
        let holds = |speed: f64| self.pull_out_torque(speed) >= LEAST * self.holding_torque;
        if holds(most) {
            return most;
        }
        let (mut low, mut high) = (0.0, most);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if holds(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    /// Angle between rotor and magnetic axis from which the rotor falls out of step [rad].
    #[inline]
    pub fn stall_angle(&self) -> f64 {
        STEPS_TO_STALL * TAU / self.full_steps
    }

    /// Torque on a rotor that lags the magnetic axis by `lag` [rad], which could give `torque` at
    /// most [N·m].
    #[inline]
    pub fn field_torque(&self, torque: f64, lag: f64) -> f64 {
        torque * math::sin(self.periods() * lag)
    }

    /// Torque of the teeth on a rotor at `angle` from a full step [rad], in N·m; there with the
    /// power off too.
    #[inline]
    pub fn teeth_torque(&self, angle: f64) -> f64 {
        -self.detent_torque * math::sin(STEPS_PER_PERIOD * self.periods() * angle)
    }

    /// How far the magnetic axis must be ahead of the rotor for `torque` [N·m] at `speed` [rad/s],
    /// in rad. The detent torque is left out: over a full step its mean is 0.
    ///
    /// # Errors
    /// A torque beyond what the motor gives at that speed.
    pub fn load_angle(&self, torque: f64, speed: f64) -> Result<f64, BeyondTorque> {
        let limit = self.pull_out_torque(speed);
        // Put this way a torque that is no number is beyond.
        if torque.abs() <= limit && limit > 0.0 {
            return Ok(math::asin(torque / limit) / self.periods());
        }
        if torque == 0.0 { Ok(0.0) } else { Err(BeyondTorque { torque, limit }) }
    }

    /// The load angle of the largest torque, a full step [rad].
    pub fn largest_load_angle(&self) -> f64 {
        FRAC_PI_2 / self.periods()
    }

    /// Torque per load angle at small angles [N·m/rad].
    pub fn stiffness(&self) -> f64 {
        self.holding_torque * self.periods()
    }

    /// Largest torque at `speed` [rad/s], in N·m.
    ///
    /// While the supply can drive the rated current, it is the holding torque. Beyond, each phase is
    /// a voltage `V` across `Z = √(R² + (ω_e·L)²)` at `ω_e = N_r·ω`, against a back-EMF of `k·ω`
    /// with `k = T/I`; over all load angles its largest torque is
    ///
    /// ```text
    /// k·V/Z − k²·ω·R/Z²
    /// ```
    ///
    /// (the synchronous machine with fixed voltage; Acarnley, Stepping Motors, sec. 5.3). Both
    /// phases in quadrature give that torque evenly.
    #[inline]
    pub fn pull_out_torque(&self, speed: f64) -> f64 {
        /// Rounding of the comparison that saves the divisions.
        const SURELY: f64 = 1.0 + 1e-9;
        let speed = speed.abs();
        let reactance = self.periods() * speed * self.inductance;
        let square = self.resistance * self.resistance + reactance * reactance;
        let given = self.current * self.voltage * square.sqrt()
            - self.holding_torque * speed * self.resistance;
        if given > self.current * self.current * square * SURELY {
            return self.holding_torque;
        }
        let constant = self.holding_torque / self.current;
        let driven = constant * self.voltage / square.sqrt()
            - constant * constant * speed * self.resistance / square;
        driven.min(self.holding_torque).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A usual 1.8° motor of 56 mm.
    fn motor() -> StepperMotor {
        StepperMotor {
            full_steps: 200.0,
            microsteps: 16.0,
            holding_torque: 1.2,
            detent_torque: 0.04,
            rotor_inertia: 3e-5,
            current: 2.8,
            resistance: 0.9,
            inductance: 2.5e-3,
            voltage: 24.0,
            damping: 1e-3,
            pulse_rate: 200e3,
        }
    }

    #[test]
    fn the_load_angle_is_the_inverse_of_the_torque() {
        let motor = motor();
        // asin(0.6/1.2) = 30° electrical, 0.6° at the shaft.
        let angle = motor.load_angle(0.6, 0.0).map(f64::to_degrees);
        assert!(angle.is_ok_and(|angle| (angle - 0.6).abs() < 1e-12), "{angle:?}");
        for torque in [-1.19, -0.3, 0.0, 0.01, 1.2] {
            let angle = motor.load_angle(torque, 0.0).unwrap_or(f64::NAN);
            assert!((motor.field_torque(1.2, angle) - torque).abs() < 1e-12);
        }
        let refused = motor.load_angle(1.3, 0.0);
        assert_eq!(refused, Err(BeyondTorque { torque: 1.3, limit: 1.2 }));
        assert!(motor.load_angle(f64::NAN, 0.0).is_err());
        assert!((motor.largest_load_angle().to_degrees() - 1.8).abs() < 1e-12);
        assert!((motor.stall_angle().to_degrees() - 3.6).abs() < 1e-12);
    }

    #[test]
    fn stiffness_is_the_slope_of_the_torque() {
        let motor = motor();
        assert_eq!(motor.stiffness(), 60.0);
        let slope = motor.field_torque(1.2, 1e-7) / 1e-7;
        assert!((slope - 60.0).abs() < 1e-6, "{slope}");
        // The teeth pull back to each of 200 full steps.
        for step in 0..200 {
            let angle = f64::from(step) * TAU / 200.0;
            assert!(motor.teeth_torque(angle).abs() < 1e-12);
            let back = motor.teeth_torque(angle + TAU / 800.0);
            assert!((back + 0.04).abs() < 1e-12, "{back}");
        }
    }

    /// Largest torque over all load angles, from phasors of one phase: current and voltage as
    /// complex numbers, no formula of the module.
    fn by_phasors(motor: &StepperMotor, speed: f64) -> f64 {
        let constant = motor.holding_torque / motor.current;
        let (r, x) = (motor.resistance, 50.0 * speed * motor.inductance);
        let square = r * r + x * x;
        (0..100_000)
            .map(|index| {
                let angle = f64::from(index) * TAU / 100_000.0;
                let (sine, cosine) = math::sin_cos(angle);
                // (V·e^{jβ} − k·ω)/(R + jX), its part in phase with the back-EMF gives torque.
                let (re, im) = (motor.voltage * cosine - constant * speed, motor.voltage * sine);
                constant * (re * r + im * x) / square
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn the_pull_out_torque_is_the_largest_over_all_load_angles() {
        let motor = motor();
        for speed in [40.0, 60.0, 100.0, 150.0, 200.0] {
            let (found, expected) = (motor.pull_out_torque(speed), by_phasors(&motor, speed));
            println!("{speed} rad/s: {found:.4} N·m");
            let expected = expected.clamp(0.0, 1.2);
            assert!((found - expected).abs() < 1e-8, "{speed} rad/s: {found} {expected}");
        }
        assert_eq!(motor.pull_out_torque(0.0), 1.2);
        assert_eq!(motor.pull_out_torque(20.0), 1.2);
        // k·V/Z = 0.41116 N·m at Z = 25.016 Ω, less k²·ω·R/Z² = 0.05283 N·m.
        let fast = motor.pull_out_torque(200.0);
        assert!((fast - 0.35833).abs() < 1e-5, "{fast}");
    }

    #[test]
    fn pulses_follow_from_steps() {
        let motor = motor();
        assert_eq!(motor.pulses_per_turn(), 3200.0);
        // 200 kHz at 3200 pulses are 62.5 turns a second.
        assert!((motor.largest_speed() / TAU - 62.5).abs() < 1e-12);
    }
}
