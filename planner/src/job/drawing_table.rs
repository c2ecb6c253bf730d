//! Drawings: the job file's tables of them, and a file that is a job by itself.

use std::path::Path;

use machine::document::{Diagnostics, Document, Either, Named};
use machine::{Machine, Override, table};
use nalgebra::Vector3;

use super::composition::tables::{DrawingTable, FrameTable, LayerTable, OrderTable};
use super::composition::{Composed, Defaults, Part, Parts, compose};
use super::file::Reading;
use super::files::JobFiles;
use super::marking_table::{MarkingTable, check_frame_power};
use super::workpiece_table::{self, AttitudeTable, SurfaceTable};
use super::{Job, JobError, frequency, gcode};
use crate::drawing::{Drawing, Power};
use crate::light::Policy;

table! {
    /// How to mark a file of a drawing program, or an image.
    pub struct DrawingFileTable {
        /// Where it lies.
        pub drawing: DrawingTable,
        /// How its layers are marked, in the order of marking.
        pub layers: Option<Named<LayerTable>>,
        /// In which order it is marked.
        pub order: Option<OrderTable>,
        /// Shows where it lies instead of marking it.
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

/// The job that marks one drawing.
pub(super) fn read(table: &DrawingTable, reading: Reading<'_>) -> Result<Job, JobError> {
    of_tables([table].into_iter(), reading)
}

/// The job that marks several drawings.
pub(super) fn read_all(
    tables: &Named<DrawingTable>,
    reading: Reading<'_>,
) -> Result<Job, JobError> {
    of_tables(tables.entries.iter().map(|(_, table)| table), reading)
}

fn of_tables<'a>(
    tables: impl Iterator<Item = &'a DrawingTable>,
    reading: Reading<'a>,
) -> Result<Job, JobError> {
    let name = reading.stem("drawing");
    let Reading { beside, diagnostics, files, machine, .. } = reading;
    let parts = Parts {
        drawings: tables.map(|table| Part { table, file: None }).collect(),
        layers: beside.layers.as_ref(),
        order: beside.order.as_ref(),
        frame: beside.frame.as_ref(),
        defaults: defaults(&beside.marking, machine),
        is_level: beside.surface.is_none() && beside.attitude.is_none(),
    };
    of_drawings(&parts, &name, &beside.marking, diagnostics, files, machine)
}

/// Reads the drawing at `path` as a job of its own, with `overrides` of its tables.
pub(super) fn drawing(
    path: &Path,
    files: &JobFiles,
    overrides: &[Override],
    machine: &Machine,
) -> Result<Job, JobError> {
    let empty = Document::parse(&path.display().to_string(), "")?;
    let (table, mut diagnostics) =
        empty.override_with(overrides, "")?.decode::<DrawingFileTable>()?;
    table.marking.check(machine, &mut diagnostics);
    table.marking.refuse_line(&mut diagnostics);
    let home = Vector3::from(machine.home);
    let is_level = table.surface.is_none() && table.attitude.is_none();
    let surface =
        table.surface.and_then(|table| workpiece_table::surface(&table, &mut diagnostics));
    let on_surface = workpiece_table::flat(machine, surface.as_ref());
    let parts = Parts {
        drawings: vec![Part { table: &table.drawing, file: Some(JobFiles::own_name(path)) }],
        layers: table.layers.as_ref(),
        order: table.order.as_ref(),
        frame: table.frame.as_ref(),
        defaults: defaults(&table.marking, machine),
        is_level,
    };
    let name = gcode::name(&path.display().to_string());
    let job = of_drawings(&parts, &name, &table.marking, diagnostics, files, &on_surface)?;
    Ok(workpiece_table::place(job, surface, table.attitude.as_ref(), home))
}

/// What layers have that say nothing else.
fn defaults(marking: &MarkingTable, machine: &Machine) -> Defaults {
    let speed = match &marking.speed {
        None => Some(machine.path.speed),
        Some(Either::Value(speed)) => Some(speed.value),
        Some(Either::Word(_)) => None,
    };
    let follows_speed =
        marking.policy.as_ref().is_some_and(|policy| policy.value == Policy::Proportional);
    Defaults {
        speed,
        power: Power { level: marking.level(), follows_speed },
        frequency: marking.frequency.as_ref().map_or(0.0, frequency::of),
    }
}

fn of_drawings(
    parts: &Parts<'_>,
    name: &str,
    marking: &MarkingTable,
    mut diagnostics: Diagnostics,
    files: &JobFiles,
    machine: &Machine,
) -> Result<Job, JobError> {
    if let (Some(frame), true) = (parts.frame, marking.frame.value) {
        let text = "[frame] and `marking.frame` both show where the drawing lies".to_owned();
        diagnostics.contradict(frame.span, text, "keep one of them");
    }
    if let Some(power) = parts.frame.and_then(|frame| frame.power.as_ref()) {
        check_frame_power(power, machine, &mut diagnostics);
    }
    let composed = compose(parts, files, machine, &mut diagnostics)?;
    let Composed { composition, room, notes, files } = composed;
    let start = Vector3::from(machine.home);
    let drawing = Drawing { name: name.to_owned(), start, steps: Vec::new(), notes };
    let mut job = Job {
        composition: Some(composition),
        placed: room.shift(),
        too_large: room.too_large(),
        files,
        marking: marking.marking(),
        ..Job::of(drawing)
    };
    // Each layer has its own, or the default.
    (job.marking.policy, job.marking.speed) = (None, None);
    Ok(diagnostics.finish(job)?)
}
