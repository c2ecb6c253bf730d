//! `graver run` and `graver domain`: a pipeline with a job, or one that waits for jobs.

use crate::arguments::{DomainArguments, RunArguments};
use crate::exit::{Exit, Failure};
use crate::pipeline::configuration::Configuration;
use crate::pipeline::job_run::JobRun;
use crate::pipeline::operators::News;
use crate::pipeline::{LOOK, Pipeline, Starter};
use crate::{inputs, output};
use monitor::run_folder::RunFolder;
use runtime::{Instance, signal};
use serde_json::json;
use std::path::Path;
use std::time::Instant;

/// Runs one job in a pipeline of its own.
///
/// # Errors
/// Bad input, an instance in use, a service that does not start, a folder that cannot be written.
pub fn run(arguments: &RunArguments) -> Result<Exit, Failure> {
    let started = Instant::now();
    signal::install().map_err(Failure::service)?;
    let instance = Instance::new(&arguments.instance.instance).map_err(Failure::bad_input)?;
    let input = inputs::machine(&arguments.machine)?;
    let request = inputs::job_request(
        arguments.job.as_deref(),
        &input.machine,
        input.folder.as_deref(),
        &input.job_overrides,
    );
    // Read here only to refuse early; the planner reads it again.
    let job = request.read(&input.machine)?;
    let configuration = Configuration::new(input.source, &arguments.drives)?;
    let mut pipeline = Pipeline::start(&instance, configuration, Starter::Own)?;
    let folder = run_folder(arguments.out.as_deref(), &job.drawing.name)?;
    let request = request.absolute();
    let summary =
        JobRun::offer(&mut pipeline, &request, folder, started, None).and_then(JobRun::follow);
    pipeline.shut_down();
    output::summary(&summary?, arguments.instance.json)
}

fn run_folder(out: Option<&Path>, job: &str) -> Result<RunFolder, Failure> {
    match out {
        Some(path) => RunFolder::create_at(path),
        None => RunFolder::create_below(Path::new("."), job),
    }
    .map_err(Failure::service)
}

/// Holds a domain for services that somebody else starts, and runs the jobs that operators submit.
///
/// # Errors
/// Bad input, an instance in use, a channel that fails.
pub fn domain(arguments: &DomainArguments) -> Result<Exit, Failure> {
    signal::install().map_err(Failure::service)?;
    let instance = Instance::new(&arguments.instance.instance).map_err(Failure::bad_input)?;
    let source = inputs::machine(&arguments.machine)?.source;
    let configuration = Configuration::new(source, &arguments.drives)?;
    let mut pipeline = Pipeline::start(&instance, configuration, Starter::Others)?;
    eprintln!("graver: instance {} waits for its services and jobs", instance.name());
    while signal::termination().is_none() {
        pipeline.look()?;
        if let Some(submission) = pipeline.submission() {
            let started = Instant::now();
            let news = submission.news.clone();
            let ran = pipeline.enable().and_then(|()| {
                let folder = run_folder(submission.out.as_deref(), "job")?;
                let job = submission.job.clone();
                JobRun::offer(&mut pipeline, &job, folder, started, Some(submission))?.follow()
            });
            if let Err(failure) = ran {
                eprintln!("graver: {}", failure.refusal.text.trim());
                let _ = news.send(News::End(json!({ "error": failure.refusal.message })));
            }
        }
        std::thread::sleep(LOOK);
    }
    pipeline.shut_down();
    Ok(Exit::Done)
}
