//! `graver doctor`: is this PC fit for real time, and what to change. It reads, and tries in threads and processes that
//! end at once; it changes nothing.

mod cores;
mod finding;
mod host;
mod instances;
mod kernel;
mod memory;
mod network;
mod noise;
mod rights;

pub use finding::{Finding, Verdict};
pub use noise::Noise;

use crate::arguments::{DoctorArguments, MachineArguments};
use crate::exit::{Exit, Failure};
use crate::inputs::MachineSource;
use crate::output::{self, say};
use host::Host;
use machine::limits::Timing;
use machine::{Machine, drives::DrivesKind};
use serde::Serialize;
use std::time::Duration;

/// How long the wake-ups are measured.
const MEASURED: Duration = Duration::from_secs(1);

/// What `doctor --json` prints.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct DoctorReport {
    /// The gravest verdict.
    pub verdict: Verdict,
    /// The CPU that was examined: where controller and drives would run.
    pub core: usize,
    /// What was found.
    pub findings: Vec<Finding>,
    /// How late a real-time thread woke up; null where that was not measured.
    pub noise: Option<Noise>,
}

/// Runs the command.
///
/// # Errors
/// A machine file that does not hold.
pub fn run(arguments: &DoctorArguments) -> Result<Exit, Failure> {
    let machine = match &arguments.machine {
        Some(file) => {
            let machine = MachineArguments { machine: Some(file.clone()), set: Vec::new() };
            Some(MachineSource::read(&machine)?.machine()?)
        }
        None => None,
    };
    let host = Host::new(&arguments.root);
    let core = core(&host, arguments.core)?;
    let report = examine(&host, core, machine.as_ref());
    if arguments.json {
        output::json(&report)?;
    } else {
        print(&report);
    }
    Ok(if report.verdict == Verdict::Problem { Exit::Stopped } else { Exit::Done })
}

/// The CPU that was asked for, or else the one that `run` takes.
fn core(host: &Host, asked: Option<usize>) -> Result<usize, Failure> {
    let online = host.cpus("/sys/devices/system/cpu/online").unwrap_or_default();
    let last = if host.is_this_one() {
        runtime::thread::last_core()
    } else {
        online.iter().copied().max().unwrap_or(0)
    };
    match asked {
        Some(core) if !online.is_empty() && !online.contains(&core) => {
            let online = online.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
            Err(Failure::bad_input(format!(
                "--core {core}: there is no such CPU; there are {online}"
            )))
        }
        asked => Ok(asked.unwrap_or(last)),
    }
}

fn examine(host: &Host, core: usize, machine: Option<&Machine>) -> DoctorReport {
    let mut findings = vec![
        kernel::preemption(host),
        kernel::clock_source(host),
        kernel::throttle(host),
        kernel::virtualisation(host),
        cores::isolation(host, core),
        cores::governor(host, core),
        cores::idle_states(host, core),
        cores::siblings(host, core),
        cores::interrupts(host, core),
    ];
    findings.extend(rights::limits(host));
    findings.push(rights::real_time_priority(host));
    findings.push(rights::locked_memory(host));
    findings.push(memory::swap(host));
    findings.push(memory::huge_pages(host));
    findings.push(memory::shared(host));
    findings.push(instances::run_directory(host));
    findings.push(instances::leftovers(host));
    let drives = machine.map_or(&DrivesKind::Simulated, |machine| &machine.drives.kind);
    findings.extend(network::findings(host, drives));
    let timing = machine.map_or(Timing::DEFAULT, |machine| machine.realtime);
    let noise = if host.is_this_one() {
        noise::measure(host, core, timing.period.time(), MEASURED)
    } else {
        None
    };
    findings.push(noise::finding(noise.as_ref()));
    let verdict = findings.iter().map(|finding| finding.verdict).max().unwrap_or(Verdict::Unknown);
    DoctorReport { verdict, core, findings, noise }
}

fn print(report: &DoctorReport) {
    for finding in &report.findings {
        say!("{:8}  {:22}  {}", finding.verdict.name(), finding.check, finding.found);
        if finding.verdict >= Verdict::Advice {
            say!("{:8}  {:22}  why: {}", "", "", finding.why);
        }
        if let Some(remedy) = &finding.remedy {
            say!("{:8}  {:22}  do:  {remedy}", "", "");
        }
    }
    let count = |verdict| report.findings.iter().filter(|it| it.verdict == verdict).count();
    say!("{} problems, {} pieces of advice", count(Verdict::Problem), count(Verdict::Advice));
}
