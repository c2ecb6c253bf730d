//! `graver bench`: measures this PC.

pub mod planning;

use crate::arguments::{BenchArguments, LatencyArguments};
use crate::exit::{Exit, Failure};
use crate::output::say;
use crate::pipeline::configuration::Configuration;
use crate::pipeline::{POLL_INTERVAL, Pipeline, ServiceOwner};
use crate::{inputs, output};
use drives::PlantOptions;
use messages::plan::PlanFacts;
use messages::time::CYCLE_TIME;
use messages::{Command, Feedback, OperatorVerb, PlannerPhase, run_folder};
use monitor::conclusion::{RunOutcome, summarise};
use monitor::latency::HopLatency;
use monitor::run_analysis::{Clock, RunResults};
use monitor::stage::{Inputs, MonitorStage, Outputs};
use monitor::summary::Realtime;
use planner::request::JobRequest;
use runtime::{Domain, Instance, Role, Samples, Subscriber, signal};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write;
use std::time::{Duration, Instant};

/// What `bench latency --json` prints.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct LatencyReport {
    /// How long was measured [s].
    pub seconds: f64,
    /// Cycles seen.
    pub cycles: u64,
    /// Cycles whose work did not end before the next deadline.
    pub overruns: u64,
    /// Cycles without a fresh command.
    pub missed: u64,
    /// Latencies by hop [ns].
    pub latency: BTreeMap<String, HopLatency>,
    /// |period − 1 ms| of the drives' clock [ns].
    pub period_error: HopLatency,
    /// Where and how the processes ran.
    pub realtime: Realtime,
}

/// Measures every hop of a pipeline that marks the machine's sample job again and again.
///
/// # Errors
/// As `graver run`.
pub fn latency(arguments: &LatencyArguments) -> Result<Exit, Failure> {
    signal::install().map_err(Failure::service)?;
    let name = format!("bench-{}", std::process::id());
    let instance = Instance::new(&name).map_err(Failure::bad_input)?;
    let input = inputs::machine(&arguments.machine)?;
    let request =
        inputs::job_request(None, &input.machine, input.folder.as_deref(), &input.job_overrides)
            .absolute();
    let configuration = Configuration::new(input.source.clone(), &arguments.drives)?;
    // Of an unpredictable name and for this user alone; it goes when this ends.
    let folder = tempfile::Builder::new()
        .prefix("graver-bench-")
        .tempdir()
        .map_err(|error| Failure::output(format!("{}: {error}", std::env::temp_dir().display())))?;
    let mut pipeline = Pipeline::start(&instance, &configuration, ServiceOwner::Own)?;
    let measured = pipeline.enable().and_then(|()| {
        measure(&mut pipeline, &request, folder.path(), &instance, arguments.seconds)
    });
    let latest = pipeline.latest;
    pipeline.shut_down();
    let measured = measured?;

    if arguments.periods {
        let lines: String = measured.periods.iter().map(|period| format!("{period}\n")).collect();
        output::printed(std::io::stdout().lock().write_all(lines.as_bytes()))?;
        return Ok(Exit::Done);
    }
    let run_outcome = RunOutcome {
        controller: Some(latest.controller).filter(|report| report.stream != 0),
        drives: Some(latest.drives),
        ..RunOutcome::default()
    };
    let summary = summarise(
        &input.machine,
        &PlanFacts::default(),
        &run_outcome,
        None::<&RunResults>,
        Clock::Real,
    );
    let report = LatencyReport {
        seconds: arguments.seconds,
        cycles: measured.periods.len() as u64,
        overruns: latest.drives.overruns,
        missed: latest.drives.missed,
        latency: measured.stage.histograms().summary(),
        period_error: measured.period_error(),
        realtime: summary.realtime,
    };
    if arguments.json {
        output::json(&report)?;
    } else {
        print_latency(&report);
    }
    Ok(Exit::Done)
}

fn print_latency(report: &LatencyReport) {
    let micro = |value: u64| value as f64 * 1e-3;
    say!("{:<14}{:>9}{:>10}{:>10}{:>10}{:>10}", "", "count", "p50", "p99", "p99.9", "max [µs]");
    let row = |name: &str, hop: &HopLatency| {
        say!(
            "{name:<14}{:>9}{:>10.1}{:>10.1}{:>10.1}{:>10.1}",
            hop.count,
            micro(hop.p50),
            micro(hop.p99),
            micro(hop.p999),
            micro(hop.max)
        );
    };
    for (name, hop) in &report.latency {
        row(name, hop);
    }
    row("period error", &report.period_error);
    say!("{} cycles, {} overruns, {} missed", report.cycles, report.overruns, report.missed);
    say!("scheduler {}, priority {}", report.realtime.scheduler, report.realtime.priority);
    for (name, core) in &report.realtime.cores {
        say!("{name} on CPU {core}");
    }
    for warning in &report.realtime.warnings {
        say!("warning   {warning}");
    }
}

struct Measured {
    stage: MonitorStage,
    /// Periods of the drives' clock [ns].
    periods: Vec<i64>,
}

impl Measured {
    fn period_error(&self) -> HopLatency {
        let mut errors: Vec<u64> = self
            .periods
            .iter()
            .map(|period| period.abs_diff(messages::time::CYCLE_PERIOD.0))
            .collect();
        errors.sort_unstable();
        let at = |share: f64| {
            let index = (share * errors.len() as f64) as usize;
            errors.get(index.min(errors.len().saturating_sub(1))).copied().unwrap_or(0)
        };
        HopLatency {
            count: errors.len() as u64,
            min: at(0.0),
            p50: at(0.5),
            p99: at(0.99),
            p999: at(0.999),
            max: at(1.0),
        }
    }
}

