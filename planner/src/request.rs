//! What the domain asks of the planner and what the planner answers besides samples: small JSON
//! files in the run folder.

use crate::job::files::JobFiles;
use crate::job::gcode::GcodeError;
use crate::job::{Job, JobError};
use crate::{Plan, PlanError};
use machine::Machine;
use machine::document::{Document, DocumentError, Override};
use machine::offsets::Offsets;
use miette::Diagnostic;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A job by name, as `request.json` in the run folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct JobRequest {
    /// The job file; `None` for the built-in job.
    pub job: Option<PathBuf>,
    /// Changes of the job, `KEY=VALUE`.
    pub set: Vec<String>,
    /// The offsets that people have set at the machine; null where there are none.
    #[serde(default)]
    pub offsets: Option<OffsetsFile>,
    /// Whether it may read the files of its own folder only, as a job must that a stranger may have sent: see
    /// [`runtime::beneath`]. Fonts are found by their names all the same.
    #[serde(default)]
    pub confined: bool,
}

/// A file of offsets as it was when the job was asked for: see [`machine::offsets`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct OffsetsFile {
    /// Its path.
    pub path: PathBuf,
    /// What it says.
    pub text: String,
}

impl OffsetsFile {
    /// The one beside the machine file at `machine`, if there is one.
    ///
    /// # Errors
    /// One that cannot be read.
    pub fn beside(machine: &Path) -> Result<Option<Self>, Refusal> {
        let path = Offsets::path(machine);
        if !path.exists() {
            return Ok(None);
        }
        let text = Document::text(&path).map_err(|error| Refusal::of_document(&error))?;
        Ok(Some(Self { path, text }))
    }

    /// What it says.
    ///
    /// # Errors
    /// One that is damaged, with the place.
    pub fn offsets(&self) -> Result<Offsets, Refusal> {
        let offsets = Offsets::parse(&self.path.display().to_string(), &self.text);
        offsets.map_err(|error| Refusal::of_document(&error))
    }
}

/// Why a job was refused, as `refused.json` in the run folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Refusal {
    /// The file at fault; `None` when it is none.
    pub file: Option<String>,
    /// Line from 1.
    pub line: Option<u64>,
    /// Column from 1.
    pub column: Option<u64>,
    /// What is wrong, and what would be right.
    pub message: String,
    /// The same for a person, with the lines at fault.
    pub text: String,
    /// What else is wrong.
    #[serde(default)]
    pub others: Box<[Problem]>,
}

/// One thing that is wrong with a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Problem {
    /// The file at fault.
    pub file: Option<String>,
    /// Line from 1.
    pub line: Option<u64>,
    /// Column from 1.
    pub column: Option<u64>,
    /// What is wrong, and what would be right.
    pub message: String,
}

impl JobRequest {
    /// The same job by a path that holds from any folder.
    #[must_use]
    pub fn absolute(mut self) -> Self {
        self.job = self.job.map(|path| std::path::absolute(&path).unwrap_or(path));
        self
    }

    /// Reads the job that is asked for.
    ///
    /// # Errors
    /// What is wrong with it, and where.
    pub fn read(&self, machine: &Machine) -> Result<Job, Refusal> {
        self.read_up_to(u64::MAX, machine)
    }

    /// Reads the job that is asked for, but leaves the steps of a long program in its file.
    ///
    /// # Errors
    /// As of [`Self::read`].
    pub fn open(&self, machine: &Machine) -> Result<Job, Refusal> {
        self.read_up_to(Job::HELD, machine)
    }

