//! G-code programs: the job file's table of one, and one that is a job by itself.

use std::path::Path;

use machine::document::{Diagnostics, Document, Spanned};
use machine::gcode_settings::WordMeanings;
use machine::{Machine, Override, table};
use nalgebra::Vector3;

use super::file::Reading;
use super::files::JobFiles;
use super::marking_table::MarkingTable;
use super::{Job, JobError, gcode};
use crate::drawing::{Drawing, Note};

machine::dialect_table! {
    /// A G-code program.
    pub struct GcodeTable {
        /// The file, relative to this one.
        pub file: Spanned<String>,
    }
}

machine::dialect_table! {
    /// What the words of a G-code program mean.
    pub struct DialectTable {
    }
}

table! {
    /// How to mark a G-code program, whose S words are its power.
    pub struct ProgramTable {
        /// What its words mean; what is left out, the machine file's `[gcode]` table rules.
        pub gcode: DialectTable,
        /// How to mark; what is left out, the program and the machine file rule.
        pub marking: MarkingTable,
    }
}

/// The job that is a program.
pub(super) fn read(table: &GcodeTable, reading: Reading<'_>) -> Result<Job, JobError> {
    let Reading { beside, diagnostics, files, most, machine } = reading;
    let words = table.over(machine.gcode.words);
    let name = Path::new(&table.file.value);
    of_program((files, name), words, &beside.marking, diagnostics, machine, most)
}

/// Reads the G-code program at `path` as a job of its own, with `overrides` of `[marking]`; the steps of
/// one with more than `most` lines stay in the file.
pub(super) fn program(
    path: &Path,
    files: &JobFiles,
    overrides: &[Override],
    machine: &Machine,
    most: u64,
) -> Result<Job, JobError> {
    let empty = Document::parse(&path.display().to_string(), "")?;
    let (table, mut diagnostics) = empty.override_with(overrides, "")?.decode::<ProgramTable>()?;
    table.marking.check(machine, &mut diagnostics);
    let words = table.gcode.over(machine.gcode.words);
    let own = JobFiles::own_name(path);
    of_program((files, own), words, &table.marking, diagnostics, machine, most)
}

fn of_program(
    (files, file): (&JobFiles, &Path),
    words: WordMeanings,
    marking: &MarkingTable,
    mut diagnostics: Diagnostics,
    machine: &Machine,
    most: u64,
) -> Result<Job, JobError> {
    if let Some(power) = &marking.power {
        diagnostics.contradict(
            power.span,
            "the power of a G-code program is its S words'".to_owned(),
            "leave `power` out",
        );
    }
    diagnostics.finish(())?;
    let from_line = marking.first_line();
    let (program, steps) = gcode::ProgramFile::open(files, file, words, from_line, machine, most)?;
    let path = files.path(file);
    let survey = program.survey.clone();
    let begins = from_line.map(|line| Note {
        line,
        text: "begins with this line, as the job says, with all that the lines before it leave in force"
            .to_owned(),
    });
    let rest = if steps.is_none() { Some(program) } else { None };
    let drawing = Drawing {
        name: gcode::name(&path.display().to_string()),
        start: Vector3::from(machine.home),
        steps: steps.unwrap_or_default(),
        notes: begins.into_iter().chain(survey.notes.iter().cloned()).collect(),
    };
    Ok(Job {
        program: Some(survey.facts),
        survey: Some(survey),
        rest,
        files: vec![path],
        marking: marking.marking(),
        ..Job::of(drawing)
    })
}
