//! The states of the controller, with what each has to remember.

use crate::supervision::Tracking;
use messages::{CommandMode, ControllerState};

/// What the controller is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum State {
    Disabled,
    /// Waiting for the power, then holding until the brakes are open and the axes have stood in their
    /// places for a moment. All in cycles.
    Enabling {
        waited: u64,
        held: u64,
        settled: u64,
    },
    /// Enabled, and on the way to where the actuators of each axis are together, for so many cycles, having
    /// stood there for so many.
    Squaring {
        waited: u64,
        settled: u64,
    },
    Idle,
    Running,
    Holding(AfterRest),
    Stopping,
    /// Coming to rest with a fault latched.
    Failing {
        tracking: Tracking,
        waited: u64,
    },
    Faulted,
}

/// What follows once a hold has come to rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AfterRest {
    /// A person decides.
    Wait,
    /// The stream goes on.
    Resume,
    /// The stream goes on when enough of it has come in.
    Supply { waited: u64 },
}

impl State {
    pub(crate) fn to_wire(self) -> ControllerState {
        match self {
            Self::Disabled => ControllerState::Disabled,
            Self::Enabling { .. } | Self::Squaring { .. } => ControllerState::Enabling,
            Self::Idle => ControllerState::Idle,
            Self::Running => ControllerState::Running,
            Self::Holding(_) => ControllerState::Holding,
            Self::Stopping | Self::Failing { .. } => ControllerState::Stopping,
            Self::Faulted => ControllerState::Faulted,
        }
    }

    pub(crate) fn mode(self) -> CommandMode {
        match self {
            Self::Disabled | Self::Faulted => CommandMode::Disabled,
            Self::Failing { tracking: Tracking::Lost, .. } => CommandMode::QuickStop,
            _ => CommandMode::Driven,
        }
    }

    /// Whether the plan holds the axes, so that they must follow it.
    pub(crate) fn follows(self) -> bool {
        match self {
            Self::Enabling { held, .. } => held > 0,
            state => state.mode() == CommandMode::Driven,
        }
    }
}
