//! Homing before a job: axes that do not know their place find it, or the job is refused.

use super::{JobRun, Stage};
use crate::exit::Failure;
use crate::pipeline::JobSource;
use messages::{ControllerState, MotionEnd, OperatorVerb};
use monitor::summary::Outcome;
use std::time::Duration;

/// How long the controller may take to answer.
const ANSWER_PATIENCE: Duration = Duration::from_secs(2);

impl JobRun<'_> {
    /// Homes the machine first, where it has to be.
    #[must_use]
    pub fn homing_first(mut self, homes: bool) -> Self {
        self.homes = homes;
        self
    }

    /// The motors are on: the job is offered, once every axis knows its place.
    pub(super) fn home_or_offer(&mut self) -> Result<(), Failure> {
        match self.unhomed() {
            None => self.offer(),
            Some(_) if self.homes => {
                self.begin_homing();
                Ok(())
            }
            Some(axis) => {
                self.refuse_unhomed(&axis);
                Ok(())
            }
        }
    }

    fn begin_homing(&mut self) {
        match self.pipeline.request(OperatorVerb::Home, 0.0, ANSWER_PATIENCE) {
            Ok(reply) if reply.accepted == 1 => self.stage = Stage::Homing(reply.number),
            Ok(reply) => {
                let state = ControllerState::from_wire(reply.state).name();
                let why = messages::Refusal::from_wire(reply.refusal).name();
                self.end_with(format!("the machine, which is {state}, cannot be homed: {why}"));
            }
            Err(error) => self.end_with(error.to_string()),
        }
    }

    /// Goes on when the homing that was accepted under this number has ended.
    pub(super) fn heed_homing(&mut self, number: u32) -> Result<(), Failure> {
        let progress = self.pipeline.latest.progress;
        let is_told = progress.requests >= number;
        if !is_told || progress.state == ControllerState::Homing as u32 {
            return Ok(());
        }
        match MotionEnd::from_wire(progress.motion_end) {
            MotionEnd::Reached if self.unhomed().is_none() => self.offer(),
            // Stopped, and coming to rest.
            _ if progress.state == ControllerState::Jogging as u32 => Ok(()),
            end => {
                self.end_with(format!("homing was ended before it was done: {}", end.name()));
                self.run_outcome.outcome = Some(Outcome::Stopped);
                Ok(())
            }
        }
    }

    /// The first axis that has to be homed before a job.
    fn unhomed(&self) -> Option<String> {
        let homed = self.pipeline.latest.progress.homed;
        let mut axes = self.pipeline.machine.axes.iter().enumerate();
        axes.find(|(index, _)| homed >> index & 1 == 0).map(|(_, axis)| axis.name.clone())
    }

    /// A job is refused while an axis does not know its place.
    fn refuse_unhomed(&mut self, axis: &str) {
        let advice = match self.pipeline.jobs() {
            JobSource::Submitted => "`graver home` finds its place",
            JobSource::Own => "`graver run --home` finds its place first",
        };
        self.end_with(format!("axis {axis} is not homed: {advice}"));
        self.run_outcome.outcome = Some(Outcome::Refused);
    }
}
