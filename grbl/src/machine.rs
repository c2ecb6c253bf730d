//! What grbl's clients ask of the machine, and what the machine says.

use operator::{Status, Verb, VerbReply};
use std::path::PathBuf;

/// A request of a session, to be answered under its number.
#[derive(Debug, Clone, PartialEq)]
pub enum Ask {
    /// A verb for the machine.
    Verb {
        /// Its name.
        verb: Verb,
        /// Its argument.
        value: f64,
    },
    /// A verb about axes, or the tool along x, y and z, with two numbers, SI.
    Operate {
        /// Its name.
        verb: Verb,
        /// The axes by name, all for none.
        axes: Vec<String>,
        /// Its first argument.
        value: f64,
        /// Its second one.
        second: f64,
    },
    /// Switches an output.
    Output {
        /// Its name in the machine file.
        name: String,
        /// Whether it is on from now on.
        is_on: bool,
    },
    /// Puts a program into the queue of jobs.
    Submit {
        /// Its file.
        file: PathBuf,
        /// Changes of the job, `KEY=VALUE`.
        set: Vec<String>,
    },
    /// Takes a job back: stopped if it is under way.
    Withdraw {
        /// Its number.
        job: u64,
    },
}

impl Ask {
    /// Whether it must not wait for another request.
    pub fn is_urgent(&self) -> bool {
        matches!(self, Self::Verb { verb, .. } if verb.is_urgent())
            || matches!(self, Self::Withdraw { .. })
            || matches!(self, Self::Operate { verb: Verb::Jog, value, .. } if *value == 0.0)
    }
}

/// What came of a request.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// It is carried out, or begun, as the request of this number.
    Done(u32),
    /// The job has this number.
    Submitted(u64),
    /// It is not, for this reason.
    Refused(String),
}

impl From<VerbReply> for Answer {
    fn from(reply: VerbReply) -> Self {
        if reply.accepted {
            return Self::Done(reply.number);
        }
        Self::Refused(reply.refusal.unwrap_or_else(|| "refused".to_owned()))
    }
}

/// Where a submitted job is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum JobState {
    /// It waits, or is under way.
    Goes,
    /// It has ended, or nobody knows of it any more.
    Ended {
        /// How, as a summary's `outcome`.
        outcome: String,
        /// Why, in words.
        message: Option<String>,
    },
}

/// A machine that does what grbl's clients ask. Any thread may ask.
pub trait Machine: Send + Sync {
    /// What it is doing.
    ///
    /// # Errors
    /// Why nobody answers.
    fn status(&self) -> Result<Status, String>;

    /// Asks for something, and waits for the answer, not for the end of what is begun.
    fn ask(&self, ask: &Ask) -> Answer;

    /// Where a job that was submitted is.
    ///
    /// # Errors
    /// Why nobody answers.
    fn job(&self, number: u64) -> Result<JobState, String>;
}
