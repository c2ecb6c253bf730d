//! Which setpoints are taken into the look-ahead: those of the stream that was started.
//!
//! Only a stream that the domain has started is played, so a restarted process never replays an
//! old one. Setpoints may arrive before the start of their stream does; whatever belongs to a
//! stream that is over, or was never started, is let go.

use crate::lookahead::Lookahead;
use crate::stream_time::StreamTime;
use crate::supervision::{Finding, Supervision};
use messages::{Fault, FaultCode, FaultQuantity, Setpoint};

/// Setpoints that must be in hand before a stream begins, unless it is shorter.
pub const BEGINNING: u64 = 250;

/// The way into the look-ahead.
#[derive(Debug, Default)]
pub struct Intake {
    lookahead: Lookahead,
    /// The stream to play, 0 for none.
    started: u64,
    /// The newest stream that is over.
    finished: u64,
}

impl Intake {
    /// Empty.
    pub fn new() -> Self {
        Self { lookahead: Lookahead::new(), started: 0, finished: 0 }
    }

    /// The setpoints in hand.
    pub fn lookahead(&self) -> &Lookahead {
        &self.lookahead
    }

    /// The setpoints in hand, to pass time.
    pub fn lookahead_mut(&mut self) -> &mut Lookahead {
        &mut self.lookahead
    }

    /// The stream to play, 0 for none.
    pub fn started(&self) -> u64 {
        self.started
    }

    /// The newest stream that is over, 0 for none.
    pub fn finished(&self) -> u64 {
        self.finished
    }

    /// Makes `stream` the one to play; `false` when it is over or no stream number.
    #[must_use]
    pub fn start(&mut self, stream: u64) -> bool {
        if stream <= self.finished {
            return false;
        }
        self.started = stream;
        if self.lookahead.stream() != stream {
            self.lookahead.clear(stream);
        }
        true
    }

    /// Whether enough of the started stream is in hand to begin.
    pub fn is_ready(&self) -> bool {
        self.started != 0
            && self.lookahead.stream() == self.started
            && (self.lookahead.is_complete() || self.lookahead.accepted() >= BEGINNING)
    }

    /// Whether the stream can go on from `time` after it ran dry.
    pub fn is_supplied(&self, time: StreamTime) -> bool {
        let ahead = self.lookahead.accepted().saturating_sub(time.sequence());
        self.lookahead.is_complete() || ahead >= BEGINNING
    }

    /// The stream in hand is over.
    pub fn finish(&mut self) {
        self.finished = self.finished.max(self.started);
        self.started = 0;
        self.lookahead.clear(0);
    }

    /// Takes one setpoint, or lets it go.
    ///
    /// # Errors
    /// One that breaks a limit, or breaks the stream that was started.
    pub fn take(&mut self, setpoint: &Setpoint, supervision: &Supervision) -> Result<(), Finding> {
        if setpoint.stream <= self.finished && setpoint.stream != 0 {
            return Ok(());
        }
        if self.started == 0 {
            let repeated = setpoint.sequence == 0;
            let continued = setpoint.stream == self.lookahead.stream()
                && setpoint.sequence == self.lookahead.accepted();
            match (repeated, continued) {
                (true, _) => self.lookahead.clear(setpoint.stream),
                (false, true) => {}
                (false, false) => return Ok(()),
            }
        } else if setpoint.stream < self.started && setpoint.stream != 0 {
            return Ok(());
        }
        supervision.setpoint(setpoint)?;
        let newest = self.lookahead.accepted().checked_sub(1);
        let before = newest.map(|sequence| self.lookahead.setpoint(sequence));
        let continues = setpoint.sequence == self.lookahead.accepted();
        if continues {
            supervision.continuity(before, setpoint)?;
        }
        self.lookahead.accept(setpoint).map_err(|broken| {
            let (value, limit) = (broken.sequence as f64, broken.expected as f64);
            let fault = Fault::new(FaultCode::StreamBroken);
            Finding::sound(fault.beyond(FaultQuantity::Setpoint, value, limit))
        })
    }
}
