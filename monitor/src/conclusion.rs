//! From what is known at the end of a run to its summary and its report.
//!
//! What cannot be read or judged leaves a gap in the summary and a warning that says why; a figure
//! that might be wrong is never given. Nor is a run without a summary: what cannot be written is a
//! warning in it too.

pub mod artwork;
mod room;
pub mod verdict;

pub use crate::recording::info::{RecordingInfo, RecordingState};

use crate::marks::{DrawnPlace, MarkEvaluation, Marks, StreamEnd};
use crate::recording::file::RecordingError;
use crate::recording::file::parts::PartsReader;
use crate::recording::file::reduce::reduce;
use crate::recording::info::Progress;
use crate::recording::level::Level;
use crate::report::Report;
use crate::run_analysis::{Clock, RunAnalysis, RunResults};
use crate::run_folder::RunFolder;
use crate::summary::text::length;
use crate::summary::{
    DrivesSummary, ErrorSummary, FaultSummary, JobPlace, JobSummary, LeftSummary, MachineSummary,
    Outcome, Realtime, StallSummary, Summary,
};
use machine::{Actuator, Machine};
use messages::artwork::Artwork;
use messages::plan::PlanFacts;
use messages::time::Period;
use messages::{ControllerReport, DrivesReport, Fault, FaultCode, RealtimeFacts, run_folder};
use runtime::thread;
use serde::Deserialize;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Cycles after the stream's last during which its light is still reported: the command acts one
/// cycle later, and the feedback tells one after that.
pub const LIGHT_LAG: u64 = 2;

/// Cycles that the controller counts beyond the time of a stream's last setpoint: the one of its first, and the
/// one that finds it at rest.
const END_CYCLES: u64 = 2;

/// How a run ended, as its supervisor (or the monitor after the supervisor's death) knows.
#[derive(Debug, Clone, Default)]
pub struct RunOutcome {
    /// How whoever watched ended it; `None` where it ended by itself. What the reports say of the
    /// machine goes before it: see [`verdict`](verdict::verdict).
    pub outcome: Option<Outcome>,
    /// Why, in words.
    pub error: Option<ErrorSummary>,
    /// Where the job was when it was last heard of, without its place in the drawing.
    pub place: Option<JobPlace>,
    /// What else is wrong.
    pub others: Vec<ErrorSummary>,
    /// The controller's final report of this stream, if it came.
    pub controller: Option<ControllerReport>,
    /// The fault that the controller has latched at the end, if any.
    pub latched: Fault,
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
    /// What was left of the job when it ended, as planned or estimated [s].
    pub time_left: f64,
    /// Job time over wall time of the stepping loop, in virtual time.
    pub realtime_factor: Option<f64>,
    /// What a person should know.
    pub warnings: Vec<String>,
    /// Where the recording may go on that its folder could not take; the artwork does so beside it.
    pub spare: Option<PathBuf>,
    /// What stays of the recording when the run has been judged.
    pub level: Level,
}

