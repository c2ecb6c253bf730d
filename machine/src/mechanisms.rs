//! The mechanisms, one file each, and the choice among them that a machine file makes.

mod by_joints;
pub mod cartesian;
pub mod corexy;
pub mod five_bar;
pub mod galvo;
pub mod mcm;
mod plane;
pub mod polar;
pub mod prrrp;
mod scaled;
pub mod serial;
pub(crate) mod spectrum;
pub mod tri_planar;
pub mod twin_actuator;

pub use cartesian::Cartesian;
pub use corexy::CoreXy;
pub use five_bar::{FiveBar, FiveBarBranch};
pub use galvo::Galvo;
pub use mcm::Mcm;
pub use polar::Polar;
pub use prrrp::{Prrrp, PrrrpBranch};
pub use serial::Serial;
pub use tri_planar::TriPlanar;
pub use twin_actuator::{ActuatorBodies, TwinActuator, TwinBranch};

use by_joints::{by_joints, of_another};
use nalgebra::{SMatrix, Vector3, Vector6};
use scaled::Scale;

use crate::analysis::Bodies;
use crate::kinematics::{
    Branch, Jacobian, JointMotion, Joints, KinematicsError, Margin, Mechanism, Pose, TaskSpace,
    ToolMotion,
};

/// The one list of the mechanisms: the choice among them, and what is asked of whichever it is.
macro_rules! mechanisms {
    ($( $joints:literal, $any:ident, $branch:ident, $chain:ident {
        $( $(#[doc = $about:expr])* $variant:ident($held:ty): $mechanism:ty; )*
    } )*) => {
        $( by_joints! { $joints, $any, $branch, $chain: $( $variant: $mechanism; )* } )*

        /// The mechanism of a machine file, matched once when a stage starts.
        #[derive(Debug, Clone, PartialEq)]
        pub enum MechanismKind {
            $( $( $(#[doc = $about])* $variant($held), )* )*
        }

        $( $( impl From<$mechanism> for MechanismKind {
            fn from(mechanism: $mechanism) -> Self {
                Self::$variant(mechanism.into())
            }
        } )* )*

        impl MechanismKind {
            /// Hands the mechanism to `visitor`.
            pub fn visit<V: MechanismVisitor>(&self, visitor: V) -> V::Output {
                match self {
                    $( $( Self::$variant(mechanism) => {
                        visitor.visit($any::$variant(<$mechanism as Clone>::clone(mechanism)))
                    } )* )*
                }
            }

            /// The same with all masses and inertias `mass` times as large, and all springs `stiffness`
            /// times as stiff, at the same damping ratio of a given load. What balances a weight stays as
            /// it is.
            #[must_use]
            pub fn scaled(&self, mass: f64, stiffness: f64) -> Self {
                let mut kind = self.clone();
                match &mut kind {
                    $( $( Self::$variant(mechanism) => mechanism.scale(mass, stiffness), )* )*
                }
                kind
            }
        }
    };
}

mechanisms! {
    2, TwoJoints, TwoJointsBranch, TwoJointsChain {
        /// Carriages in x and y, or one of them over a chuck.
        Cartesian(Cartesian<2>): Cartesian<2>;
        /// Two belts that move the head in x and y together.
        CoreXy(CoreXy<2>): CoreXy<2>;
        /// Two mirrors that turn the beam over a flat field.
        Galvo(Galvo): Galvo;
        /// Two arms whose forearms meet in the tool.
        FiveBar(FiveBar): FiveBar;
        /// Two carts on one rail, with a link each to the tool.
        Prrrp(Prrrp): Prrrp;
        /// Two actuators of variable length that meet in one joint.
        TwinActuator(TwinActuator): TwinActuator;
        /// An open chain of two joints.
        Serial2(Box<Serial<2>>): Serial<2>;
    }
    3, ThreeJoints, ThreeJointsBranch, ThreeJointsChain {
        /// The same, and a carriage that moves the head up and down.
        CartesianLift(Cartesian<3>): Cartesian<3>;
        /// The same, and a carriage that moves the head up and down.
        CoreXyLift(CoreXy<3>): CoreXy<3>;
        /// A rotary arm over a rotary table, with a vertical axis.
        Polar(Polar): Polar;
        /// An open chain of three joints.
        Serial3(Box<Serial<3>>): Serial<3>;
    }
    4, FourJoints, FourJointsBranch, FourJointsChain {
        /// An open chain of four joints.
        Serial4(Box<Serial<4>>): Serial<4>;
    }
    5, FiveJoints, FiveJointsBranch, FiveJointsChain {
        /// Two linear axes, a rotary table, and a head that tilts and turns.
        Mcm(Mcm): Mcm;
        /// An open chain of five joints.
        Serial5(Box<Serial<5>>): Serial<5>;
    }
    6, SixJoints, SixJointsBranch, SixJointsChain {
        /// A platform on three legs with planar motors as feet.
        TriPlanar(Box<TriPlanar>): TriPlanar;
        /// An open chain of six joints.
        Serial6(Box<Serial<6>>): Serial<6>;
    }
}

/// Work that is generic over the mechanism, such as a sampler or a plant.
///
/// ```
/// use machine::{Machine, Mechanism, MechanismVisitor};
///
/// struct CountAxes;
/// impl MechanismVisitor for CountAxes {
///     type Output = usize;
///     fn visit<const N: usize, M: Mechanism<N>>(self, _mechanism: M) -> usize {
///         N
///     }
/// }
/// assert_eq!(Machine::builtin().mechanism.visit(CountAxes), 2);
/// ```
pub trait MechanismVisitor {
    /// What the visit gives back.
    type Output;

    /// Called once, with the mechanism of the machine.
    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output;
}

impl MechanismKind {
    /// The name in machine files and summaries.
    pub fn name(&self) -> &'static str {
        struct Name;
        impl MechanismVisitor for Name {
            type Output = &'static str;
            fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> &'static str {
                mechanism.name()
            }
        }
        self.visit(Name)
    }

    /// Whether it moves its tool in z.
    pub fn moves_in_z(&self) -> bool {
        struct MovesInZ;
        impl MechanismVisitor for MovesInZ {
            type Output = bool;
            fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> bool {
                mechanism.task_space() != TaskSpace::Plane
            }
        }
        self.visit(MovesInZ)
    }

    /// Whether a job can say how its tool is turned, or at least where the beam points.
    pub fn turns_its_tool(&self) -> bool {
        struct TurnsItsTool;
        impl MechanismVisitor for TurnsItsTool {
            type Output = bool;
            fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> bool {
                matches!(mechanism.task_space(), TaskSpace::Axis | TaskSpace::Pose)
            }
        }
        self.visit(TurnsItsTool)
    }

    /// Whether its transmissions are springs, none of them rigid.
    pub fn is_elastic(&self) -> bool {
        struct IsElastic;
        impl MechanismVisitor for IsElastic {
            type Output = bool;
            fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> bool {
                mechanism.stiffness().is_some()
            }
        }
        self.visit(IsElastic)
    }
}
