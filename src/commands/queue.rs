//! The jobs of an instance: those that wait, the one under way, and those that have ended.

use super::operator::{checked, connect};
use crate::arguments::{InstanceArguments, QueueCommand};
use crate::exit::{Exit, Failure};
use crate::output::{self, say};
use monitor::run_folder::local_time;
use operator::{Queue, QueuedJob, Request, Submitted};
use runtime::socket::ANSWER_PATIENCE;
use serde::de::DeserializeOwned;
use serde_json::json;

/// Jobs that have ended and are listed.
const ENDED_SHOWN: usize = 10;

/// Asks for the jobs, or changes what waits.
///
/// # Errors
/// No pipeline, or no such job.
pub fn run(command: &QueueCommand) -> Result<Exit, Failure> {
    match command {
        QueueCommand::List(arguments) => show(&Request::Queue, arguments),
        QueueCommand::Cancel(job) => show(&Request::Withdraw { job: job.number }, &job.instance),
        QueueCommand::Move(it) => {
            show(&Request::Move { job: it.number, place: it.place }, &it.instance)
        }
        QueueCommand::Repeat(job) => repeat(job.number, &job.instance),
        QueueCommand::Hold(arguments) => hold(arguments),
        QueueCommand::Start(arguments) => show(&Request::StartQueue, arguments),
    }
}

fn show(request: &Request, arguments: &InstanceArguments) -> Result<Exit, Failure> {
    tell(&ask(request, arguments)?, arguments)
}

fn hold(arguments: &InstanceArguments) -> Result<Exit, Failure> {
    let queue: Queue = ask(&Request::HoldQueue, arguments)?;
    let exit = tell(&queue, arguments)?;
    if queue.held.is_none() && !arguments.json {
        say!("no job waits, so nothing is held: the next job that is submitted begins at once");
    }
    Ok(exit)
}

fn tell(queue: &Queue, arguments: &InstanceArguments) -> Result<Exit, Failure> {
    if arguments.json {
        output::json(queue)?;
        return Ok(Exit::Done);
    }
    let beyond = queue.ended.len().saturating_sub(ENDED_SHOWN);
    if beyond > 0 {
        say!("{beyond} others have ended before these");
    }
    let told = queue.ended[beyond..].iter().chain(&queue.running).chain(&queue.waiting);
    let mut is_empty = true;
    for job in told {
        is_empty = false;
        say!("{}", line(job));
    }
    if is_empty {
        say!("no jobs");
    }
    if let Some(why) = &queue.held {
        say!("the queue is held: {why}; `graver queue start` begins what waits");
    }
    Ok(Exit::Done)
}

fn repeat(job: u64, arguments: &InstanceArguments) -> Result<Exit, Failure> {
    let submitted: Submitted = ask(&Request::Repeat { job }, arguments)?;
    if arguments.json {
        output::json(&submitted)?;
    } else {
        say!("job {} is job {job} once more", submitted.number);
        say_held(&submitted);
    }
    Ok(Exit::Done)
}

/// Says why a job that was submitted does not begin by itself, if so.
pub(super) fn say_held(submitted: &Submitted) {
    if let Some(why) = &submitted.held {
        say!("the queue is held: {why}; `graver queue start` begins what waits");
    }
}

/// Asks the pipeline; what it cannot do is a check that failed.
fn ask<T: DeserializeOwned>(
    request: &Request,
    arguments: &InstanceArguments,
) -> Result<T, Failure> {
    let mut client = connect(arguments)?;
    let reply = client.request_within(&json!(request), ANSWER_PATIENCE);
    let reply = checked(reply.map_err(Failure::service)?)
        .map_err(|failure| Failure::stopped(failure.refusal.message))?;
    serde_json::from_value(reply).map_err(Failure::service)
}

/// A job in one line.
fn line(job: &QueuedJob) -> String {
    let QueuedJob { number, name, submitted, started, ended, outcome, message, out, .. } = job;
    let state = match (outcome, started) {
        (Some(outcome), _) => outcome.as_str(),
        (None, Some(_)) => "running",
        (None, None) => "waiting",
    };
    let since = local_time(ended.or(*started).unwrap_or(*submitted));
    let set = job.set.iter().map(|change| format!(" {change}")).collect::<String>();
    let out = out.as_ref().map(|out| format!("  {out}")).unwrap_or_default();
    let message = message.as_ref().map(|message| format!("\n      {message}")).unwrap_or_default();
    format!("{number:>4}  {state:<9}  {since}  {name}{set}{out}{message}")
}
