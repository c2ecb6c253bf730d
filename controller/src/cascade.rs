//! The three loops of one actuator: position P, velocity PI, current PI, with saturation and
//! anti-windup.
//!
//! Gains from motor and load (source 003 ch. 3, the cascade): current `Kp = L·ω_c`, `Ki = R·ω_c`;
//! velocity `Kp = J·ω_v/k` with its corner at `ω_v/4`. The integrals are kept in the unit of the
//! output, already multiplied by their gain, so that changing a gain does not move the output.

use machine::{DcMotor, LoopGains};
use messages::time::Period;

/// A proportional-integral controller with a limited output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProportionalIntegral {
    /// Output per error.
    pub proportional: f64,
    /// Output per error and second.
    pub integral: f64,
    /// Largest |output|.
    pub limit: f64,
    accumulated: f64,
}

impl ProportionalIntegral {
    /// With an empty integral.
    pub fn new(proportional: f64, integral: f64, limit: f64) -> Self {
        Self { proportional, integral, limit, accumulated: 0.0 }
    }

    /// The output for this cycle, feedforward included, and the part of it beyond the limit.
    fn output(&self, error: f64, feedforward: f64) -> (f64, f64) {
        let wanted = feedforward + self.proportional * error + self.accumulated;
        let given = wanted.clamp(-self.limit, self.limit);
        (given, wanted - given)
    }

    /// Integrates after the output was formed (forward Euler). The integral gets no more of the
    /// output's range than the feedforward leaves to it, and keeps its value where there is no
    /// number to add.
    fn integrate(&mut self, error: f64, feedforward: f64, cycle_time: f64) {
        let next = self.accumulated + self.integral * cycle_time * error;
        let given = feedforward.clamp(-self.limit, self.limit);
        if next.is_finite() && given.is_finite() {
            self.accumulated = next.clamp(-self.limit - given, self.limit - given);
        }
    }

    /// One cycle on its own: output, then integration.
    pub fn step(&mut self, error: f64, feedforward: f64, cycle_time: f64) -> f64 {
        let (output, _) = self.output(error, feedforward);
        self.integrate(error, feedforward, cycle_time);
        output
    }

    /// Empties the integral.
    pub fn reset(&mut self) {
        self.accumulated = 0.0;
    }
}

/// What the plan asks of an axis. The references belong to the instant of the measurement, the
/// voltage to the cycle in which the command acts.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Reference {
    /// Motor position [rad].
    pub position: f64,
    /// Motor velocity, formed by the same difference over one cycle as the measured one [rad/s].
    pub velocity: f64,
    /// Motor current [A].
    pub current: f64,
    /// Feedforward voltage [V].
    pub voltage: f64,
}

/// What was measured of an axis at one instant.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Measurement {
    /// Motor position [rad].
    pub position: f64,
    /// Motor velocity over the last cycle [rad/s].
    pub velocity: f64,
    /// Motor current [A].
    pub current: f64,
}

/// What the cascade asks of the power stage.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Drive {
    /// Current asked of the current loop [A].
    pub current: f64,
    /// Voltage [V].
    pub voltage: f64,
}

/// The loops of one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cascade {
    /// Time of a cycle [s].
    cycle_time: f64,
    position: f64,
    speed_limit: f64,
    velocity: ProportionalIntegral,
    current: ProportionalIntegral,
    /// Whether the plan stands.
    stands: bool,
    /// The integral of the velocity loop when it came to stand [A].
    before: f64,
}

impl Cascade {
    /// Gains and limits from the data of motor and load, for cycles of this `period`.
    pub fn new(motor: &DcMotor, gains: &LoopGains, period: Period) -> Self {
        // Source 003 ch. 3: Kp_v = J·ω_v/k, corner frequency ω_v/4.
        let velocity = gains.inertia * gains.velocity / motor.torque_constant;
        Self {
            cycle_time: period.seconds(),
            position: gains.position,
            speed_limit: motor.no_load_speed(),
            velocity: ProportionalIntegral::new(
                velocity,
                velocity * gains.velocity / 4.0,
                motor.current,
            ),
            // The pole of the winding is cancelled: Kp_i = L·ω_c, Ki_i = R·ω_c.
            current: ProportionalIntegral::new(
                motor.inductance * gains.current,
                motor.resistance * gains.current,
                motor.voltage,
            ),
            stands: false,
            before: 0.0,
        }
    }

