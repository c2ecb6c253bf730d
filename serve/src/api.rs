//! What each request is answered with.

pub(crate) mod artwork;
pub(crate) mod guard;
pub(crate) mod jobs;
pub(crate) mod queue;
pub(crate) mod requests;
pub(crate) mod runs;
pub(crate) mod state;
pub(crate) mod system;

use crate::access::Denied;
use crate::context::Context;
use crate::spool::SpoolError;
use axum::Json;
use axum::http::StatusCode;
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE};
use axum::response::{IntoResponse, Response};
use operator::{ClientError, Request};
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// What a request is answered with that could not be done.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub(crate) struct ErrorBody {
    /// Why, and what would be right.
    pub error: String,
}

/// Why a request could not be done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ApiError {
    status: StatusCode,
    text: String,
}

impl ApiError {
    pub(crate) fn new(status: StatusCode, text: impl Into<String>) -> Self {
        Self { status, text: text.into() }
    }

    pub(crate) fn bad(text: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, text)
    }

    pub(crate) fn absent(text: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, text)
    }

    pub(crate) fn unavailable(text: impl Into<String>) -> Self {
        Self::new(StatusCode::SERVICE_UNAVAILABLE, text)
    }
}

impl std::fmt::Display for ApiError {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(&self.text)
    }
}

impl IntoResponse for ApiError {
    fn into_response(self) -> Response {
        (self.status, answer(&ErrorBody { error: self.text })).into_response()
    }
}

impl From<ClientError> for ApiError {
    fn from(error: ClientError) -> Self {
        let status = match error {
            // It is there, and says that this cannot be done.
            ClientError::Refused(_) => StatusCode::CONFLICT,
            ClientError::Socket(_) | ClientError::Unheard { .. } | ClientError::Unreadable(_) => {
                StatusCode::SERVICE_UNAVAILABLE
            }
        };
        Self::new(status, error.to_string())
    }
}

impl From<SpoolError> for ApiError {
    fn from(error: SpoolError) -> Self {
        let status = match error {
            SpoolError::Unknown(_) => StatusCode::NOT_FOUND,
            SpoolError::Name(_) | SpoolError::Empty => StatusCode::BAD_REQUEST,
            SpoolError::Full { .. } => StatusCode::PAYLOAD_TOO_LARGE,
            SpoolError::Io { .. } => StatusCode::SERVICE_UNAVAILABLE,
        };
        Self::new(status, error.to_string())
    }
}

impl From<Denied> for ApiError {
    fn from(error: Denied) -> Self {
        let status = match error {
            Denied::NoToken | Denied::WrongToken => StatusCode::UNAUTHORIZED,
            Denied::Host | Denied::Watcher | Denied::Foreign => StatusCode::FORBIDDEN,
            Denied::TooMany => StatusCode::TOO_MANY_REQUESTS,
        };
        Self::new(status, error.to_string())
    }
}

/// JSON that is of now.
pub(crate) fn answer(value: &impl Serialize) -> Response {
    match serde_json::to_vec(value) {
        Ok(bytes) => {
            let headers = [(CONTENT_TYPE, "application/json"), (CACHE_CONTROL, "no-store")];
            (headers, bytes).into_response()
        }
        Err(error) => {
            let body = Json(ErrorBody { error: error.to_string() });
            (StatusCode::INTERNAL_SERVER_ERROR, body).into_response()
        }
    }
}

/// What a request brings: nothing is an empty object.
pub(crate) fn parse<T: DeserializeOwned>(body: &[u8]) -> Result<T, ApiError> {
    let body = if body.iter().all(u8::is_ascii_whitespace) { b"{}" } else { body };
    serde_json::from_slice(body).map_err(|error| ApiError::bad(format!("the body: {error}")))
}

/// Does what may wait on another thread.
pub(crate) async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, ApiError> + Send + 'static,
) -> Result<T, ApiError> {
    let done = tokio::task::spawn_blocking(work).await;
    done.map_err(|error| ApiError::new(StatusCode::INTERNAL_SERVER_ERROR, error.to_string()))?
}

/// Asks the pipeline.
pub(crate) async fn ask(context: &Context, request: Request) -> Result<Value, ApiError> {
    let pipeline = context.pipeline.clone();
    blocking(move || Ok(pipeline.ask(&request)?)).await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Default, PartialEq, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    struct Body {
        value: f64,
    }

    #[test]
    fn no_body_is_an_empty_one_and_a_wrong_one_is_told_where() {
        assert_eq!(parse::<Body>(b" \n"), Ok(Body::default()));
        assert_eq!(parse::<Body>(br#"{"value":2}"#), Ok(Body { value: 2.0 }));
        for (body, word) in [(&br#"{"valu":2}"#[..], "valu"), (b"{", "line 1"), (b"2", "body")] {
            let error = parse::<Body>(body).map_err(|error| error.text);
            assert!(error.as_ref().is_err_and(|text| text.contains(word)), "{error:?}");
        }
    }
}
