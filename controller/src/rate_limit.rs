//! The largest rate at which a setpoint keeps every limit.
//!
//! At rate `r` velocity goes with `r`, acceleration and its torque with `r²`, jerk with `r³`, and
//! laser power with `r`. While the rate changes, `v·ṙ` comes to the acceleration and
//! `3·a·r·ṙ + v·r̈` to the jerk; room is left for both. As planned is always allowed: the planner's
//! checker vouches for rate 1.

use crate::ramp::{AVERAGING, LARGEST_RATE, OVERRIDE_CHANGE};
use machine::{Axis, DcMotor, Machine, Motor};
use messages::Setpoint;

/// Share of the supply that a rate may use up; the rest is left to the winding's inductance and
/// to the feedback loops.
const VOLTAGE_SHARE: f64 = 0.9;

/// Share of the power stage's current that a rate may use up.
const CURRENT_SHARE: f64 = 0.9;

/// Edges in a setpoint beyond which it is not played faster: two cycles' worth, with a change of
/// power at the start of each setpoint, must fit into one.
const MOST_EDGES: u32 = 5;

/// Newton steps from [`LARGEST_RATE`] down to a root that is at least 1: the error squares with each.
const NEWTON_STEPS: usize = 7;

/// The limits that a rate must keep. It is asked for every setpoint, so they stand as reciprocals.
#[derive(Debug, Clone)]
pub struct RateLimit {
    per_marking_speed: f64,
    per_moving_speed: f64,
    per_acceleration: f64,
    per_jerk: f64,
    axes: Vec<AxisRate>,
}

/// One axis: reciprocal limits of its joint, and the two lines that bound its motor's torque.
#[derive(Debug, Clone, Copy)]
struct AxisRate {
    per_velocity: f64,
    per_acceleration: f64,
    per_jerk: f64,
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
            per_marking_speed: 1.0 / path.speed,
            per_moving_speed: 1.0 / path.speed.max(path.rapid),
            per_acceleration: 1.0 / path.acceleration,
            per_jerk: 1.0 / path.jerk,
            axes: machine.axes.iter().map(AxisRate::new).collect(),
        }
    }

    /// The largest rate for `setpoint`, 1..=[`LARGEST_RATE`].
    pub fn of(&self, setpoint: &Setpoint) -> f64 {
        let lit = setpoint.laser.is_lit();
        let path_velocity = setpoint.path_velocity;
        let mut velocity =
            path_velocity * if lit { self.per_marking_speed } else { self.per_moving_speed };
        let mut acceleration = setpoint.path_acceleration * self.per_acceleration;
        let mut jerk = setpoint.path_jerk * self.per_jerk;
        // What a change of the rate adds, in shares of the limits, per ṙ and r̈.
        let mut pull = path_velocity * self.per_acceleration;
        let (mut twist, mut jolt) =
            (setpoint.path_acceleration * self.per_jerk, path_velocity * self.per_jerk);
        let mut rate = LARGEST_RATE;
        let joints = setpoint.velocity.iter().zip(&setpoint.acceleration).zip(&setpoint.jerk);
        let efforts = setpoint.effort.iter().zip(&setpoint.static_effort).zip(&setpoint.momentum);
        for ((axis, ((speed, joint_acceleration), joint_jerk)), ((effort, standing), momentum)) in
            self.axes.iter().zip(joints).zip(efforts)
        {
            let (speed, joint_acceleration) = (speed.abs(), joint_acceleration.abs());
            velocity = velocity.max(speed * axis.per_velocity);
            acceleration = acceleration.max(joint_acceleration * axis.per_acceleration);
            jerk = jerk.max(joint_jerk.abs() * axis.per_jerk);
            pull = pull.max(speed * axis.per_acceleration);
            twist = twist.max(joint_acceleration * axis.per_jerk);
            jolt = jolt.max(speed * axis.per_jerk);
            let constant = standing.abs() + momentum.abs() * OVERRIDE_CHANGE;
            rate = rate.min(axis.motor_rate(speed, (effort - standing).abs(), constant));
        }
        if lit {
            velocity = velocity.max(brightest(setpoint));
        }
        if setpoint.laser.edge_count > MOST_EDGES {
            rate = 1.0;
        }
        // Only above these shares does the largest rate break the limit.
        if velocity * LARGEST_RATE > 1.0 {
            rate = rate.min(1.0 / velocity);
        }
        rate = rate.min(largest_root(acceleration, 0.0, pull * OVERRIDE_CHANGE - 1.0));
        let constant = jolt * OVERRIDE_CHANGE / AVERAGING - 1.0;
        rate.min(largest_cubic_root(jerk, 3.0 * twist * OVERRIDE_CHANGE, constant)).max(1.0)
    }
}

