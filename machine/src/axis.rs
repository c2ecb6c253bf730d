//! A joint of the mechanism as the machine file names it. What moves it are its [`Actuator`]s.
//!
//! [`Actuator`]: crate::Actuator

use core::ops::Range;

use crate::actuator::Actuator;
use crate::limits::AxisLimits;

/// What a joint is measured in. Its number is the form of a quantity of a joint's travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointUnit {
    /// [m].
    Length = 0,
    /// [rad].
    Angle = 1,
}

impl JointUnit {
    /// The symbol of the joint's position.
    pub fn name(self) -> &'static str {
        self.names()[0]
    }

    /// The symbols of the joint's position and its first three derivatives by time.
    pub fn names(self) -> [&'static str; 4] {
        match self {
            Self::Length => ["m", "m/s", "m/s²", "m/s³"],
            Self::Angle => ["rad", "rad/s", "rad/s²", "rad/s³"],
        }
    }
}

/// One axis, in the order of the joints of the mechanism.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// The name in the machine file.
    pub name: String,
    /// What its joint is measured in.
    pub unit: JointUnit,
    /// How far the joint moves freely while the motor stands, from stop to stop; 0 of an axis with
    /// several actuators [m or rad].
    pub backlash: f64,
    /// Its limits.
    pub limits: AxisLimits,
    /// Which of the machine's actuators drive it, at least one.
    pub actuators: Range<usize>,
}

impl Axis {
    /// Those of the machine's `actuators` that drive it.
    pub fn driven_by<'a>(&self, actuators: &'a [Actuator]) -> &'a [Actuator] {
        actuators.get(self.actuators.clone()).unwrap_or_default()
    }
}
