//! The table of a polar machine.

use super::chain;
use super::{BuildContext, Built};
use crate::document::{Diagnostics, NonNegative, Positive, Quantity};
use crate::file::axes::JointUnit;
use crate::kinematics::STANDARD_GRAVITY;
use crate::mechanisms::MechanismKind;
use crate::mechanisms::polar::{Polar, PolarBranch, PolarLoad};
use crate::quantity as unit;
use crate::table;

type Above<K> = Quantity<K, Positive>;
type AtLeastZero<K> = Quantity<K, NonNegative>;

table! {
    /// An arm that swings the head over a rotary table, and a vertical axis. Its axes are `th1` (arm),
    /// `th2` (table) and `d` (height); the work turns with the table.
    pub struct PolarTable {
        /// Length of the arm, from its pivot to the beam (a1 of the source).
        pub arm: Above<unit::Length>,
        /// Distance of the table's axis from the arm's pivot (c).
        pub center_distance: Above<unit::Length>,
        /// Height of the focus over the table with the vertical axis at zero (z0).
        pub height: Quantity<unit::Length> = "0 mm",
        /// Nearer to the centre than this, a position alone does not tell the table's angle.
        pub singular_radius: Above<unit::Length> = "0.2 mm",
        /// Mass of the arm (m1).
        pub arm_mass: Above<unit::Mass>,
        /// Distance of the arm's centre of mass from its pivot (ac).
        pub arm_center: AtLeastZero<unit::Length>,
        /// Inertia of the arm about its centre of mass (Izz1).
        pub arm_inertia: Above<unit::Inertia>,
        /// Mass of the head, which also moves up and down (m2).
        pub head_mass: Above<unit::Mass>,
        /// Distance of the head's centre of mass from the arm's pivot (rc2); the arm's length when left
        /// out.
        pub head_center: Option<AtLeastZero<unit::Length>>,
        /// Inertia of the head about its centre of mass (Izz2).
        pub head_inertia: AtLeastZero<unit::Inertia> = "0 kg m^2",
        /// Inertia of the table about its axis (It).
        pub table_inertia: Above<unit::Inertia>,
        /// Mass of the workpiece (mw).
        pub workpiece_mass: AtLeastZero<unit::Mass> = "0 kg",
        /// Distance of the workpiece's centre of mass from the table's axis (rw).
        pub workpiece_center: AtLeastZero<unit::Length> = "0 mm",
        /// Inertia of the workpiece about its centre of mass (Iw).
        pub workpiece_inertia: AtLeastZero<unit::Inertia> = "0 kg m^2",
        /// Upward force of a counterbalance on the head (Fcb).
        pub counterbalance: Quantity<unit::Force> = "0 N",
    }
}

pub(super) fn build(
    table: &PolarTable,
    context: &BuildContext<'_>,
    diagnostics: &mut Diagnostics,
) -> Option<Built> {
    let names = [("th1", JointUnit::Angle), ("th2", JointUnit::Angle), ("d", JointUnit::Length)];
    let mut mechanism = Polar {
        arm: table.arm.value,
        center_distance: table.center_distance.value,
        height: table.height.value,
        singular_radius: table.singular_radius.value,
        endless: chain::range(context, "th2").is_some_and(|[lower, _]| lower.is_infinite()),
        branch: PolarBranch { side: None, table_turn: None },
        load: PolarLoad {
            arm_mass: table.arm_mass.value,
            arm_center: table.arm_center.value,
            arm_inertia: table.arm_inertia.value,
            head_mass: table.head_mass.value,
            head_center: table.head_center.map_or(table.arm.value, |center| center.value),
            head_inertia: table.head_inertia.value,
            table_inertia: table.table_inertia.value,
            workpiece_mass: table.workpiece_mass.value,
            workpiece_center: table.workpiece_center.value,
            workpiece_inertia: table.workpiece_inertia.value,
            counterbalance: table.counterbalance.value,
            gravity: STANDARD_GRAVITY,
        },
        elasticity: None,
    };
    let (joints, elasticity, home) = chain::joints(&mechanism, names, context, diagnostics)?;
    mechanism.elasticity = elasticity;
    Some(Built { mechanism: MechanismKind::Polar(mechanism), joints, home })
}
