//! What every mechanism of links and joints has in common: transmissions that stand with the axes,
//! a home that is solved, and loads that the joints feel there.

use core::f64::consts::TAU;

use nalgebra::Vector3;

use crate::actuator::Friction;
use crate::document::{Either, Findings, Number, Place, Positive, ProblemKind};
use crate::file::axes::{Joint, JointUnit};
use crate::file::tables::{AxisTable, MachineTable};
use crate::kinematics::{Joints, KinematicsError, Mechanism, Pose};
use crate::transmission::{Elasticity, link};

use super::{Site, rest, springs};

/// The spring behind an axis [N/m or N·m/rad at the joint] and the damping ratio of its load.
struct Spring<'a> {
    stiffness: f64,
    damping_ratio: &'a Number<Positive>,
}

/// What a transmission makes of the gear's output.
struct Output<'a> {
    /// [m/rad or rad/rad].
    travel: f64,
    /// Turns stiffly with the gear's output [kg·m²].
    inertia: f64,
    spring: Option<Spring<'a>>,
    /// What the joint must be measured in for this transmission.
    unit: JointUnit,
    place: Place,
}

/// A joint of a mechanism as its table names it.
pub(super) type Named = (&'static str, JointUnit);

fn output(axis: &AxisTable) -> Vec<Output<'_>> {
    let table = &axis.transmission;
    let screw = table.screw.as_ref().map(|screw| {
        let lead = screw.lead.value;
        Output {
            travel: lead,
            inertia: screw.inertia.value,
            spring: springs::of_screw(screw.stiffness.as_ref(), screw.shaft.as_ref(), lead)
                .map(|stiffness| Spring { stiffness, damping_ratio: &screw.damping_ratio }),
            unit: JointUnit::Length,
            place: screw.place,
        }
    });
    let belt = table.belt.as_ref().map(|belt| Output {
        travel: belt.pulley_radius.value,
        inertia: belt.inertia.value,
        spring: springs::of_belt(belt.stiffness.as_ref(), belt.section.as_ref())
            .map(|stiffness| Spring { stiffness, damping_ratio: &belt.damping_ratio }),
        unit: JointUnit::Length,
        place: belt.place,
    });
    let direct = table.direct.as_ref().map(|direct| Output {
        travel: 1.0,
        inertia: direct.inertia.value,
        spring: direct.stiffness.map(|stiffness| Spring {
            stiffness: stiffness.value,
            damping_ratio: &direct.damping_ratio,
        }),
        unit: JointUnit::Angle,
        place: direct.place,
    });
    let link = table.link.as_ref().map(|table| Output {
        travel: 1.0,
        inertia: 0.0,
        spring: Some(Spring {
            // What the arm moves hangs on a hinge at its tip, which takes no moment.
            stiffness: link::pushed_at_tip(
                table.modulus.value * table.second_moment.value,
                table.length.value,
            ),
            damping_ratio: &table.damping_ratio,
        }),
        unit: JointUnit::Angle,
        place: table.place,
    });
    let planar = table.planar.as_ref().map(|planar| Output {
        travel: planar.pitch.value / TAU,
        inertia: 0.0,
        spring: None,
        unit: JointUnit::Length,
        place: planar.place,
    });
    [screw, belt, direct, link, planar].into_iter().flatten().collect()
}

/// The damping ratio of the spring behind `axis`, where there is one.
pub(super) fn damping_ratio(axis: &AxisTable) -> Option<&Number<Positive>> {
    output(axis).into_iter().find_map(|output| output.spring).map(|spring| spring.damping_ratio)
}

/// The joints of a mechanism, the springs behind them, and its tool at rest [m].
type Standing<const N: usize> = (Vec<Joint>, Option<[Elasticity; N]>, [f64; 3]);

/// How `mechanism` stands at home.
pub(super) fn joints<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    names: [Named; N],
    site: &Site<'_>,
    findings: &mut Findings,
) -> Option<Standing<N>> {
    let Site { table, area, home } = *site;
    let (standing, assembly) = standing(mechanism, &names, table, home, findings)?;
    // In an area that is refused already, where to rest cannot be said.
    if let Some(values) = table.home_axes.as_ref().filter(|_| findings.is_empty()) {
        rest::check(mechanism, &assembly, values, area, findings);
    }
    let mass = mechanism.mass_matrix(&assembly);
    let mut joints = Vec::with_capacity(N);
    let mut springs = Vec::with_capacity(N);
    for (index, (name, unit)) in names.into_iter().enumerate() {
        let output = axis(site, name).and_then(|axis| transmission(name, unit, axis, findings));
        let load = mass[(index, index)];
        let spring = output.as_ref().and_then(|output| output.spring.as_ref());
        springs.extend(
            spring.map(|spring| {
                Elasticity::damped(spring.stiffness, load, spring.damping_ratio.value)
            }),
        );
        joints.push(Joint {
            name,
            unit,
            travel: output.as_ref().map_or(1.0, |output| output.travel),
            load,
            stiff_inertia: output.as_ref().map_or(0.0, |output| output.inertia),
            range: None,
            home: standing[index],
            // What an arm must do for a path depends on where it is: the planner checks each job.
            worst_speed: 0.0,
        });
    }
    if !springs.is_empty() && springs.len() < N {
        findings.contradict(
            table.axis.place,
            "some axes have an elastic transmission, others a rigid one".to_owned(),
            "give every axis a `stiffness`, or none",
        );
    }
    let home = mechanism.pose(&assembly).position.into();
    Some((joints, springs.try_into().ok(), home))
}

