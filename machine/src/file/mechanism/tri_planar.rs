//! The table of a tri-planar platform.

use super::chain::{self, sign};
use super::serial::{FrameTable, frame};
use super::{BuildContext, Built};
use crate::document::{Diagnostics, NonNegative, Number, Positive, Quantity};
use crate::file::axes::JointUnit;
use crate::kinematics::{Joints, Pose};
use crate::mechanisms::MechanismKind;
use crate::mechanisms::tri_planar::{Fold, Legs, Mounting, TriPlanar};
use crate::quantity as unit;
use crate::table;
use nalgebra::Vector3;

type Above<K> = Quantity<K, Positive>;
type Range = [Quantity<unit::Length>; 2];

table! {
    /// A triangular platform on three hinged triangles, each on a planar motor: six degrees of freedom.
    /// Its axes are `xD`, `yD`, `xE`, `yE`, `xF` and `yF`, the places of the motors on the stator.
    pub struct TriPlanarTable {
        /// Side of platform and legs, all equal triangles (a of the source).
        pub side: Above<unit::Length>,
        /// The stator in x, [from, to].
        pub stator_x: Range,
        /// The stator in y, [from, to].
        pub stator_y: Range,
        /// Side of a motor's square body.
        pub inductor: Above<unit::Length>,
        /// Smallest gap between two motors.
        pub gap: Quantity<unit::Length, NonNegative> = "5 mm",
        /// Smallest height of the platform's corners over the stator.
        pub clearance: Quantity<unit::Length, NonNegative> = "20 mm",
        /// Smallest distance of a leg from standing upright, as the vertical part of its unit normal.
        pub type_1_margin: Number<Positive> = 0.15,
        /// Smallest singular value of the matrix of the six struts.
        pub type_2_margin: Number<Positive> = 0.05,
        /// Mass of the platform with its tool.
        pub platform_mass: Above<unit::Mass>,
        /// Inertia of the platform about its x, y and z.
        pub platform_inertia: [Above<unit::Inertia>; 3],
        /// Mass of one leg, a uniform thin triangle.
        pub leg_mass: Above<unit::Mass>,
        /// Mass of one planar motor.
        pub motor_mass: Above<unit::Mass>,
        /// The sides of the legs that meet in a foot, as measured; `side` where they are left out. For D from
        /// the corners A and C, for E from C and B, for F from A and B.
        pub legs_length: Option<[[Above<unit::Length>; 2]; 3]>,
        /// Where the stator stands, as measured.
        pub base: FrameTable,
        /// Where the tool is on the platform, seen from its centroid.
        pub tool: FrameTable,
        /// For the legs at D, E and F, 1 folded away from the platform, −1 below it.
        pub legs: Option<[Number; 3]>,
    }
}

/// The lengths of the legs' sides, none of them far from the platform's.
fn struts(table: &TriPlanarTable, diagnostics: &mut Diagnostics) -> [[f64; 2]; 3] {
    /// A leg may be so much longer or shorter than drawn, as a share.
    const OFF: f64 = 0.1;
    let side = table.side.value;
    let Some(lengths) = &table.legs_length else { return [[side; 2]; 3] };
    for length in lengths.iter().flatten() {
        let near = (length.value - side).abs() <= OFF * side;
        if !near {
            diagnostics.contradict(
                length.span,
                format!(
                    "a leg of {:.6} m is no leg of a platform whose `side` is {side} m",
                    length.value
                ),
                "write a length within a tenth of `side`",
            );
        }
    }
    lengths.each_ref().map(|pair| pair.each_ref().map(|length| length.value))
}

/// Where stator and tool are, unless that is where they are drawn.
fn mounting(table: &TriPlanarTable) -> Option<Mounting> {
    let (base, tool) = (frame(&table.base), frame(&table.tool));
    let drawn = Pose::at(Vector3::zeros());
    (base != drawn || tool != drawn).then_some(Mounting { base, tool })
}

pub(super) fn build(
    table: &TriPlanarTable,
    context: &BuildContext<'_>,
    diagnostics: &mut Diagnostics,
) -> Option<Built> {
    let mut fold = |number: &Number| match sign(number, diagnostics) {
        1 => Fold::Outward,
        _ => Fold::Inward,
    };
    let legs = match &table.legs {
        Some([d, e, f]) => Legs([fold(d), fold(e), fold(f)]),
        None => Legs([Fold::Outward; 3]),
    };
    let range = |range: &Range| [range[0].value, range[1].value];
    let mut mechanism = TriPlanar {
        side: table.side.value,
        struts: struts(table, diagnostics),
        mounting: mounting(table),
        home: None,
        stator: [range(&table.stator_x), range(&table.stator_y)],
        inductor: table.inductor.value,
        gap: table.gap.value,
        clearance: table.clearance.value,
        type_1_limit: table.type_1_margin.value,
        type_2_limit: table.type_2_margin.value,
        platform_mass: table.platform_mass.value,
        platform_inertia: table.platform_inertia.map(|inertia| inertia.value),
        leg_mass: table.leg_mass.value,
        inductor_mass: table.motor_mass.value,
        legs,
        elasticity: None,
    };
    let names = ["xD", "yD", "xE", "yE", "xF", "yF"].map(|name| (name, JointUnit::Length));
    let (mut joints, elasticity, home) = chain::joints(&mechanism, names, context, diagnostics)?;
    let feet = Joints::<6>::from_fn(|axis, _| joints[axis].home);
    let standing = mechanism.standing_near(&feet, &Pose::at(home.into()));
    let half = mechanism.inductor / 2.0;
    for (index, joint) in joints.iter_mut().enumerate() {
        let [lower, upper] = mechanism.stator[index % 2];
        joint.range = Some([lower + half, upper - half]);
    }
    mechanism.elasticity = elasticity;
    mechanism.home = standing;
    Some(Built { mechanism: MechanismKind::TriPlanar(Box::new(mechanism)), joints, home })
}
