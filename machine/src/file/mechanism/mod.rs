//! From the table of a mechanism to the mechanism, and what it asks of each axis.

mod chain;
pub mod five_bar;
mod linear;
pub mod mcm;
pub mod polar;
pub mod prrrp;
mod rest;
pub mod serial;
mod springs;
pub mod tri_planar;
pub mod twin_actuator;

use super::axes::Joint;
use super::tables::{MachineTable, MechanismTable};
use crate::document::{Findings, Number, Place, Positive, ProblemKind};
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
pub(super) struct Site<'a> {
    pub(super) table: &'a MachineTable,
    pub(super) area: &'a WorkArea,
    /// Where the tool rests [m], unless the file says how the axes stand.
    pub(super) home: [f64; 3],
}

/// Every kind of mechanism, and where its table stands if it is given.
fn given(table: &MechanismTable) -> Vec<(&'static str, Place)> {
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
        place: _,
    } = table;
    [
        ("cartesian", cartesian.as_ref().map(|table| table.place)),
        ("corexy", corexy.as_ref().map(|table| table.place)),
        ("five_bar", five_bar.as_ref().map(|table| table.place)),
        ("prrrp", prrrp.as_ref().map(|table| table.place)),
        ("polar", polar.as_ref().map(|table| table.place)),
        ("tri_planar", tri_planar.as_ref().map(|table| table.place)),
        ("mcm", mcm.as_ref().map(|table| table.place)),
        ("twin_actuator", twin_actuator.as_ref().map(|table| table.place)),
        ("serial", serial.as_ref().map(|table| table.place)),
    ]
    .into_iter()
    .filter_map(|(name, place)| Some((name, place?)))
    .collect()
}

/// The mechanism of `table`, with its tool at `home` [m] unless the file says how the axes stand.
pub(super) fn build(
    table: &MachineTable,
    area: &WorkArea,
    home: [f64; 3],
    findings: &mut Findings,
) -> Option<Built> {
    let kinds = &table.mechanism;
    springs::check(table, findings);
    match given(kinds).as_slice() {
        [] => {
            findings.refuse(
                ProblemKind::MissingKey,
                kinds.place,
                "no mechanism is given".to_owned(),
                Some("add one, such as [mechanism.cartesian] or [mechanism.corexy]".to_owned()),
            );
            return None;
        }
        [_] => {}
        [(first, first_place), (second, second_place), ..] => {
            findings.contradict(
                *first_place.max(second_place),
                "the machine has two mechanisms".to_owned(),
                &format!("keep either [mechanism.{first}] or [mechanism.{second}]"),
            );
            return None;
        }
    }
    if let Some(cartesian) = &kinds.cartesian {
        return linear::cartesian(cartesian, area, home, findings);
    }
    if let Some(corexy) = &kinds.corexy {
        return Some(linear::corexy(corexy, area, home));
    }
    let site = Site { table, area, home };
    if let Some(five_bar) = &kinds.five_bar {
        return five_bar::build(five_bar, &site, findings);
    }
    if let Some(prrrp) = &kinds.prrrp {
        return prrrp::build(prrrp, &site, findings);
    }
    if let Some(polar) = &kinds.polar {
        return polar::build(polar, &site, findings);
    }
    if let Some(tri_planar) = &kinds.tri_planar {
        return tri_planar::build(tri_planar, &site, findings);
    }
    if let Some(mcm) = &kinds.mcm {
        return mcm::build(mcm, &site, findings);
    }
    if let Some(twin_actuator) = &kinds.twin_actuator {
        return twin_actuator::build(twin_actuator, &site, findings);
    }
    if let Some(serial) = &kinds.serial {
        return serial::build(serial, &site, findings);
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
