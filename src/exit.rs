//! Exit codes, in one place, and the error that carries one.

use machine::document::DocumentError;
use monitor::summary::{ErrorSummary, Outcome};
use planner::request::Refusal;

/// How a command ended, as the shell sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// Done.
    Done = 0,
    /// Stopped by a person, or a check that failed.
    Stopped = 1,
    /// Bad arguments, machine file or job.
    BadInput = 2,
    /// A fault stopped the machine.
    Fault = 3,
    /// A service could not start or died, or the instance is in use.
    Service = 4,
}

/// The exit codes as `--help` shows them.
pub const EXIT_CODES: &str = "\
Exit codes:
  0  done
  1  stopped by a person (Ctrl-C, graver stop), or a check that failed
  2  bad arguments, machine file or job
  3  a fault stopped the machine
  4  a service could not start or died, or the instance is in use";

impl From<Exit> for std::process::ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

impl From<Outcome> for Exit {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Completed => Self::Done,
            Outcome::Stopped => Self::Stopped,
            Outcome::Refused => Self::BadInput,
            Outcome::Faulted => Self::Fault,
            Outcome::Aborted => Self::Service,
        }
    }
}

/// Why a command could not do what it was asked.
#[derive(Debug, Clone)]
pub struct Failure {
    /// The exit code that goes with it.
    pub exit: Exit,
    /// What is wrong, where, and what would be right.
    pub refusal: Refusal,
}

impl Failure {
    /// Bad input.
    pub fn bad_input(message: impl std::fmt::Display) -> Self {
        Self { exit: Exit::BadInput, refusal: Refusal::internal(message) }
    }

    /// A service that could not start or died.
    pub fn service(error: impl std::fmt::Display) -> Self {
        Self { exit: Exit::Service, refusal: Refusal::internal(error) }
    }

    /// How a run ends that fails this way.
    pub fn outcome(&self) -> Outcome {
        match self.exit {
            Exit::Done => Outcome::Completed,
            Exit::Stopped => Outcome::Stopped,
            Exit::BadInput => Outcome::Refused,
            Exit::Fault => Outcome::Faulted,
            Exit::Service => Outcome::Aborted,
        }
    }

    /// The error as a summary tells it.
    pub fn summary(&self) -> ErrorSummary {
        error_summary(&self.refusal)
    }
}

/// A refusal as a summary tells it.
pub fn error_summary(refusal: &Refusal) -> ErrorSummary {
    ErrorSummary {
        file: refusal.file.clone(),
        line: refusal.line,
        column: refusal.column,
        message: refusal.message.clone(),
    }
}

impl From<Refusal> for Failure {
    fn from(refusal: Refusal) -> Self {
        Self { exit: Exit::BadInput, refusal }
    }
}

impl From<DocumentError> for Failure {
    fn from(error: DocumentError) -> Self {
        Refusal::of_document(&error).into()
    }
}
