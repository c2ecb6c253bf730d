//! From the table of a mechanism to the mechanism, and what it asks of each axis.

pub mod cartesian;
mod chain;
pub mod corexy;
pub mod five_bar;
pub mod galvo;
mod home;
mod linear;
pub mod mcm;
pub mod polar;
pub mod prrrp;
pub mod serial;
mod springs;
pub mod tri_planar;
pub mod twin_actuator;

use super::axes::Joint;
use super::frame::FRAMED;
use super::tables::MachineTable;
use crate::document::{Diagnostics, Number, Positive, ProblemKind, Span};
use crate::limits::WorkArea;
use crate::mechanisms::MechanismKind;
use crate::table;

/// A mechanism, what it asks of each axis in the order of its joints, and where it rests.
pub(super) struct Built {
    pub(super) mechanism: MechanismKind,
    pub(super) joints: Vec<Joint>,
    /// The tool at rest [m].
    pub(super) home: [f64; 3],
}

/// What a mechanism's table needs of the rest of the file.
pub(super) struct BuildContext<'a> {
    pub(super) table: &'a MachineTable,
    pub(super) area: &'a WorkArea,
    /// Where the tool rests [m], unless the file says how the axes stand.
    pub(super) home: [f64; 3],
}

/// The one list of the mechanisms that a machine file can have: key, table, and what builds it.
macro_rules! mechanism_tables {
    ($( $(#[doc = $about:expr])* $key:ident: $table:ty, $build:path; )*) => {
        table! {
            /// How the axes move the tool: exactly one of these.
            pub struct MechanismTable {
                $( $(#[doc = $about])* pub $key: Option<$table>, )*
            }
        }

        impl MechanismTable {
            /// Every kind that the file declares, and where its table stands.
            fn declared(&self) -> Vec<(&'static str, Span)> {
                let all = [$( (stringify!($key), self.$key.as_ref().map(|table| table.span)) ),*];
                all.into_iter().filter_map(|(name, span)| Some((name, span?))).collect()
            }

            /// The kind that the file declares, or the first of them.
            fn name(&self) -> &'static str {
                self.declared().first().map_or("KIND", |(name, _)| name)
            }

            /// The mechanism of the first table that there is.
            fn build(
                &self,
                context: &BuildContext<'_>,
                diagnostics: &mut Diagnostics,
            ) -> Option<Built> {
                $( if let Some(table) = &self.$key {
                    return $build(table, context, diagnostics);
                } )*
                None
            }
        }
    };
}

mechanism_tables! {
    /// A carriage for each direction, on a screw, a belt or a rack.
    cartesian: cartesian::CartesianTable, cartesian::build;
    /// Two crossed belts that move one head.
    corexy: corexy::CoreXyTable, corexy::build;
    /// A scan head: two mirrors that turn the beam.
    galvo: galvo::GalvoTable, galvo::build;
    /// Two arms whose forearms meet in the tool (5R).
    five_bar: five_bar::FiveBarTable, five_bar::build;
    /// Two carts on one rail with a link each to the tool.
    prrrp: prrrp::PrrrpTable, prrrp::build;
    /// An arm over a rotary table.
    polar: polar::PolarTable, polar::build;
    /// A platform on three planar motors, six degrees of freedom.
    tri_planar: tri_planar::TriPlanarTable, tri_planar::build;
    /// A head that turns and tilts over a rotary table.
    mcm: mcm::McmTable, mcm::build;
    /// Two actuators of variable length that meet in one joint.
    twin_actuator: twin_actuator::TwinActuatorTable, twin_actuator::build;
    /// Any open chain of turning and sliding joints.
    serial: serial::SerialTable, serial::build;
}

/// The mechanism of `table`, with its tool at `home` [m] unless the file says how the axes stand.
pub(super) fn build(
    table: &MachineTable,
    area: &WorkArea,
    home: [f64; 3],
    diagnostics: &mut Diagnostics,
) -> Option<Built> {
    let kinds = &table.mechanism;
    springs::check(table, diagnostics);
    match kinds.declared().as_slice() {
        [] => {
            diagnostics.refuse(
                ProblemKind::MissingKey,
                kinds.span,
                "no mechanism is given".to_owned(),
                Some("add one, such as [mechanism.cartesian] or [mechanism.corexy]".to_owned()),
            );
            return None;
        }
        [_] => {}
        [(first, first_place), (second, second_place), ..] => {
            diagnostics.contradict(
                *first_place.max(second_place),
                "the machine has two mechanisms".to_owned(),
                &format!("keep either [mechanism.{first}] or [mechanism.{second}]"),
            );
            return None;
        }
    }
    if let Some(frame) = table.frame.as_ref().filter(|_| !FRAMED.contains(&kinds.name())) {
        diagnostics.contradict(
            frame.span,
            format!("[frame] has no effect on [mechanism.{}]", kinds.name()),
            "put what it says into the dimensions of the mechanism; it is of a cartesian, a corexy and a \
             galvo",
        );
    }
    kinds.build(&BuildContext { table, area, home }, diagnostics)
}

/// The damping ratios of the springs that there are.
pub(super) fn damping_ratios(table: &MachineTable) -> impl Iterator<Item = &Number<Positive>> {
    let kinds = &table.mechanism;
    let carriages = linear::carriages(kinds).map(|(_, carriage)| carriage);
    let sprung =
        carriages.filter(|carriage| carriage.stiffness.is_some() || carriage.shaft.is_some());
    let belt = kinds.corexy.iter().flat_map(|corexy| &corexy.belt);
    let axes = table.axis.entries.iter().filter_map(|(_, axis)| chain::damping_ratio(axis));
    sprung
        .map(|carriage| &carriage.damping_ratio)
        .chain(belt.map(|belt| &belt.damping_ratio))
        .chain(axes)
}

/// Where the travel of the axis `name` per turn of its gear is said.
pub(super) fn travel_place(table: &MachineTable, name: &str) -> Option<Span> {
    let kinds = &table.mechanism;
    let carriage = linear::carriages(kinds).find(|(axis, _)| *axis == name);
    let lead = carriage.and_then(|(_, carriage)| carriage.lead);
    let corexy = kinds.corexy.as_ref().filter(|_| name != "z");
    lead.map(|lead| lead.span)
        .or(corexy.map(|corexy| corexy.pulley_radius.span))
        .or(chain::axis(table, name).and_then(chain::travel_place))
}
