//! From the table of a mechanism to the mechanism, and what it asks of each axis.

mod chain;
pub mod five_bar;
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
use super::tables::{MachineTable, MechanismTable};
use crate::document::{Diagnostics, Number, Positive, ProblemKind, Span};
use crate::limits::WorkArea;
use crate::mechanisms::MechanismKind;

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

/// Every kind of mechanism, and where its table stands if the file declares it.
fn declared(table: &MechanismTable) -> Vec<(&'static str, Span)> {
    let MechanismTable {
        cartesian,
        corexy,
        five_bar,
        prrrp,
        polar,
        tri_planar,
        mcm,
        twin_actuator,
        serial,
        span: _,
    } = table;
    [
        ("cartesian", cartesian.as_ref().map(|table| table.span)),
        ("corexy", corexy.as_ref().map(|table| table.span)),
        ("five_bar", five_bar.as_ref().map(|table| table.span)),
        ("prrrp", prrrp.as_ref().map(|table| table.span)),
        ("polar", polar.as_ref().map(|table| table.span)),
        ("tri_planar", tri_planar.as_ref().map(|table| table.span)),
        ("mcm", mcm.as_ref().map(|table| table.span)),
        ("twin_actuator", twin_actuator.as_ref().map(|table| table.span)),
        ("serial", serial.as_ref().map(|table| table.span)),
    ]
    .into_iter()
    .filter_map(|(name, span)| Some((name, span?)))
    .collect()
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
    match declared(kinds).as_slice() {
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
    if let Some(cartesian) = &kinds.cartesian {
        return linear::cartesian(cartesian, area, home, diagnostics);
    }
    if let Some(corexy) = &kinds.corexy {
        return Some(linear::corexy(corexy, area, home));
    }
    let context = BuildContext { table, area, home };
    if let Some(five_bar) = &kinds.five_bar {
        return five_bar::build(five_bar, &context, diagnostics);
    }
    if let Some(prrrp) = &kinds.prrrp {
        return prrrp::build(prrrp, &context, diagnostics);
    }
    if let Some(polar) = &kinds.polar {
        return polar::build(polar, &context, diagnostics);
    }
    if let Some(tri_planar) = &kinds.tri_planar {
        return tri_planar::build(tri_planar, &context, diagnostics);
    }
    if let Some(mcm) = &kinds.mcm {
        return mcm::build(mcm, &context, diagnostics);
    }
    if let Some(twin_actuator) = &kinds.twin_actuator {
        return twin_actuator::build(twin_actuator, &context, diagnostics);
    }
    if let Some(serial) = &kinds.serial {
        return serial::build(serial, &context, diagnostics);
    }
    None
}

/// The damping ratios of the springs that there are.
pub(super) fn damping_ratios(table: &MachineTable) -> impl Iterator<Item = &Number<Positive>> {
    let kinds = &table.mechanism;
    let screws = kinds
        .cartesian
        .iter()
        .flat_map(|cartesian| [&cartesian.x, &cartesian.y].into_iter().chain(&cartesian.z));
    let sprung = screws.filter(|screw| screw.stiffness.is_some() || screw.shaft.is_some());
    let belt = kinds.corexy.iter().flat_map(|corexy| &corexy.belt);
    let axes = table.axis.entries.iter().filter_map(|(_, axis)| chain::damping_ratio(axis));
    sprung.map(|screw| &screw.damping_ratio).chain(belt.map(|belt| &belt.damping_ratio)).chain(axes)
}
