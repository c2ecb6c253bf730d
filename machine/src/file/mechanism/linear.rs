//! What the mechanisms have in common whose joints follow from the area: where these stand, and carriages
//! with what drives them.

use nalgebra::Vector3;

use super::chain::{self, Output, Spring};
use super::{BuildContext, MechanismTable, springs};
use crate::document::{Diagnostics, NonNegative, Number, Positive, ProblemKind, Quantity, Span};
use crate::file::axes::{Joint, JointUnit};
use crate::file::tables::ShaftTable;
use crate::kinematics::{Joints, KinematicsError, Mechanism, Pose, TaskSpace, ToolMotion};
use crate::quantity as unit;
use crate::table;
use crate::transmission::Elasticity;

type Above<K> = Quantity<K, Positive>;
type AtLeastZero<K> = Quantity<K, NonNegative>;

table! {
    /// A carriage. What drives it stands in [axis.NAME.transmission], or is a screw that is given here.
    pub struct CarriageTable {
        /// Everything that moves with the carriage.
        pub mass: Above<unit::Mass>,
        /// Travel per turn of the carriage's screw; without it [axis.NAME.transmission] says what drives
        /// the carriage, and nothing of the following is given here.
        pub lead: Option<Above<unit::Lead>>,
        /// Moment of inertia of the screw, without the carriage; it turns with the motor.
        pub inertia: AtLeastZero<unit::Inertia> = "0 kg m^2",
        /// Torsional stiffness from gear to nut, the axial one in series; rigid when this and
        /// `shaft` are left out.
        pub stiffness: Option<Above<unit::TorsionalStiffness>>,
        /// The shaft that it follows from, instead of `stiffness`.
        pub shaft: Option<ShaftTable>,
        /// Damping of that spring, as a share of critical damping under the carriage.
        pub damping_ratio: Number<Positive> = 0.9,
    }
}

/// All carriages that a file has, by the names of their axes.
pub(super) fn carriages(
    kinds: &MechanismTable,
) -> impl Iterator<Item = (&'static str, &CarriageTable)> {
    let cartesian = kinds.cartesian.iter().flat_map(|cartesian| {
        [("x", Some(&cartesian.x)), ("y", cartesian.y.as_ref()), ("z", cartesian.z.as_ref())]
    });
    let lift = kinds.corexy.iter().map(|corexy| ("z", corexy.z.as_ref()));
    cartesian.chain(lift).filter_map(|(name, carriage)| Some((name, carriage?)))
}

/// A joint before it is known where it stands: what it is called and moves, and what drives it.
pub(super) struct Part<'a> {
    pub(super) name: &'static str,
    pub(super) unit: JointUnit,
    /// [kg or kg·m²].
    pub(super) load: f64,
    /// `None` where nothing sound is given.
    pub(super) output: Option<Output<'a>>,
}

impl<'a> Part<'a> {
    /// The axis `name` with its carriage, on the screw that is given there, or on what the axis says.
    pub(super) fn carriage(
        name: &'static str,
        carriage: &'a CarriageTable,
        context: &BuildContext<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Self {
        let output = match &carriage.lead {
            Some(lead) => {
                let kind = context.table.mechanism.name();
                let place = format!("[mechanism.{kind}.{name}] gives its screw by `lead`");
                let help = "remove this table, or there `lead` and all that is of the screw";
                no_transmission(name, &place, help, context, diagnostics);
                Some(screw(carriage, lead.value))
            }
            None => {
                no_screw(name, carriage, diagnostics);
                chain::axis(context.table, name).and_then(|axis| {
                    chain::transmission(name, JointUnit::Length, axis, diagnostics)
                })
            }
        };
        Self { name, unit: JointUnit::Length, load: carriage.mass.value, output }
    }
}

fn screw(carriage: &CarriageTable, lead: f64) -> Output<'_> {
    let spring = springs::of_screw(carriage.stiffness.as_ref(), carriage.shaft.as_ref(), lead);
    Output {
        travel: lead,
        inertia: carriage.inertia.value,
        spring: spring
            .map(|stiffness| Spring { stiffness, damping_ratio: &carriage.damping_ratio }),
        unit: JointUnit::Length,
        span: carriage.span,
    }
}

/// Refuses what a carriage says of a screw that it does not have.
fn no_screw(name: &str, carriage: &CarriageTable, diagnostics: &mut Diagnostics) {
    // The place of a default is that of its table.
    let declared = |span: Span| (span != carriage.span).then_some(span);
    let extra = [
        ("inertia", declared(carriage.inertia.span)),
        ("stiffness", carriage.stiffness.as_ref().map(|stiffness| stiffness.span)),
        ("shaft", carriage.shaft.as_ref().map(|shaft| shaft.span)),
        ("damping_ratio", declared(carriage.damping_ratio.span)),
    ];
    for (key, span) in extra.into_iter().filter_map(|(key, span)| Some((key, span?))) {
        diagnostics.contradict(
            span,
            format!("`{key}` has no effect here: it is of a screw, and there is no `lead`"),
            &format!("add `lead`, or write it in [axis.{name}.transmission]"),
        );
    }
}

