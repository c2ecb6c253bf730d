//! Where a request comes from, as a browser says, and by what name it calls us.

use super::PROGRAM_HEADER;
use axum::http::HeaderMap;
use axum::http::header::{AUTHORIZATION, HOST, ORIGIN};
use std::net::{Ipv4Addr, Ipv6Addr};

/// Where the kernel tells the name of this computer.
const HOST_NAME: &str = "/proc/sys/kernel/hostname";

/// The names by which this computer may be called, besides its addresses.
pub(super) fn own_names(more: &[String]) -> Vec<String> {
    let mut names = vec!["localhost".to_owned()];
    if let Ok(name) = std::fs::read_to_string(HOST_NAME) {
        let name = name.trim().to_ascii_lowercase();
        if !name.is_empty() && name != "(none)" {
            names.extend([format!("{name}.local"), name]);
        }
    }
    names.extend(more.iter().map(|name| name.to_ascii_lowercase()));
    names
}

/// Whether a `Host` is one of our names, or an address: what has a name can be made to point here by whoever owns the
/// name, an address cannot.
pub(super) fn is_own(host: &str, names: &[String]) -> bool {
    if let Some(rest) = host.strip_prefix('[') {
        let Some((address, port)) = rest.split_once(']') else { return false };
        return address.parse::<Ipv6Addr>().is_ok() && (port.is_empty() || is_port(port));
    }
    let name = match host.split_once(':') {
        Some((name, _)) if !is_port(&host[name.len()..]) => return false,
        Some((name, _)) => name,
        None => host,
    };
    name.parse::<Ipv4Addr>().is_ok() || names.contains(&name.to_ascii_lowercase())
}

fn is_port(text: &str) -> bool {
    text.strip_prefix(':').is_some_and(|port| port.parse::<u16>().is_ok())
}

/// Whether a request that changes something may: it comes from our own page, or a page cannot have sent it.
pub(super) fn may_change(headers: &HeaderMap) -> bool {
    match headers.get(ORIGIN) {
        Some(_) => is_same(headers),
        None => headers.contains_key(PROGRAM_HEADER) || headers.contains_key(AUTHORIZATION),
    }
}

/// Whether a connection for messages may be opened: a browser always tells its origin.
pub(super) fn may_connect(headers: &HeaderMap) -> bool {
    headers.get(ORIGIN).is_none() || is_same(headers)
}

/// Whether the page of a request was loaded from here.
fn is_same(headers: &HeaderMap) -> bool {
    let text = |name| headers.get(name).and_then(|it: &axum::http::HeaderValue| it.to_str().ok());
    let (Some(origin), Some(host)) = (text(ORIGIN), text(HOST)) else { return false };
    let authority = origin.split_once("://").map(|(_, authority)| authority);
    authority.is_some_and(|authority| authority.eq_ignore_ascii_case(host))
}