impl AxisRate {
    fn new(axis: &Axis) -> Self {
        let velocity = axis.velocity_limit().plan;
        let (velocity, [by_current, by_voltage, back_emf]) = match &axis.motor {
            Motor::Dc(motor) => (velocity, lines_of_dc(motor, axis.ratio)),
            Motor::Stepper(motor) => {
                let fastest = velocity.min(motor.largest_speed() * axis.ratio);
                // What it still gives at its fastest it gives at every speed below.
                let torque = motor.pull_out_torque(fastest / axis.ratio) * CURRENT_SHARE;
                (fastest, [torque, torque, 0.0])
            }
        };
        Self {
            per_velocity: 1.0 / velocity,
            per_acceleration: 1.0 / axis.acceleration_limit().plan,
            per_jerk: 1.0 / axis.jerk_limit().plan,
            viscous: axis.friction.viscous / axis.ratio,
            coulomb: axis.friction.coulomb,
            by_current,
            by_voltage,
            back_emf,
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

/// Torque that the current gives, that the voltage gives at standstill, and what each unit of joint
/// speed takes from that.
fn lines_of_dc(motor: &DcMotor, ratio: f64) -> [f64; 3] {
    let settled =
        |voltage: f64, speed: f64| motor.torque_constant * motor.settled_current(voltage, speed);
    [
        motor.largest_torque() * CURRENT_SHARE,
        settled(motor.voltage * VOLTAGE_SHARE, 0.0),
        // The torque falls evenly with the speed.
        -settled(0.0, 1.0 / ratio),
    ]
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

/// The largest `r` in 1..=[`LARGEST_RATE`] with `a·r³ + b·r + c ≤ 0`, for `a, b ≥ 0`; 1 or less
/// without.
fn largest_cubic_root(a: f64, b: f64, c: f64) -> f64 {
    let value = |r: f64| (a * r * r + b) * r + c;
    let mut rate = LARGEST_RATE;
    if value(rate) <= 0.0 {
        return rate;
    }
    // Convex and rising: from above, Newton's method comes down to the root and not beyond.
    for _ in 0..NEWTON_STEPS {
        rate -= value(rate) / (3.0 * a * rate * rate + b);
        if rate < 1.0 {
            break;
        }
    }
    rate
}

/// The highest power in the cycle that starts at `setpoint`.
fn brightest(setpoint: &Setpoint) -> f64 {
    let laser = &setpoint.laser;
    laser.edges().iter().map(|edge| edge.power).fold(laser.power, f64::max)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
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
        let motor = machine.axes[0].motor.dc().unwrap();
        let speed = rate * 0.3 / machine.axes[0].ratio;
        let torque = 0.01 * rate * rate + 5e-3 + 1e-6 * speed;
        let voltage = motor.voltage(torque / motor.torque_constant, 0.0, speed);
        assert!(rate > 1.0 && rate < 2.0);
        assert!((voltage - 0.9 * motor.voltage).abs() < 1e-9, "{voltage} V at rate {rate}");
    }
}
