//! How soon a large drawing and a large image are under way, both made here.

use super::{memory, reset_memory};
use crate::exit::Failure;
use crate::output::say;
use machine::Machine;
use machine::document::Override;
use messages::math::{TURN, sin_cos};
use messages::random::SplitMix64;
use messages::time::SETPOINT_TIME;
use planner::{Job, plan_while};
use serde::Serialize;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::time::Instant;

/// How soon a drawing or an image was under way, on one core.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct PlannedDrawing {
    /// Its name.
    pub name: String,
    /// Its file [bytes].
    pub bytes: u64,
    /// Wall time of reading: the file, its place, the order of its strokes [s].
    pub reading: f64,
    /// Wall time from the beginning of reading until the first setpoint of a run could leave [s].
    pub first_setpoint: f64,
    /// Setpoints that were made and checked, of its beginning.
    pub setpoints: u64,
    /// Wall time from the end of reading to the last of them [s].
    pub planning: f64,
    /// How much faster than they are marked, without reading.
    pub realtime_factor: f64,
    /// The largest memory that the process had at once meanwhile [bytes]; null where the kernel does not say.
    pub memory: Option<u64>,
}

/// How much of each is planned [s].
const BEGINNING: f64 = 10.0;

/// The size of the drawing's file [bytes].
const DRAWING: usize = 5_000_000;

/// Columns and rows of the image, and its pixels in a metre.
const IMAGE: [u32; 2] = [4000, 3000];
const PIXELS: u32 = 100_000;

/// A file to be made: its name, what it is called, what is said of it, and how it is written.
type Made = (&'static str, &'static str, &'static [&'static str], fn(&Path) -> io::Result<()>);

/// The setting that puts a drawing on a layer of its own.
const LAYER: &str = "drawing.layer=a";

/// Small enough for any machine of the tree: within 20 mm of home.
const FILES: [Made; 3] = [
    ("drawing of 5 MB, traced", "traced.svg", &[], traced),
    ("image of 12 Mpixel, grey", "grey.bmp", &[LAYER, "layers.a.image.mode=grey"], image),
    (
        "image of 12 Mpixel, dithered",
        "dithered.bmp",
        &[LAYER, "layers.a.image.mode=floyd_steinberg"],
        image,
    ),
];

/// Makes each of them in `folder` and plans its beginning.
pub(super) fn all(folder: &Path, machine: &Machine) -> Result<Vec<PlannedDrawing>, Failure> {
    let measured = |(name, file, settings, write): Made| {
        let path = folder.join(file);
        write(&path).map_err(|error| Failure::output(format!("{}: {error}", path.display())))?;
        measured(name, &path, settings, machine)
    };
    FILES.into_iter().map(measured).collect()
}

fn measured(
    name: &str,
    path: &Path,
    settings: &[&str],
    machine: &Machine,
) -> Result<PlannedDrawing, Failure> {
    let refused = |error: &dyn std::fmt::Display| Failure::bad_input(format!("{name}: {error}"));
    let settings: Result<Vec<Override>, _> = settings.iter().map(|text| text.parse()).collect();
    let settings = settings.map_err(|error| refused(&error))?;
    let bytes = path.metadata().map_or(0, |file| file.len());
    reset_memory();
    let began = Instant::now();
    let job = Job::open(path, &settings, machine).map_err(|error| refused(&error))?;
    let leaves_early = job.is_surely_within_reach(machine);
    let reading = began.elapsed().as_secs_f64();
    let (mut setpoints, mut first) = (0, None);
    plan_while(machine, &job, |window| {
        first.get_or_insert_with(|| began.elapsed().as_secs_f64());
        setpoints += window.setpoints.len() as u64;
        !leaves_early || setpoints as f64 * SETPOINT_TIME < BEGINNING
    })
    .map_err(|error| refused(&error))?;
    let all = began.elapsed().as_secs_f64();
    let planning = all - reading;
    Ok(PlannedDrawing {
        name: name.to_owned(),
        bytes,
        reading,
        first_setpoint: first.filter(|_| leaves_early).unwrap_or(all),
        setpoints,
        planning,
        realtime_factor: setpoints as f64 * SETPOINT_TIME / planning,
        memory: memory(),
    })
}

