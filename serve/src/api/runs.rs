//! The jobs that have ended, and what they left.

use super::{ApiError, answer, ask, blocking};
use crate::assets::content_type;
use crate::context::Context;
use axum::extract::{Path, State};
use axum::http::header::{CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE};
use axum::response::{IntoResponse, Response};
use messages::run_folder;
use operator::{Queue, QueuedJob, Request};
use schemars::JsonSchema;
use serde::Serialize;
use std::fs::File;
use std::io::Read;
use std::path::PathBuf;

/// The files of a run that are handed out.
pub(crate) const FILES: [&str; 3] = [run_folder::REPORT, run_folder::SUMMARY, run_folder::PICTURE];

/// The largest that is [bytes].
const LARGEST: u64 = 256 << 20;

/// A report is a page of its own, with its styles and scripts in it; it is nobody here, and can ask nothing.
const POLICY: &str = "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; \
                      style-src 'unsafe-inline'; img-src data:";

/// A job that has ended.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Run {
    /// Its number.
    pub n: u64,
    /// The job's name.
    pub name: String,
    /// How it ended; null of one that never began.
    pub outcome: Option<String>,
    /// When it was begun, in seconds since 1970.
    pub started: Option<u64>,
    /// When it ended.
    pub ended: Option<u64>,
    /// How long it took [s].
    pub time: Option<u64>,
    /// Why it ended so; null where there is nothing to say.
    pub message: Option<String>,
    /// The files of its run folder that can be asked for.
    pub files: Vec<String>,
}

impl Run {
    fn of(job: &QueuedJob) -> Self {
        let has = |file: &&&str| {
            let folder = job.out.as_ref().map(PathBuf::from);
            folder.is_some_and(|folder| folder.join(file).is_file())
        };
        Self {
            n: job.number,
            name: job.name.clone(),
            outcome: job.outcome.clone(),
            started: job.started,
            ended: job.ended,
            time: job.ended.zip(job.started).map(|(ended, started)| ended.saturating_sub(started)),
            message: job.message.clone(),
            files: FILES.iter().filter(has).map(|file| (*file).to_owned()).collect(),
        }
    }
}

async fn ended(context: &Context) -> Result<Vec<QueuedJob>, ApiError> {
    let queue = ask(context, Request::Queue).await?;
    let queue: Queue = serde_json::from_value(queue)
        .map_err(|error| ApiError::unavailable(format!("the pipeline's queue: {error}")))?;
    Ok(queue.ended)
}

pub(crate) async fn list(State(context): State<Context>) -> Result<Response, ApiError> {
    let ended = ended(&context).await?;
    let runs = blocking(move || Ok(ended.iter().rev().map(Run::of).collect::<Vec<_>>())).await?;
    Ok(answer(&runs))
}

pub(crate) async fn file(
    State(context): State<Context>,
    Path((number, name)): Path<(u64, String)>,
) -> Result<Response, ApiError> {
    let Some(name) = FILES.into_iter().find(|file| *file == name) else {
        let files = FILES.join(", ");
        return Err(ApiError::absent(format!("a run has the files {files}")));
    };
    let job = ended(&context).await?.into_iter().find(|job| job.number == number);
    let folder = job.and_then(|job| job.out);
    let Some(folder) = folder else {
        return Err(ApiError::absent(format!("no run {number} is known")));
    };
    let content = blocking(move || read(&PathBuf::from(folder).join(name))).await?;
    let headers = [
        (CONTENT_TYPE, content_type(name)),
        (CONTENT_SECURITY_POLICY, POLICY),
        (CACHE_CONTROL, "no-cache"),
    ];
    Ok((headers, content).into_response())
}

fn read(path: &std::path::Path) -> Result<Vec<u8>, ApiError> {
    let absent = || ApiError::absent("this run left no such file");
    if !path.is_file() {
        return Err(absent());
    }
    let mut content = Vec::new();
    let file = File::open(path).map_err(|_| absent())?;
    let read = file.take(LARGEST + 1).read_to_end(&mut content);
    read.map_err(|error| ApiError::unavailable(format!("the file of the run: {error}")))?;
    if content.len() as u64 > LARGEST {
        return Err(ApiError::unavailable(format!("it has more than {} MiB", LARGEST >> 20)));
    }
    Ok(content)
}
