//! `graver check`: is the machine file sound, what can the machine reach, and can it do the job?

pub mod axes;
pub mod job;
mod text;

use self::axes::AxisReport;
use self::job::JobReport;
use crate::arguments::CheckArguments;
use crate::exit::{Exit, Failure};
use crate::files::Sources;
use crate::inputs::MachineInput;
use crate::{inputs, output};
use drives::port::{self, PortError};
use drives::{PlantOptions, SimulatedPlant, ports};
use machine::{DrivesKind, Machine};
use messages::artwork::{Artwork, ArtworkLine, Stroke};
use monitor::conclusion::machine_summary;
use monitor::report::workspace::Workspace;
use monitor::summary::{DrivesSummary, MachineSummary};
use planner::Job;
use planner::preview::PreviewLine;
use planner::request::JobRequest;
use serde::Serialize;
use std::io::Write;
use std::path::{Component, Path, PathBuf};
use workbench::reach::{self, ReachReport, Surveyed};

/// What `check --json` prints.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct CheckReport {
    /// The machine.
    pub machine: MachineSummary,
    /// Its axes, in order.
    pub axes: Vec<AxisReport>,
    /// What drives its motors.
    pub drives: DrivesSummary,
    /// Which part of its area it reaches.
    pub reach: ReachReport,
    /// Warnings about the machine file, with the numbers.
    pub warnings: Vec<CheckWarning>,
    /// The job that the machine file names as its sample; null where it names none, and for the built-in
    /// machine.
    pub sample_job: Option<String>,
    /// What the job comes to on it; null without a job.
    pub job: Option<JobReport>,
}

/// A warning and its place.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct CheckWarning {
    /// Line of the machine file, 0 for an override or the machine as a whole.
    pub line: u64,
    /// Column from 1, 0 likewise.
    pub column: u64,
    /// What is wrong or unusual, with the numbers.
    pub message: String,
}

/// Runs the command.
///
/// # Errors
/// A machine or job that does not hold, or a picture that cannot be written.
pub fn run(arguments: &CheckArguments) -> Result<Exit, Failure> {
    let input = inputs::machine(&arguments.machine)?.with(&arguments.options);
    let machine = &input.machine;
    let planned = match &arguments.job {
        None => None,
        Some(path) => Some(plan(&input, path)?),
    };
    let surveyed = reach::survey(machine)
        .map_err(|error| Failure::bad_input(format!("the machine at home: {error}")))?;
    if let Some(path) = &arguments.picture {
        let drawn = planned.as_ref().map(|planned| planned.drawn(machine)).transpose()?;
        let picture = picture(machine, &surveyed, drawn.as_ref())?;
        let job = planned.as_ref().map_or(&[][..], |planned| &planned.job.files);
        let mut file =
            Sources::new(arguments.machine.machine.as_deref(), job).create("--picture", path)?;
        file.write_all(picture.as_bytes())
            .map_err(|error| Failure::output(format!("{}: {error}", path.display())))?;
    }
    let job = planned.map(|planned| planned.report);
    let report = CheckReport {
        machine: machine_summary(machine),
        axes: axes::axes(machine),
        drives: DrivesSummary::of(machine),
        reach: surveyed.report,
        warnings: warnings(&input),
        sample_job: sample_job(&input),
        job,
    };
    if arguments.json {
        output::json(&report)?;
    } else {
        text::print(&report);
    }
    Ok(Exit::Done)
}

/// A job that was planned, and what it comes to.
struct Planned {
    request: JobRequest,
    job: Job,
    report: JobReport,
}

/// The most points of a job in a picture.
const DRAWN: usize = 40_000;

impl Planned {
    /// What it marks on `machine`, as a picture shows it.
    fn drawn(&self, machine: &Machine) -> Result<Artwork, Failure> {
        let preview = planner::preview::preview(machine, &self.job, DRAWN)
            .map_err(|error| self.request.refuse(&error))?;
        let mut artwork = Artwork::default();
        for PreviewLine { points, goes_on, .. } in preview.marks {
            artwork.add(ArtworkLine { goes_on, stroke: Stroke { points, line: 0 } });
        }
        Ok(artwork)
    }
}

fn plan(input: &MachineInput, path: &Path) -> Result<Planned, Failure> {
    let mut request = inputs::job_request(Some(path), &input.machine, None, &input.job_overrides);
    request.offsets = input.source.offsets()?;
    let job = request.open(&input.machine)?;
    let (facts, margins) =
        planner::plan_with_margins(&input.machine, &job).map_err(|error| request.refuse(&error))?;
    let report = JobReport::new(&input.machine, facts, margins);
    Ok(Planned { request, job, report })
}

/// The sample job, by a path that holds from here.
fn sample_job(input: &MachineInput) -> Option<String> {
    let sample = input.machine.sample_job.as_ref()?;
    // The built-in machine's sample is built in too, and no path leads to it.
    let path = input.folder.as_ref()?.join(sample);
    let tidied = tidy(&path);
    // A symbolic link on the way may lead elsewhere.
    let same =
        tidied.canonicalize().is_ok_and(|tidied| path.canonicalize().is_ok_and(|it| it == tidied));
    Some(if same { tidied } else { path }.display().to_string())
}

/// `path` without what `..` takes back: `machines/../jobs/a.ngc` is `jobs/a.ngc`.
fn tidy(path: &Path) -> PathBuf {
    let mut tidy = PathBuf::new();
    for part in path.components() {
        let back = part == Component::ParentDir;
        if back && matches!(tidy.components().next_back(), Some(Component::Normal(_))) {
            tidy.pop();
        } else {
            tidy.push(part);
        }
    }
    tidy
}

/// The warnings about the machine file, and why it cannot be driven or simulated, if it cannot.
fn warnings(input: &MachineInput) -> Vec<CheckWarning> {
    let warnings = input.machine.warnings.iter().map(|warning| CheckWarning {
        line: warning.line as u64,
        column: warning.column as u64,
        message: warning.text.clone(),
    });
    let simulated = SimulatedPlant::new(&input.plant, PlantOptions::default());
    let refused = simulated.err().map(|error| CheckWarning {
        line: 0,
        column: 0,
        message: format!("`graver simulate` cannot simulate it: {error}"),
    });
    let undriven = undriven(input).map(|error| CheckWarning {
        line: 0,
        column: 0,
        message: format!("`graver run` cannot drive it: {error}"),
    });
    warnings.chain(undriven).chain(refused).collect()
}

/// Why its port would refuse the machine, as far as that can be told without the hardware.
fn undriven(input: &MachineInput) -> Option<PortError> {
    let MachineInput { machine, plant, .. } = input;
    if machine.drives.kind == DrivesKind::Simulated {
        return None;
    }
    let port = ports::build(machine, plant);
    port.and_then(|port| port::check(port.profile(), machine)).err()
}

/// The picture of the workspace, as SVG.
fn picture(
    machine: &Machine,
    surveyed: &Surveyed,
    artwork: Option<&Artwork>,
) -> Result<String, Failure> {
    let (lower, upper) = (machine.area.lower, machine.area.upper);
    let workspace = Workspace {
        area: [[lower[0], upper[0]], [lower[1], upper[1]]],
        columns: reach::GRID,
        ground: &surveyed.ground,
        home: [machine.home[0], machine.home[1]],
        artwork,
    };
    workspace.picture().map_err(Failure::bad_input)
}
