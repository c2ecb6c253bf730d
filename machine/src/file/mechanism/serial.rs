//! The table of a serial arm.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::chain;
use super::{BuildContext, Built};
use crate::document::{Diagnostics, NonNegative, Point, Positive, Quantity, Spanned};
use crate::file::axes::{Joint, JointUnit};
use crate::kinematics::{Mechanism, Pose, STANDARD_GRAVITY, TaskSpace};
use crate::mechanisms::MechanismKind;
use crate::mechanisms::serial::{JointKind, Link, Serial};
use crate::quantity as unit;
use crate::table;
use crate::transmission::Elasticity;

type Signed<K> = Quantity<K>;

table! {
    /// Any open chain of two to six turning and sliding joints, by modified Denavit-Hartenberg
    /// parameters (source 000 sec. 3). Its axes are `j1`, `j2` and so on, one for each link.
    pub struct SerialTable {
        /// The links, from the base on.
        pub link: Vec<SerialLinkTable>,
        /// Where the base stands.
        pub base: FrameTable,
        /// The tool, seen from the last link; the beam shines along its −z.
        pub tool: FrameTable,
        /// What of a pose the joints must meet: `plane` (x and y), `space` (x, y and z), `axis` (also
        /// the beam's direction) or `pose` (the whole orientation).
        pub freedom: Spanned<TaskSpace>,
    }
}

table! {
    /// One link and the joint before it.
    pub struct SerialLinkTable {
        /// `revolute` or `prismatic`.
        pub joint: Spanned<JointKind>,
        /// Angle from the joint axis before to this one, about the x before (α).
        pub twist: Signed<unit::Angle> = "0 deg",
        /// Distance from the joint axis before to this one, along the x before (a).
        pub length: Signed<unit::Length> = "0 mm",
        /// Distance along this joint's axis (d); a sliding joint adds to it.
        pub offset: Signed<unit::Length> = "0 mm",
        /// Angle about this joint's axis (θ); a turning joint adds to it.
        pub angle: Signed<unit::Angle> = "0 deg",
        /// Mass of the link.
        pub mass: Quantity<unit::Mass, Positive>,
        /// Its centre of mass, in the link's frame.
        pub center: Point,
        /// Its moments of inertia about the centre of mass, in the link's frame: xx, yy, zz.
        pub inertia: [Quantity<unit::Inertia, NonNegative>; 3],
    }
}

table! {
    /// A frame: a place, and turns about x, then y, then z of the frame it is seen from.
    pub struct FrameTable {
        /// [x, y, z].
        pub position: Option<Point>,
        /// About x.
        pub roll: Signed<unit::Angle> = "0 deg",
        /// About y.
        pub pitch: Signed<unit::Angle> = "0 deg",
        /// About z.
        pub yaw: Signed<unit::Angle> = "0 deg",
    }
}

/// The names of the axes, from the base on.
const NAMES: [&str; 6] = ["j1", "j2", "j3", "j4", "j5", "j6"];

pub(super) fn build(
    table: &SerialTable,
    context: &BuildContext<'_>,
    diagnostics: &mut Diagnostics,
) -> Option<Built> {
    match table.link.len() {
        2 => arm::<2>(table, context, diagnostics, |arm| MechanismKind::Serial2(Box::new(arm))),
        3 => arm::<3>(table, context, diagnostics, |arm| MechanismKind::Serial3(Box::new(arm))),
        4 => arm::<4>(table, context, diagnostics, |arm| MechanismKind::Serial4(Box::new(arm))),
        5 => arm::<5>(table, context, diagnostics, |arm| MechanismKind::Serial5(Box::new(arm))),
        6 => arm::<6>(table, context, diagnostics, |arm| MechanismKind::Serial6(Box::new(arm))),
        count => {
            diagnostics.contradict(
                table.span,
                format!("an arm of {count} links cannot be driven"),
                "give two to six tables [[mechanism.serial.link]]",
            );
            None
        }
    }
}

fn arm<const N: usize>(
    table: &SerialTable,
    context: &BuildContext<'_>,
    diagnostics: &mut Diagnostics,
    kind: impl Fn(Serial<N>) -> MechanismKind,
) -> Option<Built>
where
    Serial<N>: Mechanism<N>,
{
    let links: [Link; N] =
        core::array::from_fn(|index| link(&table.link[index], context, NAMES[index]));
    let mut mechanism = Serial {
        base: frame(&table.base),
        links,
        tool: frame(&table.tool),
        task_space: table.freedom.value,
        gravity: Vector3::new(0.0, 0.0, -STANDARD_GRAVITY),
        elasticity: None,
    };
    let names = core::array::from_fn(|index| (NAMES[index], unit_of(links[index].kind)));
    let (joints, elasticity, home): (Vec<Joint>, Option<[Elasticity; N]>, _) =
        chain::joints(&mechanism, names, context, diagnostics)?;
    mechanism.elasticity = elasticity;
    Some(Built { mechanism: kind(mechanism), joints, home })
}

fn unit_of(kind: JointKind) -> JointUnit {
    match kind {
        JointKind::Revolute => JointUnit::Angle,
        JointKind::Prismatic => JointUnit::Length,
    }
}

fn link(table: &SerialLinkTable, context: &BuildContext<'_>, name: &str) -> Link {
    let [lower, upper] = chain::range(context, name).unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
    let moments = table.inertia.map(|inertia| inertia.value);
    Link {
        twist: table.twist.value,
        length: table.length.value,
        offset: table.offset.value,
        angle: table.angle.value,
        kind: table.joint.value,
        mass: table.mass.value,
        center: Vector3::from(table.center.value),
        inertia: Matrix3::from_diagonal(&Vector3::from(moments)),
        lower,
        upper,
    }
}

pub(super) fn frame(table: &FrameTable) -> Pose {
    Pose {
        position: Vector3::from(table.position.map_or([0.0; 3], |point| point.value)),
        rotation: *Rotation3::from_euler_angles(
            table.roll.value,
            table.pitch.value,
            table.yaw.value,
        )
        .matrix(),
    }
}

crate::keyword! {
    JointKind, "a kind of joint",
    "revolute" => Self::Revolute,
    "prismatic" => Self::Prismatic,
}

crate::keyword! {
    TaskSpace, "a task space",
    "plane" => Self::Plane,
    "space" => Self::Space,
    "axis" => Self::Axis,
    "pose" => Self::Pose,
}
