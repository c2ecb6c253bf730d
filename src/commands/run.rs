//! `graver run` and `graver domain`: a pipeline with a job, or one that waits for jobs.

use crate::arguments::{DomainArguments, RunArguments};
use crate::commands::fleet;
use crate::exit::{Exit, Failure};
use crate::files::{Claim, Sources};
use crate::inputs::MachineSource;
use crate::pipeline::configuration::Configuration;
use crate::pipeline::job_run::{JobRun, job_name};
use crate::pipeline::queue::Entry;
use crate::pipeline::{JobSource, POLL_INTERVAL, Pipeline, ServiceOwner};
use crate::{inputs, notify, output};
use monitor::run_folder::RunFolder;
use runtime::{Instance, message, signal};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Runs one job in a pipeline of its own.
///
/// # Errors
/// Bad input, an instance in use, a service that does not start, a folder that cannot be written.
pub fn run(arguments: &RunArguments) -> Result<Exit, Failure> {
    let started = Instant::now();
    let shared = &arguments.pipeline;
    let instance = Instance::new(&shared.instance.instance).map_err(Failure::bad_input)?;
    let input = inputs::machine(&shared.machine)?.with(&arguments.options);
    let mut request = inputs::job_request(
        arguments.job.as_deref(),
        &input.machine,
        input.folder.as_deref(),
        &input.job_overrides,
    );
    request.offsets = input.source.offsets()?;
    // Read here only to refuse early; the planner reads it again.
    let job = request.read(&input.machine)?;
    let sources = Sources::new(shared.machine.machine.as_deref(), &job.files);
    sources.spare(arguments.out.as_deref())?;
    let configuration = Configuration::new(input.source, &shared.drives, shared.extent())?;
    // From here on a signal brings the machine to rest before it ends anything, and a terminal that closes does not end
    // the job.
    signal::outlive_terminal().map_err(Failure::service)?;
    signal::install().map_err(Failure::service)?;
    let mut pipeline =
        Pipeline::start(&instance, &configuration, ServiceOwner::Own, JobSource::Own)?;
    pipeline.serve(&shared.access)?;
    let folder = run_folder(arguments.out.as_deref(), Path::new("."), &job.drawing.name)?;
    let claim = Claim::of(&folder)?;
    let request = request.absolute();
    let number = pipeline.queue.begin_own(&request, folder.path(), &pipeline.control);
    let run = JobRun::prepare(&mut pipeline, &request, folder, started, number);
    let summary = run.map(|run| run.homing_first(arguments.home).follow());
    if let Err(failure) = &summary {
        pipeline.queue.end(&failure.summary());
    }
    pipeline.shut_down();
    drop(claim);
    Ok(output::summary(&summary?, shared.instance.json))
}

fn run_folder(out: Option<&Path>, below: &Path, job: &str) -> Result<RunFolder, Failure> {
    match out {
        Some(path) => RunFolder::create_at(path),
        None => RunFolder::create_below(below, job),
    }
    .map_err(Failure::bad_input)
}

/// Holds a domain, with services of its own or for those that somebody else starts, and runs the jobs that operators
/// submit.
///
/// # Errors
/// Bad input, an instance in use, a channel that fails, a service of its own that has died.
pub fn domain(arguments: &DomainArguments) -> Result<Exit, Failure> {
    let shared = &arguments.pipeline;
    let instance = Instance::new(&shared.instance.instance).map_err(Failure::bad_input)?;
    let source = inputs::machine(&shared.machine)?.source;
    // A damaged file of offsets is told before anything starts, and again with each job.
    if let Some(file) = source.offsets()? {
        file.offsets()?;
    }
    fleet::check(&arguments.publish, &instance)?;
    let configuration = Configuration::new(source.clone(), &shared.drives, shared.extent())?;
    let configuration = configuration.publishing(&arguments.publish)?;
    signal::outlive_terminal().map_err(Failure::service)?;
    signal::install().map_err(Failure::service)?;
    let owner = if arguments.services { ServiceOwner::Own } else { ServiceOwner::Others };
    let mut pipeline = Pipeline::start(&instance, &configuration, owner, JobSource::Submitted)?;
    pipeline.serve(&shared.access)?;
    let awaited = if arguments.services { "jobs" } else { "its services and jobs" };
    let waits = format!("instance {} waits for {awaited}", instance.name());
    message::tell(&waits);
    notify::watch().map_err(Failure::service)?;
    notify::ready(&waits);
    if let Some(why) = pipeline.queue.held() {
        let waiting = pipeline.queue.list().waiting.len();
        message::tell(&format!(
            "{waiting} jobs wait, and the queue is held: {why}; `graver queue start` begins them"
        ));
    }
    while signal::termination().is_none() {
        for ended in pipeline.poll()? {
            message::tell(&ended.to_string());
        }
        if let Some(ended) = pipeline.lost() {
            return Err(Failure::service(format!("{ended}; the pipeline ends")));
        }
        if let Some(entry) = pipeline.queue.begin_next(&pipeline.control) {
            notify::status(&format!("job {}", entry.job.number));
            run_submission(&mut pipeline, &source, &entry);
            notify::status(&waits);
        }
        std::thread::sleep(POLL_INTERVAL);
    }
    notify::stopping();
    pipeline.shut_down();
    Ok(Exit::Done)
}

/// Runs a submitted job to its end; whoever submitted it hears of it in any case.
fn run_submission(pipeline: &mut Pipeline, source: &MachineSource, entry: &Entry) {
    let started = Instant::now();
    let mut job = entry.request();
    let below = entry.below.as_deref().unwrap_or(Path::new("."));
    let folder = run_folder(entry.job.out.as_deref().map(Path::new), below, &job_name(&job));
    let ran = folder.and_then(|folder| {
        pipeline.queue.note_folder(folder.path());
        let files: Vec<PathBuf> = job.job.iter().cloned().collect();
        Sources::new(source.path().as_deref(), &files).spare(Some(folder.path()))?;
        job.offsets = source.offsets()?;
        let _claim = Claim::of(&folder)?;
        let run = JobRun::prepare(pipeline, &job, folder, started, entry.job.number)?;
        Ok(run.follow())
    });
    if let Err(failure) = ran {
        message::tell(failure.refusal.text.trim());
        pipeline.control.end();
        pipeline.queue.end(&failure.summary());
    }
}
