//! From the axes' tables to [`Axis`] and [`Actuator`]: ratios, what the loops move, and the motors' own
//! limits.

use super::loops::{DeadTimes, Driven, gains};
use super::motors::{counts, mode, motor};
use super::tables::{AxisActuatorTable, AxisTable, LimitsTable};
use crate::actuator::{Actuator, Friction, HoldingBrake, LoopGains};
use crate::axis::Axis;
use crate::document::{Diagnostics, Either, ProblemKind, Quantity, Range, Spanned};
use crate::limits::AxisLimits;
use crate::motor::Motor;
use crate::quantity::Kind;
use crate::transmission::gear::Efficiency;
use messages::Nanoseconds;
use messages::time::Period;

pub(super) use crate::axis::JointUnit;

/// Share of the motor's no-load speed that an axis may use where the file sets no limit: what is
/// left of the voltage there drives the current that friction takes.
const SPEED_SHARE: f64 = 0.9;

/// What the mechanism knows of an axis.
pub(super) struct Joint {
    /// The name that the axis must have.
    pub(super) name: &'static str,
    /// What it is measured in.
    pub(super) unit: JointUnit,
    /// Joint travel per radian of the gear's output [m/rad or rad/rad].
    pub(super) travel: f64,
    /// Load that the joint moves, the other joints at rest [kg or kg·m²].
    pub(super) load: f64,
    /// Inertia that turns stiffly with the gear's output [kg·m²].
    pub(super) stiff_inertia: f64,
    /// Range of the joint over the working area [m or rad], where it follows from the area.
    pub(super) range: Option<[f64; 2]>,
    /// The joint at home [m or rad].
    pub(super) home: f64,
    /// Joint speed per tool speed in the tool's least favourable direction.
    pub(super) worst_speed: f64,
}

impl JointUnit {
    /// The following error that stops the machine where the file names none.
    fn following_error(self) -> f64 {
        match self {
            Self::Length => 1e-3,
            Self::Angle => 1e-2,
        }
    }

    fn example_range(self) -> &'static str {
        match self {
            Self::Length => "[\"0 mm\", \"200 mm\"]",
            Self::Angle => "[\"-90 deg\", \"90 deg\"]",
        }
    }

    /// Refuses a `quantity` of `axis` that is of the other kind; whether it is of this one.
    pub(super) fn expect<K: Kind, R: Range>(
        self,
        quantity: &Quantity<K, R>,
        axis: &str,
        diagnostics: &mut Diagnostics,
    ) -> bool {
        if quantity.form == self as usize {
            return true;
        }
        let (moves, due) = match self {
            Self::Length => ("moves along a line", "a length, such as \"1 mm\""),
            Self::Angle => ("turns", "an angle, such as \"1 deg\""),
        };
        diagnostics.refuse(
            ProblemKind::WrongUnit,
            quantity.span,
            format!("axis `{axis}` {moves}: this unit does not fit"),
            Some(format!("write it with {due}")),
        );
        false
    }
}

/// One actuator of an axis as the file says it.
pub(super) struct Drive {
    /// Its name, `x` or `y.left`.
    pub(super) name: String,
    /// The key of its table under `axis`, `x` or `y.actuator.left`.
    pub(super) key: String,
    /// The table of its axis, with what is its own in it.
    pub(super) table: AxisTable,
    /// 1, or −1 where the motor is mounted the other way round.
    side: f64,
    /// How far beyond its place its home reference is [m or rad].
    square: f64,
}

/// The actuators that `table` gives to `joint`, at least one.
pub(super) fn drives(
    table: &AxisTable,
    joint: &Joint,
    diagnostics: &mut Diagnostics,
) -> Vec<Drive> {
    let alone = || Drive {
        name: joint.name.to_owned(),
        key: joint.name.to_owned(),
        table: table.clone(),
        side: 1.0,
        square: 0.0,
    };
    let Some(actuators) = &table.actuator else { return vec![alone()] };
    if actuators.entries.is_empty() {
        diagnostics.refuse(
            ProblemKind::MissingKey,
            actuators.span,
            format!("axis `{}` has a table of actuators, and none in it", joint.name),
            Some("name them, such as `actuator.left = {}`, or leave the table out".to_owned()),
        );
        return vec![alone()];
    }
    let drive = |(name, own): &(Spanned<String>, AxisActuatorTable)| {
        refuse_name(name, diagnostics);
        let square = own.square.as_ref().map_or(0.0, |square| {
            let fits = joint.unit.expect(square, joint.name, diagnostics);
            if fits { square.value } else { 0.0 }
        });
        Drive {
            name: format!("{}.{}", joint.name, name.value),
            key: format!("{}.actuator.{}", joint.name, name.value),
            table: table.with_own(own),
            side: if own.mirrored.value { -1.0 } else { 1.0 },
            square,
        }
    };
    actuators.entries.iter().map(drive).collect()
}

