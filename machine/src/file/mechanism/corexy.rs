//! The table of a CoreXY machine.

use super::linear::{self, CarriageTable, Part};
use super::{BuildContext, Built, chain::Output, springs};
use crate::document::{Diagnostics, Number, Positive, Quantity};
use crate::file::axes::JointUnit;
use crate::file::frame;
use crate::file::tables::SectionTable;
use crate::mechanisms::CoreXy;
use crate::quantity as unit;
use crate::table;
use crate::transmission::Elasticity;

type Above<K> = Quantity<K, Positive>;

table! {
    /// Two crossed belts that move one head. Its axes are the belts `a` and `b`, and `z` if it has one.
    pub struct CoreXyTable {
        /// Mass that moves in x: the head.
        pub mass_x: Above<unit::Mass>,
        /// Mass that moves in y: the head with its bridge.
        pub mass_y: Above<unit::Mass>,
        /// Pitch radius of the driving pulleys.
        pub pulley_radius: Above<unit::Length>,
        /// The belts' elasticity; rigid when left out.
        pub belt: Option<BeltTable>,
        /// Carriage of z, where the head moves up and down. It is elastic if the belts are.
        pub z: Option<CarriageTable>,
    }
}

table! {
    /// Elasticity of both belts together, in each direction of the tool.
    pub struct BeltTable {
        /// Stiffness in x and in y, both belts together.
        pub stiffness: Option<Above<unit::Stiffness>>,
        /// The belts that it follows from, instead of `stiffness`.
        pub section: Option<SectionTable>,
        /// Damping between motor and tool, as a share of critical damping in each direction.
        pub damping_ratio: Number<Positive> = 0.9,
    }
}

pub(super) fn build(
    table: &CoreXyTable,
    context: &BuildContext<'_>,
    diagnostics: &mut Diagnostics,
) -> Option<Built> {
    let mass = [table.mass_x.value, table.mass_y.value];
    let belts = ["a", "b"].map(|name| {
        linear::no_transmission(
            name,
            "[mechanism.corexy] gives the belts",
            "write `pulley_radius` and `belt` there, and the gear in the axis",
            context,
            diagnostics,
        );
        Part {
            name,
            unit: JointUnit::Length,
            // Source 003 eq. 4.6: the diagonal of Jᵀ·M·J.
            load: (mass[0] + mass[1]) / 4.0,
            output: Some(Output {
                travel: table.pulley_radius.value,
                inertia: 0.0,
                spring: None,
                unit: JointUnit::Length,
                span: table.span,
            }),
        }
    });
    let springs = table.belt.as_ref().and_then(|belt| {
        // A direction of the tool has a span of either belt on either side.
        let both = |belt: f64| 2.0 * belt;
        let built = springs::of_belt(None, belt.section.as_ref()).map(both);
        let stiffness = belt.stiffness.map(|declared| declared.value).or(built)?;
        Some(mass.map(|mass| Elasticity::damped(stiffness, mass, belt.damping_ratio.value)))
    });
    let Some(lift) = &table.z else {
        let frame = frame::build(context.table, false, context.area, diagnostics);
        let mechanism = CoreXy { mass, elasticity: springs, frame };
        let joints = linear::joints(&mechanism, &belts, context, diagnostics)?;
        return Some(Built { mechanism: mechanism.into(), joints, home: context.home });
    };
    let lift = Part::carriage("z", lift, context, diagnostics);
    let spring = linear::elasticity(core::array::from_ref(&lift), diagnostics);
    if let (Some(output), true) = (&lift.output, springs.is_some() != spring.is_some()) {
        diagnostics.contradict(
            output.span,
            "one of belts and lift is elastic, the other is rigid".to_owned(),
            "give both their stiffness, or none",
        );
    }
    let mechanism = CoreXy {
        mass: [mass[0], mass[1], lift.load],
        elasticity: springs.zip(spring).map(|([x, y], [z])| [x, y, z]),
        frame: frame::build(context.table, true, context.area, diagnostics),
    };
    let [a, b] = belts;
    let joints = linear::joints(&mechanism, &[a, b, lift], context, diagnostics)?;
    Some(Built { mechanism: mechanism.into(), joints, home: context.home })
}
