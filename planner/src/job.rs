//! Job readers: each turns one kind of file into a drawing.

pub mod cloud;
pub mod cloud_table;
pub mod composition;
mod drawing_error;
pub mod drawing_table;
mod estimate;
pub mod file;
pub(crate) mod files;
mod frame;
mod frequency;
pub mod gcode;
pub mod letters;
pub mod letters_table;
pub mod marking_table;
pub mod one_file;
pub mod path_table;
pub mod points;
pub mod points_table;
pub mod program_table;
mod room;
mod whole;
mod within_reach;
pub mod workpiece_table;

use std::path::{Path, PathBuf};

use machine::document::{Document, nearest};
use machine::{DocumentError, Machine, Override};

use crate::drawing::{Drawing, Power, Step, Turns};
use crate::light::Policy;
pub use drawing_error::DrawingError;
use files::JobFiles;
use gcode::GcodeError;
pub(crate) use room::TooLarge;

/// A job, read and understood, but not planned.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// What to mark.
    pub drawing: Drawing,
    /// How to mark it.
    pub marking: Marking,
    /// Largest speed of free moves that the job's convention has [m/s]; `None` leaves it to the
    /// machine file.
    pub rapid: Option<f64>,
    /// What a G-code program asks for; `None` for other jobs.
    pub program: Option<gcode::ProgramFacts>,
    /// What the first reading of a G-code program found; `None` for other jobs.
    pub survey: Option<gcode::Survey>,
    /// A program too long to be held, whose steps follow those of the drawing; `None` where the drawing
    /// has all of them, as after [`Job::read`].
    pub rest: Option<gcode::ProgramFile>,
    /// Drawings whose steps follow those of `drawing`; `None` for other jobs.
    pub composition: Option<composition::Composition>,
    /// How far from home a drawing was put that says no place of its own and has no room there, in x and y [m].
    pub placed: Option<[f64; 2]>,
    /// What is drawn where the area holds it nowhere; `None` where it does, or where that is not known.
    pub too_large: Option<TooLarge>,
    /// Why this job can be planned but not run on a machine, if so.
    pub ideal_only: Option<&'static str>,
    /// How the joints stand before the job, load side [m or rad], on a machine that is planned by
    /// its joints; `None` where they are at home.
    pub standing: Option<messages::AxisArray>,
    /// The surface that the drawing is put on; `None` where it lies as it is drawn.
    pub surface: Option<machine::surface::Surface>,
    /// How the tool is turned.
    pub attitude: crate::geometry::attitude::AttitudeLaw,
    /// The files that it was read from.
    pub files: Vec<PathBuf>,
}

impl Job {
    /// Marks `drawing` as the machine file has it: flat, with a level tool, from home.
    pub fn of(drawing: Drawing) -> Self {
        Self {
            drawing,
            marking: Marking::default(),
            rapid: None,
            program: None,
            survey: None,
            rest: None,
            composition: None,
            placed: None,
            too_large: None,
            ideal_only: None,
            standing: None,
            surface: None,
            attitude: crate::geometry::attitude::AttitudeLaw::Level,
            files: Vec::new(),
        }
    }
}

/// How a job wants its lines marked; what is `None` the machine file's `[path]` table rules.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Marking {
    /// Speed while the laser is on; `None` leaves it to each line of the job, then to
    /// [`MarkingSpeed::Optimum`].
    pub speed: Option<MarkingSpeed>,
    /// Largest speed while the laser is on [m/s].
    pub max_speed: Option<f64>,
    /// How far a smoothed join may lie from the drawn line, and the tool from its path between two
    /// setpoints [m].
    pub tolerance: Option<f64>,
    /// How the light goes with the speed along lines; `None` leaves it to each line of the job.
    pub policy: Option<Policy>,
    /// How the tool gets from one line to the next.
    pub turns: Turns,
    /// Pulse repetition rate of the laser where the job sets no other [pulses/s]; `None` leaves it as the
    /// source is set.
    pub frequency: Option<f64>,
    /// The stroke to begin with, from 1: what is marked before is left out.
    pub from_stroke: u64,
    /// How much of that stroke is left out, from its beginning [m].
    pub from_along: f64,
    /// Whether nothing is lit: the same motion in the dark.
    pub is_dry: bool,
    /// How the box around all of it is shown instead of marking it; `None` where it is marked.
    pub frame: Option<Frame>,
}

