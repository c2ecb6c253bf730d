//! From the tables of a machine file to a [`Machine`] without contradictions.

use std::path::PathBuf;

use super::axes::{Drive, Joint, axis};
use super::bounds::BOUNDS;
use super::drives;
use super::laser;
use super::loops;
use super::mechanism::{self, Built};
use super::modbus;
use super::motors;
use super::operating::{self, operating};
use super::relations;
use super::tables::{AreaTable, AxisTable, MachineTable, OriginsTable, PathTable, RealtimeTable};
use super::{unused, warnings};
use crate::actuator::Actuator;
use crate::axis::Axis;
use crate::document::{
    Diagnostics, Document, DocumentError, Named, Point, ProblemKind, Span, Spanned, nearest,
};
use crate::gcode_settings::{Dialect, GcodeSettings, ZMeaning};
use crate::limits::{PathLimits, StallTolerance, Timing, WorkArea};
use crate::machine::Machine;
use crate::mechanisms::MechanismKind;
use crate::operating::Operating;
use messages::time::Period;
use messages::{MAX_ACTUATORS, Nanoseconds};

pub(super) fn machine(document: Document) -> Result<Machine, DocumentError> {
    let (table, mut diagnostics) = document.decode_within::<MachineTable>(BOUNDS)?;
    unused::check(&table, &mut diagnostics);
    let area = area(&table.area, &mut diagnostics);
    let home = home(table.home, &area, &mut diagnostics);
    let Some(Built { mechanism, joints, home }) =
        mechanism::build(&table, &area, home, &mut diagnostics)
    else {
        return diagnostics.fail();
    };
    let Some(tables) = axes_in_order(&table.axis, &joints, &mut diagnostics) else {
        return diagnostics.fail();
    };
    let realtime = realtime(&table.realtime, &mut diagnostics);
    let (axes, mut driven) = axes(&table, &tables, &joints, realtime.period, &mut diagnostics);
    let mut actuators: Vec<Actuator> =
        driven.iter().map(|(_, actuator)| actuator.clone()).collect();
    let mut operating = if axes.len() == joints.len() {
        let (inputs, outputs) = (table.inputs.as_ref(), table.outputs.as_ref());
        let safety = &table.safety;
        let own = operating::Tables { inputs, outputs, safety, axes: &tables, joints: &joints };
        operating(&own, &axes, &actuators, &mut diagnostics)
    } else {
        Operating::default()
    };
    let period = realtime.period;
    let switched = modbus::switched(table.modbus.as_ref());
    let wired = (&operating, switched.as_slice());
    let drives = drives::build(&table.drives, period, &mut actuators, wired, &mut diagnostics);
    modbus::connect(table.modbus.as_ref(), &mut operating, &mut diagnostics);
    if diagnostics.is_empty() {
        for ((drive, own), actuator) in driven.iter_mut().zip(&mut actuators) {
            loops::slow_down(actuator, &drive.table, period, &mut diagnostics);
            *own = actuator.clone();
        }
    }
    if diagnostics.is_empty() {
        relations::check(&table, &mechanism, &joints, &axes, &driven, &mut diagnostics);
    }
    refuse_rigid_backlash(&mechanism, &table.axis, &mut diagnostics);
    refuse_rigid_pairs(&mechanism, &table.axis, &mut diagnostics);
    refuse_many(&table.axis, &driven, &mut diagnostics);
    check_z(&table, &mechanism, &mut diagnostics);
    let laser = laser::source(&table.laser, &drives.kind, &mut diagnostics);
    let PathTable { speed, rapid, acceleration, jerk, tolerance, corners, span: _ } = &table.path;
    let gcode = &table.gcode;
    let machine = Machine {
        name: table.name.value.clone(),
        mechanism,
        axes,
        actuators,
        area,
        home,
        home_joints: joints.iter().map(|joint| joint.home).collect(),
        path: PathLimits {
            speed: speed.value,
            rapid: rapid.value,
            acceleration: acceleration.value,
            jerk: jerk.value,
            tolerance: tolerance.value,
        },
        corners: corners.value,
        realtime,
        drives,
        laser,
        gcode: GcodeSettings {
            words: gcode.over(Dialect::Standard.meanings()),
            z: gcode.z.value,
            origins: origins(&gcode.origins, home),
            air_assist: gcode.air_assist.value && operating.may_have_air(),
            tool_offset: [0.0; 3],
            digital_outputs: operating.general_outputs(),
        },
        operating,
        sample_job: table.job.as_ref().map(|job| PathBuf::from(&job.sample.value)),
        warnings: warnings::warnings(&mut diagnostics),
    };
    diagnostics.finish(machine)
}

