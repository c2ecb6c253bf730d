//! What every mechanism of links and joints has in common: transmissions that stand with the axes,
//! a home that is solved, and loads that the joints feel there.

use core::f64::consts::TAU;

use nalgebra::Vector3;

use crate::document::{Diagnostics, Either, Number, Positive, ProblemKind, Span};
use crate::file::axes::{Joint, JointUnit};
use crate::file::tables::{AxisTable, MachineTable};
use crate::kinematics::{Joints, KinematicsError, Mechanism, Pose};
use crate::transmission::{Elasticity, link};

use super::{BuildContext, home, springs};

/// The spring behind an axis [N/m or N·m/rad at the joint] and the damping ratio of its load.
pub(super) struct Spring<'a> {
    pub(super) stiffness: f64,
    pub(super) damping_ratio: &'a Number<Positive>,
}

/// What a transmission makes of the gear's output.
pub(super) struct Output<'a> {
    /// [m/rad or rad/rad].
    pub(super) travel: f64,
    /// Turns stiffly with the gear's output [kg·m²].
    pub(super) inertia: f64,
    pub(super) spring: Option<Spring<'a>>,
    /// What the joint must be measured in for this transmission.
    pub(super) unit: JointUnit,
    pub(super) span: Span,
}

/// A joint of a mechanism as its table names it.
pub(super) type Named = (&'static str, JointUnit);

/// Every transmission that `axis` gives.
pub(super) fn output(axis: &AxisTable) -> Vec<Output<'_>> {
    let table = &axis.transmission;
    let screw = table.screw.as_ref().map(|screw| {
        let lead = screw.lead.value;
        Output {
            travel: lead,
            inertia: screw.inertia.value,
            spring: springs::of_screw(screw.stiffness.as_ref(), screw.shaft.as_ref(), lead)
                .map(|stiffness| Spring { stiffness, damping_ratio: &screw.damping_ratio }),
            unit: JointUnit::Length,
            span: screw.span,
        }
    });
    let belt = table.belt.as_ref().map(|belt| Output {
        travel: belt.pulley_radius.value,
        inertia: belt.inertia.value,
        spring: springs::of_belt(belt.stiffness.as_ref(), belt.section.as_ref())
            .map(|stiffness| Spring { stiffness, damping_ratio: &belt.damping_ratio }),
        unit: JointUnit::Length,
        span: belt.span,
    });
    let rack = table.rack.as_ref().map(|rack| Output {
        travel: rack.pinion_radius.value,
        inertia: rack.inertia.value,
        spring: rack.stiffness.map(|stiffness| Spring {
            stiffness: stiffness.value,
            damping_ratio: &rack.damping_ratio,
        }),
        unit: JointUnit::Length,
        span: rack.span,
    });
    let direct = table.direct.as_ref().map(|direct| Output {
        travel: 1.0,
        inertia: direct.inertia.value,
        spring: direct.stiffness.map(|stiffness| Spring {
            stiffness: stiffness.value,
            damping_ratio: &direct.damping_ratio,
        }),
        unit: JointUnit::Angle,
        span: direct.span,
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
        span: table.span,
    });
    let planar = table.planar.as_ref().map(|planar| Output {
        travel: planar.pitch.value / TAU,
        inertia: 0.0,
        spring: None,
        unit: JointUnit::Length,
        span: planar.span,
    });
    [screw, belt, rack, direct, link, planar].into_iter().flatten().collect()
}

/// The damping ratio of the spring behind `axis`, where there is one.
pub(super) fn damping_ratio(axis: &AxisTable) -> Option<&Number<Positive>> {
    output(axis).into_iter().find_map(|output| output.spring).map(|spring| spring.damping_ratio)
}

/// Where the travel of `axis` per turn of its gear is said.
pub(super) fn travel_place(axis: &AxisTable) -> Option<Span> {
    let transmission = &axis.transmission;
    let screw = transmission.screw.as_ref().map(|screw| screw.lead.span);
    screw
        .or(transmission.belt.as_ref().map(|belt| belt.pulley_radius.span))
        .or(transmission.rack.as_ref().map(|rack| rack.pinion_radius.span))
        .or(transmission.planar.as_ref().map(|planar| planar.pitch.span))
}

/// The joints of a mechanism, the springs behind them, and its tool at rest [m].
type Standing<const N: usize> = (Vec<Joint>, Option<[Elasticity; N]>, [f64; 3]);

/// How `mechanism` stands at home.
pub(super) fn joints<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    names: [Named; N],
    context: &BuildContext<'_>,
    diagnostics: &mut Diagnostics,
) -> Option<Standing<N>> {
    let BuildContext { table, area, home } = *context;
    let (standing, chain) = standing(mechanism, &names, table, home, diagnostics)?;
    // In an area that is refused already, where to rest cannot be said.
    if let Some(values) = table.home_axes.as_ref().filter(|_| diagnostics.is_empty()) {
        home::check(mechanism, &chain, values, area, diagnostics);
    }
    let mass = mechanism.mass_matrix(&chain);
    let mut joints = Vec::with_capacity(N);
    let mut springs = Vec::with_capacity(N);
    for (index, (name, unit)) in names.into_iter().enumerate() {
        let output =
            self::axis(table, name).and_then(|axis| transmission(name, unit, axis, diagnostics));
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
        diagnostics.contradict(
            table.axis.span,
            "some axes have an elastic transmission, others a rigid one".to_owned(),
            "give every axis a `stiffness`, or none",
        );
    }
    let home = mechanism.pose(&chain).position.into();
    Some((joints, springs.try_into().ok(), home))
}

