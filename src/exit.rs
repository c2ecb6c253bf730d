//! Exit codes, in one place, and the error that carries one.

use machine::document::DocumentError;
use monitor::summary::{ErrorSummary, JobSummary, MachineSummary, Outcome, Summary};
use planner::request::Refusal;

/// How a command ended, as the shell sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// Done.
    Done = 0,
    /// Stopped by a person, or a request, check or output that failed.
    Stopped = 1,
    /// Bad arguments, machine file or job.
    BadInput = 2,
    /// A fault stopped the machine.
    Fault = 3,
    /// A service could not start or died, no pipeline runs or answers, or the instance is in use.
    Service = 4,
}

impl Exit {
    /// All of them, by their codes.
    const ALL: [Self; 5] = [Self::Done, Self::Stopped, Self::BadInput, Self::Fault, Self::Service];

    /// What it means, as `--help` and `docs/operating.md` say.
    fn meaning(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Stopped => {
                "stopped by a person (Ctrl-C, graver stop), or a request, check or output that failed"
            }
            Self::BadInput => "bad arguments, machine file or job",
            Self::Fault => "a fault stopped the machine",
            Self::Service => {
                "a service could not start or died, no pipeline runs or answers, or the instance is in use (its pid is named)"
            }
        }
    }
}

/// The exit codes as `--help` shows them.
pub fn help() -> String {
    let lines = Exit::ALL.map(|exit| format!("\n  {}  {}", exit as u8, exit.meaning()));
    format!("Exit codes:{}", lines.concat())
}

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
    /// How a run ends that fails this way.
    pub outcome: Outcome,
    /// What is wrong, where, and what would be right.
    pub refusal: Box<Refusal>,
}

impl Failure {
    /// Bad input.
    pub fn bad_input(message: impl std::fmt::Display) -> Self {
        Self { outcome: Outcome::Refused, refusal: Box::new(Refusal::internal(message)) }
    }

    /// A service that could not start or died.
    pub fn service(error: impl std::fmt::Display) -> Self {
        Self { outcome: Outcome::Aborted, refusal: Box::new(Refusal::internal(error)) }
    }

    /// What a person took back.
    pub fn stopped(message: impl std::fmt::Display) -> Self {
        Self { outcome: Outcome::Stopped, refusal: Box::new(Refusal::internal(message)) }
    }

    /// Output that could not be written.
    pub fn output(error: impl std::fmt::Display) -> Self {
        Self::stopped(error)
    }

    /// The exit code that goes with it.
    pub fn exit(&self) -> Exit {
        self.outcome.into()
    }

    /// The summary of a run that ended before there was a machine or a job to speak of.
    pub fn summary(&self) -> Summary {
        let (job, machine) = (JobSummary::default(), MachineSummary::default());
        let error = error_summary(&self.refusal);
        let errors = std::iter::once(error.clone()).chain(other_errors(&self.refusal)).collect();
        Summary { error: Some(error), errors, ..Summary::new(self.outcome, job, machine) }
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

/// What else is wrong, as a summary tells it.
pub fn other_errors(refusal: &Refusal) -> impl Iterator<Item = ErrorSummary> + '_ {
    refusal.others.iter().cloned().map(|problem| ErrorSummary {
        file: problem.file,
        line: problem.line,
        column: problem.column,
        message: problem.message,
    })
}

impl From<Refusal> for Failure {
    fn from(refusal: Refusal) -> Self {
        Self { outcome: Outcome::Refused, refusal: Box::new(refusal) }
    }
}

impl From<DocumentError> for Failure {
    fn from(error: DocumentError) -> Self {
        Refusal::of_document(&error).into()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn outcomes_have_the_documented_codes() {
        for (outcome, code) in [
            (Outcome::Completed, 0),
            (Outcome::Stopped, 1),
            (Outcome::Refused, 2),
            (Outcome::Faulted, 3),
            (Outcome::Aborted, 4),
        ] {
            assert_eq!(Exit::from(outcome) as u8, code);
        }
    }

    #[test]
    fn the_manual_says_what_the_help_says() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/operating.md");
        let manual = std::fs::read_to_string(path).unwrap().replace('`', "");
        for exit in Exit::ALL {
            let row = format!("\n| {} | {} |\n", exit as u8, exit.meaning());
            assert!(manual.contains(&row), "docs/operating.md lacks:{row}");
        }
    }
}
