//! Fault codes: what stopped the machine, as a `Copy` value that a cycle can hold.

use crate::{Nanoseconds, sample};

/// Why the machine was stopped. Discriminants are the values in samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum FaultCode {
    /// Nothing is wrong.
    #[default]
    None = 0,
    /// |setpoint − feedback| of an axis above its limit; `value` and `limit` in joint units.
    FollowingError = 1,
    /// A measured joint position outside its soft limits.
    PositionLimit = 2,
    /// A setpoint breaks a limit of its axis; the planner's checker should have refused it.
    SetpointLimit = 3,
    /// A number that is not finite in a setpoint or a feedback.
    NotFinite = 4,
    /// Feedback stopped or skipped cycles; `value` is the gap in cycles.
    StaleFeedback = 5,
    /// The stream ran dry before its last sample; `value` is the stream time [s].
    StreamStarved = 6,
    /// Setpoints out of order or of two streams at once.
    StreamBroken = 7,
    /// More overruns in a row than allowed; `value` counts them.
    Overrun = 8,
    /// No fresh command reached drives for `value` cycles; drives stopped by itself.
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
    /// The first setpoint of a stream is not where the axis stands; `value` is the distance.
    StreamStart = 16,
    /// The domain's supervisor died; the machine is brought to rest.
    SupervisorLost = 15,
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

sample! {
    /// A latched fault: the first one, with where and how much.
    Fault = "graver.Fault.v1" {
        /// A [`FaultCode`].
        code: u32,
        /// The axis from 1, or 0 when the fault belongs to none.
        axis: u32,
        /// The offending value, in the unit that the code names.
        value: f64,
        /// The limit it broke, 0 when there is none.
        limit: f64,
        /// When it was found.
        at: Nanoseconds,
    }
}

impl Fault {
    /// Which fault.
    pub fn code(&self) -> FaultCode {
        FaultCode::from_wire(self.code)
    }

    /// Whether there is one.
    pub fn is_some(&self) -> bool {
        self.code != FaultCode::None as u32
    }
}
