//! How a motion ended that a person asked for.

/// Why what was moved by hand came to rest: a homing, a jog, a step, a probe, or a test pulse that went out.
/// Discriminants are the values in samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum MotionEnd {
    /// It has not ended, or there was none.
    #[default]
    None = 0,
    /// It did what was asked for.
    Reached = 1,
    /// Somebody stopped it.
    Stopped = 2,
    /// It came to the end of what it may go to.
    SoftLimit = 3,
    /// Nobody asked for it any more.
    DeadMan = 4,
    /// The door was opened.
    DoorOpen = 5,
    /// An interlock was missing: of a test pulse.
    Interlock = 6,
    /// The probe did not touch within its way.
    NotTouched = 7,
    /// The mechanism cannot go on from there.
    OutOfReach = 8,
    /// A fault is latched.
    Fault = 9,
}

impl MotionEnd {
    const ALL: [Self; 10] = [
        Self::None,
        Self::Reached,
        Self::Stopped,
        Self::SoftLimit,
        Self::DeadMan,
        Self::DoorOpen,
        Self::Interlock,
        Self::NotTouched,
        Self::OutOfReach,
        Self::Fault,
    ];

    /// The end with this number in a sample; an unknown number reads as [`Self::Fault`].
    pub fn from_wire(value: u32) -> Self {
        Self::ALL.into_iter().find(|end| *end as u32 == value).unwrap_or(Self::Fault)
    }

    /// The name in a status.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Reached => "reached",
            Self::Stopped => "stopped",
            Self::SoftLimit => "soft_limit",
            Self::DeadMan => "dead_man",
            Self::DoorOpen => "door_open",
            Self::Interlock => "interlock",
            Self::NotTouched => "not_touched",
            Self::OutOfReach => "out_of_reach",
            Self::Fault => "fault",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::MotionEnd;

    #[test]
    fn an_end_keeps_its_number_and_an_unknown_one_is_no_success() {
        for (number, end) in MotionEnd::ALL.into_iter().enumerate() {
            assert_eq!(end as usize, number);
            assert_eq!(MotionEnd::from_wire(number as u32), end);
        }
        assert_eq!(MotionEnd::from_wire(1000), MotionEnd::Fault);
    }
}
