//! `graver bench plan`: from a program in a file to checked setpoints, on programs that it makes itself; and how
//! soon a large drawing and a large image are under way.

pub mod drawings;

use self::drawings::PlannedDrawing;

use crate::arguments::PlanBenchArguments;
use crate::exit::{Exit, Failure};
use crate::output::say;
use crate::{inputs, output};
use machine::Machine;
use messages::math::{TURN, sin_cos};
use messages::time::SETPOINT_TIME;
use planner::job::gcode::survey;
use planner::{Job, plan_through};
use serde::Serialize;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::time::Instant;

/// What `bench plan --json` prints.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct PlanBenchReport {
    /// The machine.
    pub machine: String,
    /// The programs, in the order in which they were planned.
    pub programs: Vec<PlannedProgram>,
    /// Drawings and images; none where a program is named.
    pub drawings: Vec<PlannedDrawing>,
    /// The largest memory that the process had at once for the programs [bytes]; null where the kernel does not say.
    pub memory: Option<u64>,
}

/// How fast one program was read and planned, on one core.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct PlannedProgram {
    /// Its name.
    pub name: String,
    /// Its lines.
    pub lines: u64,
    /// How long it marks and moves [s].
    pub time: f64,
    /// Setpoints made and checked.
    pub setpoints: u64,
    /// Wall time of the first reading: syntax, extent and an estimate of the time [s].
    pub reading: f64,
    /// Wall time from the file to the last checked setpoint, the first reading left out [s].
    pub planning: f64,
    /// Lines read in a second.
    pub lines_read_per_second: f64,
    /// Lines planned in a second.
    pub lines_per_second: f64,
    /// Setpoints made and checked in a second.
    pub setpoints_per_second: f64,
    /// `time` over `planning`.
    pub realtime_factor: f64,
}

/// A program to be made: its name, a thousandth of its lines, and how a line of it comes to be.
struct Made {
    name: &'static str,
    head: &'static str,
    /// Of as many lines as are asked for, one in so many.
    share: u64,
    line: fn(u64) -> String,
}

/// Small enough for any machine of the tree: within 20 mm of its work origin.
const PROGRAMS: [Made; 5] = [
    Made { name: "circle in chords of 0.1 mm, M4", head: "M4 S800", share: 1, line: circle },
    Made { name: "circle in chords of 0.1 mm, M3", head: "M3 S800", share: 1, line: circle },
    Made { name: "waves in chords of 0.1 mm, M4", head: "M4 S800", share: 1, line: waves },
    Made { name: "raster, 0.1 mm pixels, M4", head: "M4", share: 10, line: raster },
    Made { name: "slow lines, M4", head: "M4 S800", share: 5_000, line: slow },
];

/// Rounds of a circle of 18 mm, at 300 mm/s.
fn circle(index: u64) -> String {
    let (sine, cosine) = sin_cos(index as f64 * 0.1 / 18.0);
    let feed = if index == 0 { " F18000" } else { "" };
    format!("G1 X{:.3} Y{:.3}{feed}", 18.0 * cosine, 18.0 * sine)
}

/// The same with eight waves of 0.4 mm a round, which are slower where they bend most.
fn waves(index: u64) -> String {
    let angle = index as f64 * 0.1 / 18.0;
    let radius = 18.0 + 0.4 * sin_cos(8.0 * angle).0;
    let (sine, cosine) = sin_cos(angle);
    let feed = if index == 0 { " F18000" } else { "" };
    format!("G1 X{:.3} Y{:.3}{feed}", radius * cosine, radius * sine)
}

/// Rows of 300 pixels to and fro, each of its own power.
fn raster(index: u64) -> String {
    const PIXELS: u64 = 300;
    let (row, pixel) = (index / PIXELS, index % PIXELS);
    let place = if row.is_multiple_of(2) { pixel + 1 } else { PIXELS - 1 - pixel };
    let y = -15.0 + 0.1 * (row % 300) as f64;
    let x = -15.0 + 0.1 * place as f64;
    if pixel == 0 {
        let start = if row.is_multiple_of(2) { -15.0 } else { 15.0 };
        return format!("G0 X{start:.1} Y{y:.1}\nG1 X{x:.1} S{} F18000", 100 + index % 800);
    }
    format!("X{x:.1} S{}", 100 + (index * 7919) % 800)
}

