//! The job file's table of a cloud of points.

use std::path::Path;

use machine::document::{Diagnostics, NonNegative, Number, Point, Positive, Quantity, Spanned};
use machine::quantity::{Angle, Duration, Length, PulseRate};
use machine::{DocumentError, Machine, table};
use nalgebra::Vector3;

use super::cloud::{self, Cloud, Glass, Height};
use super::file::Reading;
use super::files::JobFiles;
use super::whole::whole;
use super::{Job, JobError, frequency};
use crate::drawing::Drawing;

table! {
    /// Points inside glass, deepest first: a file of them, or a sphere of so many.
    pub struct CloudTable {
        /// File of points, relative to this one: PLY, or lines x, y, z (CSV, XYZ).
        pub file: Option<Spanned<String>>,
        /// What the file's numbers count; left out, the unit that its first line names, else metres.
        pub unit: Option<Quantity<Length, Positive>>,
        /// A sample: points at random inside a sphere.
        pub sphere: Option<SphereTable>,
        /// Where the file's origin lies; its z as `z` says.
        pub at: Option<Point>,
        /// Thickness of a layer.
        pub layer: Quantity<Length, Positive> = "0.2 mm",
        /// Width of a ring about the table's axis, inside which the points follow each other round.
        pub ring: Quantity<Length, Positive> = "1 mm",
        /// The least distance of two points across the beam; nearer ones are left out.
        pub spacing: Quantity<Length, NonNegative> = "0.1 mm",
        /// The same along the beam.
        pub depth_spacing: Quantity<Length, NonNegative> = "0.2 mm",
        /// The largest distance from the table's axis that a point may have.
        pub radius: Option<Quantity<Length, Positive>>,
        /// The lowest and the highest z that a point may have.
        pub heights: Option<[Quantity<Length>; 2]>,
        /// Height of the glass's upper face, through which the beam comes.
        pub face: Option<Quantity<Length>>,
        /// true: z of the points is where they shall be in the glass; apparent: where they shall seem to
        /// be from straight above. All other heights and lengths of this table are true ones.
        pub z: Spanned<Height> = "true",
        /// Refractive index of the glass.
        pub index: Number<Positive> = 1.52,
        /// Half of the angle of the beam's cone in air; near-axis rays when left out.
        pub half_angle: Option<Quantity<Angle, Positive>>,
        /// How long each point is lit.
        pub dwell: Option<Quantity<Duration, Positive>>,
        /// How many pulses mark a point, instead of a time.
        pub pulses: Option<Number<Positive>>,
        /// How often the source pulses; it is told so where the machine has a range of `laser.frequency`.
        pub pulse_rate: Option<Quantity<PulseRate, Positive>>,
        /// The point to go on from, in the order of marking, from 0.
        pub from: Number<NonNegative> = 0.0,
    }
}

table! {
    /// Points at random inside a sphere, the same for the same seed.
    pub struct SphereTable {
        /// Its centre.
        pub center: Point,
        /// Its radius.
        pub radius: Quantity<Length, Positive>,
        /// How many points.
        pub count: Number<Positive> = 1000.0,
        /// Which of all such clouds, a whole number.
        pub seed: Number<NonNegative> = 1.0,
    }
}

/// The job that marks a cloud.
pub(super) fn read(table: &CloudTable, mut reading: Reading<'_>) -> Result<Job, JobError> {
    let power = reading.beside.marking.level();
    let (files, machine) = (reading.files, reading.machine);
    let drawing = draw(table, files, power, &mut reading.diagnostics, machine)?;
    let files = table.file.iter().map(|file| files.path(&file.value)).collect();
    let mut job = Job { files, ..reading.job_of(drawing) };
    if let Some(frequency) = pulse_rate(table, &mut reading) {
        job.marking.frequency = Some(frequency);
    }
    reading.finish(job)
}

/// The pulse repetition rate that the table asks the machine's source for [pulses/s].
fn pulse_rate(table: &CloudTable, reading: &mut Reading<'_>) -> Option<f64> {
    let source = &reading.machine.laser;
    let rate = table.pulse_rate.as_ref().filter(|_| source.frequency.is_some())?;
    if let Some(other) = &reading.beside.marking.frequency
        && other.value != rate.value
    {
        let text = "`frequency` and the cloud's `pulse_rate` differ".to_owned();
        reading.diagnostics.contradict(other.span, text, "leave one of them out");
    }
    frequency::asked(Some(rate), source, &mut reading.diagnostics)
}

