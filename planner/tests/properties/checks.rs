//! What every plan must keep, seen from its setpoints alone: nothing here believes what a setpoint says
//! of its own derivatives.

use machine::{Actuator, Axis, DcMotor, Machine, Motor, StepperMotor};
use messages::Setpoint;
use messages::setpoint::flags;
use messages::time::{SETPOINT_PERIOD, SETPOINT_TIME};
use nalgebra::{DVector, Vector3};
use planner::drawing::{Action, Step};
use planner::verify::checker::Quantity;
use planner::{Job, PlanError};

/// What a limit may be exceeded by.
const ALLOWANCE: f64 = 1.01;

/// Rounding of a position [m or rad].
const ROUNDING: f64 = 2e-9;

/// The longest light at rest that an edge between two nanoseconds may leave [ns].
const GLIMMER: i64 = 2;

/// What rounding makes of the speed of a tool that stands [m/s].
const STANDING: f64 = 1e-9;

/// Speed below which a shaft stands and its friction takes no side [rad/s].
const STANDING_SHAFT: f64 = 1e-6;

type Found = Result<(), String>;

/// Whether a job was refused for a cause that no other speed mends.
pub fn is_sound(error: &PlanError) -> bool {
    match error {
        PlanError::Limit { violation, .. } => {
            matches!(violation.quantity, Quantity::ToolPosition(_) | Quantity::JointPosition)
        }
        PlanError::Unreachable { cause, .. } => cause.code != "no_time_law",
        _ => true,
    }
}

/// Holds the setpoints of a plan of `job` to everything that can be seen in them.
pub fn keeps_everything(setpoints: &[Setpoint], job: &Job, machine: &Machine) -> Found {
    setpoints.iter().try_for_each(is_finite)?;
    setpoints.iter().try_for_each(|setpoint| is_inside(setpoint, machine))?;
    keeps_tool_limits(setpoints, machine)?;
    for (index, axis) in machine.axes.iter().enumerate() {
        keeps_axis_limits(setpoints, index, axis)?;
    }
    for (index, actuator) in machine.actuators.iter().enumerate() {
        keeps_motor_limits(setpoints, index, actuator)?;
    }
    keeps_dark(setpoints, job, machine)
}

fn is_finite(setpoint: &Setpoint) -> Found {
    let own = [setpoint.path_velocity, setpoint.path_acceleration, setpoint.path_jerk];
    let joints = [setpoint.position, setpoint.velocity, setpoint.acceleration, setpoint.jerk];
    let motors = [
        setpoint.lead,
        setpoint.static_lead,
        setpoint.lead_momentum,
        setpoint.effort,
        setpoint.static_effort,
        setpoint.momentum,
    ];
    let powers = setpoint.laser.edges().iter().map(|edge| edge.power);
    let mut all = own
        .into_iter()
        .chain(setpoint.tool)
        .chain(joints.into_iter().flatten())
        .chain(motors.into_iter().flatten())
        .chain(powers)
        .chain([setpoint.laser.power]);
    if all.all(f64::is_finite) && setpoint.laser.is_valid(SETPOINT_PERIOD) {
        return Ok(());
    }
    Err(format!("no number, or no sound laser: {setpoint:?}"))
}

fn is_inside(setpoint: &Setpoint, machine: &Machine) -> Found {
    let (tool, area) = (setpoint.tool, &machine.area);
    let near =
        |value: f64, [low, high]: [f64; 2]| low - ROUNDING <= value && value <= high + ROUNDING;
    let inside = (0..3).all(|axis| near(tool[axis], [area.lower[axis], area.upper[axis]]));
    let within = machine
        .axes
        .iter()
        .enumerate()
        .all(|(index, axis)| near(setpoint.position[index], axis.limits.position));
    if inside && within {
        return Ok(());
    }
    Err(format!("setpoint {} is outside: {tool:?} {:?}", setpoint.sequence, setpoint.position))
}

/// First, second and third differences over time, by the sample that each begins at.
fn differences(places: &[DVector<f64>]) -> [Vec<DVector<f64>>; 3] {
    let step = |values: &[DVector<f64>]| -> Vec<DVector<f64>> {
        values.windows(2).map(|pair| (&pair[1] - &pair[0]) / SETPOINT_TIME).collect()
    };
    let first = step(places);
    let second = step(&first);
    let third = step(&second);
    [first, second, third]
}

fn keeps(differences: &[DVector<f64>], limit: f64, noise: f64, what: &str) -> Found {
    for (index, value) in differences.iter().enumerate() {
        let value = value.norm();
        // Put this way what is no number breaks the limit.
        if value.is_nan() || value > limit * ALLOWANCE + noise {
            return Err(format!("{what} of {value} beyond {limit} at setpoint {index}"));
        }
    }
    Ok(())
}

