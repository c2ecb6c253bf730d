//! Metrics, the description, logging in, and the page.

use super::{ApiError, answer};
use crate::access::Peer;
use crate::assets::asset;
use crate::context::Context;
use crate::{metrics, openapi};
use axum::extract::{Extension, Query, State};
use axum::http::header::{CONTENT_TYPE, LOCATION, SET_COOKIE};
use axum::http::{HeaderMap, Method, StatusCode, Uri};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;

/// The query of a login.
#[derive(Debug, Deserialize)]
pub(crate) struct Token {
    token: String,
}

pub(crate) async fn metrics(State(context): State<Context>) -> Response {
    ([(CONTENT_TYPE, metrics::CONTENT_TYPE)], context.metrics.text()).into_response()
}

pub(crate) async fn openapi() -> Response {
    answer(&openapi::document())
}

pub(crate) async fn login(
    State(context): State<Context>,
    Extension(peer): Extension<Peer>,
    Query(Token { token }): Query<Token>,
) -> Result<Response, ApiError> {
    let cookie = context.access.login(&peer, &token)?;
    let headers = [(LOCATION, "/".to_owned()), (SET_COOKIE, cookie)];
    Ok((StatusCode::SEE_OTHER, headers).into_response())
}

/// The page, and what is not there.
pub(crate) async fn page(method: Method, uri: Uri, headers: HeaderMap) -> Response {
    let is_asked = matches!(method, Method::GET | Method::HEAD);
    match asset(uri.path(), &headers).filter(|_| is_asked) {
        Some(response) => response,
        None => {
            ApiError::absent(format!("there is nothing at {method} {}", uri.path())).into_response()
        }
    }
}
