//! Requests to a running pipeline: hold, resume, override, stop, status, submit.

use crate::arguments::{InstanceArguments, OverrideArguments, SubmitArguments};
use crate::exit::{Exit, Failure};
use crate::output::{self, ProgressLine};
use crate::pipeline::operators::{Request, Verb};
use machine::quantity;
use monitor::summary::Summary;
use planner::request::JobRequest;
use runtime::Instance;
use runtime::socket::OperatorClient;
use serde_json::Value;
use std::path::absolute;

/// Asks for a verb without argument.
///
/// # Errors
/// No pipeline, or one that refuses.
pub fn verb(verb: Verb, arguments: &InstanceArguments) -> Result<Exit, Failure> {
    ask(&Request::Verb { verb, value: 0.0 }, arguments)
}

/// Asks for another rate.
///
/// # Errors
/// A rate that is none, no pipeline, or one that refuses.
pub fn override_rate(arguments: &OverrideArguments) -> Result<Exit, Failure> {
    let value = quantity::read_share(&arguments.rate)
        .map_err(|error| Failure::bad_input(format!("rate {:?}: {error}", arguments.rate)))?;
    if !(0.1..=2.0).contains(&value) {
        return Err(Failure::bad_input(format!(
            "rate {}: {:.0} % is outside 10 % to 200 %",
            arguments.rate,
            value * 100.0
        )));
    }
    ask(&Request::Verb { verb: Verb::Override, value }, &arguments.instance)
}

fn ask(request: &Request, arguments: &InstanceArguments) -> Result<Exit, Failure> {
    let reply = send(request, arguments)?;
    if arguments.json {
        output::json(&reply)?;
    }
    let state = reply["state"].as_str().unwrap_or("unknown");
    if reply["accepted"].as_bool() == Some(true) {
        if !arguments.json {
            eprintln!("accepted; the machine was {state}");
        }
        Ok(Exit::Done)
    } else {
        eprintln!("graver: refused: not possible while the machine is {state}");
        Ok(Exit::Stopped)
    }
}

/// Says what the pipeline is doing.
///
/// # Errors
/// No pipeline.
pub fn status(arguments: &InstanceArguments) -> Result<Exit, Failure> {
    let status = send(&Request::Status, arguments)?;
    if arguments.json {
        output::json(&status)?;
        return Ok(Exit::Done);
    }
    let text = |key: &str| status[key].as_str().unwrap_or("none").to_owned();
    eprintln!("state      {}", text("state"));
    eprintln!("job        {}", text("job"));
    eprintln!("planner    {}", text("planner"));
    eprintln!("played     {} of {} setpoints", status["played"], status["samples"]);
    eprintln!("stroke     {}", status["stroke"]);
    eprintln!("rate       {:.0} %", status["rate"].as_f64().unwrap_or(0.0) * 100.0);
    eprintln!("fault      {}", text("fault"));
    eprintln!("cycles     {}, {} overruns", status["cycles"], status["overruns"]);
    for (name, pid) in status["services"].as_object().into_iter().flatten() {
        match pid.as_i64() {
            Some(pid) => eprintln!("{name:<10} pid {pid}"),
            None => eprintln!("{name:<10} not running"),
        }
    }
    Ok(Exit::Done)
}

/// Hands a job to a running pipeline and follows it to its end.
///
/// # Errors
/// No pipeline, or a job that is refused.
pub fn submit(arguments: &SubmitArguments) -> Result<Exit, Failure> {
    let instance = Instance::new(&arguments.instance.instance).map_err(Failure::bad_input)?;
    let mut client = OperatorClient::connect(&instance).map_err(Failure::service)?;
    let whole = |path: &std::path::Path| absolute(path).unwrap_or_else(|_| path.to_owned());
    let out = match &arguments.out {
        Some(path) => whole(path),
        None => {
            let name = arguments.job.file_stem().unwrap_or_default().to_string_lossy();
            let here = std::env::current_dir().map_err(Failure::service)?;
            let folder = monitor::run_folder::RunFolder::create_below(&here, &name);
            folder.map_err(Failure::service)?.path().to_owned()
        }
    };
    let job = JobRequest { job: Some(whole(&arguments.job)), set: arguments.set.clone() };
    let request = Request::Submit { job, out: Some(out) };
    let line = ProgressLine::on_terminal();
    let request = serde_json::to_value(&request).map_err(Failure::service)?;
    let reply = client
        .follow(&request, |part| {
            line.draw(part["share"].as_f64().unwrap_or(0.0), "submitted job");
        })
        .map_err(Failure::service)?;
    line.clear();
    let summary: Summary = serde_json::from_value(checked(reply)?).map_err(Failure::service)?;
    output::summary(&summary, arguments.instance.json)
}

fn send(request: &Request, arguments: &InstanceArguments) -> Result<Value, Failure> {
    let instance = Instance::new(&arguments.instance).map_err(Failure::bad_input)?;
    let mut client = OperatorClient::connect(&instance).map_err(Failure::service)?;
    let request = serde_json::to_value(request).map_err(Failure::service)?;
    checked(client.request(&request).map_err(Failure::service)?)
}

fn checked(reply: Value) -> Result<Value, Failure> {
    if reply.is_null() {
        return Err(Failure::service("the pipeline ended before it answered"));
    }
    match reply["error"].as_str() {
        Some(error) if reply.get("outcome").is_none() => Err(Failure::service(error)),
        _ => Ok(reply),
    }
}
