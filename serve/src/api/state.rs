//! What is: status, machine, faults, latencies, signals.

use super::{ApiError, answer, ask};
use crate::advice::advice;
use crate::context::Context;
use axum::extract::State;
use axum::response::Response;
use operator::{PastFault, Request};
use schemars::JsonSchema;
use serde::Serialize;

/// A fault, and what to do about it.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub(crate) struct ToldFault {
    /// The fault.
    #[serde(flatten)]
    pub fault: PastFault,
    /// What to do about it; null where there is nothing to say.
    pub advice: Option<String>,
}

pub(crate) async fn status(State(context): State<Context>) -> Result<Response, ApiError> {
    Ok(answer(&ask(&context, Request::Status).await?))
}

pub(crate) async fn machine(State(context): State<Context>) -> Result<Response, ApiError> {
    match context.hub.machine() {
        Some(machine) => Ok(answer(&*machine)),
        None => Err(ApiError::unavailable("no pipeline has been found yet")),
    }
}

pub(crate) async fn faults(State(context): State<Context>) -> Result<Response, ApiError> {
    let status = ask(&context, Request::Status).await?;
    let faults: Vec<PastFault> =
        serde_json::from_value(status["faults"].clone()).unwrap_or_default();
    let told = faults.into_iter().map(|fault| {
        let advice = advice(&fault.code).map(str::to_owned);
        ToldFault { fault, advice }
    });
    Ok(answer(&told.collect::<Vec<_>>()))
}

pub(crate) async fn latency(State(context): State<Context>) -> Response {
    answer(&context.hub.latency())
}

pub(crate) async fn signals(State(context): State<Context>) -> Response {
    answer(&*context.hub.signals())
}
