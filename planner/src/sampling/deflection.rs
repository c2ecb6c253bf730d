//! How far the motors must be ahead of the load through an elastic transmission.
//!
//! The load's inertia force passes through spring and damper: `B·λ̇ + K·λ = τ`, with λ the motor
//! side ahead of the load side. The trapezoidal rule with a constant step solves it: it is stable
//! for every step, and with a quarter of a cycle its error at a step of jerk, where it is largest,
//! is below 10 nm on a belt of 60 N/mm.

use machine::Mechanism;
use machine::kinematics::Joints;
use nalgebra::SMatrix;

/// The lead of one machine's motors and its rate.
#[derive(Debug, Clone)]
pub(crate) struct Deflection<const N: usize> {
    law: Law<N>,
    value: Joints<N>,
    rate: Joints<N>,
    effort: Joints<N>,
}

/// The transmission.
#[derive(Debug, Clone)]
enum Law<const N: usize> {
    Rigid,
    /// A spring alone follows the effort at once.
    Spring {
        compliance: SMatrix<f64, N, N>,
    },
    SpringAndDamper {
        stiffness: SMatrix<f64, N, N>,
        compliance: SMatrix<f64, N, N>,
        mobility: SMatrix<f64, N, N>,
        /// λ after a step from λ before it, and from the mean effort.
        keep: SMatrix<f64, N, N>,
        take: SMatrix<f64, N, N>,
    },
}

impl<const N: usize> Deflection<N> {
    /// At rest under `effort`, to be advanced by steps of `step` [s].
    pub(crate) fn new<M: Mechanism<N>>(mechanism: &M, effort: Joints<N>, step: f64) -> Self {
        let law = Law::new(mechanism, step);
        let mut lead = Self { law, value: Joints::zeros(), rate: Joints::zeros(), effort };
        lead.value = lead.settled(&effort);
        lead
    }

    /// Goes on by one step to an instant with `effort` on the load side, which changes at
    /// `effort_rate` there.
    #[inline]
    pub(crate) fn advance(&mut self, effort: &Joints<N>, effort_rate: impl FnOnce() -> Joints<N>) {
        match &self.law {
            Law::Rigid => {}
            Law::Spring { compliance } => {
                self.value = compliance * effort;
                self.rate = compliance * effort_rate();
            }
            Law::SpringAndDamper { stiffness, mobility, keep, take, .. } => {
                self.value = keep * self.value + take * (self.effort + effort) * 0.5;
                self.rate = mobility * (effort - stiffness * self.value);
            }
        }
        self.effort = *effort;
    }

    /// λ [joint units].
    pub(crate) fn value(&self) -> &Joints<N> {
        &self.value
    }

    /// λ̇ [joint units/s].
    pub(crate) fn rate(&self) -> &Joints<N> {
        &self.rate
    }

    /// λ when `effort` has lasted long.
    pub(crate) fn settled(&self, effort: &Joints<N>) -> Joints<N> {
        match &self.law {
            Law::Rigid => Joints::zeros(),
            Law::Spring { compliance } | Law::SpringAndDamper { compliance, .. } => {
                compliance * effort
            }
        }
    }
}

impl<const N: usize> Law<N> {
    fn new<M: Mechanism<N>>(mechanism: &M, step: f64) -> Self {
        let Some(stiffness) = mechanism.stiffness() else { return Self::Rigid };
        let Some(compliance) = stiffness.try_inverse() else { return Self::Rigid };
        let damping = mechanism.damping();
        let implicit = damping / step + stiffness / 2.0;
        match (damping.try_inverse(), implicit.try_inverse()) {
            (Some(mobility), Some(take)) => Self::SpringAndDamper {
                stiffness,
                compliance,
                mobility,
                keep: take * (damping / step - stiffness / 2.0),
                take,
            },
            _ => Self::Spring { compliance },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use machine::MechanismVisitor;

    const STEP: f64 = 0.25e-3;

    /// A force that rises evenly in y and then stays, on the built-in CoreXY.
    struct RiseAndHold;

    impl MechanismVisitor for RiseAndHold {
        type Output = f64;

        fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> f64 {
            // The belts' coordinates of a pure force in y: q₁ = y, q₂ = −y, half a force each.
            let unit = Joints::<N>::from_fn(|row, _| if row == 0 { 0.5 } else { -0.5 });
            let (rise, hold) = (0.02, 0.03);
            let (mass, jerk) = (1.06, 500.0);
            let (stiffness, damping) = (6e4, 2.0 * 0.9 * (6e4_f64 * mass).sqrt());
            let decay = stiffness / damping;
            let mut lead = Deflection::new(&mechanism, Joints::zeros(), STEP);
            let mut worst: f64 = 0.0;
            let mut index = 0;
            while f64::from(index) * STEP < rise + hold {
                index += 1;
                let time = f64::from(index) * STEP;
                let (force, force_rate) =
                    if time < rise { (mass * jerk * time, mass * jerk) } else { (10.6, 0.0) };
                lead.advance(&(unit * force), || unit * force_rate);
                // Exact: a ramp's answer, and minus the same ramp once it has ended.
                let ramp = |t: f64| {
                    let slope = mass * jerk / stiffness;
                    slope * (t - (1.0 - messages::math::exp(-decay * t)) / decay)
                };
                let exact = if time < rise { ramp(time) } else { ramp(time) - ramp(time - rise) };
                let found = (lead.value()[0] - lead.value()[1]) / 2.0;
                worst = worst.max((found - exact).abs());
            }
            worst
        }
    }

    #[test]
    fn the_lead_is_the_exact_answer_to_within_10_nm() {
        let worst = machine::Machine::builtin().mechanism.visit(RiseAndHold);
        assert!(worst < 1e-8, "{worst:e} m");
    }
}
