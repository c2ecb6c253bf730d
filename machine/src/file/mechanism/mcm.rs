//! The table of an MCM.

use super::chain;
use super::{BuildContext, Built};
use crate::document::{Diagnostics, NonNegative, Positive, Quantity};
use crate::file::axes::JointUnit;
use crate::kinematics::STANDARD_GRAVITY;
use crate::mechanisms::MechanismKind;
use crate::mechanisms::mcm::{Mcm, McmBranch, McmLoad};
use crate::quantity as unit;
use crate::table;

type Above<K> = Quantity<K, Positive>;
type AtLeastZero<K> = Quantity<K, NonNegative>;

table! {
    /// A head that turns and tilts on two carriages, over a rotary table that carries the work. Its
    /// axes are `X`, `Z`, `d` (table), `a` (tilt) and `r` (turn).
    pub struct McmTable {
        /// Length of the tool, from the tilting axis to the focus (l of the source).
        pub tool: Above<unit::Length>,
        /// Offset of the head's turning axis from the plane of the table's axis (x0).
        pub offset: Quantity<unit::Length> = "0 mm",
        /// Height of the tilting axis over the table with Z at zero (z0).
        pub height: Quantity<unit::Length>,
        /// Nearer to the table's axis than this its angle is not determined.
        pub singular_distance: Above<unit::Length> = "0.1 mm",
        /// Mass that moves along X only.
        pub carriage_mass: Above<unit::Mass>,
        /// Mass of slide and yoke, which move along X and Z.
        pub slide_mass: Above<unit::Mass>,
        /// Inertia of table and workpiece about the table's axis.
        pub table_inertia: Above<unit::Inertia>,
        /// Inertia of the yoke about the turning axis, without the head.
        pub yoke_inertia: Above<unit::Inertia>,
        /// Mass of the tilting head.
        pub head_mass: Above<unit::Mass>,
        /// Distance of the head's centre of mass from the tilting axis, towards the focus.
        pub head_center: Quantity<unit::Length>,
        /// Inertia of the head about its centre of mass: about the tilting axis, across both, and about
        /// the beam.
        pub head_inertia: [Above<unit::Inertia>; 3],
        /// Upward force of a counterbalance on the slide.
        pub counterbalance: AtLeastZero<unit::Force> = "0 N",
    }
}

pub(super) fn build(
    table: &McmTable,
    context: &BuildContext<'_>,
    diagnostics: &mut Diagnostics,
) -> Option<Built> {
    let mut mechanism = Mcm {
        tool: table.tool.value,
        offset: table.offset.value,
        height: table.height.value,
        reach: chain::range(context, "X").unwrap_or([f64::NEG_INFINITY, f64::INFINITY]),
        singular_distance: table.singular_distance.value,
        branch: McmBranch { side: None, lean: None },
        load: McmLoad {
            carriage_mass: table.carriage_mass.value,
            slide_mass: table.slide_mass.value,
            table_inertia: table.table_inertia.value,
            yoke_inertia: table.yoke_inertia.value,
            head_mass: table.head_mass.value,
            head_center: table.head_center.value,
            head_inertia: table.head_inertia.map(|inertia| inertia.value),
            counterbalance: table.counterbalance.value,
            gravity: STANDARD_GRAVITY,
        },
        elasticity: None,
    };
    let names = [
        ("X", JointUnit::Length),
        ("Z", JointUnit::Length),
        ("d", JointUnit::Angle),
        ("a", JointUnit::Angle),
        ("r", JointUnit::Angle),
    ];
    let (joints, elasticity, home) = chain::joints(&mechanism, names, context, diagnostics)?;
    mechanism.elasticity = elasticity;
    Some(Built { mechanism: MechanismKind::Mcm(mechanism), joints, home })
}
