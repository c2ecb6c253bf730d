//! From what is known at the end of a run to its summary and its report.
//!
//! What cannot be read or judged leaves a gap in the summary and a warning that says why; a figure
//! that might be wrong is never given.

use crate::examination::{Clock, Examination, Findings};
use crate::marks::Marks;
use crate::recording::file::{RecordingError, RecordingReader};
use crate::report::Report;
use crate::run_folder::RunFolder;
use crate::summary::{
    ErrorSummary, FaultSummary, JobSummary, MachineSummary, Outcome, Realtime, StallSummary,
    Summary,
};
use machine::{Axis, Machine};
use runtime::thread;
use serde::{Deserialize, Serialize};
use signals::artwork::Artwork;
use signals::plan::PlanFacts;
use signals::time::CYCLE_TIME;
use signals::{ControllerReport, DrivesReport, RealtimeFacts, run_folder};
use std::fs::{self, File};
use std::io::{self, BufReader};
use std::time::Instant;

/// Cycles after the stream's last during which its light is still reported: the command acts one
/// cycle later, and the feedback tells one after that.
pub const LIGHT_LAG: u64 = 2;

/// Cycles that the controller counts beyond a stream's setpoints: the one that finds it at rest.
const END_CYCLES: u64 = 1;

/// What the monitor service notes when a recording is complete.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct WatchNote {
    /// The stream it recorded.
    pub stream: u64,
    /// Records in the recording.
    pub records: u64,
    /// Samples known to be lost.
    pub lost: u64,
}

impl WatchNote {
    /// The note in a run folder; `None` while there is none that can be read.
    pub fn read(folder: &RunFolder) -> Option<Self> {
        serde_json::from_slice(&fs::read(folder.file(run_folder::WATCH)).ok()?).ok()
    }

    /// Writes it into the run folder.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn write(&self, folder: &RunFolder) -> io::Result<()> {
        folder.write(run_folder::WATCH, serde_json::to_vec_pretty(self)?)
    }
}

/// How a run ended, as whoever watched it knows.
#[derive(Debug, Clone, Default)]
pub struct Ending {
    /// How; `None` takes it from the reports.
    pub outcome: Option<Outcome>,
    /// Why, in words.
    pub error: Option<ErrorSummary>,
    /// The controller's final report of this stream, if it came.
    pub controller: Option<ControllerReport>,
    /// The newest report of drives, if any came.
    pub drives: Option<DrivesReport>,
    /// Overruns counted before the run began.
    pub overruns_before: u64,
    /// Name of the job, for a run that was never planned.
    pub job: String,
    /// Wall time since the command began [s].
    pub wall: f64,
    /// Time from offer to the first setpoint [s].
    pub plan_time: f64,
    /// Job time over wall time of the stepping loop, in virtual time.
    pub realtime_factor: Option<f64>,
    /// What a person should know.
    pub warnings: Vec<String>,
}

/// The summary of a run from its ending, its plan, and what its recording tells; `findings` is
/// `None` without a recording.
pub fn summarise(
    machine: &Machine,
    plan: &PlanFacts,
    ending: &Ending,
    findings: Option<&Findings>,
    clock: Clock,
) -> Summary {
    let job = JobSummary {
        name: if plan.name.is_empty() { ending.job.clone() } else { plan.name.clone() },
        strokes: plan.strokes as u64,
        length: plan.length,
    };
    let mut summary = Summary::new(Outcome::Aborted, job, machine_summary(machine));
    summary.error = ending.error.clone();
    summary.wall = ending.wall;
    summary.plan_time = ending.plan_time;
    summary.realtime_factor = ending.realtime_factor;
    summary.warnings = ending.warnings.clone();
    summary.warnings.extend(plan.notes.iter().map(|note| match note.line {
        0 => note.text.clone(),
        line => format!("line {line}: {}", note.text),
    }));
    if let Some(report) = &ending.controller {
        summary.take_controller(report);
        summary.time = if report.completed == 1 {
            // What the stream took beyond its plan was holds and overrides.
            let beyond = (report.cycles as f64 - (plan.samples + END_CYCLES) as f64) * CYCLE_TIME;
            (plan.duration + beyond).max(0.0)
        } else {
            report.cycles as f64 * CYCLE_TIME
        };
    }
    if let Some(report) = &ending.drives {
        summary.overruns = report.overruns.saturating_sub(ending.overruns_before);
        if let Some(stream) = &ending.controller {
            summary.stalls = StallSummary::of(&report.stalls, stream);
        }
        // A clock that slips has the machine wait: the marks are the same.
        if report.slips == 0 {
            summary.warnings.extend(summary.stalls.warning());
        }
    }
    let faults = [ending.controller.map(|report| report.fault), ending.drives.map(|it| it.fault)];
    summary.fault =
        faults.iter().flatten().find_map(|fault| FaultSummary::of(fault, &machine.axes));
    if let Some(fault) = &mut summary.fault {
        fault.blame(&summary.stalls);
    }
    summary.outcome = outcome(ending, summary.fault.is_some());
    if let Some(findings) = findings {
        summary.latency = findings.histograms.summary();
        match judged(ending.controller.as_ref(), findings) {
            Ok(marks) => summary.marks = Some(marks),
            Err(reason) => summary.warnings.push(reason),
        }
    }
    summary.realtime = match clock {
        Clock::Virtual => Realtime::in_virtual_time(),
        Clock::Real => realtime(ending),
    };
    summary
}

fn outcome(ending: &Ending, fault: bool) -> Outcome {
    ending.outcome.unwrap_or(match &ending.controller {
        Some(report) if report.fault.is_some() => Outcome::Faulted,
        Some(report) if report.completed == 1 => Outcome::Completed,
        Some(_) if fault => Outcome::Faulted,
        Some(_) => Outcome::Stopped,
        None => Outcome::Aborted,
    })
}

