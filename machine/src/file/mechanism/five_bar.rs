//! The table of a five-bar.

use super::chain::{self, sign};
use super::{BuildContext, Built};
use crate::document::{Diagnostics, NonNegative, Number, Positive, Quantity};
use crate::file::axes::JointUnit;
use crate::mechanisms::MechanismKind;
use crate::mechanisms::five_bar::{FiveBar, FiveBarBranch};
use crate::quantity as unit;
use crate::table;

type Above<K> = Quantity<K, Positive>;

table! {
    /// Two motors side by side, an arm on each, and two forearms that meet in the tool (5R). Its axes
    /// are `th1` and `th2`, the angles of the arms from the x axis.
    pub struct FiveBarTable {
        /// Half the distance between the motors, which stand at (−e, 0) and (e, 0).
        pub half_base: Above<unit::Length>,
        /// Length of an arm, from motor to elbow (b of the source).
        pub proximal: Above<unit::Length>,
        /// Length of a forearm, from elbow to tool (a of the source).
        pub distal: Above<unit::Length>,
        /// Mass of an arm, its centre in the middle.
        pub proximal_mass: Above<unit::Mass>,
        /// Inertia of an arm about its centre of mass.
        pub proximal_inertia: Above<unit::Inertia>,
        /// Mass of a forearm, its centre in the middle.
        pub distal_mass: Above<unit::Mass>,
        /// Inertia of a forearm about its centre of mass.
        pub distal_inertia: Above<unit::Inertia>,
        /// Mass of the tool.
        pub tool_mass: Above<unit::Mass>,
        /// Mass of a bar that guides the tool and moves in y only.
        pub bar_mass: Quantity<unit::Mass, NonNegative> = "0 kg",
        /// For each arm, 1 with its elbow to the left of the way from motor to tool, −1 to the right.
        pub working_mode: [Number; 2],
        /// 1 with the tool to the left of the way from the first elbow to the second, −1 to the right.
        pub assembly_mode: Number = 1.0,
        /// Smallest sine of the angle between an arm and its forearm.
        pub type_1_margin: Number<Positive> = 0.05,
        /// Smallest sine of the angle between the forearms.
        pub type_2_margin: Number<Positive> = 0.1,
    }
}

pub(super) fn build(
    table: &FiveBarTable,
    context: &BuildContext<'_>,
    diagnostics: &mut Diagnostics,
) -> Option<Built> {
    let branch = FiveBarBranch {
        working_mode: [
            sign(&table.working_mode[0], diagnostics),
            sign(&table.working_mode[1], diagnostics),
        ],
        assembly_mode: sign(&table.assembly_mode, diagnostics),
    };
    let mut mechanism = FiveBar {
        half_base: table.half_base.value,
        proximal: table.proximal.value,
        distal: table.distal.value,
        proximal_mass: table.proximal_mass.value,
        proximal_inertia: table.proximal_inertia.value,
        distal_mass: table.distal_mass.value,
        distal_inertia: table.distal_inertia.value,
        tool_mass: table.tool_mass.value,
        bar_mass: table.bar_mass.value,
        type_1_limit: table.type_1_margin.value,
        type_2_limit: table.type_2_margin.value,
        branch,
        elasticity: None,
    };
    let names = [("th1", JointUnit::Angle), ("th2", JointUnit::Angle)];
    let (joints, elasticity, home) = chain::joints(&mechanism, names, context, diagnostics)?;
    mechanism.elasticity = elasticity;
    Some(Built { mechanism: MechanismKind::FiveBar(mechanism), joints, home })
}