/// The axes that `tables` describe, in the order of `joints`, and their actuators with what is said of
/// each; warnings about them and their transmissions are noted. Those without a sound motor are left out,
/// and noted.
fn axes(
    table: &MachineTable,
    tables: &[&AxisTable],
    joints: &[Joint],
    period: Period,
    diagnostics: &mut Diagnostics,
) -> (Vec<Axis>, Vec<(Drive, Actuator)>) {
    let mut axes = Vec::with_capacity(joints.len());
    let mut driven = Vec::with_capacity(joints.len());
    for (axis_table, joint) in tables.iter().copied().zip(joints) {
        let before = [axes.len(), driven.len()];
        let Some((axis, actuators)) = axis(axis_table, joint, before, period, diagnostics) else {
            continue;
        };
        for (index, (drive, actuator)) in actuators.iter().enumerate() {
            let is_shared =
                |(other, _): &(Drive, Actuator)| other.table.motor.span == drive.table.motor.span;
            if let Some(dc) = &drive.table.motor.dc
                && !actuators[..index].iter().any(is_shared)
            {
                warnings::of_motor(&actuator.name, dc, diagnostics);
            }
        }
        if axis_table.limits.velocity.is_none() {
            let speeds = [&table.path.speed, &table.path.rapid];
            warnings::of_speeds(speeds, joint, &axis, diagnostics);
        }
        axes.push(axis);
        driven.extend(actuators);
    }
    if axes.len() == tables.len() {
        motors::of_one_kind(&driven, diagnostics);
    }
    for ratio in mechanism::damping_ratios(table) {
        warnings::of_damping(ratio, diagnostics);
    }
    (axes, driven)
}

/// That the area has a range of z, and Z moves the focus, only where the mechanism moves in z.
fn check_z(table: &MachineTable, mechanism: &MechanismKind, diagnostics: &mut Diagnostics) {
    if mechanism.moves_in_z() {
        if table.area.z.is_none() {
            diagnostics.contradict(
                table.area.span,
                "the machine has a z axis, but its area has no range of z".to_owned(),
                "add `z = [from, to]`",
            );
        }
        return;
    }
    if let Some([lower, _]) = table.area.z {
        diagnostics.contradict(
            lower.span,
            "the area has a range of z, but the mechanism has no z axis".to_owned(),
            "remove `z`",
        );
    }
    if table.gcode.z.value == ZMeaning::Focus {
        diagnostics.contradict(
            table.gcode.z.span,
            "Z cannot move the focus: the mechanism has no z axis".to_owned(),
            "write \"ignored\", or add the z axis",
        );
    }
}

/// Refuses a gap with nothing elastic behind it: what meets at its end would meet in no time.
fn refuse_rigid_backlash(
    mechanism: &MechanismKind,
    axes: &Named<AxisTable>,
    diagnostics: &mut Diagnostics,
) {
    if mechanism.is_elastic() {
        return;
    }
    for (name, table) in &axes.entries {
        if let Some(backlash) = table.backlash.filter(|backlash| backlash.value > 0.0) {
            diagnostics.contradict(
                backlash.span,
                format!("axis `{}` has backlash, and its transmission is rigid", name.value),
                "give its transmission a stiffness, or leave the backlash out",
            );
        }
    }
}

/// Refuses several motors on a joint with nothing elastic between them: nothing would say what each bears.
fn refuse_rigid_pairs(
    mechanism: &MechanismKind,
    axes: &Named<AxisTable>,
    diagnostics: &mut Diagnostics,
) {
    if mechanism.is_elastic() {
        return;
    }
    for (name, table) in &axes.entries {
        let Some(actuators) = &table.actuator else { continue };
        if let [_, (second, _), ..] = actuators.entries.as_slice() {
            diagnostics.contradict(
                second.span,
                format!(
                    "axis `{}` has {} actuators, and its transmission is rigid: nothing says what \
                     each of them bears",
                    name.value,
                    actuators.entries.len()
                ),
                "give its transmission a stiffness: that of all its actuators together",
            );
        }
    }
}

/// Refuses more actuators than a sample holds.
fn refuse_many(
    axes: &Named<AxisTable>,
    driven: &[(Drive, Actuator)],
    diagnostics: &mut Diagnostics,
) {
    let Some((first, _)) = driven.get(MAX_ACTUATORS) else { return };
    let named = axes.entries.iter().flat_map(|(axis, table)| {
        let own = table.actuator.iter().flat_map(|actuators| &actuators.entries);
        own.map(move |(name, _)| (format!("{}.{}", axis.value, name.value), name.span))
    });
    let span = named.filter(|(name, _)| *name == first.name).map(|(_, span)| span).next();
    diagnostics.contradict(
        span.unwrap_or(axes.span),
        format!("the machine has {} actuators", driven.len()),
        &format!("a machine can have {MAX_ACTUATORS} of them, on all its axes together"),
    );
}

