//! Cartesian and CoreXY: joints that follow from the area.

use super::{Built, springs};
use crate::document::Diagnostics;
use crate::file::axes::{Joint, JointUnit};
use crate::file::tables::{CartesianTable, CoreXyTable, ScrewTable};
use crate::limits::WorkArea;
use crate::mechanisms::{Cartesian, CoreXy, MechanismKind};
use crate::transmission::Elasticity;

pub(super) fn cartesian(
    table: &CartesianTable,
    area: &WorkArea,
    home: [f64; 3],
    diagnostics: &mut Diagnostics,
) -> Option<Built> {
    let screws: Vec<&ScrewTable> = [&table.x, &table.y].into_iter().chain(&table.z).collect();
    let joints: Vec<Joint> = ["x", "y", "z"]
        .into_iter()
        .zip(&screws)
        .enumerate()
        .map(|(index, (name, screw))| Joint {
            name,
            travel: screw.lead.value,
            load: screw.mass.value,
            stiff_inertia: screw.inertia.value,
            unit: JointUnit::Length,
            range: Some([area.lower[index], area.upper[index]]),
            home: home[index],
            worst_speed: 1.0,
        })
        .collect();
    let springs: Vec<Elasticity> = screws
        .iter()
        .filter_map(|screw| {
            let lead = screw.lead.value;
            let spring = springs::of_screw(screw.stiffness.as_ref(), screw.shaft.as_ref(), lead)?;
            Some(Elasticity::damped(spring, screw.mass.value, screw.damping_ratio.value))
        })
        .collect();
    if !springs.is_empty() && springs.len() < screws.len() {
        let rigid = screws.iter().find(|screw| screw.stiffness.is_none() && screw.shaft.is_none());
        diagnostics.contradict(
            rigid.map_or(table.span, |screw| screw.span),
            "this screw is rigid, another one is not".to_owned(),
            "give every screw its `stiffness` or `shaft`, or none",
        );
        return None;
    }
    let kind = match *screws.as_slice() {
        [x, y] => MechanismKind::Cartesian(Cartesian {
            mass: [x.mass.value, y.mass.value],
            elasticity: springs.try_into().ok(),
        }),
        [x, y, z] => MechanismKind::CartesianLift(Cartesian {
            mass: [x.mass.value, y.mass.value, z.mass.value],
            elasticity: springs.try_into().ok(),
        }),
        _ => return None,
    };
    Some(Built { mechanism: kind, joints, home })
}

pub(super) fn corexy(table: &CoreXyTable, area: &WorkArea, home: [f64; 3]) -> Built {
    let mass = [table.mass_x.value, table.mass_y.value];
    let joint = |name, range, home| Joint {
        name,
        travel: table.pulley_radius.value,
        // Source 003 eq. 4.6: the diagonal of Jᵀ·M·J.
        load: (mass[0] + mass[1]) / 4.0,
        stiff_inertia: 0.0,
        unit: JointUnit::Length,
        range: Some(range),
        home,
        // Along a diagonal one belt takes the whole motion.
        worst_speed: core::f64::consts::SQRT_2,
    };
    let ([x0, y0, _], [x1, y1, _]) = (area.lower, area.upper);
    let joints = vec![
        joint("a", [x0 + y0, x1 + y1], home[0] + home[1]),
        joint("b", [x0 - y1, x1 - y0], home[0] - home[1]),
    ];
    let elasticity = table.belt.as_ref().and_then(|belt| {
        // A direction of the tool has a span of either belt on either side.
        let both = |belt: f64| 2.0 * belt;
        let built = springs::of_belt(None, belt.section.as_ref()).map(both);
        let stiffness = belt.stiffness.map(|declared| declared.value).or(built)?;
        Some(mass.map(|mass| Elasticity::damped(stiffness, mass, belt.damping_ratio.value)))
    });
    Built { mechanism: MechanismKind::CoreXy(CoreXy { mass, elasticity }), joints, home }
}
