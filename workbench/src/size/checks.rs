//! What an axis uses of a motor and its gear, limit by limit.

use super::candidate::Candidate;
use super::need::AxisNeed;
use super::{Options, parts, thermal};
use crate::catalogue::Catalogue;
use crate::operating::{AxisCourse, OperatingPoint};
use core::f64::consts::TAU;
use machine::{DcMotor, JointUnit, Motor, StepperMotor};
use messages::time::SETPOINT_TIME;
use schemars::JsonSchema;
use serde::Serialize;

/// What stands for a use that has no end.
const ENDLESS: f64 = 1e6;

/// Load inertia over the rotor's beyond which a gear is not made for it. Source 003 eq. 5.17.
const LARGEST_INERTIA_RATIO: f64 = 10.0;

/// What of a motor's largest speed an axis may use where the machine file sets no limit.
pub const SPEED_SHARE: f64 = 0.9;

/// Counts of a position that the tolerance of the path must hold.
const COUNTS: f64 = 2.0;

/// What is used of one limit.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Use {
    /// What is limited.
    pub check: &'static str,
    /// The need with what is kept in hand, as a share of the limit: up to 1 it holds.
    #[serde(rename = "use")]
    pub share: f64,
    /// The need, without what is kept in hand.
    pub value: f64,
    /// The limit.
    pub limit: f64,
    /// What both are measured in.
    pub unit: &'static str,
    /// When the need is largest [s]; null where it is of the whole job.
    pub at: Option<f64>,
}

impl Use {
    pub(super) fn new(
        check: &'static str,
        (value, at): (f64, Option<f64>),
        limit: f64,
        unit: &'static str,
        margin: f64,
    ) -> Self {
        let share = value * margin / limit;
        let share = if share.is_finite() { share.min(ENDLESS) } else { ENDLESS };
        Self { check, share, value, limit, unit, at }
    }

    /// Whether the limit is held.
    pub fn holds(&self) -> bool {
        self.share <= 1.0
    }
}

/// The largest share of `uses`.
pub fn worst(uses: &[Use]) -> Option<&Use> {
    uses.iter().max_by(|one, other| one.share.total_cmp(&other.share))
}

/// The largest of `value` over `points`, and when.
fn peak(points: &[OperatingPoint], value: impl Fn(&OperatingPoint) -> f64) -> (f64, Option<f64>) {
    points.iter().fold((0.0, None), |most, point| {
        let here = value(point).abs();
        if here > most.0 { (here, Some(point.time)) } else { most }
    })
}

/// The root mean square of `values`.
pub(super) fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    (values.map(|value| value * value).sum::<f64>() / count).sqrt()
}

/// What `candidate` uses on the axis of `need`, whose job it does as `course`.
pub fn uses(
    candidate: &Candidate,
    need: &AxisNeed,
    course: &AxisCourse,
    catalogue: &Catalogue,
    options: &Options,
) -> Vec<Use> {
    let points = &course.points;
    let mut uses = vec![speed(candidate, need, options.margin)];
    match &candidate.motor {
        Motor::Dc(motor) => dc(candidate, motor, points, options, &mut uses),
        Motor::Stepper(motor) => stepper(motor, points, options.margin, &mut uses),
    }
    let ratio = candidate.inertia_ratio(need);
    if candidate.motor.stepper().is_none_or(|motor| !motor.is_planar()) {
        let found = (ratio, None);
        uses.push(Use::new("inertia", found, LARGEST_INERTIA_RATIO, "1", 1.0));
    }
    uses.push(resolution(candidate, need));
    parts::output(candidate, need, ratio, options.margin, &mut uses);
    let is_named = |axis: &str| axis == need.axis;
    if let Some(screw) = catalogue.screws.iter().find(|screw| is_named(&screw.axis)) {
        uses.push(parts::whip(screw, need, options.margin));
    }
    if let Some(belt) = catalogue.belts.iter().find(|belt| is_named(&belt.axis)) {
        parts::strands(belt, need, options.margin, &mut uses);
    }
    uses
}

/// The speed of the motor against what it reaches and what motor and gear allow, whichever it uses more of.
pub fn speed(candidate: &Candidate, need: &AxisNeed, margin: f64) -> Use {
    let found = need.points.iter().fold((0.0, None), |worst, point| {
        let speed = (point.speed / candidate.ratio).abs();
        if speed > worst.0 { (speed, Some(point.time)) } else { worst }
    });
    let most = candidate.motor.largest_speed();
    let reached = Use::new("speed", found, SPEED_SHARE * most, "rad/s", 1.0);
    // A stepper's torque and pulse rate say what it has in hand.
    let without_load = candidate.motor.dc().map(|motor| motor.no_load_speed());
    let limits = [without_load, candidate.max_speed];
    let others = limits.into_iter().flatten();
    others
        .map(|limit| Use::new("speed", found, limit, "rad/s", margin))
        .fold(reached, |worst, other| if other.share > worst.share { other } else { worst })
}

