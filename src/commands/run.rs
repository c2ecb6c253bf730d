//! `graver run` and `graver domain`: a pipeline with a job, or one that waits for jobs.

use crate::arguments::{DomainArguments, RunArguments};
use crate::exit::{Exit, Failure};
use crate::files::Claim;
use crate::inputs::MachineSource;
use crate::pipeline::configuration::Configuration;
use crate::pipeline::job_run::JobRun;
use crate::pipeline::operators::{self, Submission};
use crate::pipeline::{POLL_INTERVAL, Pipeline, ServiceOwner};
use crate::{inputs, output};
use monitor::run_folder::RunFolder;
use runtime::{Instance, message, signal};
use std::path::Path;
use std::time::Instant;

/// Runs one job in a pipeline of its own.
///
/// # Errors
/// Bad input, an instance in use, a service that does not start, a folder that cannot be written.
pub fn run(arguments: &RunArguments) -> Result<Exit, Failure> {
    let started = Instant::now();
    let instance = Instance::new(&arguments.instance.instance).map_err(Failure::bad_input)?;
    let input = inputs::machine(&arguments.machine)?;
    let mut request = inputs::job_request(
        arguments.job.as_deref(),
        &input.machine,
        input.folder.as_deref(),
        &input.job_overrides,
    );
    request.offsets = input.source.offsets()?;
    // Read here only to refuse early; the planner reads it again.
    let job = request.read(&input.machine)?;
    let configuration = Configuration::new(input.source, &arguments.drives)?;
    // From here on a signal brings the machine to rest before it ends anything.
    signal::install().map_err(Failure::service)?;
    let mut pipeline = Pipeline::start(&instance, &configuration, ServiceOwner::Own)?;
    let folder = run_folder(arguments.out.as_deref(), &job.drawing.name)?;
    let claim = Claim::of(&folder)?;
    let request = request.absolute();
    let run = JobRun::prepare(&mut pipeline, &request, folder, started, None);
    let summary = run.map(|run| run.homing_first(arguments.home).follow());
    pipeline.shut_down();
    drop(claim);
    Ok(output::summary(&summary?, arguments.instance.json))
}

fn run_folder(out: Option<&Path>, job: &str) -> Result<RunFolder, Failure> {
    match out {
        Some(path) => RunFolder::create_at(path),
        None => RunFolder::create_below(Path::new("."), job),
    }
    .map_err(Failure::bad_input)
}

/// Holds a domain for services that somebody else starts, and runs the jobs that operators submit.
///
/// # Errors
/// Bad input, an instance in use, a channel that fails.
pub fn domain(arguments: &DomainArguments) -> Result<Exit, Failure> {
    let instance = Instance::new(&arguments.instance.instance).map_err(Failure::bad_input)?;
    let source = inputs::machine(&arguments.machine)?.source;
    // A damaged file of offsets is told before anything starts, and again with each job.
    if let Some(file) = source.offsets()? {
        file.offsets()?;
    }
    let configuration = Configuration::new(source.clone(), &arguments.drives)?;
    signal::install().map_err(Failure::service)?;
    let mut pipeline = Pipeline::start(&instance, &configuration, ServiceOwner::Others)?;
    message::tell(&format!("instance {} waits for its services and jobs", instance.name()));
    while signal::termination().is_none() {
        pipeline.poll()?;
        if let Some(submission) = pipeline.submission() {
            run_submission(&mut pipeline, &source, submission);
        }
        std::thread::sleep(POLL_INTERVAL);
    }
    pipeline.shut_down();
    Ok(Exit::Done)
}

/// Runs a submitted job to its end; whoever submitted it hears of it in any case.
fn run_submission(pipeline: &mut Pipeline, source: &MachineSource, submission: Submission) {
    let started = Instant::now();
    let (number, events) = (submission.number, submission.events.clone());
    let (mut job, out) = (submission.job.clone(), submission.out.clone());
    let ran = if pipeline.control.begin(number) {
        run_folder(out.as_deref(), "job").and_then(|folder| {
            job.offsets = source.offsets()?;
            let _claim = Claim::of(&folder)?;
            let run = JobRun::prepare(pipeline, &job, folder, started, Some(submission))?;
            Ok(run.follow())
        })
    } else {
        Err(Failure::stopped("the job was withdrawn before its turn came"))
    };
    if let Err(failure) = ran {
        message::tell(failure.refusal.text.trim());
        pipeline.control.end();
        operators::tell_end(&events, &failure.summary());
    }
}
