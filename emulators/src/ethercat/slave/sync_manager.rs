//! Sync managers: which part of the process memory is a mailbox, and which is process data.

use super::registers::{MANAGERS, SYNC_MANAGERS};
use crate::ethercat::frame::word;

/// Which way a manager's buffer goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// The master reads it.
    Read,
    /// The master writes it.
    Write,
}

/// A manager as its registers have it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SyncManager {
    /// First byte of its buffer.
    pub start: u16,
    /// Bytes of its buffer.
    pub length: u16,
    /// Whether it hands over one message at a time; else the newest data.
    pub mailbox: bool,
    /// Which way it goes.
    pub direction: Direction,
    /// Whether a write to it feeds the watchdog.
    pub watchdog: bool,
    /// Whether it is active.
    pub active: bool,
}

impl SyncManager {
    /// The manager `index` of a slave's `memory`.
    pub fn of(memory: &[u8], index: usize) -> Self {
        let at = usize::from(SYNC_MANAGERS) + 8 * index.min(MANAGERS - 1);
        let control = word(memory, at + 4);
        Self {
            start: word(memory, at),
            length: word(memory, at + 2),
            mailbox: control & 0x03 == 0x02,
            direction: if control & 0x0C == 0x04 { Direction::Write } else { Direction::Read },
            watchdog: control & 0x40 != 0,
            active: word(memory, at + 6) & 1 != 0,
        }
    }

    /// One past the last byte of its buffer.
    pub fn end(&self) -> u32 {
        u32::from(self.start) + u32::from(self.length)
    }

    /// Whether any of the bytes from `from` to before `to` are in its buffer.
    pub fn overlaps(&self, from: usize, to: usize) -> bool {
        self.active && from < self.end() as usize && usize::from(self.start) < to
    }

    /// Whether it is a buffer of `length` bytes at `start` in this direction, active if it has any.
    pub fn is(&self, start: u16, length: u16, mailbox: bool, direction: Direction) -> bool {
        if length == 0 {
            return !self.active || self.length == 0;
        }
        self.active
            && (self.start, self.length, self.mailbox, self.direction)
                == (start, length, mailbox, direction)
    }
}
