//! Whether a job that plays goes on: what the services, drives and the controller say.

use std::time::{Duration, Instant};

use messages::{Fault, FaultCode};
use runtime::domain::Role;
use runtime::message;

use super::{JobRun, Stage};
use crate::pipeline::services::{Ended, Recovery};
use crate::pipeline::{ServiceOwner, is_dark_and_at_rest};

/// How long the controller may take to bring the axes to rest and say so.
pub(super) const REST_PATIENCE: Duration = Duration::from_secs(10);

/// How long the controller's last word may follow when the axes rest: it comes with the next cycle,
/// unless the controller hangs or is dead.
pub(super) const WORD_PATIENCE: Duration = Duration::from_millis(250);

/// How long the axes may take to stand of a job that was never played: they only held.
const UNPLAYED_PATIENCE: Duration = Duration::from_millis(500);

/// How long drives may say nothing while a job is played; its clock may slip by some tenths of a
/// second.
const DRIVES_PATIENCE: Duration = Duration::from_secs(5);

impl JobRun<'_> {
    /// Whether the controller has said how the job ended, or nothing more can be expected of it.
    pub(super) fn is_over(&mut self) -> bool {
        let report = self.pipeline.latest.controller;
        if Some(report.stream) == self.stream && report.is_final == 1 {
            self.run_outcome.controller = Some(report);
            return true;
        }
        self.hear_drives();
        let since = match self.stage {
            // What was never played only holds, or is being stopped.
            Stage::Resting(since) if !self.played => {
                let holds =
                    self.pipeline.has(Role::Controller) && !self.run_outcome.latched.is_some();
                let gone = !self.pipeline.has(Role::Drives);
                let at_rest = is_dark_and_at_rest(&self.pipeline.latest);
                return holds || gone || at_rest || since.elapsed() > UNPLAYED_PATIENCE;
            }
            Stage::Resting(since) => Some(since),
            _ => None,
        };
        let latest = &self.pipeline.latest;
        // Without drives nothing moves, and axes that drives has stopped rest by themselves.
        let gone = !self.pipeline.has(Role::Drives);
        let at_rest =
            is_dark_and_at_rest(latest) && (since.is_some() || latest.drives.fault.is_some());
        self.quiet =
            if gone || at_rest { self.quiet.or_else(|| Some(Instant::now())) } else { None };
        let silent = self.quiet.is_some_and(|quiet| quiet.elapsed() > WORD_PATIENCE);
        if silent && since.is_none() {
            self.fail(latest.drives.fault);
        }
        silent || since.is_some_and(|since| since.elapsed() > REST_PATIENCE)
    }

    /// Gives a job up that is being played while drives says nothing: it reports ten times a second.
    pub(super) fn hear_drives(&mut self) {
        let cycle = self.pipeline.latest.drives.cycle;
        if cycle != self.drives_heard.0 {
            self.drives_heard = (cycle, Instant::now());
        } else if self.drives_heard.1.elapsed() > DRIVES_PATIENCE {
            self.end_with(format!(
                "drives said nothing for {} s: it is stopped or hangs",
                DRIVES_PATIENCE.as_secs()
            ));
        }
    }

    /// A service has ended by itself: says so at once, and what is done about it.
    pub(super) fn note_ended(&mut self, ended: &Ended) {
        let consequence = match (ended.role, self.stage) {
            (Role::Monitor, _) => "; the job goes on without harm",
            (Role::Modbus, _) => ": its devices count as silent, laser off",
            (_, Stage::Starting(_)) => " while starting",
            (Role::Planner, _) => {
                ": laser off, the controller brings the axes to rest along the path"
            }
            (Role::Controller, _) => ": laser off, drives stops the axes",
            (Role::Drives, _) => ": the simulated plant is gone with it",
            (Role::Domain | Role::Observer, _) => "",
        };
        let message = format!("{ended}{consequence}");
        message::tell(&message);
        match ended.recovery {
            Recovery::Stop => {
                if !self.run_outcome.latched.is_some() {
                    self.run_outcome.latched = Fault::new(death_of(ended.role));
                }
                self.end_with(message);
            }
            _ => self.run_outcome.warnings.push(message),
        }
    }

    /// What ails a job whose services somebody else starts, when one that it cannot end without is
    /// gone. Of the others' deaths the controller tells.
    pub(super) fn missing(&self) -> Option<&'static str> {
        if self.pipeline.owner() == ServiceOwner::Own {
            return None;
        }
        match self.stage {
            Stage::Planning if !self.pipeline.has(Role::Planner) => {
                Some("the planner is not running: start it and submit again")
            }
            Stage::Ready(_) | Stage::Playing if !self.pipeline.has(Role::Controller) => {
                Some("the controller has ended: laser off, drives stops the axes")
            }
            Stage::Ready(_) | Stage::Playing if !self.pipeline.has(Role::Drives) => {
                Some("drives has ended: start it, reset the fault and submit again")
            }
            _ => None,
        }
    }
}

/// The fault that the death of a service is.
fn death_of(role: Role) -> FaultCode {
    match role {
        Role::Planner => FaultCode::PlannerLost,
        Role::Controller => FaultCode::ControllerLost,
        Role::Drives => FaultCode::DrivesLost,
        Role::Domain => FaultCode::SupervisorLost,
        Role::Monitor | Role::Modbus | Role::Observer => FaultCode::None,
    }
}
