//! What a motor can give, as rows of the time law.
//!
//! With the joints at `q(u)`, the torque at a motor's shaft is linear in ü and u̇²:
//!
//! ```text
//! q̈ = q′·ü + q″·u̇²        τ = (J_r/r + r·M)·q̈ + r·c·u̇² + r·g ± friction
//! ```
//!
//! and a DC motor's voltage `R·i + L·i′ + k·ω` with `i = τ/k` adds the third order, in which the mass
//! matrix is taken to be constant. What that leaves out, the check of the samples finds.

use machine::{Actuator, DcMotor, Motor, StepperMotor};

use crate::law::row::Row;
use crate::limits::limit_id::LimitId;
use crate::limits::tightening::AxisShares;

/// Where on a stepper's curve of torque over speed its tangent is taken, as a share of the speed that
/// everything else leaves: torque falls ever more slowly, so a tangent lies below it.
const TANGENT: f64 = 0.8;

/// What one actuator does along a path, by derivatives of its parameter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AxisMotion {
    /// q′ of its joint, with its sign.
    pub(crate) velocity: f64,
    /// Torque at the shaft per ü, per u̇² and, for the third order, the weights of u̇·ü′, u̇·ü and
    /// u̇·u̇² [N·m].
    pub(crate) inertia: f64,
    pub(crate) turning: f64,
    pub(crate) rate: [f64; 3],
    /// Torque that holds the load [N·m].
    pub(crate) gravity: f64,
}

/// A motor that cannot hold its load at rest: its torque [N·m] and what it would need.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Overload {
    pub(crate) needed: f64,
    pub(crate) limit: f64,
}

/// Friction at the shaft while the path is followed: with the motion, and per unit of u̇.
fn friction(actuator: &Actuator, motion: &AxisMotion) -> [f64; 2] {
    let turns = motion.velocity / actuator.ratio;
    let side = if turns == 0.0 { 0.0 } else { turns.signum() };
    [actuator.friction.coulomb * side, actuator.friction.viscous * turns]
}

/// Appends the rows of the motor of `actuator`, which drives the `index`th axis, and gives the largest u̇ that it has
/// [m/s]. `speed` is what everything else leaves.
pub(crate) fn motor_rows(
    actuator: &Actuator,
    index: usize,
    motion: &AxisMotion,
    shares: &AxisShares,
    speed: f64,
    rows: &mut Vec<Row>,
) -> Result<f64, Overload> {
    let torque = LimitId::torque(index).0;
    match &actuator.motor {
        Motor::Dc(motor) => {
            let most = motor.current_limit().plan * motor.torque_constant;
            torque_rows(actuator, motion, [most, 0.0], shares.torque, torque, rows)?;
            voltage_rows(actuator, motor, motion, shares, LimitId::voltage(index).0, rows);
            Ok(f64::INFINITY)
        }
        Motor::Stepper(motor) => {
            let turns = (motion.velocity / actuator.ratio).abs();
            let most = shares.velocity * motor.pulse_rate / (motor.pulses_per_radian() * turns);
            let line = tangent(motor, turns, TANGENT * speed.min(most));
            torque_rows(actuator, motion, line, shares.torque, torque, rows)?;
            Ok(most)
        }
    }
}

/// The line below a stepper's torque: its value at rest [N·m] and its slope by u̇, where u̇ turns the
/// shaft `turns` times as fast [rad/m].
fn tangent(motor: &StepperMotor, turns: f64, speed: f64) -> [f64; 2] {
    /// How far apart the two points are, as a share of the speed.
    const APART: f64 = 1e-3;
    let speed = if speed.is_finite() { speed } else { motor.largest_speed() / turns.max(1e-9) };
    let torque = |speed: f64| motor.torque_limit(turns * speed);
    let here = torque(speed);
    let slope = (here - torque(speed * (1.0 - APART))) / (speed * APART);
    let slope = if slope.is_finite() { slope.min(0.0) } else { 0.0 };
    let rest = (here - slope * speed).min(motor.torque_limit(0.0));
    [rest, (here - rest) / speed.max(f64::MIN_POSITIVE)]
}

/// τ within ±`share`·(`most[0]` + `most[1]`·u̇). Where that is less than the load needs at rest, a tenth of the
/// torque beyond the load is left: enough for slow motion.
fn torque_rows(
    actuator: &Actuator,
    motion: &AxisMotion,
    most: [f64; 2],
    share: f64,
    limit: u16,
    rows: &mut Vec<Row>,
) -> Result<(), Overload> {
    /// Part of what is left beside the load.
    const LEAST: f64 = 0.1;
    let [coulomb, viscous] = friction(actuator, motion);
    for sign in [1.0, -1.0] {
        let held = sign * (motion.gravity + coulomb);
        if most[0] <= held {
            return Err(Overload { needed: held, limit: most[0] });
        }
        let top = (share * most[0] - held).max(LEAST * share * (most[0] - held));
        rows.push(Row {
            base: [0.0, sign * motion.inertia, sign * motion.turning],
            by_speed: [0.0; 3],
            top,
            // Friction that helps to brake is not counted on.
            top_by_speed: (share * most[1] - sign * viscous).min(share * most[1]).min(0.0),
            limit,
        });
    }
    Ok(())
}

fn voltage_rows(
    actuator: &Actuator,
    motor: &DcMotor,
    motion: &AxisMotion,
    shares: &AxisShares,
    limit: u16,
    rows: &mut Vec<Row>,
) {
    let [coulomb, viscous] = friction(actuator, motion);
    let by_torque = motor.resistance / motor.torque_constant;
    let by_rate = motor.inductance / motor.torque_constant;
    let most = shares.voltage * motor.voltage_limit().plan;
    let back = motor.torque_constant * motion.velocity / actuator.ratio + by_torque * viscous;
    for sign in [1.0, -1.0] {
        rows.push(Row {
            base: [0.0, sign * by_torque * motion.inertia, sign * by_torque * motion.turning],
            by_speed: motion.rate.map(|weight| sign * by_rate * weight),
            top: most - sign * by_torque * (motion.gravity + coulomb),
            top_by_speed: (-sign * back).min(0.0),
            limit,
        });
    }
}