/// A number that must be 1 or −1.
pub(super) fn sign(number: &Number, diagnostics: &mut Diagnostics) -> i32 {
    if number.value != 1.0 && number.value != -1.0 {
        diagnostics.refuse(
            ProblemKind::OutOfRange,
            number.span,
            format!("`{}` is no side", number.value),
            Some("write 1 or -1".to_owned()),
        );
    }
    if number.value < 0.0 { -1 } else { 1 }
}

/// The table of the axis `name`.
pub(super) fn axis<'a>(table: &'a MachineTable, name: &str) -> Option<&'a AxisTable> {
    table.axis.entries.iter().find(|(found, _)| found.value == name).map(|(_, axis)| axis)
}

/// The range [m or rad] that the file gives to the axis `name`, infinite where it is unlimited.
pub(super) fn range(context: &BuildContext<'_>, name: &str) -> Option<[f64; 2]> {
    match axis(context.table, name)?.limits.position.as_ref()? {
        Either::Word(_) => Some([f64::NEG_INFINITY, f64::INFINITY]),
        Either::Value([lower, upper]) => Some([lower.value, upper.value]),
    }
}

/// How the axes stand at rest, and the chain there.
fn standing<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    names: &[Named; N],
    table: &MachineTable,
    home: [f64; 3],
    diagnostics: &mut Diagnostics,
) -> Option<(Joints<N>, M::ChainState)> {
    let branch = mechanism.branch();
    let level = Pose::at(Vector3::from(home));
    let solved = match &table.home_axes {
        // The pose is known, and with it which way the chain closes.
        None => mechanism
            .inverse(&level, branch, &Joints::zeros())
            .and_then(|q| Ok((q, mechanism.solve_at(&level, &q, branch, None)?))),
        Some(values) if values.len() == N => {
            for (value, (name, unit)) in values.iter().zip(names) {
                unit.expect(value, name, diagnostics);
            }
            if let Some(point) = &table.home {
                diagnostics.contradict(
                    point.span,
                    "the rest is given twice, by `home` and by `home_axes`".to_owned(),
                    "keep one of them",
                );
            }
            let q = Joints::from_fn(|row, _| values[row].value);
            mechanism.solve(&q, branch, None).map(|chain| (q, chain))
        }
        Some(values) => {
            let span = values.first().map_or(table.span, |value| value.span);
            diagnostics.contradict(
                span,
                format!("`home_axes` has {} values, the mechanism {N} axes", values.len()),
                &format!("write one for each of {}", names.map(|(name, _)| name).join(", ")),
            );
            return None;
        }
    };
    solved.map_err(|error| refuse_home(&error, table, diagnostics)).ok()
}

fn refuse_home(error: &KinematicsError, table: &MachineTable, diagnostics: &mut Diagnostics) {
    let span = table
        .home
        .map(|point| point.span)
        .or(table.home_axes.as_ref().and_then(|values| Some(values.first()?.span)))
        .unwrap_or(table.span);
    diagnostics.refuse(
        ProblemKind::Contradiction,
        span,
        format!("the mechanism cannot rest here: {error}"),
        Some("give a `home` that it can reach, or `home_axes`".to_owned()),
    );
}

/// The one transmission of an axis; none is a joint that turns with the gear.
pub(super) fn transmission<'a>(
    name: &str,
    unit: JointUnit,
    axis: &'a AxisTable,
    diagnostics: &mut Diagnostics,
) -> Option<Output<'a>> {
    let found = output(axis);
    if let [_, second, ..] = found.as_slice() {
        diagnostics.contradict(
            second.span,
            format!("axis `{name}` has two transmissions"),
            "keep one",
        );
    }
    let only = found.into_iter().next();
    match (&only, unit) {
        (Some(output), _) if output.unit != unit => diagnostics.contradict(
            output.span,
            format!(
                "axis `{name}` cannot have this transmission: it is measured in {}",
                unit.name()
            ),
            match unit {
                JointUnit::Length => "use a screw, a belt, a rack or a planar motor",
                JointUnit::Angle => "use `direct` or `link`",
            },
        ),
        (None, JointUnit::Length) => diagnostics.refuse(
            ProblemKind::MissingKey,
            axis.transmission.span,
            format!("axis `{name}` moves along a line, and nothing says how far in a turn"),
            Some(format!("add [axis.{name}.transmission.screw], `.belt`, `.rack` or `.planar`")),
        ),
        _ => {}
    }
    only
}