/// How the box around a job is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Power of the laser [fraction of full scale]; `None` in the dark.
    pub power: Option<f64>,
    /// How often it is gone round.
    pub passes: u32,
}

impl Default for Marking {
    fn default() -> Self {
        Self {
            speed: None,
            max_speed: None,
            tolerance: None,
            policy: None,
            turns: Turns::default(),
            frequency: None,
            from_stroke: 1,
            from_along: 0.0,
            is_dry: false,
            frame: None,
        }
    }
}

impl Job {
    /// Whether it shows where something else lies instead of marking it.
    pub(crate) fn shows_frame(&self) -> bool {
        let composition = self.composition.as_ref();
        self.marking.frame.is_some() || composition.is_some_and(|composition| composition.is_frame)
    }
}

impl Marking {
    /// How the light goes with the speed along a line that asks for `power`.
    pub(crate) fn policy(&self, power: &Power) -> Policy {
        let asked = if power.follows_speed { Policy::Proportional } else { Policy::Constant };
        self.policy.unwrap_or(asked)
    }
}

/// The policy for the speed while the laser is on, constant along each stroke.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MarkingSpeed {
    /// The speed that minimises the drawing's time.
    Optimum,
    /// This speed [m/s].
    Constant(f64),
}

/// Why a job could not be read.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum JobError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {cause}", path.display())]
    #[diagnostic(help(
        "give the path of a job file (.toml), a G-code program (.ngc, .nc, .gcode, .tap, .gc, .cnc, .g), a drawing \
         (.svg, .dxf, .lbrn2, .plt and their like) or an image (.png, .jpg, .bmp and their like)"
    ))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// The name does not say what kind of job it is.
    #[error("{}: no kind of job has this extension", path.display())]
    #[diagnostic(help("{help}"))]
    UnknownExtension {
        /// The file.
        path: PathBuf,
        /// What would be right.
        help: String,
    },
    /// A job file or an override that is not sound.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Document(#[from] DocumentError),
    /// A drawing that is not sound.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Drawing(#[from] DrawingError),
    /// A G-code program that is not sound.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Gcode(#[from] Box<GcodeError>),
}

/// Extensions of G-code programs. Another file is one too if it begins like one.
const GCODE: [&str; 7] = ["ngc", "nc", "gcode", "tap", "gc", "cnc", "g"];

/// Extensions of drawings and images.
const DRAWINGS: [&str; 17] = graphics::read::EXTENSIONS;

/// Extension of job files.
const JOB_FILE: &str = "toml";

/// The job of the built-in machine.
const BUILTIN: &str = include_str!("../../jobs/letters.toml");

impl Job {
    /// Lines of a G-code program whose steps are held in memory, at most.
    pub const HELD: u64 = 100_000;

    /// Reads the job at `path` for `machine`, with `overrides` of its keys laid over it.
    ///
    /// # Errors
    /// Where it cannot be read or is not sound, with the place.
    pub fn read(path: &Path, overrides: &[Override], machine: &Machine) -> Result<Self, JobError> {
        Self::read_up_to(path, &JobFiles::of(path, false), overrides, machine, u64::MAX)
    }

    /// Like [`Job::read`], but the steps of a G-code program with more than [`Job::HELD`] lines stay in
    /// its file: [`Job::steps`] reads them as they are asked for.
    ///
    /// # Errors
    /// As of [`Job::read`].
    pub fn open(path: &Path, overrides: &[Override], machine: &Machine) -> Result<Self, JobError> {
        Self::read_up_to(path, &JobFiles::of(path, false), overrides, machine, Self::HELD)
    }

