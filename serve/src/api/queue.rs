//! The queue of jobs.

use super::jobs::{Nothing, number};
use super::{ApiError, answer, ask, parse};
use crate::context::Context;
use axum::body::Bytes;
use axum::extract::{Path, State};
use axum::response::Response;
use operator::Request;
use schemars::JsonSchema;
use serde::Deserialize;

/// A place in the queue.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Place {
    /// From 1, the next one.
    pub place: usize,
}

pub(crate) async fn queue(State(context): State<Context>) -> Result<Response, ApiError> {
    Ok(answer(&ask(&context, Request::Queue).await?))
}

pub(crate) async fn hold(State(context): State<Context>) -> Result<Response, ApiError> {
    Ok(answer(&ask(&context, Request::HoldQueue).await?))
}

pub(crate) async fn start(State(context): State<Context>) -> Result<Response, ApiError> {
    Ok(answer(&ask(&context, Request::StartQueue).await?))
}

pub(crate) async fn cancel(
    State(context): State<Context>,
    Path(job): Path<u64>,
) -> Result<Response, ApiError> {
    ask(&context, Request::Withdraw { job }).await?;
    Ok(answer(&Nothing {}))
}

pub(crate) async fn move_to(
    State(context): State<Context>,
    Path(job): Path<u64>,
    body: Bytes,
) -> Result<Response, ApiError> {
    let Place { place } = parse(&body)?;
    ask(&context, Request::Move { job, place }).await?;
    Ok(answer(&Nothing {}))
}

pub(crate) async fn repeat(
    State(context): State<Context>,
    Path(job): Path<u64>,
) -> Result<Response, ApiError> {
    number(&ask(&context, Request::Repeat { job }).await?)
}
