//! The states of the controller, with what each has to remember.

use crate::supervision::Tracking;
use messages::{CommandMode, ControllerState, HoldCause};

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
    /// At rest and powered, with the fault of an emergency stop of category 2 latched.
    Halted,
    /// Axes look for their references.
    Homing(HomingStage),
    /// Axes are moved by hand, or come to rest from what was given up.
    Jogging,
    /// An axis moves until the probe touches.
    Probing,
    /// The laser is tested, at rest.
    Pulsing,
}

/// How far homing has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HomingStage {
    /// The axes of a group look for their references.
    Searching,
    /// Those of the group were found, and are brought together where they have several actuators.
    Squaring { begun: bool },
    /// All were found, and go home.
    Returning,
}

/// What follows once a hold has come to rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AfterRest {
    /// A person decides.
    Wait(HoldCause),
    /// The same, once the light before the program's pause has been given.
    Pause,
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
            Self::Halted => ControllerState::Halted,
            Self::Homing(_) => ControllerState::Homing,
            Self::Jogging => ControllerState::Jogging,
            Self::Probing => ControllerState::Probing,
            Self::Pulsing => ControllerState::Pulsing,
        }
    }

    /// Why the stream is held, if it is.
    pub(crate) fn hold_cause(self) -> HoldCause {
        match self {
            Self::Holding(AfterRest::Wait(cause)) => cause,
            Self::Holding(AfterRest::Pause) => HoldCause::Program,
            Self::Holding(AfterRest::Resume) => HoldCause::Light,
            Self::Holding(AfterRest::Supply { .. }) => HoldCause::Setpoints,
            _ => HoldCause::None,
        }
    }

    pub(crate) fn mode(self) -> CommandMode {
        match self {
            Self::Disabled | Self::Faulted => CommandMode::Disabled,
            Self::Failing { tracking: Tracking::Lost, .. } => CommandMode::QuickStop,
            _ => CommandMode::Driven,
        }
    }

    /// Whether it is a motion, or light, that a person asked for without a stream.
    pub(crate) fn is_by_hand(self) -> bool {
        matches!(self, Self::Homing(_) | Self::Jogging | Self::Probing | Self::Pulsing)
    }

    /// Whether the plan holds the axes, so that they must follow it.
    pub(crate) fn follows(self) -> bool {
        match self {
            Self::Enabling { held, .. } => held > 0,
            state => state.mode() == CommandMode::Driven,
        }
    }
}
