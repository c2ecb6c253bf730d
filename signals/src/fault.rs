//! Fault codes: what stopped the machine, as a `Copy` value that a cycle can hold.

use crate::{Nanoseconds, sample};

/// Why the machine was stopped. Discriminants are the values in samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum FaultCode {
    /// Nothing is wrong.
    #[default]
    None = 0,
    /// |setpoint − feedback| of an axis above its limit.
    FollowingError = 1,
    /// A measured joint position outside its soft limits.
    PositionLimit = 2,
    /// A setpoint breaks a limit of its axis; the planner's checker should have refused it.
    SetpointLimit = 3,
    /// A number that is not finite in a setpoint or a feedback.
    NotFinite = 4,
    /// Feedback stopped or skipped cycles.
    StaleFeedback = 5,
    /// The stream ran dry before its last sample.
    StreamStarved = 6,
    /// Setpoints out of order or of two streams at once.
    StreamBroken = 7,
    /// More overruns in a row than allowed.
    Overrun = 8,
    /// No fresh command reached drives for some cycles; drives stopped by itself.
    StaleCommand = 9,
    /// The planner died or left.
    PlannerLost = 10,
    /// The controller died or left.
    ControllerLost = 11,
    /// The drives process died or left.
    DrivesLost = 12,
    /// The hardware or the simulated plant reports a fault of its own.
    DriveFault = 13,
    /// The motor current stayed above its rating for too long.
    Overload = 14,
    /// The domain's supervisor died; the machine is brought to rest.
    SupervisorLost = 15,
    /// The first setpoint of a stream is not where the axis stands.
    StreamStart = 16,
}

impl FaultCode {
    /// The code with this number in a sample; an unknown number reads as [`Self::DriveFault`].
    pub fn from_wire(value: u32) -> Self {
        match value {
            0 => Self::None,
            1 => Self::FollowingError,
            2 => Self::PositionLimit,
            3 => Self::SetpointLimit,
            4 => Self::NotFinite,
            5 => Self::StaleFeedback,
            6 => Self::StreamStarved,
            7 => Self::StreamBroken,
            8 => Self::Overrun,
            9 => Self::StaleCommand,
            10 => Self::PlannerLost,
            11 => Self::ControllerLost,
            12 => Self::DrivesLost,
            14 => Self::Overload,
            15 => Self::SupervisorLost,
            16 => Self::StreamStart,
            _ => Self::DriveFault,
        }
    }

    /// The name in summaries and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::FollowingError => "following_error",
            Self::PositionLimit => "position_limit",
            Self::SetpointLimit => "setpoint_limit",
            Self::NotFinite => "not_finite",
            Self::StaleFeedback => "stale_feedback",
            Self::StreamStarved => "stream_starved",
            Self::StreamBroken => "stream_broken",
            Self::Overrun => "overrun",
            Self::StaleCommand => "stale_command",
            Self::PlannerLost => "planner_lost",
            Self::ControllerLost => "controller_lost",
            Self::DrivesLost => "drives_lost",
            Self::DriveFault => "drive_fault",
            Self::Overload => "overload",
            Self::SupervisorLost => "supervisor_lost",
            Self::StreamStart => "stream_start",
        }
    }
}

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
    /// Overruns in a row.
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
    const ALL: [Self; 25] = [
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
            Self::Overruns => ("overruns in a row", Plain("")),
            Self::Losses => ("times that light was lost in one place", Plain("")),
            Self::Edges => ("gate edges in a cycle", Plain("")),
            Self::Setpoint => ("number of the setpoint", Plain("")),
            Self::Light => ("number of a setpoint with impossible light", Plain("")),
            Self::StreamTime => ("stream time", Plain("s")),
            Self::Mode => ("command mode", Plain("")),
            Self::Mechanism => ("distance that the mechanism must keep", Plain("")),
            Self::ImpossibleEdges => ("gate edges of an impossible laser cycle", Plain("")),
        }
    }
}

sample! {
    /// A latched fault: the first one, with where and how much.
    Fault = "graver.Fault.v2" {
        /// A [`FaultCode`].
        code: u32,
        /// The axis from 1, or 0 when the fault belongs to none.
        axis: u32,
        /// A [`FaultQuantity`]: what `value` and `limit` measure.
        quantity: u32,
        /// 1 when there is a limit, else 0.
        limited: u32,
        /// The offending value.
        value: f64,
        /// The limit it broke, or what was expected.
        limit: f64,
        /// When it was found.
        at: Nanoseconds,
    }
}

impl Fault {
    /// A fault that belongs to no axis and has no value.
    pub fn new(code: FaultCode) -> Self {
        Self { code: code as u32, ..Self::default() }
    }

    /// The same on the axis with this index, from 0.
    pub fn on(self, index: usize) -> Self {
        Self { axis: index as u32 + 1, ..self }
    }

    /// The same with the value that was found.
    pub fn with(self, quantity: FaultQuantity, value: f64) -> Self {
        Self { quantity: quantity as u32, value, ..self }
    }

    /// The same with the value that was found, and the limit that it broke.
    pub fn beyond(self, quantity: FaultQuantity, value: f64, limit: f64) -> Self {
        Self { limited: 1, limit, ..self.with(quantity, value) }
    }

    /// The same, found at `now` unless somebody found it before.
    pub fn at(self, now: Nanoseconds) -> Self {
        if self.at == Nanoseconds(0) { Self { at: now, ..self } } else { self }
    }

    /// Which fault.
    pub fn code(&self) -> FaultCode {
        FaultCode::from_wire(self.code)
    }

    /// What its value and limit measure.
    pub fn quantity(&self) -> FaultQuantity {
        FaultQuantity::from_wire(self.quantity)
    }

    /// The limit that was broken, if the fault has one.
    pub fn limit(&self) -> Option<f64> {
        (self.limited != 0).then_some(self.limit)
    }

    /// Whether there is one.
    pub fn is_some(&self) -> bool {
        self.code != FaultCode::None as u32
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