/// Reads along for a while, with a job always under way.
fn measure(
    pipeline: &mut Pipeline,
    request: &JobRequest,
    folder: &std::path::Path,
    instance: &Instance,
    seconds: f64,
) -> Result<Measured, Failure> {
    let text = serde_json::to_vec(request).map_err(Failure::service)?;
    let file = folder.join(run_folder::REQUEST);
    std::fs::write(&file, text)
        .map_err(|error| Failure::output(format!("{}: {error}", file.display())))?;
    let observer = Domain::join(instance, Role::Observer).map_err(Failure::service)?;
    let mut feedbacks: Subscriber<Feedback> =
        observer.subscriber(Samples::All).map_err(Failure::service)?;
    let mut commands: Subscriber<Command> =
        observer.subscriber(Samples::All).map_err(Failure::service)?;
    let (mut feedback_batch, mut command_batch) = (Vec::new(), Vec::new());
    let mut outputs = Outputs::default();
    let mut measured = Measured { stage: MonitorStage::new(), periods: Vec::new() };
    let mut previous: Option<Feedback> = None;
    let mut stream = 0;
    let mut started_stream = 0;
    let began = Instant::now();
    let end = Duration::from_secs_f64(seconds);
    while began.elapsed() < end && signal::termination().is_none() {
        if let Some(ended) = pipeline.poll()?.first() {
            return Err(Failure::service(ended));
        }
        let latest = &pipeline.latest;
        if stream == 0 || latest.progress.finished_stream >= stream {
            stream = pipeline.offer(&folder.to_string_lossy())?;
        } else if latest.planner.stream == stream
            && PlannerPhase::from_wire(latest.planner.phase) == PlannerPhase::Streaming
            && started_stream != stream
        {
            pipeline.ask(OperatorVerb::Start, stream as f64);
            started_stream = stream;
        }
        feedback_batch.clear();
        command_batch.clear();
        while let Some(feedback) = feedbacks.receive().map_err(Failure::service)? {
            if let Some(previous) = previous
                && feedback.cycle.0 == previous.cycle.0 + feedback.elapsed()
            {
                measured.periods.push((feedback.measured - previous.measured).0);
            }
            previous = Some(feedback);
            feedback_batch.push(feedback);
        }
        while let Some(command) = commands.receive().map_err(Failure::service)? {
            command_batch.push(command);
        }
        let inputs = Inputs { feedbacks: &feedback_batch, commands: &command_batch };
        measured.stage.step(&inputs, &mut outputs);
        std::thread::sleep(POLL_INTERVAL);
    }
    Ok(measured)
}

/// What `bench simulate --json` prints.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct SpeedReport {
    /// The job.
    pub job: String,
    /// How often it was done.
    pub repetitions: u64,
    /// Wall time of one repetition: the median [s].
    pub wall: f64,
    /// The fastest [s].
    pub wall_min: f64,
    /// Setpoints handled in a second, by the median.
    pub setpoints_per_second: f64,
    /// Time of the job over wall time, by the median.
    pub realtime_factor: f64,
}

/// Simulates a job again and again; planning is not counted.
///
/// # Errors
/// A machine or job that does not hold.
pub fn simulate(arguments: &BenchArguments) -> Result<Exit, Failure> {
    let input = inputs::machine(&arguments.machine)?;
    let request = inputs::job_request(
        arguments.job.as_deref(),
        &input.machine,
        input.folder.as_deref(),
        &input.job_overrides,
    );
    let planned = request.plan(&input.machine)?;
    speed(arguments, || {
        let simulated = workbench::simulation::simulate(
            &input.machine,
            &input.plant,
            &planned,
            PlantOptions::default(),
            |_| (),
        )
        .map_err(Failure::bad_input)?;
        Ok((planned.facts.name.clone(), simulated.controller.cycles, simulated.stepping))
    })
}

fn speed(
    arguments: &BenchArguments,
    mut once: impl FnMut() -> Result<(String, u64, Duration), Failure>,
) -> Result<Exit, Failure> {
    let mut walls = Vec::new();
    let (mut job, mut samples, first) = once()?;
    let mut spent = first;
    while walls.is_empty() || spent.as_secs_f64() < arguments.seconds {
        let wall;
        (job, samples, wall) = once()?;
        spent += wall;
        walls.push(wall.as_secs_f64());
    }
    walls.sort_by(f64::total_cmp);
    let median = walls[walls.len() / 2];
    let report = SpeedReport {
        job,
        repetitions: walls.len() as u64,
        wall: median,
        wall_min: walls[0],
        setpoints_per_second: samples as f64 / median,
        realtime_factor: samples as f64 * CYCLE_TIME / median,
    };
    if arguments.json {
        output::json(&report)?;
    } else {
        say!("job        {}", report.job);
        say!("repeated   {} times", report.repetitions);
        say!("wall time  {:.3} ms median, {:.3} ms least", median * 1e3, report.wall_min * 1e3);
        say!("setpoints  {:.0} a second", report.setpoints_per_second);
        say!("speed      {:.0} × real time", report.realtime_factor);
    }
    Ok(Exit::Done)
}
