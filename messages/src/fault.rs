//! Fault codes: what stopped the machine, as a `Copy` value that a cycle can hold.

mod quantity;

use crate::{Nanoseconds, sample};

pub use quantity::{FaultQuantity, FaultUnit};

/// Why the machine was stopped. Discriminants are the values in samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum FaultCode {
    /// Nothing is wrong.
    #[default]
    None = 0,
    /// |setpoint − feedback| of an actuator above the limit of its axis.
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
    /// Two actuators of one axis are too far from each other.
    Racking = 17,
    /// The emergency stop was pressed.
    EmergencyStop = 18,
    /// An axis ran onto its limit switch.
    HardLimit = 19,
    /// The door was opened.
    DoorOpened = 20,
    /// An axis did not find its reference.
    HomingFailed = 21,
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
            17 => Self::Racking,
            18 => Self::EmergencyStop,
            19 => Self::HardLimit,
            20 => Self::DoorOpened,
            21 => Self::HomingFailed,
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
            Self::Racking => "racking",
            Self::EmergencyStop => "emergency_stop",
            Self::HardLimit => "hard_limit",
            Self::DoorOpened => "door_opened",
            Self::HomingFailed => "homing_failed",
        }
    }
}

sample! {
    /// A latched fault: the first one, with where and how much.
    Fault = "graver.Fault.v3" {
        /// A [`FaultCode`].
        code: u32,
        /// The axis from 1, or 0 when the fault belongs to none, or to an actuator.
        axis: u16,
        /// The actuator from 1, or 0 when the fault belongs to none.
        actuator: u16,
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
    pub fn on_axis(self, index: usize) -> Self {
        Self { axis: index as u16 + 1, actuator: 0, ..self }
    }

    /// The same on the actuator with this index, from 0.
    pub fn on_actuator(self, index: usize) -> Self {
        Self { axis: 0, actuator: index as u16 + 1, ..self }
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
