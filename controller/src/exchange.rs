//! What goes into a controller step and what comes out of it.

use messages::command::lost;
use messages::{
    Command, ControllerReport, Feedback, Nanoseconds, OperatorReply, OperatorRequest, Progress,
    Setpoint,
};

/// Whether a peer is there.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Presence {
    /// It is alive, or has not been there yet.
    #[default]
    Present,
    /// It was there, and has died or left.
    Lost,
}

/// The processes that this one depends on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Peers {
    /// Who sends setpoints; missed only while a stream is played.
    pub planner: Presence,
    /// Who sends feedback.
    pub drives: Presence,
    /// Who holds the domain.
    pub supervisor: Presence,
}

impl Peers {
    /// Who is lost, in bits of [`lost`].
    pub fn lost(&self) -> u32 {
        let bit = |peer, bit| if peer == Presence::Lost { bit } else { 0 };
        bit(self.planner, lost::PLANNER)
            | bit(self.drives, lost::DRIVES)
            | bit(self.supervisor, lost::SUPERVISOR)
    }

    /// Those of whom these are lost; bits of [`lost`].
    pub fn without(lost: u32) -> Self {
        let of = |bit| if lost & bit == 0 { Presence::Present } else { Presence::Lost };
        Self {
            planner: of(lost::PLANNER),
            drives: of(lost::DRIVES),
            supervisor: of(lost::SUPERVISOR),
        }
    }
}

/// What a step is given.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    /// The newest feedback.
    pub feedback: &'a Feedback,
    /// When it was read.
    pub received: Nanoseconds,
    /// Setpoints that arrived since the last step, in order; no more than
    /// [`Controller::room`](crate::Controller::room) had room for.
    pub setpoints: &'a [Setpoint],
    /// A person's request.
    pub request: Option<OperatorRequest>,
    /// Who is there.
    pub peers: Peers,
    /// Inputs that slow devices make active, one bit each in the order of the machine file.
    pub slow: u64,
}

/// What a step gives back.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Outputs {
    /// The answer to the feedback. Its `published` is the time of the step; whoever publishes it
    /// may set it anew.
    pub command: Command,
    /// How far the stream has come: every few cycles, and when the state changes.
    pub progress: Option<Progress>,
    /// What was counted over the stream: when it ends, and once a second, the final one repeated
    /// until the next stream begins.
    pub report: Option<ControllerReport>,
    /// The answer to the request.
    pub reply: Option<OperatorReply>,
}
