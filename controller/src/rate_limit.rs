//! The largest rate at which a setpoint keeps every limit.
//!
//! At rate `r` velocity goes with `r`, acceleration and its torque with `r²`, jerk with `r³`, and
//! laser power with `r`. As planned is always allowed: the planner's checker vouches for rate 1.

use machine::{Axis, Machine};
use signals::{Setpoint, math};

/// The fastest a stream is ever played.
pub const LARGEST_RATE: f64 = 2.0;

/// Share of the supply that a rate may use up; the rest is left to the winding's inductance and
/// to the feedback loops.
const VOLTAGE_SHARE: f64 = 0.9;

/// Share of the power stage's current that a rate may use up.
const CURRENT_SHARE: f64 = 0.9;

/// The limits that a rate must keep, as reciprocals: this is asked once a cycle.
#[derive(Debug, Clone)]
pub struct RateLimit {
    marking: f64,
    moving: f64,
    acceleration: f64,
    jerk: f64,
    axes: Vec<AxisRate>,
}

/// One axis: reciprocal limits of its joint, and the two lines that bound its motor's torque.
#[derive(Debug, Clone, Copy)]
struct AxisRate {
    velocity: f64,
    acceleration: f64,
    jerk: f64,
    /// Friction per joint speed [N·m·s/m or N·m·s/rad].
    viscous: f64,
    coulomb: f64,
    /// Torque that the current gives [N·m].
    by_current: f64,
    /// Torque that the voltage gives at standstill [N·m].
    by_voltage: f64,
    /// Torque that each unit of joint speed takes from that.
    back_emf: f64,
}

impl RateLimit {
    /// Of this machine.
    pub fn new(machine: &Machine) -> Self {
        let path = &machine.path;
        Self {
            marking: 1.0 / path.speed,
            moving: 1.0 / path.speed.max(path.rapid),
            acceleration: 1.0 / path.acceleration,
            jerk: 1.0 / path.jerk,
            axes: machine.axes.iter().map(AxisRate::new).collect(),
        }
    }

    /// The largest rate for `setpoint`, 1..=[`LARGEST_RATE`].
    pub fn of(&self, setpoint: &Setpoint) -> f64 {
        let lit = setpoint.laser.is_lit();
        let mut velocity = setpoint.path_velocity * if lit { self.marking } else { self.moving };
        let mut acceleration = setpoint.path_acceleration * self.acceleration;
        let mut jerk = setpoint.path_jerk * self.jerk;
        let mut rate = LARGEST_RATE;
        let joints = setpoint.velocity.iter().zip(&setpoint.acceleration).zip(&setpoint.jerk);
        let efforts = setpoint.effort.iter().zip(&setpoint.static_effort);
        for ((axis, ((speed, joint_acceleration), joint_jerk)), (effort, standing)) in
            self.axes.iter().zip(joints).zip(efforts)
        {
            velocity = velocity.max(speed.abs() * axis.velocity);
            acceleration = acceleration.max(joint_acceleration.abs() * axis.acceleration);
            jerk = jerk.max(joint_jerk.abs() * axis.jerk);
            let motor = axis.motor_rate(speed.abs(), (effort - standing).abs(), standing.abs());
            rate = rate.min(motor);
        }
        if lit {
            velocity = velocity.max(brightest(setpoint));
        }
        // Only above these shares does the largest rate break the limit.
        if velocity * LARGEST_RATE > 1.0 {
            rate = rate.min(1.0 / velocity);
        }
        if acceleration * LARGEST_RATE * LARGEST_RATE > 1.0 {
            rate = rate.min(1.0 / acceleration.sqrt());
        }
        if jerk * LARGEST_RATE * LARGEST_RATE * LARGEST_RATE > 1.0 {
            rate = rate.min(1.0 / math::cbrt(jerk));
        }
        rate.max(1.0)
    }
}

