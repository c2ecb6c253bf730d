//! The kinds of machines: each has a module that drafts it for what is asked.

mod cartesian;
mod corexy;
mod five_bar;
mod gantry;
mod mcm;
mod parts;
mod polar;
mod prrrp;
mod samples;
mod serial;
pub(super) mod tri_planar;
mod twin_actuator;

use super::draft::{Asked, Draft};
use super::{Request, Short};

/// A kind of machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Two screws.
    Cartesian,
    /// Three screws: the third lifts the head.
    CartesianLift,
    /// Two belts, and a screw that lifts the head.
    Gantry,
    /// Two crossed belts.
    CoreXy,
    /// Two arms with two forearms.
    FiveBar,
    /// Two carts on one rail.
    Prrrp,
    /// An arm over a rotary table.
    Polar,
    /// A platform on three planar motors.
    TriPlanar,
    /// A head on two carriages, turned and tilted, over a rotary table.
    Mcm,
    /// Two actuators of variable length.
    TwinActuator,
    /// An arm of two turning joints and a slide.
    Serial,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 11] = [
        Self::Cartesian,
        Self::CartesianLift,
        Self::Gantry,
        Self::CoreXy,
        Self::FiveBar,
        Self::Prrrp,
        Self::Polar,
        Self::TriPlanar,
        Self::Mcm,
        Self::TwinActuator,
        Self::Serial,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cartesian => "cartesian",
            Self::CartesianLift => "cartesian_lift",
            Self::Gantry => "gantry",
            Self::CoreXy => "corexy",
            Self::FiveBar => "five_bar",
            Self::Prrrp => "prrrp",
            Self::Polar => "polar",
            Self::TriPlanar => "tri_planar",
            Self::Mcm => "mcm",
            Self::TwinActuator => "twin_actuator",
            Self::Serial => "serial",
        }
    }

    /// The name of a machine of its kind.
    pub fn title(self) -> &'static str {
        match self {
            Self::Cartesian => "Cartesian",
            Self::CartesianLift => "Cartesian with lift",
            Self::Gantry => "Gantry",
            Self::CoreXy => "CoreXY",
            Self::FiveBar => "Five-bar",
            Self::Prrrp => "PRRRP",
            Self::Polar => "Polar",
            Self::TriPlanar => "Tri-planar",
            Self::Mcm => "MCM",
            Self::TwinActuator => "Twin actuator",
            Self::Serial => "Serial arm",
        }
    }

    /// Whether its tool moves in z.
    pub fn has_z(self) -> bool {
        matches!(
            self,
            Self::CartesianLift
                | Self::Gantry
                | Self::Polar
                | Self::TriPlanar
                | Self::Mcm
                | Self::Serial
        )
    }

    /// Whether it stands on planar motors, which are steppers anyway.
    pub fn has_planar_motors(self) -> bool {
        self == Self::TriPlanar
    }

    /// Why it takes no steppers; `None` where it does.
    pub fn refuses_steppers(self) -> Option<&'static str> {
        match self {
            Self::TriPlanar => Some("it stands on planar motors, which are steppers themselves"),
            _ => None,
        }
    }

    /// The area where none is asked for [m].
    pub(super) fn usual_area(self) -> [f64; 2] {
        match self {
            Self::FiveBar => [0.16, 0.12],
            Self::Prrrp => [0.14, 0.2],
            Self::TwinActuator => [0.12, 0.1],
            Self::Gantry => [0.6, 0.4],
            Self::TriPlanar => [0.16, 0.16],
            _ => [0.2, 0.2],
        }
    }

    /// Speed and acceleration where none is asked for [m/s, m/s²].
    pub(super) fn usual_motion(self) -> [f64; 2] {
        match self {
            Self::Cartesian | Self::CartesianLift | Self::CoreXy | Self::FiveBar | Self::Prrrp => {
                [0.25, 10.0]
            }
            Self::Serial | Self::Gantry => [0.2, 5.0],
            Self::Polar => [0.1, 2.0],
            Self::Mcm => [0.1, 1.0],
            Self::TriPlanar => [0.05, 0.5],
            Self::TwinActuator => [0.04, 0.5],
        }
    }
}

/// The draft of a machine for `request`, of which `asked` is what may be met.
pub(super) fn draft(request: &Request, asked: &Asked) -> Result<Draft, Short> {
    match request.kind {
        Kind::Cartesian | Kind::CartesianLift => cartesian::draft(request, asked),
        Kind::Gantry => gantry::draft(request, asked),
        Kind::CoreXy => Ok(corexy::draft(request, asked)),
        Kind::FiveBar => Ok(five_bar::draft(request, asked)),
        Kind::Prrrp => Ok(prrrp::draft(request, asked)),
        Kind::Polar => polar::draft(request, asked),
        Kind::TriPlanar => Ok(tri_planar::draft(request, asked)),
        Kind::Mcm => Ok(mcm::draft(request, asked)),
        Kind::TwinActuator => Ok(twin_actuator::draft(request, asked)),
        Kind::Serial => serial::draft(request, asked),
    }
}
