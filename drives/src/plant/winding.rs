//! The motors' electrical part: `V = R·i + L·i′ + k·ω` (source 003 sec. 3.3), integrated exactly
//! for a constant voltage and a speed that is a quadratic in time over the step.
//!
//! The winding's own pole is solved by its exponential, so the step is stable for every `L/R`,
//! and there is nothing to gain from a finer one. Within the four stages of the mechanical
//! Runge–Kutta step the weights below tend to the classical ones for `R·h/L → 0`; the whole step
//! is therefore of fourth order (exponential time differencing, Cox and Matthews 2002, J. Comput.
//! Phys. 176, sec. 3).

use machine::DcMotor;
use messages::math;
use nalgebra::SVector;

/// Where series take over from the closed form of the weights: below it the first omitted term
/// is under 1e-14, above it cancellation is under 1e-12.
const SERIES_BOUND: f64 = 1e-3;

/// The windings of `N` motors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Windings<const N: usize> {
    motors: [DcMotor; N],
    /// [Ω].
    pub resistance: SVector<f64, N>,
    /// [H].
    pub inductance: SVector<f64, N>,
    /// [N·m/A] and [V·s/rad].
    pub torque_constant: SVector<f64, N>,
    /// 1/R [S].
    conductance: SVector<f64, N>,
    /// k/R, current per speed [A·s/rad].
    back: SVector<f64, N>,
}

/// The weights of a step of one length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights<const N: usize> {
    /// The step [s].
    pub step: f64,
    /// Share of a current that is left after half a step.
    half_decay: SVector<f64, N>,
    /// Share of a current that is left after a step.
    decay: SVector<f64, N>,
    /// Response after half a step to a speed that ramps to 1.
    half_ramp: SVector<f64, N>,
    /// Response after a step to a speed that ramps to 1.
    ramp: SVector<f64, N>,
    /// Response after a step to a speed that grows with the square of time to 1.
    parabola: SVector<f64, N>,
}

/// The currents through one step: where they started, where they would settle.
#[derive(Debug, Clone, Copy)]
pub struct Course<const N: usize> {
    speed: SVector<f64, N>,
    settled: SVector<f64, N>,
    excess: SVector<f64, N>,
    /// k/R, current per speed.
    back: SVector<f64, N>,
}

impl<const N: usize> Windings<N> {
    /// The windings of `motors`.
    pub fn new(motors: [DcMotor; N]) -> Self {
        let each = |value: fn(&DcMotor) -> f64| SVector::from_fn(|row, _| value(&motors[row]));
        let torque_constant = each(|motor| motor.torque_constant);
        let conductance = each(|motor| 1.0 / motor.resistance);
        Self {
            motors,
            resistance: each(|motor| motor.resistance),
            inductance: each(|motor| motor.inductance),
            torque_constant,
            conductance,
            back: torque_constant.component_mul(&conductance),
        }
    }

    /// The motors themselves.
    pub fn motors(&self) -> &[DcMotor; N] {
        &self.motors
    }

    /// The weights for steps of `step` [s].
    pub fn weights(&self, step: f64) -> Weights<N> {
        let rate = self.resistance.component_div(&self.inductance) * step;
        Weights {
            step,
            half_decay: rate.map(|z| math::exp(-0.5 * z)),
            decay: rate.map(|z| math::exp(-z)),
            half_ramp: rate.map(|z| ramp_response(0.5 * z)),
            ramp: rate.map(ramp_response),
            parabola: rate.map(parabola_response),
        }
    }

    /// Starts a step from `current` [A] at `speed` [rad/s] with `voltage` [V] held.
    pub fn course(
        &self,
        current: &SVector<f64, N>,
        speed: &SVector<f64, N>,
        voltage: &SVector<f64, N>,
    ) -> Course<N> {
        let settled = self.conductance.component_mul(voltage) - self.back.component_mul(speed);
        Course { speed: *speed, settled, excess: current - settled, back: self.back }
    }
}

impl<const N: usize> Course<N> {
    /// Current at the second stage, half a step on [A].
    pub fn second(&self, weights: &Weights<N>) -> SVector<f64, N> {
        self.settled + weights.half_decay.component_mul(&self.excess)
    }