/// What rounding makes of the differences of places at most `far` from 0.
fn noise(far: f64) -> [f64; 3] {
    let rounding = 4.0 * f64::EPSILON * far.max(1e-3);
    let rate = 2.0 / SETPOINT_TIME;
    [rounding * rate, rounding * rate * rate, rounding * rate * rate * rate]
}

fn keeps_tool_limits(setpoints: &[Setpoint], machine: &Machine) -> Found {
    let places: Vec<_> =
        setpoints.iter().map(|setpoint| DVector::from_row_slice(&setpoint.tool)).collect();
    let far = places.iter().map(|place| place.norm()).fold(0.0, f64::max);
    let noise = noise(far);
    let [first, second, third] = differences(&places);
    let path = &machine.path;
    keeps(&first, path.rapid.max(path.speed), noise[0], "speed of the tool")?;
    for (speed, setpoint) in first.iter().zip(setpoints) {
        let lit = setpoint.laser.gate != 0 && setpoint.laser.edges().iter().all(|e| e.gate != 0);
        if lit && speed.norm() > path.speed * ALLOWANCE + noise[0] {
            return Err(format!("lit at {} m/s at setpoint {}", speed.norm(), setpoint.sequence));
        }
    }
    keeps(&second, path.acceleration, noise[1], "acceleration of the tool")?;
    keeps(&third, path.jerk, noise[2], "jerk of the tool")
}

fn keeps_axis_limits(setpoints: &[Setpoint], index: usize, axis: &Axis) -> Found {
    let places: Vec<_> = setpoints
        .iter()
        .map(|setpoint| DVector::from_element(1, setpoint.position[index]))
        .collect();
    let far = places.iter().map(|place| place.norm()).fold(0.0, f64::max);
    let noise = noise(far);
    let [first, second, third] = differences(&places);
    let name = |what: &str| format!("{what} of axis {}", axis.name);
    keeps(&first, axis.limits.velocity, noise[0], &name("velocity"))?;
    keeps(&second, axis.limits.acceleration, noise[1], &name("acceleration"))?;
    keeps(&third, axis.limits.jerk, noise[2], &name("jerk"))
}

/// What a motor's shaft does in the cycle before a setpoint: its mean speed [rad/s], and its torque at
/// the end of it [N·m].
#[derive(Clone, Copy)]
struct Shaft {
    speed: f64,
    torque: f64,
}

/// Torque is the effort and the friction of a shaft that turns; the spring of the transmission makes
/// the motor turn otherwise than the joint.
fn shafts(setpoints: &[Setpoint], index: usize, actuator: &Actuator) -> Vec<Shaft> {
    let Actuator { axis, ratio, friction, .. } = *actuator;
    let angle = |setpoint: &Setpoint| (setpoint.position[axis] + setpoint.lead[index]) / ratio;
    let turns = setpoints.windows(2).map(|pair| {
        let speed = (angle(&pair[1]) - angle(&pair[0])) / SETPOINT_TIME;
        let stands = speed.abs() < STANDING_SHAFT;
        let coulomb = if stands { 0.0 } else { friction.coulomb.copysign(speed) };
        let torque = pair[1].effort[index] + coulomb + friction.viscous * speed;
        Shaft { speed, torque }
    });
    turns.collect()
}

fn keeps_motor_limits(setpoints: &[Setpoint], index: usize, actuator: &Actuator) -> Found {
    let shafts = shafts(setpoints, index, actuator);
    match &actuator.motor {
        Motor::Dc(motor) => keeps_dc_limits(&shafts, motor),
        Motor::Stepper(motor) => keeps_stepper_limits(&shafts, motor),
    }
    .map_err(|found| format!("axis {}: {found}", actuator.name))
}

/// i = τ/k and R·i + L·i′ + k·ω, within what the machine leaves a plan of the power stage.
fn keeps_dc_limits(shafts: &[Shaft], motor: &DcMotor) -> Found {
    let constant = motor.torque_constant;
    let mut before = shafts.first().map_or(0.0, |shaft| shaft.torque / constant);
    for (cycle, shaft) in shafts.iter().enumerate() {
        let current = shaft.torque / constant;
        let voltage = motor.resistance * (current + before) / 2.0
            + motor.inductance * (current - before) / SETPOINT_TIME
            + constant * shaft.speed;
        let (most_current, most_voltage) = (motor.current_limit().plan, motor.voltage_limit().plan);
        if current.abs() > most_current * ALLOWANCE || voltage.abs() > most_voltage * ALLOWANCE {
            return Err(format!(
                "{current} A of {most_current} A, {voltage} V of {most_voltage} V in cycle {cycle}"
            ));
        }
        before = current;
    }
    Ok(())
}

