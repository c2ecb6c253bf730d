//! The states of a slave's application layer, and the codes of why one was refused or left.

/// A state (ETG.1000.6).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum State {
    /// No mailbox, no process data.
    Init = 1,
    /// Mailbox.
    PreOp = 2,
    /// Mailbox and inputs.
    SafeOp = 4,
    /// Mailbox, inputs and outputs.
    Op = 8,
}

impl State {
    /// The state of the lower four bits of a request.
    ///
    /// # Errors
    /// The boot state, which these slaves do not have, and what is no state.
    pub fn of(request: u8) -> Result<Self, Code> {
        match request & 0x0F {
            1 => Ok(Self::Init),
            2 => Ok(Self::PreOp),
            3 => Err(Code::NoBoot),
            4 => Ok(Self::SafeOp),
            8 => Ok(Self::Op),
            _ => Err(Code::UnknownState),
        }
    }

    /// Whether a slave goes from here to `next` in one step: down as far as it likes, up one by one.
    pub fn leads_to(self, next: Self) -> bool {
        next <= self
            || matches!(
                (self, next),
                (Self::Init, Self::PreOp) | (Self::PreOp, Self::SafeOp) | (Self::SafeOp, Self::Op)
            )
    }
}

/// Why a state was refused or left: the AL status code (ETG.1000.6 table 11, ETG.1020).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u16)]
pub enum Code {
    /// One step may not go from there to there.
    InvalidChange = 0x0011,
    /// It is no state.
    UnknownState = 0x0012,
    /// There is no boot state.
    NoBoot = 0x0013,
    /// The mailbox' sync managers are not as they must be.
    Mailbox = 0x0016,
    /// No new targets for too many cycles.
    Synchronization = 0x001A,
    /// The watchdog of the process data expired.
    Watchdog = 0x001B,
    /// The outputs' sync manager is not as it must be.
    Outputs = 0x001D,
    /// The inputs' sync manager is not as it must be.
    Inputs = 0x001E,
    /// No sync signal comes.
    NoSync = 0x002D,
    /// The sync signals are not what the device can work with.
    Sync = 0x0030,
    /// Their period is not.
    SyncPeriod = 0x0035,
}