    /// The steps of its drawing, in order, from memory or from the program's file.
    ///
    /// # Errors
    /// Where the file cannot be opened; and the steps end with an error where it cannot be read on or
    /// was changed.
    pub fn steps(&self) -> Result<impl Iterator<Item = Result<Step, JobError>> + '_, JobError> {
        let rest = self.rest.as_ref().map(gcode::ProgramFile::steps).transpose()?;
        let rest = rest.into_iter().flatten().map(|step| step.map_err(JobError::Gcode));
        let composed = self.composition.iter().flat_map(composition::Composition::steps).map(Ok);
        Ok(self.drawing.steps.iter().cloned().map(Ok).chain(composed).chain(rest))
    }

    /// Reads the job at `path`, whose files are `files`; the steps of a G-code program with more than `most` lines
    /// stay in its file.
    pub(crate) fn read_up_to(
        path: &Path,
        files: &JobFiles,
        overrides: &[Override],
        machine: &Machine,
        most: u64,
    ) -> Result<Self, JobError> {
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or("");
        let extension = extension.to_ascii_lowercase();
        if GCODE.contains(&extension.as_str()) {
            return program_table::program(path, files, overrides, machine, most)?.framed(machine);
        }
        if DRAWINGS.contains(&extension.as_str()) {
            return drawing_table::drawing(path, files, overrides, machine)?.framed(machine);
        }
        if extension != JOB_FILE {
            if gcode::is_program(path, files) {
                return program_table::program(path, files, overrides, machine, most)?
                    .framed(machine);
            }
            let known = || GCODE.into_iter().chain([JOB_FILE]).chain(DRAWINGS);
            let help = match nearest(&extension, known()) {
                Some(near) => format!("did you mean `.{near}`?"),
                None => {
                    let names: Vec<String> = known().map(|name| format!(".{name}")).collect();
                    format!(
                        "known are {}; another file is taken for G-code if its first lines are",
                        names.join(", ")
                    )
                }
            };
            return Err(JobError::UnknownExtension { path: path.to_owned(), help });
        }
        let text = read_text(path, files)?;
        let name = path.display().to_string();
        let document = Document::parse(&name, &text)?.override_with(overrides, "")?;
        let mut job = file::job(document, files, machine, most)?;
        job.files.push(path.to_owned());
        job.framed(machine)
    }

    /// The built-in job, letters at 20 mm, with `overrides` of its keys laid over it.
    ///
    /// # Errors
    /// Where an override is not sound.
    pub fn builtin(overrides: &[Override], machine: &Machine) -> Result<Self, JobError> {
        let document = Document::parse("letters.toml", BUILTIN)?.override_with(overrides, "")?;
        file::job(document, &JobFiles::of_text(), machine, u64::MAX)?.framed(machine)
    }

    /// The job file called `name` with this `text`, which may name no other file.
    ///
    /// # Errors
    /// Where it is not sound, with the place.
    pub fn parse(name: &str, text: &str, machine: &Machine) -> Result<Self, JobError> {
        let document = Document::parse(name, text)?;
        file::job(document, &JobFiles::of_text(), machine, u64::MAX)?.framed(machine)
    }
}

impl JobError {
    /// The file that it speaks of.
    pub fn file(&self) -> String {
        match self {
            Self::Unreadable { path, .. } | Self::UnknownExtension { path, .. } => {
                path.display().to_string()
            }
            Self::Document(error) => error.file().to_owned(),
            Self::Drawing(error) => error.path.display().to_string(),
            Self::Gcode(error) => error.file.clone(),
        }
    }

    /// Line and column from 1; `None` where an override or the whole file is meant.
    pub fn position(&self) -> Option<(u64, u64)> {
        match self {
            Self::Unreadable { .. } | Self::UnknownExtension { .. } => None,
            Self::Document(error) => {
                error.line().zip(error.column()).map(|(line, column)| (line as u64, column as u64))
            }
            Self::Drawing(error) => error.line.map(|line| (line, error.column.unwrap_or(1))),
            Self::Gcode(error) => Some((error.line, error.column)),
        }
    }
}

/// The text of the file at `path`.
fn read_text(path: &Path, files: &JobFiles) -> Result<String, JobError> {
    let read = || std::io::read_to_string(files.open(JobFiles::own_name(path))?);
    read().map_err(|cause| JobError::Unreadable { path: path.to_owned(), cause })
}