    /// Whether the plan `stands` in this cycle. The friction of a standing motor takes either side, and up to
    /// `friction` [A] of what the integral gathers meanwhile is against that: when the plan moves again, the
    /// feedforward has the friction, and that much of the integral would push the motor past its place, or hold it
    /// back, row after row of a hatch. What is more stays: it is weight, or a motor that the file has wrong.
    pub fn heed_friction(&mut self, stands: bool, friction: f64) {
        if stands && !self.stands {
            self.before = self.velocity.accumulated;
        } else if self.stands && !stands {
            let gathered = self.velocity.accumulated - self.before;
            self.velocity.accumulated -= gathered.clamp(-friction, friction);
        }
        self.stands = stands;
    }

    /// One cycle. With `integrating` off the velocity integral stays as it is: where friction holds
    /// an axis to within its encoder's counts, integrating them would make it hunt.
    pub fn step(
        &mut self,
        reference: &Reference,
        measured: &Measurement,
        integrating: bool,
    ) -> Drive {
        let behind = reference.position - measured.position;
        let velocity_error = self.speed(reference.velocity, behind) - measured.velocity;
        let (current, current_excess) = self.velocity.output(velocity_error, reference.current);
        let current_error = current - measured.current;
        let (voltage, voltage_excess) = self.current.output(current_error, reference.voltage);
        // A current or a voltage at its limit gives no more torque, whatever is asked for:
        // integrating on would only delay the way back.
        let excess = if current_excess != 0.0 { current_excess } else { voltage_excess };
        if integrating && excess * velocity_error <= 0.0 {
            self.velocity.integrate(velocity_error, reference.current, self.cycle_time);
        }
        self.current.integrate(current_error, reference.voltage, self.cycle_time);
        Drive { current, voltage }
    }

    /// One cycle of the outer two loops, for a drive that closes the current loop, of a motor that will be so much
    /// `behind` the plan and so much `slower` [rad, rad/s] when it acts: the current that it shall drive, and what of that
    /// is from neither plan nor integral [A]. `reference.current` is that of the plan in the cycle in which it acts.
    pub fn outer(
        &mut self,
        reference: &Reference,
        [behind, slower]: [f64; 2],
        integrating: bool,
    ) -> [f64; 2] {
        let wanted = self.speed(reference.velocity, behind);
        let velocity_error = wanted - (reference.velocity - slower);
        let (current, excess) = self.velocity.output(velocity_error, reference.current);
        let correction = current - reference.current - self.velocity.accumulated;
        if integrating && excess * velocity_error <= 0.0 {
            self.velocity.integrate(velocity_error, reference.current, self.cycle_time);
        }
        [current, correction]
    }

    /// The speed that brings a motor that is so much `behind` [rad] to its reference, beside that of the plan [rad/s].
    pub fn speed(&self, planned: f64, behind: f64) -> f64 {
        let wanted = planned + self.position * behind;
        wanted.clamp(-self.speed_limit, self.speed_limit)
    }