    fn read_up_to(&self, most: u64, machine: &Machine) -> Result<Job, Refusal> {
        let overrides: Vec<Override> = self
            .set
            .iter()
            .map(|text| text.parse())
            .collect::<Result<_, _>>()
            .map_err(|error| Refusal::of_diagnostic(&error))?;
        let applied = match &self.offsets {
            Some(file) => Some(file.offsets()?.applied(machine)),
            None => None,
        };
        let machine = applied.as_ref().unwrap_or(machine);
        match &self.job {
            Some(path) => {
                let files = JobFiles::of(path, self.confined);
                Job::read_up_to(path, &files, &overrides, machine, most)
            }
            None => Job::builtin(&overrides, machine),
        }
        .map_err(|error| Refusal::of_job(&error))
    }

    /// Reads and plans it.
    ///
    /// # Errors
    /// What is wrong with it, and where.
    pub fn plan(&self, machine: &Machine) -> Result<Plan, Refusal> {
        let job = self.read(machine)?;
        crate::plan(machine, &job).map_err(|error| self.refuse(&error))
    }

    /// The refusal that a plan's error means for this job.
    pub fn refuse(&self, error: &PlanError) -> Refusal {
        let file = self.job.as_ref().map(|path| path.display().to_string());
        let line = Some(error.line()).filter(|line| *line > 0);
        let message = error.to_string();
        let place = match (&file, line) {
            (Some(file), Some(line)) => format!("{file}:{line}: "),
            (Some(file), None) => format!("{file}: "),
            (None, _) => String::new(),
        };
        let text = format!("{place}{message}");
        Refusal { file, line, column: None, message, text, others: Box::default() }
    }
}

impl Refusal {
    /// The refusal that a job which cannot be read means.
    pub fn of_job(error: &JobError) -> Self {
        let position = error.position();
        Self {
            file: Some(error.file()),
            line: position.map(|(line, _)| line),
            column: position.map(|(_, column)| column),
            others: match error {
                JobError::Document(error) => others_of_document(error),
                JobError::Gcode(error) => others_of_program(error),
                _ => Box::default(),
            },
            ..Self::of_diagnostic(error)
        }
    }

    /// The refusal that a machine file or an override which is not sound means.
    pub fn of_document(error: &DocumentError) -> Self {
        Self {
            file: Some(error.file().to_owned()),
            line: error.line().map(|line| line as u64),
            column: error.column().map(|column| column as u64),
            message: error.message(),
            others: others_of_document(error),
            ..Self::of_diagnostic(error)
        }
    }

    /// A refusal with the text of a diagnostic, without a place.
    pub fn of_diagnostic(diagnostic: &dyn Diagnostic) -> Self {
        let mut text = String::new();
        let theme = miette::GraphicalTheme::unicode_nocolor();
        let handler = miette::GraphicalReportHandler::new_themed(theme);
        if handler.render_report(&mut text, diagnostic).is_err() {
            text = diagnostic.to_string();
        }
        let message = message_of(diagnostic);
        Self { file: None, line: None, column: None, message, text, others: Box::default() }
    }

    /// A refusal that no line of a file is to blame for.
    pub fn internal(error: impl std::fmt::Display) -> Self {
        let message = error.to_string();
        let others = Box::default();
        Self { file: None, line: None, column: None, text: message.clone(), message, others }
    }
}

/// What is wrong, and what would be right.
fn message_of(diagnostic: &dyn Diagnostic) -> String {
    match diagnostic.help() {
        Some(help) => format!("{diagnostic}; {help}"),
        None => diagnostic.to_string(),
    }
}

/// All that is wrong with a document but the first.
fn others_of_document(error: &DocumentError) -> Box<[Problem]> {
    let others = error.problems().skip(1).map(|problem| Problem {
        file: Some(error.file_of(problem).to_owned()),
        line: problem.line().map(|line| line as u64),
        column: problem.column().map(|column| column as u64),
        message: problem.message(),
    });
    others.collect()
}

/// All that is wrong with a program but the first.
fn others_of_program(error: &GcodeError) -> Box<[Problem]> {
    let others = error.others.iter().map(|other| Problem {
        file: Some(other.file.clone()),
        line: Some(other.line),
        column: Some(other.column),
        message: message_of(other),
    });
    others.collect()
}
