//! Hands a job to a running pipeline, and follows it if it shall.

use super::operator::checked;
use super::queue::say_held;
use crate::arguments::SubmitArguments;
use crate::exit::{Exit, Failure};
use crate::output::progress::{JobProgress, ProgressLine};
use crate::output::{self, say};
use monitor::summary::Summary;
use operator::{Part, Request, Status, Submitted};
use planner::request::JobRequest;
use runtime::socket::{ANSWER_PATIENCE, OperatorClient, SocketError};
use runtime::{Instance, message, signal};
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf, absolute};
use std::time::Duration;

/// How long the pipeline may take to say how far the job has come.
const STATUS_PATIENCE: Duration = Duration::from_millis(200);

/// Hands a job to a running pipeline and follows it to its end.
///
/// # Errors
/// No pipeline, or a job that is refused.
pub fn run(arguments: &SubmitArguments) -> Result<Exit, Failure> {
    let instance = Instance::new(&arguments.instance.instance).map_err(Failure::bad_input)?;
    let mut client = OperatorClient::connect(&instance).map_err(Failure::service)?;
    signal::install().map_err(Failure::service)?;
    let whole = |path: &Path| absolute(path).unwrap_or_else(|_| path.to_owned());
    // The offsets are those of the pipeline's machine, when the job's turn comes.
    let changes = arguments.options.overrides();
    let changes = changes.iter().map(|change| format!("{}={}", change.key, change.value));
    let set = arguments.set.iter().cloned().chain(changes).collect();
    let job = JobRequest { job: Some(whole(&arguments.job)), set, offsets: None, confined: false };
    let out = Some(run_folder(arguments)?);
    if arguments.detach {
        let request = Request::Submit { job, out, detached: true };
        let reply = client.request_within(&json!(request), ANSWER_PATIENCE);
        let reply = checked(reply.map_err(Failure::service)?)?;
        let submitted: Submitted = serde_json::from_value(reply).map_err(Failure::service)?;
        if arguments.instance.json {
            output::json(&submitted)?;
        } else {
            let number = submitted.number;
            say!(
                "job {number} waits for its turn; `graver queue list` and `graver status` tell of it"
            );
            say_held(&submitted);
        }
        return Ok(Exit::Done);
    }
    let mut follower = Follower { instance: &instance, job: None, told: 0 };
    let line = ProgressLine::begin();
    let request = json!(Request::Submit { job, out, detached: false });
    let reply =
        client.follow(&request, |part| follower.follow(part, &line)).map_err(Failure::service)?;
    line.clear();
    let reply = match reply {
        ControlFlow::Continue(reply) => checked(reply)?,
        ControlFlow::Break(message) => return Err(Failure::stopped(message)),
    };
    let summary: Summary = serde_json::from_value(reply).map_err(Failure::service)?;
    Ok(output::summary(&summary, arguments.instance.json))
}

/// The run folder, by a path that holds from anywhere.
fn run_folder(arguments: &SubmitArguments) -> Result<PathBuf, Failure> {
    if let Some(path) = &arguments.out {
        return Ok(absolute(path).unwrap_or_else(|_| path.clone()));
    }
    let name = arguments.job.file_stem().unwrap_or_default().to_string_lossy();
    let here = std::env::current_dir()
        .map_err(|error| Failure::bad_input(format!("the current directory: {error}")))?;
    let folder = monitor::run_folder::RunFolder::create_below(&here, &name);
    Ok(folder.map_err(Failure::bad_input)?.path().to_owned())
}

/// Follows a job that was submitted. A signal takes the job back and is told; a second one leaves
/// the job to come to rest alone.
struct Follower<'a> {
    instance: &'a Instance,
    job: Option<u64>,
    /// Signals that were heeded.
    told: u32,
}

impl Follower<'_> {
    fn progress(&self) -> Option<JobProgress> {
        // One that hangs must not keep a signal waiting.
        let mut client = OperatorClient::connect(self.instance).ok()?;
        let status = client.request_within(&json!(Request::Status), STATUS_PATIENCE).ok()?;
        let status: Status = serde_json::from_value(status).ok()?;
        if status.job_number == self.job {
            return Some(JobProgress::of(&status));
        }
        let state = match status.job_number {
            Some(number) => format!("job {} waits, job {number} is under way", self.job?),
            None => status.cause.unwrap_or_else(|| "waiting".to_owned()),
        };
        Some(JobProgress { state, ..JobProgress::default() })
    }

    fn follow(&mut self, part: Option<Value>, line: &ProgressLine) -> ControlFlow<String> {
        match part.map(serde_json::from_value) {
            Some(Ok(Part::Accepted(job))) => {
                self.job = Some(job);
                say!(
                    "job {job}: Ctrl-C stops it, a closed terminal does not; `submit --detach` follows no job, and \
                     `graver queue` shows it from anywhere"
                );
            }
            // How far it has come is in the status, with all else. Or it is a part of a later version, or none.
            Some(Ok(Part::Share(_)) | Err(_)) | None => {}
        }
        line.draw(|| self.progress());
        let termination = signal::termination();
        let signals = termination.map_or(0, |termination| termination.count);
        let Some(job) = self.job.filter(|_| signals > self.told) else {
            return ControlFlow::Continue(());
        };
        let before = std::mem::replace(&mut self.told, signals);
        line.clear();
        if termination.is_some_and(|it| it.is_closed_terminal()) {
            return ControlFlow::Break(format!("the terminal was closed; job {job} goes on"));
        }
        if before > 0 {
            return ControlFlow::Break(format!("job {job} comes to rest without being waited for"));
        }
        match withdraw(job, self.instance) {
            Ok(_) => message::tell(&format!(
                "stopping job {job}; another Ctrl-C leaves without waiting for it"
            )),
            Err(error) => {
                return ControlFlow::Break(format!("job {job} could not be stopped: {error}"));
            }
        }
        ControlFlow::Continue(())
    }
}

/// Takes a job back.
fn withdraw(job: u64, instance: &Instance) -> Result<(), SocketError> {
    let request = json!(Request::Withdraw { job });
    OperatorClient::connect(instance)?.request_within(&request, ANSWER_PATIENCE)?;
    Ok(())
}