    /// Empties the integrals: with references taken from the measurement the first voltage is the
    /// feedforward alone.
    pub fn reset(&mut self) {
        self.velocity.reset();
        self.current.reset();
        (self.stands, self.before) = (false, 0.0);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use machine::{Actuator, Machine};
    use messages::math;

    fn of(actuator: &Actuator) -> Cascade {
        Cascade::new(actuator.motor.dc().unwrap(), &actuator.gains, Period::OF_SETPOINTS)
    }

    /// The current loop on a locked rotor, one cycle of delay, exact winding.
    #[test]
    fn current_loop_agrees_with_the_golden_step_responses() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/golden/dc_motor.json");
        let golden: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        let golden = &golden["current_loop_locked_rotor"];
        let number = |value: &serde_json::Value| value.as_f64().unwrap();
        let resistance = number(&golden["params"]["R"]);
        let inductance = number(&golden["params"]["L"]);
        let cases = golden["cases"].as_array().unwrap();
        assert_eq!(cases.len(), 3);
        for case in cases {
            let period = number(&case["Ts"]);
            let decay = math::exp(-period * resistance / inductance);
            let mut machine = Machine::builtin();
            let axis = &mut machine.actuators[0];
            let motor = axis.motor.dc_mut().unwrap();
            motor.resistance = resistance;
            motor.inductance = inductance;
            motor.voltage = number(&case["Vmax"]);
            axis.gains.current = number(&case["wc"]);
            let mut current_loop = of(axis).current;
            assert!((current_loop.proportional - number(&case["Kp"])).abs() < 1e-12);
            assert!((current_loop.integral - number(&case["Ki"])).abs() < 1e-9);
            let (mut current, mut applied) = (0.0, 0.0);
            for (index, sample) in case["i_samples"].as_array().unwrap().iter().enumerate() {
                assert!(
                    (current - number(sample)).abs() < 1e-12,
                    "sample {index} at Ts {period}: {current} against {sample}"
                );
                let asked = current_loop.step(number(&case["i_ref"]) - current, 0.0, period);
                current = current * decay + applied / resistance * (1.0 - decay);
                applied = asked;
            }
        }
    }

    #[test]
    fn gains_follow_from_motor_and_load() {
        let cascade = of(&Machine::builtin().actuators[0]);
        // Source 003, the pilot: CoreXY Kp_v 0.0194, Ki_v 0.775, Kp_i 0.803, Ki_i 803.
        assert!((cascade.velocity.proportional - 0.0194).abs() < 1e-4);
        assert!((cascade.velocity.integral - 0.775).abs() < 2e-3);
        assert!((cascade.current.proportional - 0.803).abs() < 1e-3);
        assert!((cascade.current.integral - 803.0).abs() < 1.0);
    }

    #[test]
    fn a_saturated_integral_takes_only_what_the_feedforward_leaves() {
        let mut winding = ProportionalIntegral::new(1.0, 100.0, 2.0);
        for _ in 0..1000 {
            assert_eq!(winding.step(5.0, 1.5, 1e-3), 2.0);
        }
        assert_eq!(winding.accumulated, 0.5);
        // Whatever the error was before, the output leaves its limit at once with its sign.
        assert_eq!(winding.step(-1.0, 1.5, 1e-3), 1.0);
    }

    #[test]
    fn a_voltage_at_its_limit_stops_the_velocity_integral() {
        let mut cascade = of(&Machine::builtin().actuators[0]);
        let far = Reference { position: 100.0, ..Reference::default() };
        // The measured current stays away, so that the voltage stays at its limit.
        for _ in 0..1000 {
            let drive = cascade.step(&far, &Measurement::default(), true);
            assert!(drive.voltage <= 12.0 && drive.current <= 5.2);
        }
        assert!(cascade.velocity.accumulated.abs() < 1e-12);
    }

    #[test]
    fn what_is_not_a_number_goes_out_and_stays_in_no_integral() {
        let mut cascade = of(&Machine::builtin().actuators[0]);
        for number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX] {
            for slot in 0..7 {
                let at = |index: usize| if index == slot { number } else { 0.0 };
                let reference =
                    Reference { position: at(0), velocity: at(1), current: at(2), voltage: at(3) };
                let measured = Measurement { position: at(4), velocity: at(5), current: at(6) };
                let drive = cascade.step(&reference, &measured, true);
                assert!(drive.voltage.is_nan() || drive.voltage.abs() <= 12.0, "{drive:?}");
                let kept = [cascade.velocity.accumulated, cascade.current.accumulated];
                assert!(kept.iter().all(|kept| kept.is_finite()), "{number} in slot {slot}");
            }
        }
    }

    #[test]
    fn at_its_references_it_gives_the_feedforward_alone() {
        let mut cascade = of(&Machine::builtin().actuators[0]);
        let reference = Reference { position: 3.0, velocity: 7.0, current: 0.5, voltage: 2.0 };
        let measured = Measurement { position: 3.0, velocity: 7.0, current: 0.5 };
        assert_eq!(cascade.step(&reference, &measured, true), Drive { current: 0.5, voltage: 2.0 });
    }
}
