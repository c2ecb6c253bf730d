//! The controller's state machine, as samples name it.

/// What the controller is doing. Discriminants are the values in samples.
///
/// ```text
/// Disabled ─enable─► Enabling ─► Idle ─stream─► Running ◄─resume─ Holding
///     ▲                            ▲  ◄──end──────┤  └────hold────►  │
///     └──────────── disable ───────┘              ▼                  │
///                                  Idle ◄──── Stopping ◄────stop─────┘
/// Idle ─home, jog, step, probe, test pulse─► Homing, Jogging, Probing, Pulsing ─► Idle
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
    /// Looking for the axes' references.
    Homing = 7,
    /// Axes moved by hand.
    Jogging = 8,
    /// Moving until the probe touches.
    Probing = 9,
    /// A test pulse of the laser, at rest.
    Pulsing = 10,
    /// At rest, powered, laser off, until a person resets the fault: an emergency stop of category 2.
    Halted = 11,
}

/// Why a stream is held. Discriminants are the values in samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum HoldCause {
    /// It is not.
    #[default]
    None = 0,
    /// A person asked for a feed hold.
    Person = 1,
    /// The program pauses (M0).
    Program = 2,
    /// A door is open, or was when nobody had resumed since.
    Door = 3,
    /// An interlock is missing, or was when nobody had resumed since.
    Interlock = 4,
    /// The planner has not sent enough to go on.
    Setpoints = 5,
    /// It goes back for light that was not given.
    Light = 6,
}

impl HoldCause {
    /// The cause with this number in a sample; an unknown number reads as [`Self::Person`], for whom a person is asked.
    pub fn from_wire(value: u32) -> Self {
        match value {
            0 => Self::None,
            2 => Self::Program,
            3 => Self::Door,
            4 => Self::Interlock,
            5 => Self::Setpoints,
            6 => Self::Light,
            _ => Self::Person,
        }
    }
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
            7 => Self::Homing,
            8 => Self::Jogging,
            9 => Self::Probing,
            10 => Self::Pulsing,
            11 => Self::Halted,
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
            Self::Homing => "homing",
            Self::Jogging => "jogging",
            Self::Probing => "probing",
            Self::Pulsing => "pulsing",
            Self::Halted => "halted",
        }
    }
}
