//! What stands behind a slave's controller: a drive, or a terminal.

use messages::Nanoseconds;

use super::slave::clock::Sync;
use super::slave::dictionary::Dictionary;
use super::slave::sdo::Abort;
use super::slave::sii::Description;
use super::slave::state::{Code, State};

/// Why a device has no process data any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    /// The master has asked for a lower state.
    Asked,
    /// The watchdog of the process data expired.
    Watchdog,
    /// The sync signals went on without new process data for too long.
    Synchronization,
    /// It lost its power.
    Power,
}

/// A drive or a terminal.
pub trait Device: core::fmt::Debug + Send {
    /// What its EEPROM says.
    fn description(&self) -> Description;

    /// Its objects, if it has a mailbox.
    fn dictionary(&mut self) -> Option<&mut Dictionary> {
        None
    }

    /// Whether the master may write `value` to an object that the dictionary lets it write.
    ///
    /// # Errors
    /// If it may not.
    fn check(&self, index: u16, sub: u8, value: &[u8]) -> Result<(), Abort> {
        let _ = (index, sub, value);
        Ok(())
    }

    /// Bytes of the process data to it and from it, under `sync` signals.
    ///
    /// # Errors
    /// If it cannot work with these signals.
    fn sizes(&self, sync: Option<Sync>) -> Result<[usize; 2], Code>;

    /// Process data has come: with sync signals it is taken at the beginning of their cycle.
    fn outputs(&mut self, data: &[u8], at: Nanoseconds, sync: Option<Sync>);

    /// A cycle of the sync signals begins without new process data.
    ///
    /// # Errors
    /// If that is once too often.
    fn missed(&mut self, at: Nanoseconds, sync: Sync) -> Result<(), Code> {
        let _ = (at, sync);
        Ok(())
    }

    /// Gives the process data from it as it is at `at`.
    fn inputs(&mut self, data: &mut [u8], at: Nanoseconds);

    /// Its loops go on by one period, the motors having been measured at `at`.
    fn tick(&mut self, at: Nanoseconds) {
        let _ = at;
    }

    /// There is process data to it from here on.
    fn start(&mut self, at: Nanoseconds) {
        let _ = at;
    }

    /// There is none any more.
    fn stop(&mut self, at: Nanoseconds, loss: Loss);

    /// An emergency message that is to be sent: its code and the error register.
    fn emergency(&mut self) -> Option<(u16, u8)> {
        None
    }
}

/// States in which a device gives inputs.
pub(super) fn has_inputs(state: State) -> bool {
    matches!(state, State::SafeOp | State::Op)
}
