//! The stiffness of a transmission, given or from what it is made of.

use super::corexy::BeltTable;
use super::linear::{self, CarriageTable};
use crate::document::{Diagnostics, Number, Positive, ProblemKind, Span};
use crate::file::tables::{AxisTable, MachineTable, SectionTable, ShaftTable};
use crate::quantity as unit;
use crate::transmission::belt::Belt;
use crate::transmission::screw::{self, ScrewShaft};

type Above<K> = crate::document::Quantity<K, crate::document::Positive>;

/// Of a screw of `lead` [m/rad], seen at the nut [N/m]; `None` where it is rigid.
pub(super) fn of_screw(
    declared: Option<&Above<unit::TorsionalStiffness>>,
    shaft: Option<&ShaftTable>,
    lead: f64,
) -> Option<f64> {
    let torsional = match (declared, shaft) {
        (Some(declared), _) => declared.value,
        (None, Some(shaft)) => shaft_of(shaft).stiffness(lead),
        (None, None) => return None,
    };
    Some(screw::at_nut(torsional, lead))
}

/// Of a belt, both spans [N/m]; `None` where it is rigid.
pub(super) fn of_belt(
    declared: Option<&Above<unit::Stiffness>>,
    section: Option<&SectionTable>,
) -> Option<f64> {
    let built = section.map(|section| {
        let belt = Belt { modulus: section.modulus.value, section: section.area.value };
        belt.stiffness(section.spans.map(|span| span.value))
    });
    declared.map(|declared| declared.value).or(built)
}

fn shaft_of(table: &ShaftTable) -> ScrewShaft {
    ScrewShaft {
        core_diameter: table.core_diameter.value,
        bore: table.bore.value,
        length: table.length.value,
        modulus: table.modulus.value,
        shear_modulus: table.shear_modulus.value,
        nut_stiffness: table.nut_stiffness.map_or(f64::INFINITY, |stiffness| stiffness.value),
        nut_accuracy: table.nut_accuracy.value,
    }
}

/// Refuses stiffnesses that are said twice, or not at all, and shafts without material.
pub(super) fn check(table: &MachineTable, diagnostics: &mut Diagnostics) {
    let mechanism = &table.mechanism;
    for (_, carriage) in linear::carriages(mechanism) {
        let CarriageTable { stiffness, shaft, .. } = carriage;
        check_shaft(stiffness.is_some(), shaft.as_ref(), diagnostics);
        if carriage.lead.is_some() {
            let is_rigid = stiffness.is_none() && shaft.is_none();
            rigid(is_rigid, &carriage.damping_ratio, carriage.span, diagnostics);
        }
    }
    if let Some(belt) = mechanism.corexy.as_ref().and_then(|corexy| corexy.belt.as_ref()) {
        let BeltTable { stiffness, section, span, .. } = belt;
        let built = section.as_ref().map(|section| section.span);
        once(stiffness.is_some(), built, "section", diagnostics);
        if stiffness.is_none() && built.is_none() {
            diagnostics.refuse(
                ProblemKind::MissingKey,
                *span,
                "nothing says how stiff the belts are".to_owned(),
                Some(
                    "add `stiffness`, or a `section`; leave `belt` out to make them rigid"
                        .to_owned(),
                ),
            );
        }
    }
    for (_, AxisTable { transmission, .. }) in &table.axis.entries {
        if let Some(screw) = &transmission.screw {
            check_shaft(screw.stiffness.is_some(), screw.shaft.as_ref(), diagnostics);
            let is_rigid = screw.stiffness.is_none() && screw.shaft.is_none();
            rigid(is_rigid, &screw.damping_ratio, screw.span, diagnostics);
        }
        if let Some(belt) = &transmission.belt {
            let built = belt.section.as_ref().map(|section| section.span);
            once(belt.stiffness.is_some(), built, "section", diagnostics);
            let is_rigid = belt.stiffness.is_none() && built.is_none();
            rigid(is_rigid, &belt.damping_ratio, belt.span, diagnostics);
        }
        if let Some(rack) = &transmission.rack {
            rigid(rack.stiffness.is_none(), &rack.damping_ratio, rack.span, diagnostics);
        }
        if let Some(direct) = &transmission.direct {
            rigid(direct.stiffness.is_none(), &direct.damping_ratio, direct.span, diagnostics);
        }
    }
}

/// Refuses a damping ratio of a spring that there is not; the table stands at `table`.
fn rigid(is_rigid: bool, ratio: &Number<Positive>, table: Span, diagnostics: &mut Diagnostics) {
    // The place of a default is that of its table.
    if is_rigid && ratio.span != table {
        diagnostics.contradict(
            ratio.span,
            "`damping_ratio` has no effect: without a `stiffness` the transmission is rigid"
                .to_owned(),
            "say how stiff it is, or leave the damping out",
        );
    }
}

fn check_shaft(declared: bool, shaft: Option<&ShaftTable>, diagnostics: &mut Diagnostics) {
    let Some(shaft) = shaft else { return };
    once(declared, Some(shaft.span), "shaft", diagnostics);
    let ShaftTable { bore, core_diameter, .. } = shaft;
    if bore.value >= core_diameter.value {
        diagnostics.contradict(
            bore.span,
            format!("a bore of {} m leaves nothing of {} m", bore.value, core_diameter.value),
            "make the bore smaller than the core",
        );
    }
}

fn once(declared: bool, built: Option<Span>, name: &str, diagnostics: &mut Diagnostics) {
    if let (true, Some(span)) = (declared, built) {
        diagnostics.contradict(
            span,
            format!("the stiffness is given twice, by `stiffness` and by `{name}`"),
            "keep one of them",
        );
    }
}
