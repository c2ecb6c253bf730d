//! Uploaded files: checked, looked at, submitted.

use super::{ApiError, answer, ask, blocking, parse};
use crate::context::Context;
use crate::pipeline::Description;
use crate::preview::{Previewer, check_changes};
use crate::spool::LARGEST;
use axum::body::{Body, Bytes};
use axum::extract::{Path, Query, State};
use axum::http::StatusCode;
use axum::response::Response;
use operator::{Queue, Request};
use planner::request::JobRequest;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Changes of a job.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Changes {
    /// `KEY=VALUE` each, as of `--set`.
    pub set: Vec<String>,
}

/// The number of a job in the queue.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub(crate) struct Number {
    /// It.
    pub number: u64,
}

/// Nothing to say.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub(crate) struct Nothing {}

/// The query of an upload.
#[derive(Debug, Deserialize)]
pub(crate) struct FileName {
    name: String,
}

pub(crate) async fn upload(
    State(context): State<Context>,
    Query(FileName { name }): Query<FileName>,
    body: Body,
) -> Result<Response, ApiError> {
    let too_many = "another file is being uploaded: wait a moment";
    // A file is in memory as it comes in.
    let Ok(_turn) = context.uploads.try_acquire() else {
        return Err(ApiError::new(StatusCode::TOO_MANY_REQUESTS, too_many));
    };
    let content = axum::body::to_bytes(body, LARGEST).await.map_err(|error| {
        let text =
            format!("a file has at most {} MiB, and must come whole: {error}", LARGEST >> 20);
        ApiError::new(StatusCode::PAYLOAD_TOO_LARGE, text)
    })?;
    let spool = context.spool.clone();
    Ok(answer(&blocking(move || Ok(spool.add(&name, &content)?)).await?))
}

pub(crate) async fn list(State(context): State<Context>) -> Result<Response, ApiError> {
    Ok(answer(&blocking(move || Ok(context.spool.files())).await?))
}

pub(crate) async fn remove(
    State(context): State<Context>,
    Path(id): Path<String>,
) -> Result<Response, ApiError> {
    blocking(move || {
        let path = context.spool.path(&id)?;
        // Without a pipeline nothing waits here; what its queue keeps on disk is told when it runs.
        if let Ok(queue) = context.pipeline.ask(&Request::Queue)
            && let Ok(queue) = serde_json::from_value::<Queue>(queue)
        {
            let path = path.display().to_string();
            let mut needed = queue.running.iter().chain(&queue.waiting);
            if let Some(job) = needed.find(|job| job.file.as_ref() == Some(&path)) {
                let text = format!("job {} in the queue needs this file", job.number);
                return Err(ApiError::new(StatusCode::CONFLICT, text));
            }
        }
        Ok(context.spool.remove(&id)?)
    })
    .await?;
    Ok(answer(&Nothing {}))
}

pub(crate) async fn check(
    State(context): State<Context>,
    Path(id): Path<String>,
    body: Bytes,
) -> Result<Response, ApiError> {
    let check = planned(context, id, parse(&body)?, Previewer::check).await?;
    Ok(answer(&*check))
}

pub(crate) async fn preview(
    State(context): State<Context>,
    Path(id): Path<String>,
    body: Bytes,
) -> Result<Response, ApiError> {
    match &*planned(context, id, parse(&body)?, Previewer::draw).await? {
        Ok(drawing) => Ok(answer(drawing)),
        Err(error) => Err(ApiError::new(StatusCode::UNPROCESSABLE_ENTITY, error.message.clone())),
    }
}

/// What `plan` says of an uploaded file, when its turn has come.
async fn planned<T: Send + Sync + 'static>(
    context: Context,
    id: String,
    changes: Changes,
    plan: fn(&Previewer, &std::path::Path, &[String], &Description) -> Arc<T>,
) -> Result<Arc<T>, ApiError> {
    check_changes(&changes.set).map_err(ApiError::bad)?;
    let Ok(turn) = context.plans.clone().try_acquire_owned() else {
        let text = "other jobs are being planned: wait a moment";
        return Err(ApiError::new(StatusCode::TOO_MANY_REQUESTS, text));
    };
    blocking(move || {
        let _turn = turn;
        let path = context.spool.path(&id)?;
        let machine = context.pipeline.describe().map_err(ApiError::unavailable)?;
        Ok(plan(&context.previewer, &path, &changes.set, &machine))
    })
    .await
}

pub(crate) async fn submit(
    State(context): State<Context>,
    Path(id): Path<String>,
    body: Bytes,
) -> Result<Response, ApiError> {
    let Changes { set } = parse(&body)?;
    check_changes(&set).map_err(ApiError::bad)?;
    let path = context.spool.path(&id)?;
    let job = JobRequest { job: Some(path), set, offsets: None, confined: true };
    let reply = ask(&context, Request::Submit { job, out: None, detached: true }).await?;
    number(&reply)
}

/// The number that a job got.
pub(crate) fn number(reply: &serde_json::Value) -> Result<Response, ApiError> {
    match reply["number"].as_u64() {
        Some(number) => Ok(answer(&Number { number })),
        None => Err(ApiError::unavailable("the pipeline gave the job no number")),
    }
}
