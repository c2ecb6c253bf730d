//! The controller's state machine, as samples name it.

/// What the controller is doing. Discriminants are the values in samples.
///
/// ```text
/// Disabled ─enable─► Enabling ─► Idle ─stream─► Running ◄─resume─ Holding
///     ▲                            ▲  ◄──end──────┤  └────hold────►  │
///     └──────────── disable ───────┘              ▼                  │
///                                  Idle ◄──── Stopping ◄────stop─────┘
/// any state ──fault──► Stopping or Faulted; Faulted ──reset──► Disabled
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum ControllerState {
    /// Motors unpowered, laser off.
    #[default]
    Disabled = 0,
    /// Motors being powered at standstill; references taken from the feedback.
    Enabling = 1,
    /// Powered, holding position, nothing to play.
    Idle = 2,
    /// Playing a stream.
    Running = 3,
    /// At rest, or coming to rest, inside a stream that can be resumed.
    Holding = 4,
    /// Coming to rest for good; the stream is given up.
    Stopping = 5,
    /// At rest, unpowered, laser off, until a person resets the fault.
    Faulted = 6,
}

impl ControllerState {
    /// The state with this number in a sample; an unknown number reads as [`Self::Faulted`].
    pub fn from_wire(value: u32) -> Self {
        match value {
            0 => Self::Disabled,
            1 => Self::Enabling,
            2 => Self::Idle,
            3 => Self::Running,
            4 => Self::Holding,
            5 => Self::Stopping,
            _ => Self::Faulted,
        }
    }

    /// The name users see.
    pub fn name(self) -> &'static str {
        match self {
            Self::Disabled => "disabled",
            Self::Enabling => "enabling",
            Self::Idle => "idle",
            Self::Running => "running",
            Self::Holding => "holding",
            Self::Stopping => "stopping",
            Self::Faulted => "faulted",
        }
    }
}