/// The machine as summaries name it.
pub fn machine_summary(machine: &Machine) -> MachineSummary {
    MachineSummary {
        name: machine.name.clone(),
        mechanism: machine.mechanism.name().to_owned(),
        axes: machine.axes.iter().map(|axis| axis.name.clone()).collect(),
    }
}

/// The marks, unless the judge found none to stand on or the recording lacks its head or tail: it
/// would miss marks that were made.
fn judged(report: Option<&ControllerReport>, findings: &Findings) -> Result<Marks, String> {
    let Some(report) = report else {
        return Err("the marks are not judged: the controller did not say where they end".into());
    };
    let needed = (report.first_cycle.0, report.last_cycle.0.saturating_add(LIGHT_LAG));
    match findings.cycles {
        Some((first, last)) if first <= needed.0 && last >= needed.1 => {
            findings.marks.clone().map_err(|reason| reason.to_string())
        }
        _ => Err("the marks are not judged: the recording lacks its beginning or its end".into()),
    }
}

fn realtime(ending: &Ending) -> Realtime {
    let controller = ending.controller.map(|report| report.realtime);
    // Until drives has run a cycle, its report is empty.
    let drives = ending.drives.filter(|report| report.cycle.0 != 0).map(|report| report.realtime);
    let reported: Vec<(&str, RealtimeFacts)> = [("controller", controller), ("drives", drives)]
        .into_iter()
        .filter_map(|(name, facts)| Some((name, facts?)))
        .collect();
    // Of a thread that did not report, nothing is claimed.
    let unknown = RealtimeFacts { core: -1, ..RealtimeFacts::default() };
    let warnings = thread::missing(&reported);
    Realtime::of(&controller.unwrap_or(unknown), &drives.unwrap_or(unknown), warnings)
}

/// Concludes a run from its folder: examines the recording, writes summary and report, and
/// returns the summary. `started` is when the command began.
///
/// # Errors
/// Whatever the operating system reports while writing the summary; all else is a warning in it.
pub fn conclude(
    folder: &RunFolder,
    machine: &Machine,
    ending: &Ending,
    started: Instant,
) -> io::Result<Summary> {
    let began = Instant::now();
    let mut ending = ending.clone();
    let (mut plan, mut artwork, mut findings) = (PlanFacts::default(), Artwork::default(), None);
    // A job that was refused has no plan: one in the folder is that of an earlier job.
    if ending.outcome != Some(Outcome::Refused) {
        let warnings = &mut ending.warnings;
        plan = read_json(folder, run_folder::PLAN, warnings).unwrap_or_default();
        // Nor was anything marked before there was an artwork.
        if let Some(planned) = read_json(folder, run_folder::ARTWORK, warnings) {
            artwork = planned;
            findings = examine(folder, &artwork)
                .map_err(|reason| warnings.push(format!("there is no recording: {reason}")))
                .ok();
        }
    }
    let mut summary = summarise(machine, &plan, &ending, findings.as_ref(), Clock::Real);
    summary.report_time = began.elapsed().as_secs_f64();
    summary.wall = started.elapsed().as_secs_f64();
    write(folder, machine, &artwork, &mut summary, findings.as_ref())?;
    Ok(summary)
}

/// Writes report and summary into the run folder, tells the summary where that is, and adds what
/// the report took to its times. Without findings there is no report.
///
/// # Errors
/// Whatever the operating system reports while writing the summary; a report that cannot be
/// written is a warning in it.
pub fn write(
    folder: &RunFolder,
    machine: &Machine,
    artwork: &Artwork,
    summary: &mut Summary,
    findings: Option<&Findings>,
) -> io::Result<()> {
    summary.out = Some(folder.path().to_string_lossy().into_owned());
    if let Some(findings) = findings {
        // A stepper's current says nothing of its torque.
        let constant = |axis: &Axis| axis.motor.dc().map_or(0.0, |motor| motor.torque_constant);
        let constants: Vec<f64> = machine.axes.iter().map(constant).collect();
        let began = Instant::now();
        let report = Report {
            summary,
            artwork,
            trace: &findings.trace,
            torque_constants: &constants,
            histograms: &findings.histograms,
        };
        if let Err(error) = report.write(folder) {
            summary.warnings.push(error.to_string());
        }
        let took = began.elapsed().as_secs_f64();
        summary.report_time += took;
        summary.wall += took;
    }
    folder.write(run_folder::SUMMARY, serde_json::to_vec_pretty(summary)?)
}

fn examine(folder: &RunFolder, artwork: &Artwork) -> Result<Findings, String> {
    let file = File::open(folder.file(run_folder::SAMPLES)).map_err(|error| error.to_string())?;
    let reader = RecordingReader::new(BufReader::new(file)).map_err(|error| error.to_string())?;
    let mut examination = Examination::new(artwork, Clock::Real);
    for record in reader {
        match record {
            Ok(record) => examination.push(&record),
            // A writer that was killed leaves a torn last record; all before it are whole.
            Err(RecordingError::Truncated { .. }) => break,
            Err(error) => return Err(error.to_string()),
        }
    }
    Ok(examination.finish())
}

/// A file of the planner; `None` when it was never written, or cannot be read: then with a warning.
fn read_json<T: for<'a> Deserialize<'a>>(
    folder: &RunFolder,
    name: &str,
    warnings: &mut Vec<String>,
) -> Option<T> {
    let content = match fs::read(folder.file(name)) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return None,
        content => content.and_then(|content| Ok(serde_json::from_slice(&content)?)),
    };
    content.map_err(|error| warnings.push(format!("cannot read {name}: {error}"))).ok()
}

#[cfg(test)]
mod tests;
