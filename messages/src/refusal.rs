//! Why a request was refused.

/// Why a request was refused. Discriminants are the values in samples; `found` and `limit` are those of the
/// [`OperatorReply`](crate::OperatorReply), in the unit of the axis where there is one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum Refusal {
    /// It was not.
    #[default]
    None = 0,
    /// The state does not allow it.
    State = 1,
    /// There is no such request.
    Unknown = 2,
    /// There is no such axis; `found` counts from 1, `limit` is how many there are.
    NoAxis = 3,
    /// `found` is not what the request takes; it must be `limit` at most.
    TooLarge = 4,
    /// `found` is not what the request takes; it must be `limit` at least.
    TooSmall = 5,
    /// A number is not finite, or not whole.
    NotANumber = 6,
    /// The axis has not found its reference.
    NotHomed = 7,
    /// It would lead to `found`, beyond the soft limit `limit`.
    SoftLimit = 8,
    /// The emergency stop is pressed.
    EmergencyStop = 9,
    /// The door is open.
    DoorOpen = 10,
    /// An interlock is missing.
    Interlock = 11,
    /// The axis stands on its limit switch.
    LimitSwitch = 12,
    /// The machine has no axis that can look for its reference, or no probe.
    NothingToFind = 13,
    /// The probe touches already.
    Touching = 14,
    /// The stream is none that can be started.
    Stream = 15,
    /// What caused the fault is still there.
    StillThere = 16,
    /// Of a test pulse: power `found`, 0..=1, is outside the range that ends at `limit`.
    Power = 17,
    /// Of a test pulse: time `found` [s] is outside the range that ends at `limit`.
    Time = 18,
    /// The jog has ended.
    Ended = 19,
    /// The output is none that people switch.
    NotByHand = 20,
    /// The tool of this machine does not go straight with its joints.
    NoDirection = 21,
}

impl Refusal {
    const ALL: [Self; 22] = [
        Self::None,
        Self::State,
        Self::Unknown,
        Self::NoAxis,
        Self::TooLarge,
        Self::TooSmall,
        Self::NotANumber,
        Self::NotHomed,
        Self::SoftLimit,
        Self::EmergencyStop,
        Self::DoorOpen,
        Self::Interlock,
        Self::LimitSwitch,
        Self::NothingToFind,
        Self::Touching,
        Self::Stream,
        Self::StillThere,
        Self::Power,
        Self::Time,
        Self::Ended,
        Self::NotByHand,
        Self::NoDirection,
    ];

    /// The refusal with this number in a sample; an unknown number reads as [`Self::State`].
    pub fn from_wire(value: u32) -> Self {
        Self::ALL.into_iter().find(|refusal| *refusal as u32 == value).unwrap_or(Self::State)
    }

    /// The name in replies.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::State => "state",
            Self::Unknown => "unknown",
            Self::NoAxis => "no_axis",
            Self::TooLarge => "too_large",
            Self::TooSmall => "too_small",
            Self::NotANumber => "not_a_number",
            Self::NotHomed => "not_homed",
            Self::SoftLimit => "soft_limit",
            Self::EmergencyStop => "emergency_stop",
            Self::DoorOpen => "door_open",
            Self::Interlock => "interlock",
            Self::LimitSwitch => "limit_switch",
            Self::NothingToFind => "nothing_to_find",
            Self::Touching => "touching",
            Self::Stream => "stream",
            Self::StillThere => "still_there",
            Self::Power => "power",
            Self::Time => "time",
            Self::Ended => "ended",
            Self::NotByHand => "not_by_hand",
            Self::NoDirection => "no_direction",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Refusal;

    #[test]
    fn a_refusal_keeps_its_number() {
        for (number, refusal) in Refusal::ALL.into_iter().enumerate() {
            assert_eq!(refusal as usize, number);
            assert_eq!(Refusal::from_wire(number as u32), refusal);
        }
        assert_eq!(Refusal::from_wire(1000), Refusal::State);
    }
}
