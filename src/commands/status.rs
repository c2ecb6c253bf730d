//! What a running pipeline is doing, once or again and again.

use super::{faults, motion};
use crate::arguments::StatusArguments;
use crate::exit::{Exit, Failure};
use crate::output::progress::{JobProgress, ProgressLine};
use crate::output::{self, say};
use monitor::summary::text::duration;
use operator::{Client, ClientError, Status};
use runtime::socket::SocketError;
use runtime::{Instance, message, signal};
use std::collections::BTreeMap;
use std::time::Duration;

/// Faults of before that are shown.
const FAULTS_SHOWN: usize = 3;

/// How often it is asked for while it is watched.
const WATCH_INTERVAL: Duration = Duration::from_millis(500);

/// Says what the pipeline is doing.
///
/// # Errors
/// No pipeline.
pub fn run(arguments: &StatusArguments) -> Result<Exit, Failure> {
    let instance = Instance::new(&arguments.instance.instance).map_err(Failure::bad_input)?;
    let client = Client::new(instance);
    if arguments.watch {
        return watch(&client, arguments.instance.json);
    }
    let status = client.status().map_err(Failure::service)?;
    if arguments.instance.json {
        output::json(&status)?;
    } else {
        show(&status);
    }
    Ok(Exit::Done)
}

/// Says it again and again, until a signal or the end of the pipeline.
fn watch(client: &Client, as_json: bool) -> Result<Exit, Failure> {
    signal::install().map_err(Failure::service)?;
    let line = ProgressLine::begin();
    let mut status = client.status().map_err(Failure::service)?;
    loop {
        if as_json {
            if !output::json_line(&status)? {
                return Ok(Exit::Done);
            }
        } else {
            line.draw(|| Some(JobProgress::of(&status)));
        }
        std::thread::sleep(WATCH_INTERVAL);
        if signal::termination().is_some() {
            line.clear();
            return Ok(Exit::Done);
        }
        status = match client.status() {
            Ok(status) => status,
            Err(ClientError::Socket(
                SocketError::NotRunning { .. } | SocketError::Ended { .. },
            )) => {
                line.clear();
                message::tell("the pipeline has ended");
                return Ok(Exit::Done);
            }
            Err(error) => {
                line.clear();
                return Err(Failure::service(error));
            }
        };
    }
}

fn show(status: &Status) {
    say!("state      {}", status.state);
    if let Some(cause) = &status.cause {
        say!("cause      {cause}");
    }
    if let Some(job) = &status.job {
        let number = status.job_number.map(|number| format!(", job {number}")).unwrap_or_default();
        say!("job        {job}{number}");
        say!("planner    {}", status.planner);
        say!("played     {} of {} setpoints", status.played, status.samples);
        if let Some(elapsed) = status.elapsed {
            say!("elapsed    {}", duration(elapsed));
        }
        if let Some(left) = status.time_left {
            say!("time left  {}", duration(left));
        }
        let line = status.line.map(|line| format!(", line {line}")).unwrap_or_default();
        let strokes =
            if status.strokes > 0 { format!(" of {}", status.strokes) } else { String::new() };
        say!("stroke     {}{strokes}{line}", status.stroke);
        say!(
            "rate       {:.0} %, override {:.0} %, of rapids {:.0} %",
            status.rate * 100.0,
            status.rate_override * 100.0,
            status.rapid_override * 100.0
        );
        let light = if status.lit { "lit" } else { "dark" };
        let power = status.power * 100.0;
        let overridden = status.power_override * 100.0;
        say!(
            "tool       {:.3} m/s, {light}, power {power:.0} %, override {overridden:.0} %",
            status.speed
        );
    }
    say!("axes       {}", motion::places(&status.axes, &[]));
    show_active("inputs", &status.inputs, "none active");
    show_active("outputs", &status.outputs, "none on");
    for words in &status.interlocks {
        say!("interlock  {words}");
    }
    for words in &status.warnings {
        say!("warning    {words}");
    }
    say!("fault      {}", status.fault.as_deref().unwrap_or("none"));
    let faults = &status.faults;
    for past in faults.iter().skip(faults.len().saturating_sub(FAULTS_SHOWN)) {
        say!("  {}", faults::line(past));
    }
    if faults.len() > FAULTS_SHOWN {
        say!("  and others before them: graver faults");
    }
    say!("cycles     {}, {} overruns", status.cycles, status.overruns);
    for (name, pid) in &status.services {
        match pid {
            Some(pid) => say!("{name:<10} pid {pid}"),
            None => say!("{name:<10} not running"),
        }
    }
}

/// The names of those that are active; nothing where the machine has none.
fn show_active(name: &str, levels: &BTreeMap<String, bool>, none: &str) {
    if levels.is_empty() {
        return;
    }
    let active = levels.iter().filter(|(_, active)| **active).map(|(name, _)| name.as_str());
    let active = active.collect::<Vec<_>>().join(", ");
    say!("{name:<10} {}", if active.is_empty() { none } else { &active });
}