/// The torque over the speed, by the curve of the machine, and the pulses.
fn keeps_stepper_limits(shafts: &[Shaft], motor: &StepperMotor) -> Found {
    for (cycle, Shaft { speed, torque }) in shafts.iter().enumerate() {
        let most = motor.pull_out_torque(*speed);
        let pulses = speed.abs() * motor.pulses_per_turn() / core::f64::consts::TAU;
        if torque.abs() > most * ALLOWANCE || pulses > motor.pulse_rate * ALLOWANCE {
            return Err(format!(
                "{torque} N·m of {most} N·m, {pulses} pulses a second of {} in cycle {cycle}",
                motor.pulse_rate
            ));
        }
    }
    Ok(())
}

/// Time [ns] in which the gate is open in a cycle.
fn open_time(setpoint: &Setpoint) -> i64 {
    let mut open = 0;
    let mut now = (0, setpoint.laser.gate);
    for edge in setpoint.laser.edges() {
        let offset = i64::from(edge.offset);
        open += if now.1 != 0 { offset - now.0 } else { 0 };
        now = (offset, edge.gate);
    }
    open + if now.1 != 0 { SETPOINT_PERIOD.0 - now.0 } else { 0 }
}

fn keeps_dark(setpoints: &[Setpoint], job: &Job, machine: &Machine) -> Found {
    let Some((first, last)) = setpoints.first().zip(setpoints.last()) else {
        return Err("a plan without setpoints".to_owned());
    };
    for (name, setpoint) in [("first", first), ("last", last)] {
        if setpoint.laser.is_lit() || setpoint.path_velocity > STANDING {
            let Setpoint { path_velocity, laser, .. } = setpoint;
            return Err(format!("{name} setpoint at {path_velocity:e} m/s with {laser:?}"));
        }
    }
    let ends = setpoints.iter().filter(|setpoint| setpoint.has(flags::LAST)).count();
    if ends != 1 || !last.has(flags::LAST) {
        return Err(format!("{ends} setpoints say that they are the last"));
    }
    let is_dot = |step: &Step| matches!(step.action, Action::Dwell { lit: Some(_), .. });
    // A dot is light at rest.
    if job.drawing.steps.iter().any(is_dot) {
        return Ok(());
    }
    // The gate opens ahead of the light, and light ends after it is shut.
    let ahead = (machine.laser.on_delay * 1e9).ceil() as i64 + GLIMMER;
    for pair in setpoints.windows(2) {
        let way = (Vector3::from(pair[1].tool) - Vector3::from(pair[0].tool)).norm();
        let rests = way == 0.0 && pair[0].path_velocity == 0.0 && pair[1].path_velocity == 0.0;
        if rests && open_time(&pair[0]) > ahead {
            return Err(format!("open gate at rest at setpoint {}", pair[0].sequence));
        }
    }
    Ok(())
}

/// Holds the lit way of a plan to the length of the drawing's marks, of which each corner may cut some.
pub fn marks_all(setpoints: &[Setpoint], job: &Job, machine: &Machine) -> Found {
    let mut drawn = 0.0;
    let mut cut = 0.0;
    let mut tolerance = machine.path.tolerance;
    for step in &job.drawing.steps {
        match &step.action {
            Action::Mark { curve, .. } => {
                const PARTS: u32 = 200;
                let point = |part: u32| curve.point(f64::from(part) / f64::from(PARTS));
                drawn += (0..PARTS).map(|part| (point(part + 1) - point(part)).norm()).sum::<f64>();
                cut += 12.0 * tolerance;
            }
            Action::Corners(planner::drawing::Corners::Blend(Some(own))) => {
                tolerance = tolerance.max(*own);
            }
            _ => {}
        }
    }
    let mut lit = 0.0;
    let mut edges = 0.0;
    for pair in setpoints.windows(2) {
        let way = (Vector3::from(pair[1].tool) - Vector3::from(pair[0].tool)).norm();
        lit += way * open_time(&pair[0]) as f64 / SETPOINT_PERIOD.0 as f64;
        // The speed within a cycle is not even, and the gate leads the light.
        let changes = open_time(&pair[0]) % SETPOINT_PERIOD.0 != 0;
        edges += if changes { way } else { 0.0 };
    }
    let delays = machine.laser.on_delay.max(machine.laser.off_delay);
    let slack = 0.01 * drawn + cut + edges + 1e-6 + delays / SETPOINT_TIME * 2.0 * edges;
    if (lit - drawn).abs() <= slack {
        return Ok(());
    }
    Err(format!("{lit} m are lit of {drawn} m drawn, {slack} m are allowed"))
}
