//! Requests that are carried out one after the other, each when what the one before began has ended.

use std::collections::VecDeque;

use operator::Status;

use crate::machine::{Answer, Ask};

/// A request and how it is followed.
#[derive(Debug, Clone)]
pub(super) struct Step {
    pub(super) ask: Ask,
    /// Whether it is a motion, or enabling, which must have ended before the next step.
    pub(super) follow: Follow,
}

/// What the end of a request is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Follow {
    /// Its answer.
    Answer,
    /// That the motors are on.
    Enabled,
    /// That the motion has ended where it should.
    Motion,
}

/// Steps that are carried out one after the other.
#[derive(Debug, Clone, Default)]
pub(super) struct Procedure {
    pub(super) steps: VecDeque<Step>,
    /// The step under way: its ticket, and the number of its request once it is accepted.
    pub(super) under_way: Option<(Follow, u64, Option<u32>)>,
}

/// How a step of a procedure ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Outcome {
    Goes,
    Done,
    Failed(String),
}

impl Procedure {
    pub(super) fn of(steps: impl IntoIterator<Item = Step>) -> Self {
        Self { steps: steps.into_iter().collect(), under_way: None }
    }

    pub(super) fn is_over(&self) -> bool {
        self.steps.is_empty() && self.under_way.is_none()
    }

    /// The answer to the step under way.
    pub(super) fn answered(&mut self, ticket: u64, answer: &Answer) -> Outcome {
        let Some((follow, own, number)) = &mut self.under_way else { return Outcome::Goes };
        if *own != ticket {
            return Outcome::Goes;
        }
        match (answer, *follow) {
            (Answer::Refused(words), _) => Outcome::Failed(words.clone()),
            (Answer::Done(accepted), Follow::Motion | Follow::Enabled) => {
                *number = Some(*accepted);
                Outcome::Goes
            }
            _ => {
                self.under_way = None;
                if self.steps.is_empty() { Outcome::Done } else { Outcome::Goes }
            }
        }
    }

    /// Whether the motion under way has ended, as `status` says.
    pub(super) fn seen(&mut self, status: &Status) -> Outcome {
        let Some((follow, _, Some(number))) = self.under_way else { return Outcome::Goes };
        // Numbers go on from 0 after the largest.
        let is_known = status.requests.wrapping_sub(number) < u32::MAX / 2;
        if !is_known || is_busy(&status.state) {
            return Outcome::Goes;
        }
        let is_there = match follow {
            Follow::Enabled => status.state == "idle",
            _ => status.motion_end == "reached" && status.fault.is_none(),
        };
        self.under_way = None;
        if !is_there {
            let end = if follow == Follow::Enabled { &status.state } else { &status.motion_end };
            return Outcome::Failed(end.clone());
        }
        if self.steps.is_empty() { Outcome::Done } else { Outcome::Goes }
    }
}

/// States in which the machine does something that ends by itself.
pub(super) fn is_busy(state: &str) -> bool {
    matches!(
        state,
        "enabling"
            | "homing"
            | "jogging"
            | "probing"
            | "pulsing"
            | "stopping"
            | "running"
            | "holding"
    )
}
