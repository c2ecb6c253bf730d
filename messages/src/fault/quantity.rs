//! What the numbers of a fault measure, so that a person can be told in words and units.

/// What the value and the limit of a fault measure. Discriminants are the values in samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum FaultQuantity {
    /// Nothing: the code says all there is.
    #[default]
    None = 0,
    /// Distance of setpoint and feedback [joint unit].
    FollowingError = 1,
    /// Position of a joint [joint unit].
    Position = 2,
    /// Velocity of a joint [joint unit/s].
    Velocity = 3,
    /// Acceleration of a joint [joint unit/s²].
    Acceleration = 4,
    /// Jerk of a joint [joint unit/s³].
    Jerk = 5,
    /// Torque of a motor [N·m].
    Torque = 6,
    /// Root mean square of a motor's current [A].
    Heating = 7,
    /// How far a setpoint is from where the one before leads [joint unit].
    Jump = 8,
    /// Change of the motor's lead from one setpoint to the next [joint unit].
    LeadJump = 9,
    /// Motion within a cycle at a planned rest [joint unit].
    Creep = 10,
    /// How far the first setpoint is from where the axis stands [joint unit].
    StartDistance = 11,
    /// How far a rotor is from its magnetic axis [rad].
    Lag = 12,
    /// Pulses per second.
    PulseRate = 13,
    /// A number in a sample that is not finite.
    Number = 14,
    /// Cycles.
    Cycles = 15,
    /// Cycles in a row in which drives was late.
    Overruns = 16,
    /// Times in a row that light was lost about one place.
    Losses = 17,
    /// Gate edges in one cycle.
    Edges = 18,
    /// The number of a setpoint in its stream; the limit is the number expected.
    Setpoint = 19,
    /// The number of a setpoint whose laser cycle makes no sense, or that is lit at a planned rest.
    Light = 20,
    /// Stream time [s].
    StreamTime = 21,
    /// A command mode that these drives, or drives in this state, do not carry out.
    Mode = 22,
    /// A distance that the mechanism must keep, or can reach [by its kinematics].
    Mechanism = 23,
    /// Gate edges of a cycle whose order, times or power cannot be carried out.
    ImpossibleEdges = 24,
    /// How far an axis is from where it is to be held as it is enabled [joint unit].
    HoldDistance = 25,
    /// Distance of an actuator from the farthest other one of its axis [joint unit].
    Racking = 26,
    /// Way that an axis went without finding its reference [joint unit].
    SearchDistance = 27,
    /// The fault word of a drive, as it gives it.
    DriveWord = 28,
    /// Cycles in a row without an answer from the hardware.
    LostCycles = 29,
    /// The status word of a drive that has given up finding its reference.
    HomingStatus = 30,
}

/// The unit of a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultUnit {
    /// That of the joint, metres or radians, with what follows it.
    Joint(&'static str),
    /// This one, or none.
    Plain(&'static str),
}

impl FaultQuantity {
    const ALL: [Self; 31] = [
        Self::None,
        Self::FollowingError,
        Self::Position,
        Self::Velocity,
        Self::Acceleration,
        Self::Jerk,
        Self::Torque,
        Self::Heating,
        Self::Jump,
        Self::LeadJump,
        Self::Creep,
        Self::StartDistance,
        Self::Lag,
        Self::PulseRate,
        Self::Number,
        Self::Cycles,
        Self::Overruns,
        Self::Losses,
        Self::Edges,
        Self::Setpoint,
        Self::Light,
        Self::StreamTime,
        Self::Mode,
        Self::Mechanism,
        Self::ImpossibleEdges,
        Self::HoldDistance,
        Self::Racking,
        Self::SearchDistance,
        Self::DriveWord,
        Self::LostCycles,
        Self::HomingStatus,
    ];

    /// The quantity with this number in a sample; an unknown number reads as [`Self::None`].
    pub fn from_wire(value: u32) -> Self {
        Self::ALL.into_iter().find(|quantity| *quantity as u32 == value).unwrap_or_default()
    }

    /// What it is called in messages, and its unit.
    pub fn name(self) -> (&'static str, FaultUnit) {
        use FaultUnit::{Joint, Plain};
        match self {
            Self::None => ("", Plain("")),
            Self::FollowingError => ("following error", Joint("")),
            Self::Position => ("position", Joint("")),
            Self::Velocity => ("velocity", Joint("/s")),
            Self::Acceleration => ("acceleration", Joint("/s²")),
            Self::Jerk => ("jerk", Joint("/s³")),
            Self::Torque => ("motor torque", Plain("N·m")),
            Self::Heating => ("root mean square of the motor current", Plain("A")),
            Self::Jump => ("jump of the position between setpoints", Joint("")),
            Self::LeadJump => ("jump of the lead between setpoints", Joint("")),
            Self::Creep => ("motion in a cycle at a planned rest", Joint("")),
            Self::StartDistance => ("distance to the start of the stream", Joint("")),
            Self::Lag => ("rotor from its magnetic axis", Plain("rad")),
            Self::PulseRate => ("pulse rate", Plain("1/s")),
            Self::Number => ("number in a sample", Plain("")),
            Self::Cycles => ("cycles gone by", Plain("")),
            Self::Overruns => ("late cycles in a row", Plain("")),
            Self::Losses => ("times that light was lost in one place", Plain("")),
            Self::Edges => ("gate edges in a cycle", Plain("")),
            Self::Setpoint => ("number of the setpoint", Plain("")),
            Self::Light => ("number of a setpoint with impossible light", Plain("")),
            Self::StreamTime => ("stream time", Plain("s")),
            Self::Mode => ("command mode", Plain("")),
            Self::Mechanism => ("distance that the mechanism must keep", Plain("")),
            Self::ImpossibleEdges => ("gate edges of an impossible laser cycle", Plain("")),
            Self::HoldDistance => ("distance from where it is to be held", Joint("")),
            Self::Racking => ("distance of the actuators of the axis", Joint("")),
            Self::SearchDistance => ("way without finding the reference", Joint("")),
            Self::DriveWord => ("fault word of the drive", Plain("")),
            Self::LostCycles => ("cycles without an answer of the hardware", Plain("")),
            Self::HomingStatus => ("status word of the drive", Plain("")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::FaultQuantity;

    #[test]
    fn a_quantity_keeps_its_number() {
        for (number, quantity) in FaultQuantity::ALL.into_iter().enumerate() {
            assert_eq!(quantity as usize, number);
            assert_eq!(FaultQuantity::from_wire(number as u32), quantity);
        }
        assert_eq!(FaultQuantity::from_wire(1000), FaultQuantity::None);
    }
}
