//! The mechanisms, one file each, and the choice among them that a machine file makes.

pub mod cartesian;
pub mod corexy;
pub mod five_bar;
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
pub use mcm::Mcm;
pub use polar::Polar;
pub use prrrp::{Prrrp, PrrrpBranch};
pub use serial::Serial;
pub use tri_planar::TriPlanar;
pub use twin_actuator::{ActuatorBodies, TwinActuator, TwinBranch};

use crate::kinematics::{Mechanism, TaskSpace};

/// The mechanism of a machine file, matched once when a stage starts.
#[derive(Debug, Clone, PartialEq)]
pub enum MechanismKind {
    /// Ball screws in x and y.
    Cartesian(Cartesian<2>),
    /// Ball screws in x and y, and one that moves the head up and down.
    CartesianLift(Cartesian<3>),
    /// Two belts that move the head in x and y together.
    CoreXy(CoreXy),
    /// Two linear axes, a rotary table, and a head that tilts and turns.
    Mcm(Mcm),
    /// A rotary arm over a rotary table, with a vertical axis.
    Polar(Polar),
    /// A platform on three legs with planar motors as feet.
    TriPlanar(Box<TriPlanar>),
    /// Two arms whose forearms meet in the tool.
    FiveBar(FiveBar),
    /// Two carts on one rail, with a link each to the tool.
    Prrrp(Prrrp),
    /// Two actuators of variable length that meet in one joint.
    TwinActuator(TwinActuator),
    /// An open chain of two joints.
    Serial2(Box<Serial<2>>),
    /// An open chain of three joints.
    Serial3(Box<Serial<3>>),
    /// An open chain of four joints.
    Serial4(Box<Serial<4>>),
    /// An open chain of five joints.
    Serial5(Box<Serial<5>>),
    /// An open chain of six joints.
    Serial6(Box<Serial<6>>),
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
    /// Hands the mechanism to `visitor` as its own type.
    pub fn visit<V: MechanismVisitor>(&self, visitor: V) -> V::Output {
        match self {
            Self::Cartesian(mechanism) => visitor.visit(*mechanism),
            Self::CartesianLift(mechanism) => visitor.visit(*mechanism),
            Self::CoreXy(mechanism) => visitor.visit(*mechanism),
            Self::Mcm(mechanism) => visitor.visit(*mechanism),
            Self::Polar(mechanism) => visitor.visit(*mechanism),
            Self::TriPlanar(mechanism) => visitor.visit(**mechanism),
            Self::FiveBar(mechanism) => visitor.visit(*mechanism),
            Self::Prrrp(mechanism) => visitor.visit(*mechanism),
            Self::TwinActuator(mechanism) => visitor.visit(*mechanism),
            Self::Serial2(mechanism) => visitor.visit(**mechanism),
            Self::Serial3(mechanism) => visitor.visit(**mechanism),
            Self::Serial4(mechanism) => visitor.visit(**mechanism),
            Self::Serial5(mechanism) => visitor.visit(**mechanism),
            Self::Serial6(mechanism) => visitor.visit(**mechanism),
        }
    }

    /// The name in machine files and summaries.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Cartesian(_) => Cartesian::<2>::NAME,
            Self::CartesianLift(_) => Cartesian::<3>::NAME,
            Self::CoreXy(_) => CoreXy::NAME,
            Self::Mcm(_) => Mcm::NAME,
            Self::Polar(_) => Polar::NAME,
            Self::TriPlanar(_) => TriPlanar::NAME,
            Self::FiveBar(_) => FiveBar::NAME,
            Self::Prrrp(_) => Prrrp::NAME,
            Self::TwinActuator(_) => TwinActuator::NAME,
            Self::Serial2(_)
            | Self::Serial3(_)
            | Self::Serial4(_)
            | Self::Serial5(_)
            | Self::Serial6(_) => Serial::<2>::NAME,
        }
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