/// Torque, voltage, heating and temperature of a DC motor: each for friction as the machine file has it, and
/// for the efficiency in its place, whichever asks more.
fn dc(
    candidate: &Candidate,
    motor: &DcMotor,
    points: &[OperatingPoint],
    options: &Options,
    uses: &mut Vec<Use>,
) {
    let margin = options.margin;
    let ways: [Vec<f64>; 2] = [
        points.iter().map(|point| point.torque() / motor.torque_constant).collect(),
        points.iter().map(|point| point.by_efficiency / motor.torque_constant).collect(),
    ];
    let squares = ways.each_ref().map(|currents| {
        let square = rms(currents.iter().copied());
        square * square
    });
    let worse = usize::from(squares[1] > squares[0]);
    let with_margin = squares[worse] * margin * margin;
    let settled = candidate
        .thermal
        .as_ref()
        .map(|thermal| thermal::steady(thermal, with_margin, motor.resistance, options.ambient));
    // Where it has no end the temperature says so; the voltage is then that of a warm winding.
    let warm = match settled {
        Some(Some(settled)) => settled.min(HOT),
        _ => thermal::COLD,
    };
    let resistance = motor.resistance * (1.0 + thermal::COPPER * (warm - thermal::COLD));
    let winding = DcMotor { resistance, ..*motor };
    let torque = peak(points, |point| point.torque().abs().max(point.by_efficiency.abs()));
    uses.push(Use::new("torque", torque, motor.largest_torque(), "N·m", margin));
    uses.push(voltage(&winding, points, &ways, margin));
    if let Some(continuous) = motor.continuous_current {
        let current = squares[worse].sqrt();
        uses.push(Use::new("heating", (current, None), continuous, "A", margin));
        let limit = motor.heating_limit().map_or(continuous, |limit| limit.plan);
        uses.push(Use::new("heating_5s", hottest(&ways, points), limit, "A", margin));
    }
    if let (Some(settled), Some(thermal)) = (settled, &candidate.thermal)
        && let Some(most) = thermal.max_winding
    {
        // What is kept in hand is in the current already.
        let found = (settled.unwrap_or(ENDLESS) - options.ambient, None);
        uses.push(Use::new("temperature", found, most - options.ambient, "K", 1.0));
    }
}

/// A winding warmer than this is lost anyway [°C].
const HOT: f64 = 250.0;

fn voltage(motor: &DcMotor, points: &[OperatingPoint], ways: &[Vec<f64>; 2], margin: f64) -> Use {
    let mut most = (0.0, None);
    for currents in ways {
        for (index, point) in points.iter().enumerate() {
            let now = currents[index];
            let before = currents[index.saturating_sub(1)];
            let rate = (now - before) / SETPOINT_TIME;
            let voltage = motor.voltage((now + before) / 2.0, rate, point.speed).abs();
            if voltage > most.0 {
                most = (voltage, Some(point.time));
            }
        }
    }
    Use::new("voltage", most, motor.voltage_limit().plan, "V", margin)
}

/// The largest of what supervision averages over some seconds [A], and when.
fn hottest(ways: &[Vec<f64>; 2], points: &[OperatingPoint]) -> (f64, Option<f64>) {
    let mut most = (0.0, None);
    for currents in ways {
        let mut heat = 0.0;
        for (current, point) in currents.iter().zip(points) {
            heat = DcMotor::heated(heat, *current, SETPOINT_TIME, DcMotor::HEATING_TIME);
            if heat > most.0 {
                most = (heat, Some(point.time));
            }
        }
    }
    (most.0.sqrt(), most.1)
}

fn stepper(motor: &StepperMotor, points: &[OperatingPoint], margin: f64, uses: &mut Vec<Use>) {
    let mut most = Use::new("torque", (0.0, None), motor.torque_limit(0.0), "N·m", margin);
    for point in points {
        let torque = point.torque().abs().max(point.by_efficiency.abs());
        let limit = motor.torque_limit(point.speed);
        let here = Use::new("torque", (torque, Some(point.time)), limit, "N·m", margin);
        if here.share > most.share {
            most = here;
        }
    }
    uses.push(most);
    let (speed, at) = peak(points, |point| point.speed);
    let rate = (speed * motor.pulses_per_radian(), at);
    uses.push(Use::new("pulse_rate", rate, motor.pulse_rate, "1/s", 1.0));
}

/// A count of the position at the joint: no coarser than half the path's tolerance, or than it is now.
fn resolution(candidate: &Candidate, need: &AxisNeed) -> Use {
    let counts = match &candidate.motor {
        Motor::Stepper(motor) => motor.pulses_per_turn(),
        Motor::Dc(_) => need.actuator.encoder.counts,
    };
    let now = need.actuator.encoder.resolution() * need.actuator.ratio;
    let limit = now.max(need.tolerance / COUNTS);
    let unit = match need.unit {
        JointUnit::Length => "m",
        JointUnit::Angle => "rad",
    };
    // Rounding of a ratio that is the present one.
    const ROUNDING: f64 = 1.0 - 1e-9;
    let found = (TAU / counts * candidate.ratio, None);
    Use::new("resolution", found, limit, unit, ROUNDING)
}
