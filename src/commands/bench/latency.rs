//! `graver bench latency`: the latency of every hop between the processes, at one rate of the control
//! cycle or at several.

use crate::arguments::{LatencyArguments, MachineArguments};
use crate::exit::{Exit, Failure};
use crate::output::say;
use crate::pipeline::configuration::Configuration;
use crate::pipeline::{JobSource, POLL_INTERVAL, Pipeline, ServiceOwner};
use crate::{inputs, output};
use messages::hop::Hop;
use messages::plan::PlanFacts;
use messages::time::Period;
use messages::{Command, Feedback, OperatorVerb, PlannerPhase, run_folder};
use monitor::conclusion::{RunOutcome, summarise};
use monitor::latency::HopLatency;
use monitor::recording::file::parts::Extent;
use monitor::run_analysis::{Clock, RunResults};
use monitor::stage::{Inputs, MonitorStage, Outputs};
use monitor::summary::Realtime;
use planner::request::JobRequest;
use runtime::{Domain, Instance, Role, Samples, Subscriber, signal};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write;
use std::time::{Duration, Instant};

/// What `bench latency --rates --json` prints.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct RatesReport {
    /// One measurement for each rate, the slowest first.
    pub rates: Vec<LatencyReport>,
}

/// What `bench latency --json` prints.
#[derive(Debug, Serialize, schemars::JsonSchema)]
pub struct LatencyReport {
    /// Period of the control cycle [s].
    pub period: f64,
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
    /// |period − what it should be| of the drives' clock [ns].
    pub period_error: HopLatency,
    /// Where and how the processes ran.
    pub realtime: Realtime,
}

/// Periods of `--rates` [µs]: 250 Hz to 8 kHz.
const RATES: [f64; 6] = [4000.0, 2000.0, 1000.0, 500.0, 250.0, 125.0];

/// Measures every hop of a pipeline that marks the machine's sample job again and again.
///
/// # Errors
/// As `graver run`.
pub fn run(arguments: &LatencyArguments) -> Result<Exit, Failure> {
    signal::install().map_err(Failure::service)?;
    if arguments.rates {
        return rates(arguments);
    }
    let mut machine = arguments.machine.clone();
    machine.set.extend(arguments.period.as_ref().map(|period| period_of(period)));
    let (report, measured) = measure(arguments, &machine)?;
    if arguments.periods {
        let lines: String = measured.periods.iter().map(|period| format!("{period}\n")).collect();
        output::printed(std::io::stdout().lock().write_all(lines.as_bytes()))?;
    } else if arguments.json {
        output::json(&report)?;
    } else {
        print_latency(&report);
    }
    Ok(Exit::Done)
}

fn period_of(period: &str) -> String {
    format!("machine.realtime.period={period}")
}

/// Measures at each of [`RATES`].
fn rates(arguments: &LatencyArguments) -> Result<Exit, Failure> {
    let mut report = RatesReport { rates: Vec::new() };
    for micro in RATES {
        let mut machine = arguments.machine.clone();
        machine.set.push(period_of(&format!("{micro} us")));
        let (measured, _) = measure(arguments, &machine)?;
        if !arguments.json {
            if report.rates.is_empty() {
                print_rates_header();
            }
            print_rate(&measured);
        }
        report.rates.push(measured);
        if signal::termination().is_some() {
            break;
        }
    }
    if arguments.json {
        output::json(&report)?;
    } else if let Some(LatencyReport { realtime, .. }) = report.rates.last() {
        say!("scheduler {}, priority {}", realtime.scheduler, realtime.priority);
        realtime.warnings.iter().for_each(|warning| say!("warning   {warning}"));
    }
    Ok(Exit::Done)
}

fn print_rates_header() {
    say!(
        "{:>8}{:>10}{:>10}{:>8}   {:<28}{:<28}{:<28}",
        "rate",
        "cycles",
        "overruns",
        "missed",
        "wake p50/p99/max [µs]",
        "compute p50/p99/max [µs]",
        "period error p50/p99/max [µs]"
    );
}

fn print_rate(report: &LatencyReport) {
    let told = |hop: Option<&HopLatency>| {
        let micro = |value: u64| value as f64 * 1e-3;
        hop.map_or_else(String::new, |hop| {
            format!("{:.1} / {:.1} / {:.1}", micro(hop.p50), micro(hop.p99), micro(hop.max))
        })
    };
    let [wake, compute] = [Hop::Wake, Hop::Compute].map(|hop| told(report.latency.get(hop.name())));
    say!(
        "{:>5} Hz{:>10}{:>10}{:>8}   {wake:<28}{compute:<28}{:<28}",
        (1.0 / report.period).round(),
        report.cycles,
        report.overruns,
        report.missed,
        told(Some(&report.period_error))
    );
}

/// Measures a pipeline of the machine that `machine` says.
fn measure(
    arguments: &LatencyArguments,
    machine: &MachineArguments,
) -> Result<(LatencyReport, Measured), Failure> {
    let name = format!("bench-{}", std::process::id());
    let instance = Instance::new(&name).map_err(Failure::bad_input)?;
    let input = inputs::machine(machine)?;
    let request =
        inputs::job_request(None, &input.machine, input.folder.as_deref(), &input.job_overrides)
            .absolute();
    let configuration =
        Configuration::new(input.source.clone(), &arguments.drives, Extent::default())?;
    // Of an unpredictable name and for this user alone; it goes when this ends.
    let folder = tempfile::Builder::new()
        .prefix("graver-bench-")
        .tempdir()
        .map_err(|error| Failure::output(format!("{}: {error}", std::env::temp_dir().display())))?;
    let mut pipeline =
        Pipeline::start(&instance, &configuration, ServiceOwner::Own, JobSource::Own)?;
    let measured = pipeline.enable().and_then(|()| {
        let period = input.machine.realtime.period;
        read_along(&mut pipeline, &request, folder.path(), &instance, period, arguments.seconds)
    });
    let latest = pipeline.latest;
    pipeline.shut_down();
    let measured = measured?;

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
        period: measured.period.seconds(),
        seconds: arguments.seconds,
        cycles: measured.periods.len() as u64,
        overruns: latest.drives.overruns,
        missed: latest.drives.missed,
        latency: measured.stage.histograms().summary(),
        period_error: measured.period_error(),
        realtime: summary.realtime,
    };
    Ok((report, measured))
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
    /// What they should be.
    period: Period,
    /// Periods of the drives' clock [ns].
    periods: Vec<i64>,
}

impl Measured {
    fn period_error(&self) -> HopLatency {
        let mut errors: Vec<u64> =
            self.periods.iter().map(|period| period.abs_diff(self.period.time().0)).collect();
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
fn read_along(
    pipeline: &mut Pipeline,
    request: &JobRequest,
    folder: &std::path::Path,
    instance: &Instance,
    period: Period,
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
    let mut measured = Measured { stage: MonitorStage::new(), period, periods: Vec::new() };
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