/// The summary of a run from its outcome, its plan, and what its recording tells; `results` is
/// `None` without a recording.
pub fn summarise(
    machine: &Machine,
    plan: &PlanFacts,
    run_outcome: &RunOutcome,
    results: Option<&RunResults>,
    clock: Clock,
) -> Summary {
    let period = machine.realtime.period;
    let job = JobSummary {
        name: if plan.name.is_empty() { run_outcome.job.clone() } else { plan.name.clone() },
        strokes: plan.strokes as u64,
        length: plan.length,
        dry_run: plan.dry_run,
        layers: plan.layers.clone(),
    };
    let mut summary = Summary::new(Outcome::Aborted, job, machine_summary(machine));
    let counters = run_outcome.drives.map(|report| report.link).unwrap_or_default();
    let drives = match clock {
        Clock::Virtual => DrivesSummary::simulated(machine),
        Clock::Real => DrivesSummary::of(machine),
    };
    summary.drives = drives.counted(&counters);
    summary.error = run_outcome.error.clone();
    summary.errors = run_outcome.error.iter().chain(&run_outcome.others).cloned().collect();
    summary.wall = run_outcome.wall;
    summary.plan_time = run_outcome.plan_time;
    summary.time_left = run_outcome.time_left;
    summary.binding = plan.binding.clone();
    summary.realtime_factor = run_outcome.realtime_factor;
    summary.warnings = run_outcome.warnings.clone();
    summary.warnings.extend(plan.notes.iter().map(|note| match note.line {
        0 => note.text.clone(),
        line => format!("line {line}: {}", note.text),
    }));
    if let Some(report) = &run_outcome.controller {
        summary.take_controller(report);
        summary.time = if report.completed == 1 {
            // What the stream took beyond its plan was holds and overrides.
            let planned = period
                .cycles_for(Period::OF_SETPOINTS.of(plan.samples.saturating_sub(1)))
                + END_CYCLES;
            let beyond = (report.cycles as f64 - planned as f64) * period.seconds();
            (plan.duration + beyond).max(0.0)
        } else {
            period.of(report.cycles).seconds()
        };
    }
    if let Some(report) = &run_outcome.drives {
        summary.overruns = report.overruns.saturating_sub(run_outcome.overruns_before);
        if let Some(stream) = &run_outcome.controller {
            summary.stalls = StallSummary::of(&report.stalls, stream, period);
        }
        // A clock that slips has the machine wait: the marks are the same.
        if report.slips == 0 {
            summary.warnings.extend(summary.stalls.warning());
        }
    }
    end(&mut summary, machine, run_outcome);
    if let Some(fault) = &mut summary.fault {
        fault.blame(&summary.stalls);
    }
    if let Some(results) = results {
        summary.latency = results.histograms.summary();
        summary.recording = Some(results.continuity.summary(period));
        match &results.marks {
            Ok(evaluation) => {
                summary.warnings.extend(warnings(evaluation));
                summary.left = LeftSummary::of(evaluation, plan);
                summary.place = place_of(evaluation, plan);
                summary.marks = Some(evaluation.marks.clone());
            }
            Err(reason) => summary.warnings.push(reason.to_string()),
        }
    }
    summary.realtime = match clock {
        Clock::Virtual => Realtime::in_virtual_time(),
        Clock::Real => realtime(run_outcome),
    };
    summary
}

/// How it ended. What came after a completed job is a warning, and none of its faults.
fn end(summary: &mut Summary, machine: &Machine, run_outcome: &RunOutcome) {
    let verdict = verdict::verdict(&verdict::Evidence {
        controller: run_outcome.controller,
        latched: run_outcome.latched,
        drives: run_outcome.drives.map(|report| report.fault).unwrap_or_default(),
        own: run_outcome.outcome,
    });
    let told = |fault: Fault| FaultSummary::of(&fault, machine);
    summary.outcome = verdict.outcome;
    summary.fault = verdict.fault.and_then(told);
    if let Some(later) = verdict.later.and_then(told) {
        summary.warnings.push(format!("after the job: {later}"));
    }
    if verdict.outcome == Outcome::Completed {
        let error = summary.error.take();
        summary.warnings.extend(error.map(|error| format!("after the job: {}", error.message)));
    }
}

/// What a person should know of marks that are not judged whole.
fn warnings(evaluation: &MarkEvaluation) -> Vec<String> {
    let MarkEvaluation { marks, unrecorded_strokes, unknown, open_end, left: _ } = evaluation;
    let Some((first, last)) = unrecorded_strokes else { return Vec::new() };
    let Marks { unrecorded, .. } = marks;
    let strokes = if first == last {
        format!("of stroke {first}")
    } else {
        format!("between stroke {first} and stroke {last}")
    };
    let mut warnings = vec![format!(
        "not all was recorded: {} {strokes} may be marked or missing and are not judged",
        length(*unrecorded)
    )];
    if *open_end {
        let nobody = "the recording ends before the job, and nobody can tell how far it went on";
        warnings.push(nobody.to_owned());
    }
    if *unknown > 0 {
        warnings.push(format!("the tool position was unknown in {unknown} lit cycles"));
    }
    warnings
}

