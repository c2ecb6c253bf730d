//! What people ask of the job under way, wherever it is.
//!
//! The controller knows of a job only while it plays it. Before that a job is on its way through
//! the queue, the start of the machine, and the planner, and a person who says `stop` there means
//! it. Operators' threads write here, the supervisor's loop reads.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// How far the job under way has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Phase {
    /// There is none.
    #[default]
    None,
    /// It is not being played yet: requests are for the supervisor.
    Preparing,
    /// The controller has it: requests are for the controller.
    Playing,
}

#[derive(Debug, Default)]
struct State {
    phase: Phase,
    stopped: bool,
    held: bool,
    /// Stops that are being carried out: a job that begins meanwhile is stopped.
    stops: u32,
}

/// Requests for the job under way.
#[derive(Debug, Default)]
pub struct JobControl {
    state: Mutex<State>,
}

impl JobControl {
    /// The supervisor takes a job up.
    pub fn begin(&self) {
        let mut state = self.lock();
        let stops = state.stops;
        *state = State { phase: Phase::Preparing, stopped: stops > 0, held: false, stops };
    }

    /// Hands the job to the controller, unless it is stopped or held; whether it did.
    pub fn play(&self) -> bool {
        let mut state = self.lock();
        if state.stopped || state.held {
            return false;
        }
        state.phase = Phase::Playing;
        true
    }

    /// The job is over.
    pub fn end(&self) {
        let mut state = self.lock();
        state.phase = Phase::None;
        state.held = false;
    }

    /// Whether a person stopped the job.
    pub fn is_stopped(&self) -> bool {
        self.lock().stopped
    }

    /// Whether a person holds the job before it is played.
    pub fn is_held(&self) -> bool {
        let state = self.lock();
        state.held && state.phase == Phase::Preparing
    }

    /// Stops the job under way; the phase that this met.
    pub fn stop(&self) -> Phase {
        let mut state = self.lock();
        state.stopped |= state.phase != Phase::None;
        state.phase
    }

    /// As [`Self::stop`]; a job that begins before [`Self::end_stop`] is stopped too.
    pub fn begin_stop(&self) -> Phase {
        let mut state = self.lock();
        state.stops += 1;
        state.stopped |= state.phase != Phase::None;
        state.phase
    }

    /// Whether a stop is being carried out: no job begins.
    pub fn is_stopping(&self) -> bool {
        self.lock().stops > 0
    }

    /// A stop has been carried out.
    pub fn end_stop(&self) {
        let mut state = self.lock();
        state.stops = state.stops.saturating_sub(1);
    }

    /// Holds the job until it is resumed; `false` when that is for the controller to do.
    pub fn hold(&self) -> bool {
        let mut state = self.lock();
        let is_ours = state.phase == Phase::Preparing;
        state.held |= is_ours;
        is_ours
    }

    /// Goes on with a job that is held; `false` when that is for the controller to do.
    pub fn resume(&self) -> bool {
        let mut state = self.lock();
        std::mem::take(&mut state.held)
    }

    /// How far the job under way has come.
    pub fn phase(&self) -> Phase {
        self.lock().phase
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Every change is whole: a thread that panicked left nothing half done.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_that_begins_while_a_stop_is_carried_out_is_stopped() {
        let control = JobControl::default();
        assert_eq!(control.begin_stop(), Phase::None);
        control.begin();
        assert!(control.is_stopped() && !control.play());
        control.end_stop();
        control.end();
        control.begin();
        assert!(!control.is_stopped() && control.play());
    }

    #[test]
    fn a_job_that_is_not_played_yet_is_stopped_here() {
        let control = JobControl::default();
        assert_eq!(control.stop(), Phase::None);
        control.begin();
        assert!(!control.is_stopped(), "what was asked before it is not meant for it");
        assert_eq!(control.stop(), Phase::Preparing);
        assert!(control.is_stopped());
        assert!(!control.play());
        control.end();
        control.begin();
        assert!(!control.is_stopped() && control.play());
    }

    #[test]
    fn a_hold_keeps_a_job_from_being_played_until_it_is_resumed() {
        let control = JobControl::default();
        assert!(!control.hold() && !control.resume(), "no job, nothing to hold");
        control.begin();
        assert!(control.hold() && control.is_held());
        assert!(!control.play());
        assert!(control.resume() && !control.is_held());
        assert!(control.play());
        assert!(!control.hold() && !control.resume(), "the controller's, once it plays");
    }
}