    /// Current at the third stage, half a step on, given the second stage's speed [A].
    pub fn third(&self, weights: &Weights<N>, second: &SVector<f64, N>) -> SVector<f64, N> {
        let response = weights.half_ramp.component_mul(&(second - self.speed)) * 2.0;
        self.settled + weights.half_decay.component_mul(&self.excess)
            - self.back.component_mul(&response)
    }

    /// Current at the fourth stage, a step on, given the third stage's speed [A].
    pub fn fourth(&self, weights: &Weights<N>, third: &SVector<f64, N>) -> SVector<f64, N> {
        let response = weights.ramp.component_mul(&(third - self.speed)) * 2.0;
        self.settled + weights.decay.component_mul(&self.excess)
            - self.back.component_mul(&response)
    }

    /// Current at the end, given the speed half-way and at the end [A].
    pub fn end(
        &self,
        weights: &Weights<N>,
        middle: &SVector<f64, N>,
        end: &SVector<f64, N>,
    ) -> SVector<f64, N> {
        let (middle, end) = (middle - self.speed, end - self.speed);
        let linear = middle * 4.0 - end;
        let square = end * 2.0 - middle * 4.0;
        let response =
            weights.ramp.component_mul(&linear) + weights.parabola.component_mul(&square);
        self.settled + weights.decay.component_mul(&self.excess)
            - self.back.component_mul(&response)
    }
}

/// `∫₀¹ z·e^{−z(1−s)}·s ds = 1 − (1 − e^{−z})/z`.
fn ramp_response(z: f64) -> f64 {
    if z < SERIES_BOUND {
        z * (0.5 - z * (1.0 / 6.0 - z / 24.0))
    } else {
        1.0 - (1.0 - math::exp(-z)) / z
    }
}

/// `∫₀¹ z·e^{−z(1−s)}·s² ds = 1 − 2·ramp/z`.
fn parabola_response(z: f64) -> f64 {
    if z < SERIES_BOUND {
        z * (1.0 / 3.0 - z * (1.0 / 12.0 - z / 60.0))
    } else {
        1.0 - 2.0 * ramp_response(z) / z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector1;

    fn winding(time_constant: f64) -> Windings<1> {
        Windings::new([DcMotor {
            resistance: 2.3,
            inductance: 2.3 * time_constant,
            torque_constant: 0.021,
            rotor_inertia: 2e-6,
            voltage: 12.0,
            current: 5.2,
            continuous_current: None,
        }])
    }

    #[test]
    fn series_and_closed_form_meet() {
        let (below, above) = (SERIES_BOUND * 0.999_999, SERIES_BOUND * 1.000_001);
        for response in [ramp_response, parabola_response] {
            let slope = (response(above) - response(below)) / (above - below);
            // The slope at 0 is 1/2 or 1/3; a jump between the forms would show in it.
            assert!((0.33..0.51).contains(&slope), "{slope}");
        }
    }

    #[test]
    fn locked_rotor_is_exact_at_any_step() {
        for step in [1e-6, 5e-5, 1e-3, 1.0] {
            let winding = winding(1e-3);
            let (still, voltage) = (Vector1::zeros(), Vector1::new(12.0));
            let course = winding.course(&Vector1::zeros(), &still, &voltage);
            let current = course.end(&winding.weights(step), &still, &still)[0];
            let exact = 12.0 / 2.3 * (1.0 - math::exp(-step / 1e-3));
            assert!((current - exact).abs() <= 1e-14 * 12.0 / 2.3, "step {step}: {current}");
        }
    }

    #[test]
    fn a_fast_winding_settles_on_the_end_speed() {
        // L/R a thousandth of the step: the current follows (V − kω)/R with a lag of L/R.
        let winding = winding(5e-8);
        let voltage = Vector1::new(6.0);
        let course = winding.course(&Vector1::new(1.0), &Vector1::new(100.0), &voltage);
        let weights = winding.weights(5e-5);
        let current = course.end(&weights, &Vector1::new(105.0), &Vector1::new(110.0))[0];
        let lag = 0.021 * 10.0 * 1e-3 / 2.3;
        assert!((current - ((6.0 - 0.021 * 110.0) / 2.3 + lag)).abs() < 1e-12, "{current}");
    }
}
