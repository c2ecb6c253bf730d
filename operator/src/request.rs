//! What goes over the operators' socket, and what the machine answers.

use messages::{ControllerState, OperatorReply, OperatorVerb, Refusal};
use planner::request::JobRequest;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// What goes over the socket.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "request")]
pub enum Request {
    /// A verb for the machine.
    Verb {
        /// Its name.
        verb: Verb,
        /// Its argument.
        value: f64,
    },
    /// A verb about axes, with two numbers.
    Operate {
        /// Its name.
        verb: Verb,
        /// The axes by name.
        axes: Vec<String>,
        /// Its first argument, SI.
        value: f64,
        /// Its second one, SI.
        second: f64,
        /// The unit that the axis must have for them: `m` or `rad`; null where they have none.
        unit: Option<String>,
    },
    /// Sets an input of a simulated machine.
    Input {
        /// Its name in the machine file.
        name: String,
        /// Whether it is active from now on.
        is_active: bool,
    },
    /// Switches an output.
    Output {
        /// Its name in the machine file.
        name: String,
        /// Whether it is on from now on.
        is_on: bool,
    },
    /// What is going on?
    Status,
    /// A job to run. The first part of the answer is [`Part::Accepted`].
    Submit {
        /// The job.
        job: JobRequest,
        /// The run folder.
        out: Option<PathBuf>,
        /// Whether to answer as soon as it waits, with [`Submitted`](crate::Submitted); else the answer comes when
        /// it has ended, and is its summary.
        #[serde(default)]
        detached: bool,
    },
    /// The jobs: see [`Queue`](crate::Queue).
    Queue,
    /// Puts a job that waits at another place; answered with the jobs.
    Move {
        /// Its number.
        job: u64,
        /// Its new place among those that wait, from 1.
        place: usize,
    },
    /// Submits a job once more, under a new number; answered as a detached one.
    Repeat {
        /// Its number.
        job: u64,
    },
    /// Takes a job back: stopped if it is under way, gone at once if it waits; answered with the jobs.
    Withdraw {
        /// Its number.
        job: u64,
    },
    /// Begins no other job that waits; answered with the jobs.
    HoldQueue,
    /// Begins the jobs that wait, one after the other; answered with the jobs.
    StartQueue,
}

/// A part of the answer to a submitted job.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// It waits for its turn, under this number.
    Accepted(u64),
    /// How far it has come, 0 to 1.
    Share(f64),
}

/// A verb by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verb {
    /// Power the motors.
    Enable,
    /// Unpower the motors.
    Disable,
    /// Feed hold.
    Hold,
    /// Go on.
    Resume,
    /// Give the job up.
    Stop,
    /// Clear a fault.
    Reset,
    /// Another rate.
    Override,
    /// Find the references of axes.
    Home,
    /// Move an axis for as long as it is asked for.
    Jog,
    /// Move an axis by a distance.
    Step,
    /// Light the laser for a moment.
    TestPulse,
    /// Move an axis until the probe touches.
    Probe,
    /// Go on with a jog.
    JogOn,
    /// Switch an output.
    Output,
    /// Another power of the laser, until the job ends.
    Power,
    /// Another rate of rapids.
    Rapid,
}

/// The machine's answer to a verb, as `graver hold --json` and its like print it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct VerbReply {
    /// Whether it is carried out.
    pub accepted: bool,
    /// Why it is not, in words; null where it is.
    pub refusal: Option<String>,
    /// The same by name, such as `soft_limit`.
    pub code: Option<String>,
    /// The requests that the controller had accepted then, this one included.
    pub number: u32,
    /// The state that the request met; `preparing` for a job that is not played yet.
    pub state: String,
    /// The rate now wanted, 1 as planned.
    pub value: f64,
    /// So many times the power that the job asks for is given, until the job ends.
    pub power: f64,
    /// What limits the override: why the job cannot run as fast as asked; null where nothing does.
    pub capped_by: Option<String>,
    /// Of a stop and a hold: that the holder does not answer, in words, where the controller answered past it; null where
    /// the holder did.
    #[serde(default)]
    pub direct: Option<String>,
}

impl VerbReply {
    /// A request that is carried out without the controller.
    pub fn accepted(state: &str) -> Self {
        let reply = OperatorReply { accepted: 1, value: 1.0, power: 1.0, ..Default::default() };
        Self { state: state.to_owned(), ..Self::from(reply) }
    }

    /// A request that is refused without the controller.
    pub fn refused(code: Refusal, words: String, state: String) -> Self {
        let (refusal, code) = (Some(words), Some(code.name().to_owned()));
        Self { refusal, code, state, ..Self::from(OperatorReply::default()) }
    }
}

impl From<OperatorReply> for VerbReply {
    fn from(reply: OperatorReply) -> Self {
        Self {
            accepted: reply.accepted == 1,
            refusal: None,
            code: (reply.accepted != 1)
                .then(|| Refusal::from_wire(reply.refusal).name().to_owned()),
            number: reply.number,
            state: ControllerState::from_wire(reply.state).name().to_owned(),
            value: reply.value,
            power: reply.power,
            capped_by: None,
            direct: None,
        }
    }
}

impl Verb {
    /// Whether it must be answered at once, or the controller is asked past a holder that hangs.
    pub fn is_urgent(self) -> bool {
        matches!(self, Self::Stop | Self::Hold)
    }
}

impl From<Verb> for OperatorVerb {
    fn from(verb: Verb) -> Self {
        match verb {
            Verb::Enable => Self::Enable,
            Verb::Disable => Self::Disable,
            Verb::Hold => Self::Hold,
            Verb::Resume => Self::Resume,
            Verb::Stop => Self::Stop,
            Verb::Reset => Self::Reset,
            Verb::Override => Self::Override,
            Verb::Home => Self::Home,
            Verb::Jog => Self::Jog,
            Verb::Step => Self::Step,
            Verb::TestPulse => Self::TestPulse,
            Verb::Probe => Self::Probe,
            Verb::JogOn => Self::JogOn,
            Verb::Output => Self::Output,
            Verb::Power => Self::Power,
            Verb::Rapid => Self::Rapid,
        }
    }
}
