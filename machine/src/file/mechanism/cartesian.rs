//! The table of a Cartesian machine.

use super::linear::{self, CarriageTable, Part};
use super::{BuildContext, Built, chain};
use crate::document::{Diagnostics, Positive, ProblemKind, Quantity};
use crate::file::axes::JointUnit;
use crate::file::frame;
use crate::mechanisms::{Cartesian, MechanismKind};
use crate::quantity as unit;
use crate::table;

table! {
    /// A carriage for each direction. Its axes are `x` and `y`, or `x` and `a` with a chuck, and `z` if it
    /// has one.
    pub struct CartesianTable {
        /// Carriage of x.
        pub x: CarriageTable,
        /// Carriage of y.
        pub y: Option<CarriageTable>,
        /// Instead of `y`: what turns the workpiece under the tool, and y is the way around it.
        pub chuck: Option<ChuckTable>,
        /// Carriage of z, where the head moves up and down.
        pub z: Option<CarriageTable>,
    }
}

table! {
    /// A chuck that turns the workpiece about an axis along x. What drives it stands in
    /// [axis.a.transmission], or nothing does where it turns with the gear.
    pub struct ChuckTable {
        /// Diameter of the workpiece where it is marked: a turn is π times that in y.
        pub diameter: Quantity<unit::Length, Positive>,
        /// Moment of inertia of chuck and workpiece about their axis.
        pub inertia: Quantity<unit::Inertia, Positive>,
    }
}

pub(super) fn build(
    table: &CartesianTable,
    context: &BuildContext<'_>,
    diagnostics: &mut Diagnostics,
) -> Option<Built> {
    let x = Part::carriage("x", &table.x, context, diagnostics);
    let (across, radius) = match (&table.y, &table.chuck) {
        (Some(y), None) => (Part::carriage("y", y, context, diagnostics), 1.0),
        (None, Some(chuck)) => (turned(chuck, context, diagnostics), chuck.diameter.value / 2.0),
        (Some(_), Some(chuck)) => {
            diagnostics.contradict(
                chuck.span,
                "y is moved by a carriage and by a chuck".to_owned(),
                "keep either [mechanism.cartesian.y] or [mechanism.cartesian.chuck]",
            );
            return None;
        }
        (None, None) => {
            diagnostics.refuse(
                ProblemKind::MissingKey,
                table.span,
                "`y` is missing: nothing moves the tool in y".to_owned(),
                Some("add [mechanism.cartesian.y], or [mechanism.cartesian.chuck]".to_owned()),
            );
            return None;
        }
    };
    match &table.z {
        None => assemble([x, across], [1.0, radius], context, diagnostics),
        Some(z) => {
            let z = Part::carriage("z", z, context, diagnostics);
            assemble([x, across, z], [1.0, radius, 1.0], context, diagnostics)
        }
    }
}

/// The axis of a chuck.
fn turned<'a>(
    chuck: &ChuckTable,
    context: &BuildContext<'a>,
    diagnostics: &mut Diagnostics,
) -> Part<'a> {
    let axis = chain::axis(context.table, "a");
    let output =
        axis.and_then(|axis| chain::transmission("a", JointUnit::Angle, axis, diagnostics));
    Part { name: "a", unit: JointUnit::Angle, load: chuck.inertia.value, output }
}

fn assemble<const N: usize>(
    parts: [Part<'_>; N],
    travel: [f64; N],
    context: &BuildContext<'_>,
    diagnostics: &mut Diagnostics,
) -> Option<Built>
where
    MechanismKind: From<Cartesian<N>>,
{
    let mechanism = Cartesian {
        mass: core::array::from_fn(|axis| parts[axis].load),
        travel,
        elasticity: linear::elasticity(&parts, diagnostics),
        frame: frame::build(context.table, N > 2, context.area, diagnostics),
    };
    let joints = linear::joints(&mechanism, &parts, context, diagnostics)?;
    Some(Built { mechanism: mechanism.into(), joints, home: context.home })
}
