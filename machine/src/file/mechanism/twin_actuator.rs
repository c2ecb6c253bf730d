//! The table of a twin actuator.

use nalgebra::Vector2;

use super::chain::{self, sign};
use super::{BuildContext, Built};
use crate::document::{Diagnostics, NonNegative, Number, Positive, Quantity};
use crate::file::axes::JointUnit;
use crate::mechanisms::MechanismKind;
use crate::mechanisms::twin_actuator::{ActuatorBodies, TwinActuator, TwinBranch};
use crate::quantity as unit;
use crate::table;

type Above<K> = Quantity<K, Positive>;

table! {
    /// Two actuators of variable length that turn about their bases and meet in one joint. Its axes
    /// are `la` and `lb`, their whole lengths from base to joint.
    pub struct TwinActuatorTable {
        /// Where actuator a turns, [x, y] (A of the source).
        pub base_a: [Quantity<unit::Length>; 2],
        /// Where actuator b turns, [x, y] (B of the source).
        pub base_b: [Quantity<unit::Length>; 2],
        /// Distance of the tool from the joint (h of the source).
        pub offset: Quantity<unit::Length, NonNegative>,
        /// Angle at the joint from actuator a to the tool, positive clockwise (θh of the source).
        pub offset_angle: Quantity<unit::Angle> = "0 deg",
        /// Moving parts of actuator a.
        pub body_a: ActuatorTable,
        /// Moving parts of actuator b.
        pub body_b: ActuatorTable,
        /// Mass of the tool.
        pub tool_mass: Above<unit::Mass>,
        /// 1 with the joint to the left of the way from A to B, −1 to the right.
        pub elbow: Number = 1.0,
        /// Smallest sine of the angle at A between base line and actuator a.
        pub baseline_margin: Number<Positive> = 0.1,
        /// Smallest length of actuator a beyond the foot of the tool's offset on it.
        pub near_margin: Above<unit::Length> = "20 mm",
    }
}

table! {
    /// The moving parts of one actuator.
    pub struct ActuatorTable {
        /// Inertia of the housing about the base.
        pub housing_inertia: Above<unit::Inertia>,
        /// Mass of the rod and what moves out with it.
        pub rod_mass: Above<unit::Mass>,
        /// Inertia of the rod about its centre of mass.
        pub rod_inertia: Above<unit::Inertia>,
        /// Distance of the rod's centre of mass from the joint, towards the base.
        pub rod_center: Quantity<unit::Length, NonNegative>,
    }
}

fn bodies(table: &ActuatorTable) -> ActuatorBodies {
    ActuatorBodies {
        housing_inertia: table.housing_inertia.value,
        rod_mass: table.rod_mass.value,
        rod_inertia: table.rod_inertia.value,
        rod_center: table.rod_center.value,
    }
}

pub(super) fn build(
    table: &TwinActuatorTable,
    context: &BuildContext<'_>,
    diagnostics: &mut Diagnostics,
) -> Option<Built> {
    let base = |point: &[Quantity<unit::Length>; 2]| Vector2::new(point[0].value, point[1].value);
    let bases = [base(&table.base_a), base(&table.base_b)];
    if bases[0] == bases[1] {
        diagnostics.contradict(
            table.base_b[0].span,
            "both actuators turn about the same point".to_owned(),
            "give them two bases",
        );
        return None;
    }
    let mut mechanism = TwinActuator {
        bases,
        offset: table.offset.value,
        offset_angle: table.offset_angle.value,
        bodies: [bodies(&table.body_a), bodies(&table.body_b)],
        tool_mass: table.tool_mass.value,
        baseline_limit: table.baseline_margin.value,
        near_limit: table.near_margin.value,
        branch: TwinBranch { elbow: sign(&table.elbow, diagnostics) },
        elasticity: None,
    };
    let names = [("la", JointUnit::Length), ("lb", JointUnit::Length)];
    let (joints, elasticity, home) = chain::joints(&mechanism, names, context, diagnostics)?;
    mechanism.elasticity = elasticity;
    Some(Built { mechanism: MechanismKind::TwinActuator(mechanism), joints, home })
}