/// Closed curves as programs that trace pictures write them: cubics that go on into each other, five decimals.
fn traced(path: &Path) -> io::Result<()> {
    let mut random = SplitMix64::new(5);
    let mut text = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"30mm\" height=\"30mm\" viewBox=\"0 0 30 30\">\n\
         <g style=\"fill:none;stroke:#000000;stroke-width:0.1\">\n",
    );
    while text.len() < DRAWING {
        let radius = random.between(0.5, 4.0);
        let centre = [0, 1].map(|_| random.between(6.0, 24.0));
        let turned = random.between(0.0, TURN);
        let count = 6 + random.below(34) as usize;
        let point = |index: usize| {
            let angle = turned + TURN * index as f64 / count as f64;
            let away = radius * (1.0 + 0.25 * sin_cos(5.0 * angle).0);
            let (sine, cosine) = sin_cos(angle);
            [centre[0] + away * cosine, centre[1] + away * sine]
        };
        let write = |text: &mut String, [x, y]: [f64; 2]| {
            // A text takes whatever is written.
            let _ = write!(text, "{x:.5},{y:.5} ");
        };
        text.push_str("<path d=\"M ");
        write(&mut text, point(0));
        text.push_str("C ");
        for index in 0..count {
            let [before, from, to, after] =
                [count - 1, 0, 1, 2].map(|step| point((index + step) % count));
            let along = |a: [f64; 2], b: [f64; 2], at: [f64; 2], sign: f64| {
                [0, 1].map(|part| at[part] + sign * (b[part] - a[part]) / 6.0)
            };
            write(&mut text, along(before, to, from, 1.0));
            write(&mut text, along(from, after, to, -1.0));
            write(&mut text, to);
        }
        text.push_str("Z\"/>\n");
    }
    text.push_str("</g>\n</svg>\n");
    std::fs::write(path, text)
}

/// A grey BMP with soft waves and grain.
fn image(path: &Path) -> io::Result<()> {
    const HEAD: u32 = 14 + 40 + 1024;
    let mut random = SplitMix64::new(6);
    let [columns, rows] = IMAGE;
    let mut file = BufWriter::new(File::create(path)?);
    file.write_all(b"BM")?;
    // File size, reserved, where the pixels begin; the information header, and grey colours.
    for value in [HEAD + columns * rows, 0, HEAD, 40, columns, rows, 1 | 8 << 16, 0] {
        file.write_all(&value.to_le_bytes())?;
    }
    for value in [columns * rows, PIXELS, PIXELS, 256, 0] {
        file.write_all(&value.to_le_bytes())?;
    }
    for level in 0..=u8::MAX {
        file.write_all(&[level, level, level, 0])?;
    }
    let across: Vec<f64> =
        (0..columns).map(|column| sin_cos(f64::from(column) / 190.0).0).collect();
    for row in 0..rows {
        let high = sin_cos(f64::from(row) / 230.0).1;
        for wave in &across {
            file.write_all(&[(120.0 + 100.0 * wave * high + random.between(0.0, 20.0)) as u8])?;
        }
    }
    file.flush()
}

/// The table of all of them, for a person.
pub(super) fn print_text(drawings: &[PlannedDrawing]) {
    if drawings.is_empty() {
        return;
    }
    say!(
        "{:<34}{:>10}{:>12}{:>12}{:>14}{:>9}",
        "",
        "bytes",
        "reading",
        "first",
        "× time",
        "memory"
    );
    for drawing in drawings {
        say!(
            "{:<34}{:>10}{:>10.2} s{:>10.2} s{:>14.0}{:>6.0} MB",
            drawing.name,
            drawing.bytes,
            drawing.reading,
            drawing.first_setpoint,
            drawing.realtime_factor,
            drawing.memory.unwrap_or(0) as f64 * 1e-6
        );
    }
}