/// Refuses a transmission of the axis `name`, for which `place` says another one.
pub(super) fn no_transmission(
    name: &str,
    place: &str,
    help: &str,
    context: &BuildContext<'_>,
    diagnostics: &mut Diagnostics,
) {
    for output in chain::axis(context.table, name).map(chain::output).unwrap_or_default() {
        diagnostics.contradict(
            output.span,
            format!("this transmission of axis `{name}` has no effect: {place}"),
            help,
        );
    }
}

/// The springs behind `parts`; all have one, or none.
pub(super) fn elasticity<const N: usize>(
    parts: &[Part<'_>; N],
    diagnostics: &mut Diagnostics,
) -> Option<[Elasticity; N]> {
    let sprung = |part: &Part<'_>| {
        let spring = part.output.as_ref()?.spring.as_ref()?;
        Some(Elasticity::damped(spring.stiffness, part.load, spring.damping_ratio.value))
    };
    let springs: Vec<Elasticity> = parts.iter().filter_map(sprung).collect();
    let mut outputs = parts.iter().filter_map(|part| part.output.as_ref());
    if let Some(rigid) = outputs.find(|output| output.spring.is_none())
        && !springs.is_empty()
    {
        diagnostics.contradict(
            rigid.span,
            "this transmission is rigid, another one is not".to_owned(),
            "give every transmission its `stiffness`, `shaft` or `section`, or none",
        );
    }
    springs.try_into().ok()
}

/// The joints of `mechanism`, made of `parts`, over the area and at home; `None` where it does not reach
/// all of them.
pub(super) fn joints<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    parts: &[Part<'_>; N],
    context: &BuildContext<'_>,
    diagnostics: &mut Diagnostics,
) -> Option<Vec<Joint>> {
    let table = context.table;
    if let Some(first) = table.home_axes.as_ref().and_then(|values| values.first()) {
        diagnostics.contradict(
            first.span,
            format!(
                "`home_axes` has no effect: a place of a {} says how its axes stand",
                mechanism.name()
            ),
            "write `home`, where the tool rests",
        );
    }
    let home = mechanism
        .inverse(&Pose::at(Vector3::from(context.home)), mechanism.branch(), &Joints::zeros())
        .map_err(|error| {
            let span = table.home.map_or(table.area.span, |point| point.span);
            out_of_reach(&error, span, "the tool cannot rest here", diagnostics);
        })
        .ok()?;
    let Standing { range, worst_speed } = standing(mechanism, context)
        .map_err(|error| {
            out_of_reach(&error, table.area.span, "not all of the area is reached", diagnostics);
        })
        .ok()?;
    let joint = |(index, part): (usize, &Part<'_>)| Joint {
        name: part.name,
        unit: part.unit,
        travel: part.output.as_ref().map_or(1.0, |output| output.travel),
        load: part.load,
        stiff_inertia: part.output.as_ref().map_or(0.0, |output| output.inertia),
        range: Some(range[index]),
        home: home[index],
        worst_speed: worst_speed[index],
    };
    Some(parts.iter().enumerate().map(joint).collect())
}

fn out_of_reach(error: &KinematicsError, span: Span, what: &str, diagnostics: &mut Diagnostics) {
    diagnostics.refuse(
        ProblemKind::Contradiction,
        span,
        format!("{what}: {error}"),
        Some("change the area and `home`, or the mechanism".to_owned()),
    );
}

/// What joints do over the area.
struct Standing<const N: usize> {
    range: [[f64; 2]; N],
    /// Joint speed per tool speed in the tool's least favourable direction.
    worst_speed: [f64; N],
}

/// What the joints of `mechanism` do over the area: at its corners, or over a grid where they do not go
/// straight with the tool.
fn standing<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    context: &BuildContext<'_>,
) -> Result<Standing<N>, KinematicsError> {
    /// Places along each side of the grid, an odd number: the middle is one.
    const PLACES: usize = 33;
    let places = if mechanism.is_linear() { 2 } else { PLACES };
    let directions = if mechanism.task_space() == TaskSpace::Plane { 2 } else { 3 };
    let (lower, upper) = (context.area.lower, context.area.upper);
    let along = |axis: usize, index: usize, count: usize| {
        let share = index as f64 / (count - 1) as f64;
        lower[axis] * (1.0 - share) + upper[axis] * share
    };
    let mut standing =
        Standing { range: [[f64::INFINITY, f64::NEG_INFINITY]; N], worst_speed: [0.0; N] };
    let mut previous = Joints::zeros();
    for index in 0..places * places * 2 {
        let (column, row, level) =
            (index % places, index / places % places, index / places / places);
        let place =
            Vector3::new(along(0, column, places), along(1, row, places), along(2, level, 2));
        let mut squares = Joints::<N>::zeros();
        for direction in 0..directions {
            let mut tool = ToolMotion::rest(&Pose::at(place));
            tool.velocity[direction] = 1.0;
            let motion = mechanism.joint_motion(&tool, mechanism.branch(), &previous)?;
            previous = motion.position;
            squares += motion.velocity.component_mul(&motion.velocity);
        }
        for joint in 0..N {
            let [least, most] = &mut standing.range[joint];
            *least = least.min(previous[joint]);
            *most = most.max(previous[joint]);
            let worst = &mut standing.worst_speed[joint];
            *worst = worst.max(squares[joint].sqrt());
        }
    }
    Ok(standing)
}