impl AxisRate {
    fn new(axis: &Axis) -> Self {
        let (motor, limits) = (&axis.motor, &axis.limits);
        // R·τ/k + k·ω ≤ V, times k/R.
        let scale = motor.torque_constant / motor.resistance;
        Self {
            velocity: 1.0 / limits.velocity,
            acceleration: 1.0 / limits.acceleration,
            jerk: 1.0 / limits.jerk,
            viscous: axis.friction.viscous / axis.ratio,
            coulomb: axis.friction.coulomb,
            by_current: motor.torque_constant * motor.current * CURRENT_SHARE,
            by_voltage: scale * motor.voltage * VOLTAGE_SHARE,
            back_emf: scale * motor.torque_constant / axis.ratio,
        }
    }

    /// The largest rate for a joint at `speed` whose motor needs `moving` torque that goes with
    /// `r²` and `standing` torque that does not [N·m], friction on top.
    fn motor_rate(&self, speed: f64, moving: f64, standing: f64) -> f64 {
        let viscous = self.viscous * speed;
        let constant = standing + self.coulomb;
        let by_current = largest_root(moving, viscous, constant - self.by_current);
        let slope = viscous + self.back_emf * speed;
        by_current.min(largest_root(moving, slope, constant - self.by_voltage))
    }
}

/// The largest `r` up to [`LARGEST_RATE`] with `a·r² + b·r + c ≤ 0`, for `a, b ≥ 0`; 0 without.
fn largest_root(a: f64, b: f64, c: f64) -> f64 {
    if (a * LARGEST_RATE + b) * LARGEST_RATE + c <= 0.0 {
        LARGEST_RATE
    } else if c >= 0.0 {
        0.0
    } else {
        // The stable form: b and the root have the same sign.
        -2.0 * c / (b + (b * b - 4.0 * a * c).sqrt())
    }
}

/// The highest power in the cycle that starts at `setpoint`.
fn brightest(setpoint: &Setpoint) -> f64 {
    let laser = &setpoint.laser;
    laser.edges().iter().map(|edge| edge.power).fold(laser.power, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_limit_caps_with_its_own_power_of_the_rate() {
        let machine = Machine::builtin();
        let limit = RateLimit::new(&machine);
        let check = |change: fn(&mut Setpoint), rate: f64| {
            let mut setpoint = Setpoint::default();
            change(&mut setpoint);
            let found = limit.of(&setpoint);
            assert!((found - rate).abs() < 1e-12, "{found} against {rate}");
        };
        check(|_| {}, 2.0);
        check(|setpoint| setpoint.path_velocity = 0.25 / 1.25, 1.25);
        check(|setpoint| setpoint.path_acceleration = 10.0 / 2.25, 1.5);
        check(|setpoint| setpoint.path_jerk = 500.0 / 1.728, 1.2);
        check(|setpoint| setpoint.path_jerk = 600.0, 1.0);
        check(
            |setpoint| {
                setpoint.laser.gate = 1;
                setpoint.laser.power = 0.8;
            },
            1.25,
        );
        // 0.9·5.2 A·0.021 N·m/A = 5 mN·m + τ·r²; a standing motor at r = 1.6.
        check(|setpoint| setpoint.effort[1] = (0.9 * 5.2 * 0.021 - 5e-3) / 2.56, 1.6);
    }

    #[test]
    fn the_voltage_line_caps_a_fast_motor() {
        let machine = Machine::builtin();
        let mut setpoint = Setpoint::default();
        setpoint.velocity[0] = 0.3;
        setpoint.effort[0] = 0.01;
        let rate = RateLimit::new(&machine).of(&setpoint);
        let (motor, speed) = (&machine.axes[0].motor, rate * 0.3 / machine.axes[0].ratio);
        let torque = 0.01 * rate * rate + 5e-3 + 1e-6 * speed;
        let voltage =
            motor.resistance * torque / motor.torque_constant + motor.torque_constant * speed;
        assert!(rate > 1.0 && rate < 2.0);
        assert!((voltage - 0.9 * motor.voltage).abs() < 1e-9, "{voltage} V at rate {rate}");
    }
}