/// Refuses a period that the cycle cannot have, and a tolerance shorter than it, or longer than any
/// axis could bear.
fn realtime(table: &RealtimeTable, diagnostics: &mut Diagnostics) -> Timing {
    let period = Period::new(Nanoseconds::from_seconds(table.period.value)).unwrap_or_else(|| {
        let [step, shortest, longest] =
            [Period::STEP, Period::SHORTEST.time(), Period::LONGEST.time()]
                .map(|time| time.seconds() * 1e6);
        diagnostics.refuse(
            ProblemKind::OutOfRange,
            table.period.span,
            format!("a control cycle cannot have a `period` of {} s", table.period.value),
            Some(format!(
                "write a whole multiple of {step} us, from {shortest} us (8 kHz) to {longest} us (250 Hz)"
            )),
        );
        Timing::DEFAULT.period
    });
    let time = Nanoseconds::from_seconds(table.stall.value);
    let stall = StallTolerance::new(time, period).unwrap_or_else(|| {
        let [shortest, longest] = [StallTolerance::shortest(period), StallTolerance::LONGEST]
            .map(|bound| bound.time().seconds() * 1e3);
        diagnostics.refuse(
            ProblemKind::OutOfRange,
            table.stall.span,
            format!("a `stall` of {} s cannot be tolerated", table.stall.value),
            Some(format!("write a time from {shortest} ms, one cycle, to {longest} ms")),
        );
        StallTolerance::shortest(period)
    });
    Timing { period, stall }
}

/// The area as a box; z is from 0 to 0 where it has no range.
fn area(table: &AreaTable, diagnostics: &mut Diagnostics) -> WorkArea {
    let mut area = WorkArea { lower: [0.0; 3], upper: [0.0; 3] };
    let ranges = [Some(table.x), Some(table.y), table.z];
    for (index, (name, range)) in ["x", "y", "z"].into_iter().zip(ranges).enumerate() {
        let Some([lower, upper]) = range else { continue };
        if lower.value >= upper.value {
            diagnostics.contradict(
                lower.span,
                format!("the range of {name} from {} m to {} m is empty", lower.value, upper.value),
                "write [from, to], the smaller first",
            );
        }
        area.lower[index] = lower.value;
        area.upper[index] = upper.value;
    }
    area
}

fn home(point: Option<Point>, area: &WorkArea, diagnostics: &mut Diagnostics) -> [f64; 3] {
    let Some(point) = point else {
        return core::array::from_fn(|index| (area.lower[index] + area.upper[index]) / 2.0);
    };
    if !diagnostics.is_empty() {
        // An empty range was found: where home should be cannot be said.
        return point.value;
    }
    for (index, name) in ["x", "y", "z"].into_iter().enumerate() {
        let (lower, upper) = (area.lower[index], area.upper[index]);
        if !(lower..=upper).contains(&point.value[index]) {
            diagnostics.contradict(
                point.span,
                format!(
                    "home lies outside the area: {name} is {} m, the area is from {lower} m to \
                     {upper} m",
                    point.value[index]
                ),
                "move `home` into the area, or widen the area",
            );
        }
    }
    point.value
}

/// The axes' tables in the order of the joints; each joint has one, and no other is there.
fn axes_in_order<'a>(
    axes: &'a Named<AxisTable>,
    joints: &[Joint],
    diagnostics: &mut Diagnostics,
) -> Option<Vec<&'a AxisTable>> {
    let names = || joints.iter().map(|joint| joint.name);
    let list = || names().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    let is_there = |name: &str| axes.entries.iter().any(|(found, _)| found.value == name);
    let mut renamed = 0;
    for (Spanned { value: name, span }, _) in &axes.entries {
        if names().all(|known| known != name) {
            renamed += 1;
            let free = names().filter(|name| !is_there(name));
            let help = match nearest(name, free) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("the axes of this mechanism are {}", list()),
            };
            unknown_axis(name, *span, help, diagnostics);
        }
    }
    let missing: Vec<&str> = names().filter(|name| !is_there(name)).collect();
    // As many unknown axes as missing ones are misspelt, and were reported where they stand.
    for name in missing.iter().skip(renamed) {
        diagnostics.refuse(
            ProblemKind::MissingKey,
            axes.span,
            format!("axis `{name}` is missing"),
            Some(format!("add [axis.{name}]: the axes of this mechanism are {}", list())),
        );
    }
    if renamed > 0 || !missing.is_empty() {
        return None;
    }
    names()
        .map(|name| {
            axes.entries.iter().find(|(found, _)| found.value == name).map(|(_, table)| table)
        })
        .collect()
}

fn unknown_axis(name: &str, span: Span, help: String, diagnostics: &mut Diagnostics) {
    diagnostics.refuse(
        ProblemKind::UnknownKey,
        span,
        format!("the mechanism has no axis `{name}`"),
        Some(help),
    );
}

fn origins(table: &OriginsTable, home: [f64; 3]) -> [[f64; 3]; 9] {
    table.each().map(|origin| origin.map_or(home, |point| point.value))
}