impl AxisTable {
    /// This as the actuator with the table `own` has it.
    pub fn with_own(&self, own: &AxisActuatorTable) -> Self {
        let AxisActuatorTable { gear, motor, friction, encoder, mode, loops, .. } = own.clone();
        let axis = self.clone();
        Self {
            gear: gear.unwrap_or(axis.gear),
            motor: motor.unwrap_or(axis.motor),
            friction: friction.unwrap_or(axis.friction),
            encoder: encoder.or(axis.encoder),
            mode: mode.or(axis.mode),
            loops: loops.or(axis.loops),
            ..axis
        }
    }
}

/// Refuses a name that could not be told from others in a list or in a table's heading.
fn refuse_name(name: &Spanned<String>, diagnostics: &mut Diagnostics) {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || letter == '_' || letter == '-';
    if name.value.is_empty() || !name.value.chars().all(is_plain) {
        diagnostics.contradict(
            name.span,
            format!("an actuator cannot be called `{}`", name.value),
            "use letters, digits, _ and - only, such as `left`",
        );
    }
}

/// The axis that `table` describes, moving `joint`, and its actuators, each with what is said of it in the
/// file, its loops in cycles of this `period`; their indices begin with those after the `before` that there are, of axes before the `index`th.
/// `None` where an actuator has no motor.
pub(super) fn axis(
    table: &AxisTable,
    joint: &Joint,
    [index, before]: [usize; 2],
    period: Period,
    diagnostics: &mut Diagnostics,
) -> Option<(Axis, Vec<(Drive, Actuator)>)> {
    let drives = drives(table, joint, diagnostics);
    let motors: Vec<Option<Motor>> =
        drives.iter().map(|drive| motor(drive, joint, diagnostics)).collect();
    let motors: Vec<Motor> = motors.into_iter().collect::<Option<_>>()?;
    let ratio = |drive: &Drive| drive.side * (joint.travel / drive.table.gear.value);
    let strength = |(drive, motor): (&Drive, &Motor)| motor.stall_torque() / ratio(drive).abs();
    let whole: f64 = drives.iter().zip(&motors).map(strength).sum();
    let mut actuators = Vec::with_capacity(drives.len());
    let mut fastest = f64::INFINITY;
    for (drive, motor) in drives.into_iter().zip(motors) {
        let ratio = ratio(&drive);
        let share = strength((&drive, &motor)) / whole;
        let inertia = motor.rotor_inertia() + ratio * ratio * (joint.load * share);
        let table = &drive.table;
        fastest = fastest.min(motor.largest_speed() * ratio.abs());
        let follows = mode(table, &motor, diagnostics);
        let actuator = Actuator {
            name: drive.name.clone(),
            axis: index,
            ratio,
            share,
            efficiency: Efficiency {
                dynamic: table.efficiency.value,
                at_start: table.static_efficiency.value,
            },
            motor,
            friction: Friction {
                coulomb: table.friction.coulomb.value,
                viscous: table.friction.viscous.value,
            },
            brake: HoldingBrake {
                torque: table.friction.brake.value,
                release: table.friction.brake_release.value,
            },
            encoder: counts(table, &motor, diagnostics)?,
            gains: match motor {
                Motor::Dc(dc) => {
                    let driven = Driven { motor: &dc, mode: follows, tells: true };
                    gains(table, &driven, inertia, DeadTimes::at_once(period), diagnostics)?
                }
                Motor::Stepper(_) => {
                    LoopGains { position: 0.0, velocity: 0.0, current: 0.0, inertia }
                }
            },
            mode: follows,
            latency: Nanoseconds(0),
            torque_delay: Nanoseconds(0),
            age: Nanoseconds(0),
            square: drive.square,
        };
        actuators.push((drive, actuator));
    }
    let axis = Axis {
        name: joint.name.to_owned(),
        unit: joint.unit,
        backlash: backlash(table, joint, actuators.len(), diagnostics),
        limits: limits(&table.limits, joint, fastest, actuators.len(), diagnostics),
        actuators: before..before + actuators.len(),
    };
    for (drive, actuator) in &actuators {
        refuse_crooked(drive, actuator, &axis, diagnostics);
    }
    Some((axis, actuators))
}

/// Refuses a home reference so far out of square that the machine would stop at once.
fn refuse_crooked(drive: &Drive, actuator: &Actuator, axis: &Axis, diagnostics: &mut Diagnostics) {
    let (limit, name) = (axis.limits.racking, axis.unit.name());
    let own = drive.table.actuator.iter().flat_map(|actuators| &actuators.entries);
    let span = own.filter(|(own, _)| actuator.name == format!("{}.{}", axis.name, own.value));
    let span = span.filter_map(|(_, own)| own.square.as_ref()).map(|square| square.span).next();
    if let Some(span) = span.filter(|_| actuator.square.abs() > limit / 2.0) {
        diagnostics.contradict(
            span,
            format!(
                "`square` is {} {name}, and actuators {limit} {name} apart stop the machine",
                actuator.square
            ),
            "square the references within half of `limits.racking`, or raise that",
        );
    }
}

