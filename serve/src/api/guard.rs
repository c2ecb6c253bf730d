//! What every request passes before it is answered.

use super::ApiError;
use crate::access::{Access, Denied, Peer, Right};
use crate::assets::GUARDS;
use crate::context::Context;
use crate::spool::LARGEST;
use axum::extract::{Extension, Request, State};
use axum::http::header::CONTENT_LENGTH;
use axum::http::{HeaderValue, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::time::Duration;

/// The longest that a request may take, an upload and a plan included.
const PATIENCE: Duration = Duration::from_secs(180);

/// The largest body that is not a file [bytes].
pub(crate) const LARGEST_BODY: usize = 256 << 10;

/// Where files come to.
const UPLOADS: &str = "/api/v1/jobs";

/// Requests that are never too many: whoever stops the machine is not to wait.
const NEVER_TOO_MANY: [&str; 2] = ["/api/v1/requests/stop", "/api/v1/requests/hold"];

/// Admits a request, or says why not. What its sender may do goes with it.
pub(crate) async fn admit(
    State(context): State<Context>,
    Extension(peer): Extension<Peer>,
    mut request: Request,
    next: Next,
) -> Response {
    if let Some(most) = too_large(&request) {
        let text = format!("this takes a body of at most {most} bytes");
        let refused = ApiError::new(StatusCode::PAYLOAD_TOO_LARGE, text).into_response();
        return guarded(&context, refused);
    }
    let admitted = admitted(&context.access, &peer, &request);
    let response = match admitted {
        Ok(right) => {
            request.extensions_mut().insert(right);
            match tokio::time::timeout(PATIENCE, next.run(request)).await {
                Ok(response) => response,
                Err(_) => {
                    let text = format!("this took longer than {} s", PATIENCE.as_secs());
                    ApiError::new(StatusCode::REQUEST_TIMEOUT, text).into_response()
                }
            }
        }
        Err(denied) => ApiError::from(denied).into_response(),
    };
    guarded(&context, response)
}

/// The most that the body of a request may have, of one that says that it has more: nothing of it need come first.
fn too_large(request: &Request) -> Option<usize> {
    let most = if request.uri().path() == UPLOADS { LARGEST } else { LARGEST_BODY };
    let length = request.headers().get(CONTENT_LENGTH).and_then(|it| it.to_str().ok());
    let length: usize = length.and_then(|it| it.parse().ok())?;
    (length > most).then_some(most)
}

fn admitted(access: &Access, peer: &Peer, request: &Request) -> Result<Option<Right>, Denied> {
    let right = access.right(peer, request.headers())?;
    if Access::is_change(request.method()) {
        match access.admit_change(peer, request.headers()) {
            Err(Denied::TooMany) if NEVER_TOO_MANY.contains(&request.uri().path()) => {}
            admitted => admitted?,
        }
    }
    Ok(right)
}

fn guarded(context: &Context, mut response: Response) -> Response {
    for (name, value) in GUARDS {
        response.headers_mut().entry(name).or_insert(HeaderValue::from_static(value));
    }
    let refused = [StatusCode::UNAUTHORIZED, StatusCode::FORBIDDEN, StatusCode::TOO_MANY_REQUESTS];
    context.metrics.answered(refused.contains(&response.status()));
    response
}

/// Lets through who may do what a route needs.
pub(crate) async fn require(
    State(needs): State<Option<Right>>,
    Extension(right): Extension<Option<Right>>,
    request: Request,
    next: Next,
) -> Response {
    match (needs, right) {
        (Some(_), None) => ApiError::from(Denied::NoToken).into_response(),
        (Some(needs), Some(right)) if right < needs => {
            ApiError::from(Denied::Watcher).into_response()
        }
        _ => next.run(request).await,
    }
}
