//! The G-code reader: RS-274 as laser users write it, to a drawing.
//!
//! What the words mean on a laser: G0 never marks; G1, G2 and G3 mark while M3 or M4 is on and S is
//! above zero, and are followed in the dark otherwise. Under M4 the power follows the speed. What a
//! program does not say itself (full scale of S, work origins, what Z means) stands in the machine
//! file.
//!
//! A code, word or form that is not known here is a [`GcodeError`] with its place, and what is accepted
//! without effect leaves a note in the drawing. Only N, numbers of programs, Q of G64, and the codes that
//! cancel what this reader does not have anyway (G15, G40, G49, G50, G69, G80, G97, G98, G99) pass without
//! one.
//!
//! A line goes through `lexer`, which reads words and what they are worth (`expression`), `block`, which
//! gathers them, and `interpreter`, which does them. `steps` puts that together and asks `flow` where an O
//! word leads.

mod arc;
mod block;
mod characters;
mod codes;
mod encoding;
mod error;
mod expression;
mod flow;
mod interpreter;
mod lexer;
mod line_reader;
mod lines;
mod parameters;
#[cfg(test)]
mod pieces;
mod recognise;
mod settings;
mod steps;
mod survey;
#[cfg(test)]
mod tests;
mod tracer;

use machine::Machine;

pub use error::GcodeError;
pub use line_reader::{LineEffect, LineError, LineReader, Modals};
pub(super) use recognise::is_program;
pub use steps::Steps;
pub use survey::{FileSteps, ProgramFacts, ProgramFile, Survey, survey};

use self::settings::ReaderSettings;
use crate::drawing::Drawing;

/// What a program asks for, and its extent for comparison with other interpreters.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    /// The program as geometry.
    pub drawing: Drawing,
    /// Its extent.
    pub facts: ProgramFacts,
}

/// Reads the program `text`; `file` is its name in errors and of the drawing.
///
/// # Errors
/// The first thing that is not G-code, not supported here, or contradicts itself, and with it what else
/// is wrong further down.
pub fn read(file: &str, text: &str, machine: &Machine) -> Result<Program, Box<GcodeError>> {
    read_by(file, text, &ReaderSettings::of(machine))
}

fn read_by(file: &str, text: &str, settings: &ReaderSettings) -> Result<Program, Box<GcodeError>> {
    let reading = Steps::new(file, text.as_bytes(), settings);
    let (survey, steps) = reading.read_through(u64::MAX)?;
    let drawing = Drawing {
        name: name(file),
        start: settings.home,
        steps: steps.unwrap_or_default(),
        notes: survey.notes,
    };
    Ok(Program { drawing, facts: survey.facts })
}

/// The name of the drawing in `file`: without folder and extension.
pub(super) fn name(file: &str) -> String {
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
    name.rsplit_once('.').map_or(name, |(stem, _)| stem).to_owned()
}