/// The machine as summaries name it.
pub fn machine_summary(machine: &Machine) -> MachineSummary {
    MachineSummary {
        name: machine.name.clone(),
        mechanism: machine.mechanism.name().to_owned(),
        axes: machine.axes.iter().map(|axis| axis.name.clone()).collect(),
        actuators: machine.actuators.iter().map(|actuator| actuator.name.clone()).collect(),
    }
}

fn realtime(run_outcome: &RunOutcome) -> Realtime {
    let controller = run_outcome.controller.map(|report| report.realtime);
    // Until drives has run a cycle, its report is empty.
    let drives =
        run_outcome.drives.filter(|report| report.cycle.0 != 0).map(|report| report.realtime);
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
/// returns the summary, with a warning for each file that could not be read or written. `started`
/// is when the command began.
pub fn conclude(
    folder: &RunFolder,
    machine: &Machine,
    run_outcome: &RunOutcome,
    started: Instant,
) -> Summary {
    let began = Instant::now();
    let mut run_outcome = run_outcome.clone();
    let (mut plan, mut drawn, mut results) = (PlanFacts::default(), Artwork::default(), None);
    // A job that was refused has no plan: one in the folder is that of an earlier job.
    if run_outcome.outcome != Some(Outcome::Refused) {
        let warnings = &mut run_outcome.warnings;
        plan = read_json(folder, run_folder::PLAN, warnings).unwrap_or_default();
        let info = RecordingInfo::read(folder).unwrap_or_default();
        if !info.message.is_empty() {
            warnings.push(format!("the recording was broken off: {}", info.message));
        }
        // Nor was anything marked before there was an artwork.
        let spared =
            run_outcome.spare.as_ref().map(|spare| spare.with_file_name(run_folder::ARTWORK));
        if let Some(planned) = artwork::read(folder, spared.as_deref(), warnings) {
            // Of a plan that was broken off the artwork is newer than the facts.
            if planned.strokes.len() != plan.strokes {
                (plan.strokes, plan.length) = (planned.strokes.len(), planned.length());
            }
            drawn = planned;
            let faults =
                [run_outcome.latched, run_outcome.drives.map(|it| it.fault).unwrap_or_default()];
            let silenced = faults.iter().any(|fault| fault.code() == FaultCode::DrivesLost);
            let end = match &run_outcome.controller {
                Some(report) => StreamEnd::Reported(report),
                None if silenced && info.progress == Progress::Complete => StreamEnd::Silenced,
                None => StreamEnd::Unknown,
            };
            let spare = run_outcome.spare.as_deref();
            results = examine((folder, spare), machine, (&drawn, plan.speed), end)
                .map_err(|reason| warnings.push(format!("there is no recording: {reason}")))
                .ok();
        }
    }
    let mut summary = summarise(machine, &plan, &run_outcome, results.as_ref(), Clock::Real);
    if summary.outcome != Outcome::Completed {
        // What the marks tell comes before what was last heard, which names the file.
        let heard = run_outcome.place.map(|place| place.within(&drawn));
        summary.place = match summary.place.take() {
            Some(marked) => {
                let heard = heard.unwrap_or_default();
                Some(JobPlace { file: heard.file, line: marked.line.or(heard.line), ..marked })
            }
            None => heard,
        };
    }
    summary.report_time = began.elapsed().as_secs_f64();
    summary.wall = started.elapsed().as_secs_f64();
    if let Err(error) = reduce(folder, run_outcome.level) {
        let path = folder.file(run_folder::SAMPLES);
        summary.warnings.push(format!("all of the recording is kept: {}: {error}", path.display()));
    }
    write(folder, machine, &drawn, &mut summary, results.as_ref());
    if let Some(spare) = &run_outcome.spare {
        // It was needed to judge the run. Where nothing went on there is none.
        let _ = fs::remove_dir_all(spare);
        let _ = fs::remove_file(spare.with_file_name(run_folder::ARTWORK));
    }
    summary
}

/// Where the job ended that was not played to its end, as its marks tell it.
fn place_of(evaluation: &MarkEvaluation, plan: &PlanFacts) -> Option<JobPlace> {
    let left = evaluation.left?;
    let DrawnPlace { line, position, bounds } = left.place?;
    Some(JobPlace {
        file: None,
        line: (line > 0).then_some(line),
        stroke: plan.passed_over + left.stroke,
        tool: Some(position),
        bounds: Some(bounds),
    })
}

/// Writes report and summary into the run folder, tells the summary where that is, and adds what
/// the report took to its times. Without results there is no report. What cannot be written is a
/// warning in the summary, which names the file and the reason.
pub fn write(
    folder: &RunFolder,
    machine: &Machine,
    artwork: &Artwork,
    summary: &mut Summary,
    results: Option<&RunResults>,
) {
    summary.out = Some(folder.path().to_string_lossy().into_owned());
    if let Some(results) = results {
        // A stepper's current says nothing of its torque.
        let constant = |it: &Actuator| it.motor.dc().map_or(0.0, |motor| motor.torque_constant);
        let constants: Vec<f64> = machine.actuators.iter().map(constant).collect();
        let began = Instant::now();
        let report = Report {
            summary,
            artwork,
            trace: &results.trace,
            torque_constants: &constants,
            histograms: &results.histograms,
        };
        if let Err(error) = report.write(folder) {
            summary.warnings.push(error.to_string());
        }
        let took = began.elapsed().as_secs_f64();
        summary.report_time += took;
        summary.wall += took;
    }
    match room::write(folder, summary) {
        Ok(false) => {}
        Ok(true) => {
            let path = folder.file(run_folder::SAMPLES);
            let words = "was cut short, so that the summary has room";
            summary.warnings.push(format!("{}: the disk is full: its end {words}", path.display()));
            // A little longer than before, and in the room that was made.
            if let Err(error) = folder.write_json(run_folder::SUMMARY, summary) {
                summary.warnings.push(format!("cannot write {error}"));
            }
        }
        Err(error) => summary.warnings.push(format!("cannot write {error}")),
    }
}

/// Examines the recording of `machine` in a folder, and where it went on that this could not take, against marks that the plan makes at most with `speed`
/// [m/s].
fn examine(
    (folder, spare): (&RunFolder, Option<&Path>),
    machine: &Machine,
    (artwork, speed): (&Artwork, f64),
    end: StreamEnd<'_>,
) -> Result<RunResults, String> {
    let path = folder.file(run_folder::SAMPLES);
    let at = |error: RecordingError| format!("{}: {error}", path.display());
    let reader = PartsReader::open_both(folder.path(), spare).map_err(at)?;
    let analysis = RunAnalysis::new(artwork, Clock::Real, reader.period());
    let mut analysis = analysis.with_fastest(speed).with_machine(machine);
    for record in reader {
        match record {
            Ok(record) => analysis.push(&record),
            // A writer that was killed leaves a torn last record; all before it are whole.
            Err(RecordingError::Truncated { .. }) => break,
            Err(error) => return Err(at(error)),
        }
    }
    Ok(analysis.finish(end))
}

/// A file of the planner; `None` when it was never written, or cannot be read: then with a warning.
fn read_json<T: for<'a> Deserialize<'a>>(
    folder: &RunFolder,
    name: &str,
    warnings: &mut Vec<String>,
) -> Option<T> {
    let content: io::Result<T> = match fs::read(folder.file(name)) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return None,
        content => content.and_then(|content| Ok(serde_json::from_slice(&content)?)),
    };
    let path = folder.file(name);
    content.map_err(|error| warnings.push(format!("cannot read {}: {error}", path.display()))).ok()
}

#[cfg(test)]
mod tests;