fn backlash(
    table: &AxisTable,
    joint: &Joint,
    actuators: usize,
    diagnostics: &mut Diagnostics,
) -> f64 {
    let Some(backlash) = &table.backlash else { return 0.0 };
    joint.unit.expect(backlash, joint.name, diagnostics);
    if actuators > 1 && backlash.value > 0.0 {
        diagnostics.contradict(
            backlash.span,
            format!("axis `{}` has backlash and {actuators} actuators", joint.name),
            "leave the backlash out: it is known of an axis with one actuator only",
        );
    }
    backlash.value
}

fn limits(
    table: &LimitsTable,
    joint: &Joint,
    no_load: f64,
    actuators: usize,
    diagnostics: &mut Diagnostics,
) -> AxisLimits {
    let (unit, name) = (joint.unit, joint.name);
    let following_error = table.following_error.map_or(unit.following_error(), |declared| {
        unit.expect(&declared, name, diagnostics);
        declared.value
    });
    if let Some(limit) = &table.acceleration {
        unit.expect(limit, name, diagnostics);
    }
    if let Some(limit) = &table.jerk {
        unit.expect(limit, name, diagnostics);
    }
    let racking = table.racking.map_or(following_error, |declared| {
        unit.expect(&declared, name, diagnostics);
        if actuators < 2 {
            diagnostics.contradict(
                declared.span,
                format!("axis `{name}` has one actuator, which cannot rack"),
                "remove `racking`",
            );
        }
        declared.value
    });
    AxisLimits {
        position: position(table, joint, following_error, diagnostics),
        velocity: velocity(table, joint, no_load, diagnostics),
        acceleration: table.acceleration.map_or(f64::INFINITY, |limit| limit.value),
        jerk: table.jerk.map_or(f64::INFINITY, |limit| limit.value),
        following_error,
        racking,
    }
}

/// The soft limits of `joint` [m or rad]: as given, or the range that the area needs with `margin`
/// beyond it.
fn position(
    table: &LimitsTable,
    joint: &Joint,
    margin: f64,
    diagnostics: &mut Diagnostics,
) -> [f64; 2] {
    let unit = joint.unit;
    match (&table.position, joint.range) {
        (None, Some([lower, upper])) => [lower - margin, upper + margin],
        (None, None) => {
            diagnostics.refuse(
                ProblemKind::MissingKey,
                table.span,
                format!("the range of axis `{}` does not follow from the area", joint.name),
                Some(format!("add `position = {}` to the axis's `limits`", unit.example_range())),
            );
            [f64::NEG_INFINITY, f64::INFINITY]
        }
        (Some(Either::Word(word)), _) => {
            if unit == JointUnit::Length {
                diagnostics.contradict(
                    word.span,
                    format!("axis `{}` moves along a line, which ends somewhere", joint.name),
                    "write [from, to]",
                );
            }
            [f64::NEG_INFINITY, f64::INFINITY]
        }
        (Some(Either::Value([lower, upper])), _) => {
            let fits = [lower, upper].map(|end| unit.expect(end, joint.name, diagnostics));
            if fits == [true, true] {
                range([lower, upper], joint, diagnostics);
            }
            [lower.value, upper.value]
        }
    }
}

/// Refuses a range of soft limits that is empty or has `joint` at home outside of it.
fn range<K: Kind>([lower, upper]: [&Quantity<K>; 2], joint: &Joint, diagnostics: &mut Diagnostics) {
    let name = joint.unit.name();
    if lower.value >= upper.value {
        diagnostics.contradict(
            lower.span,
            format!("the range from {} {name} to {} {name} is empty", lower.value, upper.value),
            "write [from, to], the smaller first",
        );
    } else if joint.home < lower.value || joint.home > upper.value {
        let span = if joint.home < lower.value { lower.span } else { upper.span };
        diagnostics.contradict(
            span,
            format!(
                "axis `{}` is at {} {name} at home, outside its limits {} {name} to {} {name}",
                joint.name, joint.home, lower.value, upper.value
            ),
            "widen the limits, or change `home` or `home_axes`",
        );
    }
}

/// The largest speed of `joint` [m/s or rad/s], whose motor reaches `no_load` without load.
fn velocity(
    table: &LimitsTable,
    joint: &Joint,
    no_load: f64,
    diagnostics: &mut Diagnostics,
) -> f64 {
    let Some(velocity) = table.velocity else { return SPEED_SHARE * no_load };
    if joint.unit.expect(&velocity, joint.name, diagnostics) && velocity.value > no_load {
        diagnostics.contradict(
            velocity.span,
            format!(
                "the motor reaches {no_load:.4} {name}/s without load, not {} {name}/s",
                velocity.value,
                name = joint.unit.name()
            ),
            "lower the limit, or leave it out to use 90 % of what the motor can do",
        );
    }
    velocity.value
}
