//! Crossing the backlash: on which side of its gap each motor stands, and how it gets to the other.
//!
//! A joint is pushed by one flank of its gap or by the other, as the effort on it has it. Where the
//! effort changes its sign the load coasts, and the motor crosses the gap behind its back: as a
//! critically damped second-order system would, so that the motor need not jump. It arrives late
//! by about 2/ω. Where the effort changes gently, as under a limit of jerk, the load lacks little of
//! it by then.
//!
//! The side is that of the planned rate. At another rate gravity and inertia weigh differently, and a
//! load between them may lean on the other flank than the motor stands for.

use crate::limits::motion_limits::torque_and_slew;
use machine::kinematics::Joints;
use machine::transmission::equilibrium;
use machine::{Actuator, Axis};
use messages::math;
use messages::time::SETPOINT_TIME;

/// Fastest rate of a crossing [rad/s]: with the voltage of a cycle held, quicker ones cannot be
/// followed.
const FASTEST: f64 = 700.0;

/// Shares of the motor's torque from rest, and of the torque that its voltage builds up in a cycle,
/// that the start of a crossing may take for the rotor.
const SHARES: [f64; 2] = [0.2, 0.25];

/// Where the motors stand in their gaps.
#[derive(Debug, Clone)]
pub(crate) struct BacklashCompensation<const N: usize> {
    /// Half of each backlash, 0 for none [joint units].
    half: Joints<N>,
    /// Index of the actuator of each: one with a gap has no other.
    actuator: [usize; N],
    /// ω of each crossing [rad/s], and what a step leaves of the way, `e^(−ω·step)`.
    rate: Joints<N>,
    decay: Joints<N>,
    step: f64,
    /// Off the middle [joint units], ahead of the load, and how fast it changes.
    value: Joints<N>,
    speed: Joints<N>,
    target: Joints<N>,
}

impl<const N: usize> BacklashCompensation<N> {
    /// The motors that drive `axes` at rest under `effort` [N or N·m], to be advanced by steps of `step` [s].
    pub(crate) fn new(
        axes: &[Axis],
        actuators: &[Actuator],
        effort: &Joints<N>,
        step: f64,
    ) -> Self {
        let actuator = core::array::from_fn(|index| axes[index].actuators.start);
        let half = Joints::from_fn(|index, _| axes[index].backlash / 2.0);
        let rate = Joints::from_fn(|index, _| {
            let drive = &actuators[actuator[index]];
            let [torque, slew] = torque_and_slew(&drive.motor);
            let torque = (SHARES[0] * torque).min(SHARES[1] * slew * SETPOINT_TIME);
            // A step of the whole backlash b starts with an acceleration of b·ω².
            let acceleration = torque / drive.motor.rotor_inertia() * drive.ratio.abs();
            (acceleration / axes[index].backlash).sqrt().min(FASTEST)
        });
        let value = Joints::from_fn(|index, _| {
            equilibrium::side(&actuators[actuator[index]], effort[index]) * half[index]
        });
        Self {
            half,
            actuator,
            rate,
            decay: rate.map(|rate| math::exp(-rate * step)),
            step,
            value,
            speed: Joints::zeros(),
            target: value,
        }
    }

    /// Goes on by one step to an instant with `effort` on the joints [N or N·m], moving or not.
    #[inline]
    pub(crate) fn advance(&mut self, actuators: &[Actuator], effort: &Joints<N>, is_moving: bool) {
        for index in 0..N {
            if self.half[index] == 0.0 {
                continue;
            }
            let side = equilibrium::side(&actuators[self.actuator[index]], effort[index]);
            if side != 0.0 || !is_moving {
                self.target[index] = side * self.half[index];
            }
            let (rate, target) = (self.rate[index], self.target[index]);
            let (off, speed) = (self.value[index] - target, self.speed[index]);
            let slope = speed + rate * off;
            self.value[index] = target + (off + slope * self.step) * self.decay[index];
            self.speed[index] = (speed - rate * slope * self.step) * self.decay[index];
        }
    }

    /// How far the motors are ahead of the middle of their gaps [joint units].
    pub(crate) fn value(&self) -> &Joints<N> {
        &self.value
    }

    /// How fast that changes [joint units/s].
    pub(crate) fn speed(&self) -> &Joints<N> {
        &self.speed
    }

    /// How far the motor farthest from its side is from it [joint units].
    pub(crate) fn left(&self) -> f64 {
        (self.value - self.target).amax()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use machine::Machine;
    use nalgebra::Vector2;

    const STEP: f64 = 0.25e-3;

    /// The built-in machine's motors, their first with a backlash of 40 µm.
    fn machine() -> Machine {
        let mut machine = Machine::builtin();
        machine.axes[0].backlash = 40e-6;
        machine
    }

    #[test]
    fn a_crossing_ends_on_the_side_that_is_pressed_and_does_not_pass_it() {
        let Machine { axes, actuators, .. } = machine();
        let mut gaps = BacklashCompensation::<2>::new(&axes, &actuators, &Vector2::zeros(), STEP);
        assert_eq!(*gaps.value(), Vector2::<f64>::zeros());
        let mut before = 0.0;
        for _ in 0..400 {
            gaps.advance(&actuators, &Vector2::new(3.0, 3.0), true);
            let value = gaps.value()[0];
            assert!(value >= before && value <= 20e-6, "{value:e}");
            // Speed is the slope of the value.
            assert!(gaps.speed()[0] >= 0.0);
            before = value;
        }
        assert!(gaps.left() < 1e-9, "{:e}", gaps.left());
        assert_eq!(gaps.value()[1], 0.0, "an axis without backlash has no gap");
    }

    #[test]
    fn a_motor_stays_on_its_side_while_nothing_presses_and_rests_in_the_middle() {
        let Machine { axes, actuators, .. } = machine();
        let effort = Vector2::new(-3.0, 0.0);
        let mut gaps = BacklashCompensation::<2>::new(&axes, &actuators, &effort, STEP);
        assert_eq!(gaps.value()[0], -20e-6, "pressed at rest");
        for _ in 0..100 {
            gaps.advance(&actuators, &Vector2::zeros(), true);
        }
        assert_eq!(gaps.value()[0], -20e-6);
        for _ in 0..400 {
            gaps.advance(&actuators, &Vector2::zeros(), false);
        }
        assert!(gaps.value()[0].abs() < 1e-9 && gaps.speed()[0].abs() < 1e-6);
    }
}