/// The drawing of a cloud; what is wrong with the table goes to `diagnostics`.
fn draw(
    table: &CloudTable,
    files: &JobFiles,
    power: f64,
    diagnostics: &mut Diagnostics,
    machine: &Machine,
) -> Result<Drawing, DocumentError> {
    let line = diagnostics.position(table.span).map_or(0, |(line, _)| line as u64);
    let mut points = points(table, files, diagnostics);
    let glass = glass(table, diagnostics);
    if let (Some(glass), Height::Apparent) = (&glass, table.z.value) {
        points.iter_mut().for_each(|point| point.z = glass.true_height(point.z));
    }
    let dwell = dwell(table, diagnostics);
    let from = whole(&table.from, 0..=MOST_POINTS, "from", diagnostics);
    let from = from.unwrap_or(0) as usize;
    let cloud = Cloud {
        layer: table.layer.value,
        ring: table.ring.value,
        spacing: [table.spacing.value, table.depth_spacing.value],
        radius: table.radius.as_ref().map_or(f64::INFINITY, |radius| radius.value),
        heights: table
            .heights
            .as_ref()
            .map_or([f64::NEG_INFINITY, f64::INFINITY], |[low, high]| [low.value, high.value]),
        glass,
        dwell,
        from,
    };
    let stem = Path::new(diagnostics.file()).file_stem().and_then(|stem| stem.to_str());
    let name = stem.unwrap_or("cloud").to_owned();
    Ok(cloud.draw(&name, &points, power, Vector3::from(machine.home), line))
}

/// The most points: more would not fit into the week that a job may last.
const MOST_POINTS: u64 = 10_000_000;

/// The largest seed: what a number in TOML holds without rounding, 2⁵³.
const LARGEST_SEED: u64 = 1 << 53;

fn points(
    table: &CloudTable,
    files: &JobFiles,
    diagnostics: &mut Diagnostics,
) -> Vec<Vector3<f64>> {
    let at = table.at.as_ref().map_or(Vector3::zeros(), |at| Vector3::from(at.value));
    match (&table.file, &table.sphere) {
        (Some(file), None) => {
            let path = files.path(&file.value);
            let unit = table.unit.as_ref().map(|unit| unit.value);
            let points = files
                .read(&file.value)
                .map_err(|error| {
                    (error.to_string(), "a path is relative to the job file's folder".to_owned())
                })
                .and_then(|bytes| cloud::read(&bytes, unit));
            match points {
                Ok(points) => points.into_iter().map(|point| point + at).collect(),
                Err((cause, help)) => {
                    let text = format!("{}: {cause}", path.display());
                    diagnostics.contradict(file.span, text, &help);
                    Vec::new()
                }
            }
        }
        (None, Some(sphere)) => {
            let count = whole(&sphere.count, 1..=MOST_POINTS, "count", diagnostics);
            let seed = whole(&sphere.seed, 0..=LARGEST_SEED, "seed", diagnostics);
            let (Some(count), Some(seed)) = (count, seed) else { return Vec::new() };
            let center = Vector3::from(sphere.center.value) + at;
            cloud::sphere(center, sphere.radius.value, count as usize, seed)
        }
        (Some(file), Some(_)) => {
            let help = "keep one of `file` and `sphere`";
            diagnostics.contradict(file.span, "a cloud has one source".to_owned(), help);
            Vec::new()
        }
        (None, None) => {
            let help = "add `file` or a table [cloud.sphere]";
            diagnostics.contradict(table.span, "there is no point to mark".to_owned(), help);
            Vec::new()
        }
    }
}

/// The glass, where the table has its face.
fn glass(table: &CloudTable, diagnostics: &mut Diagnostics) -> Option<Glass> {
    if table.face.is_none() && table.z.value == Height::Apparent {
        let text = "`z` is apparent, and there is no glass to see the points through".to_owned();
        diagnostics.contradict(table.z.span, text, "add `face`, or write z = \"true\"");
    }
    Some(Glass {
        face: table.face.as_ref()?.value,
        index: table.index.value,
        half_angle: table.half_angle.as_ref().map_or(0.0, |angle| angle.value),
    })
}

/// How long a point is lit [s].
fn dwell(table: &CloudTable, diagnostics: &mut Diagnostics) -> f64 {
    match (&table.dwell, &table.pulses, &table.pulse_rate) {
        (Some(dwell), None, _) => dwell.value,
        (None, Some(pulses), Some(rate)) => pulses.value / frequency::of(rate),
        _ => {
            let help = "write `dwell`, or `pulses` and `pulse_rate`";
            let text = "how long a point is lit is not clear".to_owned();
            diagnostics.contradict(table.span, text, help);
            1.0
        }
    }
}