/// A number that must be 1 or −1.
pub(super) fn sign(number: &Number, findings: &mut Findings) -> i32 {
    if number.value != 1.0 && number.value != -1.0 {
        findings.refuse(
            ProblemKind::OutOfRange,
            number.place,
            format!("`{}` is no side", number.value),
            Some("write 1 or -1".to_owned()),
        );
    }
    if number.value < 0.0 { -1 } else { 1 }
}

fn axis<'a>(site: &Site<'a>, name: &str) -> Option<&'a AxisTable> {
    site.table.axis.entries.iter().find(|(found, _)| found.value == name).map(|(_, axis)| axis)
}

/// The range [m or rad] that the file gives to the axis `name`, infinite where it is unlimited.
pub(super) fn range(site: &Site<'_>, name: &str) -> Option<[f64; 2]> {
    match axis(site, name)?.limits.position.as_ref()? {
        Either::Word(_) => Some([f64::NEG_INFINITY, f64::INFINITY]),
        Either::Value([lower, upper]) => Some([lower.value, upper.value]),
    }
}

/// The friction of the axis `name`, seen at its joint: coulomb [N or N·m], viscous per joint speed.
pub(super) fn friction(site: &Site<'_>, name: &str) -> Friction {
    let Some(axis) = axis(site, name) else { return Friction { coulomb: 0.0, viscous: 0.0 } };
    let travel = output(axis).first().map_or(1.0, |output| output.travel);
    let ratio = travel / axis.gear.value;
    Friction {
        coulomb: axis.friction.coulomb.value / ratio,
        viscous: axis.friction.viscous.value / (ratio * ratio),
    }
}

/// How the axes stand at rest, and the chain there.
fn standing<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    names: &[Named; N],
    table: &MachineTable,
    home: [f64; 3],
    findings: &mut Findings,
) -> Option<(Joints<N>, M::Assembly)> {
    let branch = mechanism.branch();
    let solved = match &table.home_axes {
        None => mechanism.inverse(&Pose::at(Vector3::from(home)), branch, &Joints::zeros()),
        Some(values) if values.len() == N => {
            for (value, (name, unit)) in values.iter().zip(names) {
                unit.expect(value, name, findings);
            }
            if let Some(point) = &table.home {
                findings.contradict(
                    point.place,
                    "the rest is given twice, by `home` and by `home_axes`".to_owned(),
                    "keep one of them",
                );
            }
            Ok(Joints::from_fn(|row, _| values[row].value))
        }
        Some(values) => {
            let place = values.first().map_or(table.place, |value| value.place);
            findings.contradict(
                place,
                format!("`home_axes` has {} values, the mechanism {N} axes", values.len()),
                &format!("write one for each of {}", names.map(|(name, _)| name).join(", ")),
            );
            return None;
        }
    };
    let found = solved.and_then(|q| Ok((q, mechanism.assemble(&q, branch, None)?)));
    found.map_err(|error| refuse_home(&error, table, findings)).ok()
}

fn refuse_home(error: &KinematicsError, table: &MachineTable, findings: &mut Findings) {
    let place = table
        .home
        .map(|point| point.place)
        .or(table.home_axes.as_ref().and_then(|values| Some(values.first()?.place)))
        .unwrap_or(table.place);
    findings.refuse(
        ProblemKind::Contradiction,
        place,
        format!("the mechanism cannot rest here: {error}"),
        Some("give a `home` that it can reach, or `home_axes`".to_owned()),
    );
}

/// The one transmission of an axis; none is a joint that turns with the gear.
fn transmission<'a>(
    name: &str,
    unit: JointUnit,
    axis: &'a AxisTable,
    findings: &mut Findings,
) -> Option<Output<'a>> {
    let found = output(axis);
    if let [_, second, ..] = found.as_slice() {
        findings.contradict(
            second.place,
            format!("axis `{name}` has two transmissions"),
            "keep one",
        );
    }
    let only = found.into_iter().next();
    match (&only, unit) {
        (Some(output), _) if output.unit != unit => findings.contradict(
            output.place,
            format!(
                "axis `{name}` cannot have this transmission: it is measured in {}",
                unit.name()
            ),
            match unit {
                JointUnit::Length => "use a screw, a belt or a planar motor",
                JointUnit::Angle => "use `direct` or `link`",
            },
        ),
        (None, JointUnit::Length) => findings.refuse(
            ProblemKind::MissingKey,
            axis.transmission.place,
            format!("axis `{name}` moves along a line, and nothing says how far in a turn"),
            Some(format!("add [axis.{name}.transmission.screw], `.belt` or `.planar`")),
        ),
        _ => {}
    }
    only
}
