//! The page: its files are part of the program.

use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, ETAG, IF_NONE_MATCH, REFERRER_POLICY,
    X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{HeaderMap, HeaderName, StatusCode};
use axum::response::{IntoResponse, Response};
use rust_embed::Embed;

/// Nothing but what comes from here, in no frame of somebody else's.
const POLICY: &str = "default-src 'self'; object-src 'none'; base-uri 'none'; form-action 'self'; \
                      frame-ancestors 'self'";

/// What a file without a known ending is taken for.
const UNKNOWN: &str = "application/octet-stream";

#[derive(Embed)]
#[folder = "assets"]
struct Assets;

/// Headers of everything that is sent.
pub(crate) const GUARDS: [(HeaderName, &str); 2] =
    [(X_CONTENT_TYPE_OPTIONS, "nosniff"), (REFERRER_POLICY, "no-referrer")];

/// The file of the page at `path`, `/` being the page itself; `None` where there is none.
pub fn asset(path: &str, headers: &HeaderMap) -> Option<Response> {
    let name = match path.trim_start_matches('/') {
        "" => "index.html",
        name => name,
    };
    let file = Assets::get(name)?;
    let hash = file.metadata.sha256_hash();
    let digits: String = hash.iter().take(16).map(|byte| format!("{byte:02x}")).collect();
    let tag = format!("\"{digits}\"");
    let asked = headers.get(IF_NONE_MATCH).and_then(|it| it.to_str().ok());
    let is_known = asked.is_some_and(|asked| asked.split(',').any(|it| it.trim() == tag));
    // The browser asks each time, and is told in a few bytes that nothing has changed.
    let common =
        [(ETAG, tag.as_str()), (CACHE_CONTROL, "no-cache"), (CONTENT_SECURITY_POLICY, POLICY)];
    if is_known {
        return Some((StatusCode::NOT_MODIFIED, common).into_response());
    }
    let kind = content_type(name);
    Some((common, [(CONTENT_TYPE, kind)], file.data.into_owned()).into_response())
}

/// What a file is, by its ending.
pub(crate) fn content_type(name: &str) -> &'static str {
    match name.rsplit_once('.').map(|(_, ending)| ending) {
        Some("html") => "text/html; charset=utf-8",
        Some("js" | "mjs") => "text/javascript; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("json") => "application/json",
        Some("svg") => "image/svg+xml",
        Some("png") => "image/png",
        Some("ico") => "image/x-icon",
        Some("woff2") => "font/woff2",
        Some("txt" | "md") => "text/plain; charset=utf-8",
        Some("webmanifest") => "application/manifest+json",
        _ => UNKNOWN,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use axum::http::HeaderValue;

    #[test]
    fn every_file_of_the_page_has_a_type_a_policy_and_a_tag_that_is_heeded() {
        for name in Assets::iter() {
            let response = asset(&format!("/{name}"), &HeaderMap::new()).unwrap();
            let text = |key: HeaderName| response.headers()[key].to_str().unwrap().to_owned();
            assert_ne!(text(CONTENT_TYPE), UNKNOWN, "{name}");
            assert!(text(CONTENT_SECURITY_POLICY).contains("default-src 'self'"));
            let mut asked = HeaderMap::new();
            let tag = HeaderValue::from_str(&format!("\"other\", {}", text(ETAG))).unwrap();
            asked.insert(IF_NONE_MATCH, tag);
            let again = asset(&format!("/{name}"), &asked).unwrap();
            assert_eq!(again.status(), StatusCode::NOT_MODIFIED, "{name}");
        }
    }

    #[test]
    fn there_is_a_page_and_nothing_beside_its_files() {
        assert!(asset("/", &HeaderMap::new()).is_some());
        for path in ["/../Cargo.toml", "/%2e%2e/Cargo.toml", "//etc/passwd", "/no.js"] {
            assert!(asset(path, &HeaderMap::new()).is_none(), "{path}");
        }
    }
}
