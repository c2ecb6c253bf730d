//! The job file: its tables, and how they become a [`Job`].

use std::path::{Path, PathBuf};

use machine::document::{
    Diagnostics, Document, Either, Fraction, Named, Number, Point, Positive, Quantity, Spanned,
    schema_text,
};
use machine::gcode_settings::WordMeanings;
use machine::quantity::{Duration, Length, Speed};
use machine::{DocumentError, Machine, Override, table};
use nalgebra::Vector3;

use super::cloud_table::{self, CloudTable};
use super::composition::tables::{DrawingTable, FrameTable, LayerTable, OrderTable};
use super::composition::{Composed, Defaults, Part, Parts, compose};
use super::letters::{self, Letter, Style};
use super::path_table::{self, PathTable};
use super::whole::whole;
use super::workpiece_table::{self, AttitudeTable, SurfaceTable};
use super::{Job, JobError, Marking, MarkingSpeed, gcode, points};

use crate::drawing::{Drawing, Power, Turns};
use crate::light::Policy;

table! {
    /// What to mark, and how: exactly one of `letters`, `points`, `path`, `cloud`, `gcode`, `drawing` and
    /// `drawings`.
    pub struct JobTable {
        /// Letters of the thesis.
        pub letters: Option<LettersTable>,
        /// A list of points, each marked by a dwell.
        pub points: Option<PointsTable>,
        /// A path in space.
        pub path: Option<PathTable>,
        /// Points inside glass.
        pub cloud: Option<CloudTable>,
        /// A G-code program.
        pub gcode: Option<GcodeTable>,
        /// A drawing: a file of a drawing program, an image, text or a code.
        pub drawing: Option<DrawingTable>,
        /// Several drawings, under names of their own, in order.
        pub drawings: Option<Named<DrawingTable>>,
        /// How the layers of drawings are marked, in the order of marking.
        pub layers: Option<Named<LayerTable>>,
        /// In which order drawings are marked.
        pub order: OrderTable,
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

table! {
    /// How to mark a G-code program, whose S words are its power.
    pub struct ProgramTable {
        /// What its words mean; what is left out, the machine file's `[gcode]` table rules.
        pub gcode: DialectTable,
        /// How to mark; what is left out, the program and the machine file rule.
        pub marking: MarkingTable,
    }
}

table! {
    /// How to mark a file of a drawing program, or an image.
    pub struct DrawingFileTable {
        /// Where it lies.
        pub drawing: DrawingTable,
        /// How its layers are marked, in the order of marking.
        pub layers: Option<Named<LayerTable>>,
        /// In which order it is marked.
        pub order: OrderTable,
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

table! {
    /// Letters of the thesis, in a row around the machine's home.
    pub struct LettersTable {
        /// Any of N, A, S, O.
        pub text: Spanned<String>,
        /// Height of a letter.
        pub height: Quantity<Length, Positive> = "20 mm",
        /// curves: no stop on a curve; h1, h2: chord by chord, the thesis's conventions.
        pub style: Spanned<Style> = "curves",
        /// Where the middle of the row lies as seen from the machine's home.
        pub at: Option<Point>,
    }
}

table! {
    /// A list of points, each marked by a dwell.
    pub struct PointsTable {
        /// Points [x, y] or [x, y, z] as seen from the machine's home.
        pub points: Vec<Point>,
        /// How long the laser stays on each.
        pub dwell: Quantity<Duration, Positive> = "10 ms",
    }
}

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
    /// How to mark.
    pub struct MarkingTable {
        /// "optimum", or a speed: constant while the laser is on.
        pub speed: Option<Either<Optimum, Quantity<Speed, Positive>>>,
        /// Largest speed while the laser is on.
        pub max_speed: Option<Quantity<Speed, Positive>>,
        /// How far a smoothed join may lie from the drawn line, and the tool from its path between two
        /// setpoints.
        pub tolerance: Option<Quantity<Length, Positive>>,
        /// Power of the laser, full power when left out.
        pub power: Option<Fraction<Positive>>,
        /// How the light goes with the speed along lines: `constant` marks at one speed and comes to it
        /// in the dark, `proportional` lights from rest to rest with power in proportion to the speed.
        /// When left out, a G-code program's M3 and M4 say it, and other jobs are `constant`.
        pub policy: Option<Spanned<Policy>>,
        /// The stroke to begin with, from 1, as after a job that was stopped; a path is not cut, so
        /// those of its path that come before it are marked again.
        pub from_stroke: Number<Positive> = 1.0,
    }
}

/// The word for the speed with the least time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Optimum {
    /// The speed that minimises the drawing's time.
    Optimum,
}

machine::keyword! {
    Optimum, "a speed",
    "optimum" => Self::Optimum,
}

/// The most strokes of a job.
const MOST_STROKES: u64 = 1 << 53;

/// Why style h2 is for paper only.
const REPLICA: &str = "style h2 replicates a printed table with free moves of up to 0.99 m/s, which \
                       no motor of the machine can do; use style h1 or curves, or plan it with --ideal";

/// Largest speed of free moves of convention h1 [m/s].
const H1_RAPID: f64 = 0.25;

/// The JSON schema of job files, as `jobs/schema.json` holds it.
pub fn schema() -> String {
    schema_text::<JobTable>("Graver job file")
}

/// Reads a job file whose text is in `document`; `folder` is where its relative paths start. The steps
/// of a program with more than `most` lines stay in its file.
pub(super) fn job(
    document: Document,
    folder: &Path,
    machine: &Machine,
    most: u64,
) -> Result<Job, JobError> {
    let (table, mut diagnostics) = document.decode::<JobTable>()?;
    let JobTable {
        letters,
        points,
        path,
        cloud,
        gcode,
        drawing,
        drawings,
        layers,
        order,
        frame,
        surface,
        attitude,
        marking,
        span: place,
    } = table;
    check_start(&marking, &mut diagnostics);
    let home = Vector3::from(machine.home);
    let surface = surface.and_then(|table| workpiece_table::surface(&table, &mut diagnostics));
    let on_surface = workpiece_table::flat(machine, surface.as_ref());
    let machine = &*on_surface;
    if let (Some(path), Some(_)) = (&path, surface)
        && path.smooth.value
    {
        let text = "a smooth curve through points is not put on a surface".to_owned();
        diagnostics.contradict(path.smooth.span, text, "leave `smooth` or [surface] out");
    }
    if let Some(poses) = path.as_ref().and_then(|path| path.poses.as_ref()) {
        let tables = [surface.map(|_| "[surface]"), attitude.as_ref().map(|_| "[attitude]")];
        for table in tables.into_iter().flatten() {
            let place = poses.first().map_or(place, |pose| pose.at.span);
            let text = format!("{table} and `poses` both say how the tool is turned");
            diagnostics.contradict(place, text, "keep one of them");
        }
    }
    let tables = [
        layers.as_ref().map(|layers| ("layers", layers.span)),
        frame.as_ref().map(|frame| ("frame", frame.span)),
    ];
    if drawing.is_none() && drawings.is_none() {
        for (name, span) in tables.into_iter().flatten() {
            let text = format!("[{name}] is for drawings, and this job has none");
            diagnostics.contradict(span, text, "leave it out, or add a table [drawing]");
        }
    }
    let kinds =
        Kinds { letters, points, path, cloud, gcode, drawing, drawings, layers, order, frame };
    let files = Files { folder, most };
    let job = of_tables(kinds, &marking, place, diagnostics, files, machine)?;
    Ok(workpiece_table::place(job, surface, attitude.as_ref(), home))
}

/// What a job marks: one of these.
struct Kinds {
    letters: Option<LettersTable>,
    points: Option<PointsTable>,
    path: Option<PathTable>,
    cloud: Option<CloudTable>,
    gcode: Option<GcodeTable>,
    drawing: Option<DrawingTable>,
    drawings: Option<Named<DrawingTable>>,
    /// What drawings have beside them.
    layers: Option<Named<LayerTable>>,
    order: OrderTable,
    frame: Option<FrameTable>,
}

/// Where a job file's own files are, and what is read of them.
struct Files<'a> {
    /// Where their relative paths start.
    folder: &'a Path,
    /// The steps of a program with more lines stay in its file.
    most: u64,
}

/// Reads the one kind that there is.
fn of_tables(
    kinds: Kinds,
    marking: &MarkingTable,
    place: machine::document::Span,
    mut diagnostics: Diagnostics,
    Files { folder, most }: Files<'_>,
    machine: &Machine,
) -> Result<Job, JobError> {
    let help = |verb: &str| {
        format!(
            "{verb} one of the tables [letters], [points], [path], [cloud], [gcode], [drawing] and \
             [drawings.NAME]"
        )
    };
    let Kinds { letters, points, path, cloud, gcode, drawing, drawings, layers, order, frame } =
        kinds;
    let places = [
        letters.as_ref().map(|table| table.span),
        points.as_ref().map(|table| table.span),
        path.as_ref().map(|table| table.span),
        cloud.as_ref().map(|table| table.span),
        gcode.as_ref().map(|table| table.span),
        drawing.as_ref().map(|table| table.span),
        drawings.as_ref().map(|table| table.span),
    ];
    for place in places.into_iter().flatten().skip(1) {
        diagnostics.contradict(place, "a job marks one thing".to_owned(), &help("keep"));
    }
    let power = power(marking);
    if places.iter().flatten().count() > 1 {
        Ok(diagnostics.fail()?)
    } else if let Some(letters) = letters {
        Ok(of_letters(&letters, marking, diagnostics, machine)?)
    } else if let Some(points) = points {
        Ok(of_points(&points, marking, diagnostics, machine)?)
    } else if let Some(path) = path {
        let line = line(&diagnostics, path.span);
        let name = stem(&diagnostics, "path");
        let job = path_table::job(&path, &name, power, machine, line, &mut diagnostics);
        Ok(diagnostics.finish(Job { marking: how(marking), ..job })?)
    } else if let Some(cloud) = cloud {
        let drawing = cloud_table::draw(&cloud, folder, power, &mut diagnostics, machine)?;
        let files = cloud.file.iter().map(|file| folder.join(&file.value)).collect();
        Ok(diagnostics.finish(Job { files, ..job_of(drawing, marking) })?)
    } else if let Some(program) = gcode {
        let path: PathBuf = folder.join(&program.file.value);
        let words = program.over(machine.gcode.words);
        of_program(&path, words, marking, diagnostics, machine, most)
    } else if drawing.is_some() || drawings.is_some() {
        let named = drawings.iter().flat_map(|drawings| &drawings.entries).map(|(_, table)| table);
        let parts = drawing.iter().chain(named).map(|table| Part { table, file: None }).collect();
        let name = stem(&diagnostics, "drawing");
        let parts = Parts {
            drawings: parts,
            layers: layers.as_ref(),
            order: &order,
            frame: frame.as_ref(),
            defaults: defaults(marking, machine),
        };
        of_drawings(&parts, &name, marking, diagnostics, folder, machine)
    } else {
        diagnostics.contradict(place, "nothing to mark".to_owned(), &help("add"));
        Ok(diagnostics.fail()?)
    }
}

/// The name of the job file without its extension; `other` where it has none.
fn stem(diagnostics: &Diagnostics, other: &str) -> String {
    let stem = Path::new(diagnostics.file()).file_stem().and_then(|stem| stem.to_str());
    stem.unwrap_or(other).to_owned()
}

/// Reads the G-code program at `path` as a job of its own, with `overrides` of `[marking]`; the steps of
/// one with more than `most` lines stay in the file.
pub(super) fn program(
    path: &Path,
    overrides: &[Override],
    machine: &Machine,
    most: u64,
) -> Result<Job, JobError> {
    let empty = Document::parse(&path.display().to_string(), "")?;
    let (table, mut diagnostics) = empty.override_with(overrides, "")?.decode::<ProgramTable>()?;
    check_start(&table.marking, &mut diagnostics);
    let words = table.gcode.over(machine.gcode.words);
    of_program(path, words, &table.marking, diagnostics, machine, most)
}

/// Reads the drawing at `path` as a job of its own, with `overrides` of its tables.
pub(super) fn drawing(
    path: &Path,
    overrides: &[Override],
    machine: &Machine,
) -> Result<Job, JobError> {
    let empty = Document::parse(&path.display().to_string(), "")?;
    let (table, mut diagnostics) =
        empty.override_with(overrides, "")?.decode::<DrawingFileTable>()?;
    check_start(&table.marking, &mut diagnostics);
    let home = Vector3::from(machine.home);
    let surface =
        table.surface.and_then(|table| workpiece_table::surface(&table, &mut diagnostics));
    let on_surface = workpiece_table::flat(machine, surface.as_ref());
    let parts = Parts {
        drawings: vec![Part { table: &table.drawing, file: Some(path) }],
        layers: table.layers.as_ref(),
        order: &table.order,
        frame: table.frame.as_ref(),
        defaults: defaults(&table.marking, machine),
    };
    let name = gcode::name(&path.display().to_string());
    let folder = Path::new("");
    let job = of_drawings(&parts, &name, &table.marking, diagnostics, folder, &on_surface)?;
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
    Defaults { speed, power: Power { level: power(marking), follows_speed } }
}

fn of_drawings(
    parts: &Parts<'_>,
    name: &str,
    marking: &MarkingTable,
    mut diagnostics: Diagnostics,
    folder: &Path,
    machine: &Machine,
) -> Result<Job, JobError> {
    let Composed { composition, notes, files } = compose(parts, folder, machine, &mut diagnostics)?;
    let start = Vector3::from(machine.home);
    let drawing = Drawing { name: name.to_owned(), start, steps: Vec::new(), notes };
    let mut job = Job { composition: Some(composition), files, ..job_of(drawing, marking) };
    // Each layer has its own speed and policy.
    job.marking.policy = None;
    if let Some(MarkingSpeed::Constant(_)) = job.marking.speed {
        job.marking.speed = None;
    }
    Ok(diagnostics.finish(job)?)
}

fn of_letters(
    table: &LettersTable,
    marking: &MarkingTable,
    mut diagnostics: Diagnostics,
    machine: &Machine,
) -> Result<Job, DocumentError> {
    let mut text = Vec::new();
    for character in table.text.value.chars() {
        match Letter::from_character(character) {
            Some(letter) => text.push(letter),
            None => diagnostics.contradict(
                table.text.span,
                format!("there is no letter `{character}`"),
                "write any of N, A, S, O",
            ),
        }
    }
    if table.text.value.is_empty() {
        let help = "write any of N, A, S, O";
        diagnostics.contradict(table.text.span, "there is no letter to mark".to_owned(), help);
    }
    let line = line(&diagnostics, table.text.span);
    let (style, home) = (table.style.value, Vector3::from(machine.home));
    let power = Power { level: power(marking), follows_speed: false };
    let middle = home + table.at.as_ref().map_or(Vector3::zeros(), |at| Vector3::from(at.value));
    let mut drawing = letters::draw(&text, table.height.value, style, power, middle, line);
    // Style h2 begins beside its letters, wherever they are.
    if style != Style::H2 {
        drawing.start = home;
    }
    let (rapid, ideal_only) = match style {
        Style::Curves => (None, None),
        Style::H1 => (Some(H1_RAPID), None),
        Style::H2 => (Some(f64::INFINITY), Some(REPLICA)),
    };
    let mut job = job_of(drawing, marking);
    // The printed times have a rest between two strokes; and a hold next to a letter is as accurate as
    // at rest.
    job.marking.turns = Turns::Stop;
    diagnostics.finish(Job { rapid, ideal_only, ..job })
}

fn of_points(
    table: &PointsTable,
    marking: &MarkingTable,
    mut diagnostics: Diagnostics,
    machine: &Machine,
) -> Result<Job, DocumentError> {
    if table.points.is_empty() {
        let help = "write points such as [[\"10 mm\", \"5 mm\"]]";
        diagnostics.contradict(table.span, "there is no point to mark".to_owned(), help);
    }
    let home = Vector3::from(machine.home);
    let places: Vec<Vector3<f64>> =
        table.points.iter().map(|point| home + Vector3::from(point.value)).collect();
    let line = line(&diagnostics, table.span);
    let name = stem(&diagnostics, "points");
    let drawing = points::draw(&name, &places, table.dwell.value, power(marking), home, line);
    diagnostics.finish(job_of(drawing, marking))
}

fn of_program(
    path: &Path,
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
    let (program, steps) = gcode::ProgramFile::open(path, words, machine, most)?;
    let survey = program.survey.clone();
    let rest = if steps.is_none() { Some(program) } else { None };
    let drawing = Drawing {
        name: gcode::name(&path.display().to_string()),
        start: Vector3::from(machine.home),
        steps: steps.unwrap_or_default(),
        notes: survey.notes.clone(),
    };
    Ok(Job {
        program: Some(survey.facts),
        survey: Some(survey),
        rest,
        files: vec![path.to_owned()],
        ..job_of(drawing, marking)
    })
}

fn job_of(drawing: Drawing, marking: &MarkingTable) -> Job {
    Job { marking: how(marking), ..Job::of(drawing) }
}

/// Notes a stroke to begin with that is none.
fn check_start(table: &MarkingTable, diagnostics: &mut Diagnostics) {
    whole(&table.from_stroke, 1..=MOST_STROKES, "from_stroke", diagnostics);
}

fn how(table: &MarkingTable) -> Marking {
    Marking {
        speed: table.speed.as_ref().map(|speed| match speed {
            Either::Word(_) => MarkingSpeed::Optimum,
            Either::Value(speed) => MarkingSpeed::Constant(speed.value),
        }),
        max_speed: table.max_speed.as_ref().map(|speed| speed.value),
        tolerance: table.tolerance.as_ref().map(|tolerance| tolerance.value),
        policy: table.policy.as_ref().map(|policy| policy.value),
        turns: Turns::default(),
        from_stroke: table.from_stroke.value as u64,
    }
}

fn power(table: &MarkingTable) -> f64 {
    table.power.as_ref().map_or(1.0, |power| power.value)
}

fn line(diagnostics: &Diagnostics, place: machine::document::Span) -> u64 {
    diagnostics.position(place).map_or(0, |(line, _)| line as u64)
}
