//! The job file: its tables, and how they become a [`Job`].

use std::path::Path;

use machine::document::{Diagnostics, Document, Named, Span, schema_text};
use machine::{Machine, table};
use nalgebra::Vector3;

use super::cloud_table::{self, CloudTable};
use super::composition::tables::{DrawingTable, FrameTable, LayerTable, OrderTable};
use super::drawing_table;
use super::files::JobFiles;
use super::letters_table::{self, LettersTable};
use super::marking_table::MarkingTable;
use super::path_table::{self, PathTable};
use super::points_table::{self, PointsTable};
use super::program_table::{self, GcodeTable};
use super::workpiece_table::{self, AttitudeTable, SurfaceTable};
use super::{Job, JobError};
use crate::drawing::Drawing;

/// Declares the kinds of jobs: the key of each in a job file, its table, and what reads it. A new kind has a
/// line here, and a file of its own.
macro_rules! kinds {
    ($($(#[doc = $doc:expr])* $key:ident: $table:ty => $read:path;)*) => {
        table! {
            /// What to mark, and how: exactly one kind of job, and what stands beside it.
            pub struct JobTable {
                $($(#[doc = $doc])* pub $key: Option<$table>,)*
                /// How the layers of drawings are marked, in the order of marking.
                pub layers: Option<Named<LayerTable>>,
                /// In which order drawings are marked.
                pub order: Option<OrderTable>,
                /// Shows where drawings lie instead of marking them.
                pub frame: Option<FrameTable>,
                /// The surface that the drawing is put on, around the middle of its height instead of
                /// the machine's home.
                pub surface: Option<SurfaceTable>,
                /// How the tool is turned, where not by the surface.
                pub attitude: Option<AttitudeTable>,
                /// How to mark; what is left out, the machine file's `[path]` table rules.
                pub marking: MarkingTable,
            }
        }

        /// The keys of the kinds of jobs.
        const KINDS: &[&str] = &[$(stringify!($key)),*];

        impl JobTable {
            /// Where each kind that it has stands.
            fn places(&self) -> Vec<Span> {
                let places = [$(self.$key.as_ref().map(|table| table.span)),*];
                places.into_iter().flatten().collect()
            }
        }

        /// Reads the kind of job that there is.
        fn read(reading: Reading<'_>) -> Result<Job, JobError> {
            let beside = reading.beside;
            $(
                if let Some(table) = &beside.$key {
                    return $read(table, reading);
                }
            )*
            nothing_to_mark(reading)
        }
    };
}

kinds! {
    /// Letters of the thesis.
    letters: LettersTable => letters_table::read;
    /// A list of points, each marked by a dwell.
    points: PointsTable => points_table::read;
    /// A path in space.
    path: PathTable => path_table::read;
    /// Points inside glass.
    cloud: CloudTable => cloud_table::read;
    /// A G-code program.
    gcode: GcodeTable => program_table::read;
    /// A drawing: a file of a drawing program, an image, text or a code.
    drawing: DrawingTable => drawing_table::read;
    /// Several drawings, under names of their own, in order.
    drawings: Named<DrawingTable> => drawing_table::read_all;
}

/// What a kind of job is read with.
pub(super) struct Reading<'a> {
    /// The whole job file.
    pub(super) beside: &'a JobTable,
    /// Where what is wrong goes.
    pub(super) diagnostics: Diagnostics,
    /// The files that it may read.
    pub(super) files: &'a JobFiles,
    /// The steps of a program with more lines stay in its file.
    pub(super) most: u64,
    /// For which machine; its home is the middle of the surface where there is one.
    pub(super) machine: &'a Machine,
}

impl Reading<'_> {
    /// The line of a place, 0 of an override.
    pub(super) fn line(&self, place: Span) -> u64 {
        self.diagnostics.position(place).map_or(0, |(line, _)| line as u64)
    }

    /// The name of the job file without its extension; `other` where it has none.
    pub(super) fn stem(&self, other: &str) -> String {
        let stem = Path::new(self.diagnostics.file()).file_stem().and_then(|stem| stem.to_str());
        stem.unwrap_or(other).to_owned()
    }

    /// The job that marks a drawing as `[marking]` has it.
    pub(super) fn job_of(&self, drawing: Drawing) -> Job {
        Job { marking: self.beside.marking.marking(), ..Job::of(drawing) }
    }

    /// Gives `job` if nothing is wrong.
    pub(super) fn finish(self, job: Job) -> Result<Job, JobError> {
        Ok(self.diagnostics.finish(job)?)
    }
}

/// The JSON schema of job files, as `jobs/schema.json` holds it.
pub fn schema() -> String {
    schema_text::<JobTable>("Graver job file")
}

/// Reads a job file whose text is in `document`, with its `files`. The steps of a program with more than `most` lines stay in its file.
pub(super) fn job(
    document: Document,
    files: &JobFiles,
    machine: &Machine,
    most: u64,
) -> Result<Job, JobError> {
    let (table, mut diagnostics) = document.decode::<JobTable>()?;
    check(&table, machine, &mut diagnostics);
    let home = Vector3::from(machine.home);
    let surface = table.surface.as_ref();
    let surface = surface.and_then(|table| workpiece_table::surface(table, &mut diagnostics));
    let machine = workpiece_table::flat(machine, surface.as_ref());
    let others = table.places().into_iter().skip(1);
    others.for_each(|place| {
        diagnostics.contradict(place, "a job marks one thing".to_owned(), &one_of("keep"));
    });
    let reading = Reading { beside: &table, diagnostics, files, most, machine: &machine };
    let job = match table.places().len() {
        0 | 1 => read(reading)?,
        _ => reading.diagnostics.fail()?,
    };
    Ok(workpiece_table::place(job, surface, table.attitude.as_ref(), home))
}

/// What is wrong with the tables beside the kind.
fn check(table: &JobTable, machine: &Machine, diagnostics: &mut Diagnostics) {
    table.marking.check(machine, diagnostics);
    if table.gcode.is_none() {
        table.marking.refuse_line(diagnostics);
    }
    if table.drawing.is_some() || table.drawings.is_some() {
        return;
    }
    let for_drawings = [
        table.layers.as_ref().map(|layers| ("layers", layers.span)),
        table.order.as_ref().map(|order| ("order", order.span)),
        table.frame.as_ref().map(|frame| ("frame", frame.span)),
    ];
    for (name, span) in for_drawings.into_iter().flatten() {
        let text = format!("[{name}] is for drawings, and this job has none");
        diagnostics.contradict(span, text, "leave it out, or add a table [drawing]");
    }
}

fn nothing_to_mark(mut reading: Reading<'_>) -> Result<Job, JobError> {
    let place = reading.beside.span;
    reading.diagnostics.contradict(place, "nothing to mark".to_owned(), &one_of("add"));
    Ok(reading.diagnostics.fail()?)
}

/// What to do with the tables of kinds.
fn one_of(verb: &str) -> String {
    let kinds: Vec<String> = KINDS.iter().map(|kind| format!("[{kind}]")).collect();
    format!("{verb} one of the tables {}", kinds.join(", "))
}