/// Lines of 36 mm at 10 mm/s: what counts is setpoints.
fn slow(index: u64) -> String {
    let x = if index.is_multiple_of(2) { 18.0 } else { -18.0 };
    format!("G1 X{x:.1} Y{:.2} F600", (TURN * index as f64 * 0.01) % 18.0)
}

/// Runs the command.
///
/// # Errors
/// A machine that does not hold, or a program that cannot be written or planned.
pub fn run(arguments: &PlanBenchArguments) -> Result<Exit, Failure> {
    let input = inputs::machine(&arguments.machine)?;
    let machine = &input.machine;
    let mut programs = Vec::new();
    let mut drawings = Vec::new();
    let folder = tempfile::Builder::new().prefix("graver-bench-").tempdir();
    let folder = folder
        .map_err(|error| Failure::output(format!("{}: {error}", std::env::temp_dir().display())))?;
    if let Some(path) = &arguments.job {
        let name = path.display().to_string();
        programs.push(measured(&name, path, machine)?);
    } else {
        drawings = drawings::all(folder.path(), machine)?;
        reset_memory();
        let path = folder.path().join("program.nc");
        for program in &PROGRAMS {
            let lines = (arguments.lines / program.share).max(1);
            program
                .write(&path, lines)
                .map_err(|error| Failure::output(format!("{}: {error}", path.display())))?;
            programs.push(measured(program.name, &path, machine)?);
        }
    }
    let report =
        PlanBenchReport { machine: machine.name.clone(), programs, drawings, memory: memory() };
    if arguments.json {
        output::json(&report)?;
    } else {
        print_text(&report);
    }
    Ok(Exit::Done)
}

impl Made {
    fn write(&self, path: &Path, lines: u64) -> io::Result<()> {
        let mut file = BufWriter::new(File::create(path)?);
        writeln!(file, "G21 G90\n{}\nG0 X0 Y0", self.head)?;
        for index in 0..lines {
            writeln!(file, "{}", (self.line)(index))?;
        }
        file.flush()
    }
}

/// Reads and plans the program at `path`.
fn measured(name: &str, path: &Path, machine: &Machine) -> Result<PlannedProgram, Failure> {
    let refused = |error: &dyn std::fmt::Display| Failure::bad_input(format!("{name}: {error}"));
    let began = Instant::now();
    let survey = survey(path, machine).map_err(|error| refused(&error))?;
    let reading = began.elapsed().as_secs_f64();
    let job = Job::open(path, &[], machine).map_err(|error| refused(&error))?;
    let began = Instant::now();
    let mut setpoints = 0;
    let facts = plan_through(machine, &job, |window| setpoints += window.len() as u64)
        .map_err(|error| refused(&error))?;
    let planning = began.elapsed().as_secs_f64();
    Ok(PlannedProgram {
        name: name.to_owned(),
        lines: survey.lines,
        time: facts.duration,
        setpoints,
        reading,
        planning,
        lines_read_per_second: survey.lines as f64 / reading,
        lines_per_second: survey.lines as f64 / planning,
        setpoints_per_second: setpoints as f64 / planning,
        realtime_factor: setpoints as f64 * SETPOINT_TIME / planning,
    })
}

/// Forgets the largest memory so far, where the kernel lets it.
fn reset_memory() {
    // Five: the peak of the resident set (man proc_pid_clear_refs).
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// The largest memory that this process had at once [bytes].
fn memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix(" kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

fn print_text(report: &PlanBenchReport) {
    say!(
        "{:<34}{:>10}{:>12}{:>12}{:>14}{:>9}",
        "",
        "lines",
        "read/s",
        "planned/s",
        "setpoints/s",
        "× time"
    );
    for program in &report.programs {
        say!(
            "{:<34}{:>10}{:>12.0}{:>12.0}{:>14.0}{:>9.0}",
            program.name,
            program.lines,
            program.lines_read_per_second,
            program.lines_per_second,
            program.setpoints_per_second,
            program.realtime_factor
        );
    }
    if let Some(memory) = report.memory {
        say!("memory     {:.0} MB at most", memory as f64 * 1e-6);
    }
    drawings::print_text(&report.drawings);
}
