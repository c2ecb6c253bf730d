//! Who may do what: people of this computer who are its user, and everybody else by a token.
//!
//! A request is admitted in this order: its `Host` must be ours (a page of another site that had its name point here
//! cannot read or ask anything), what it asks must be within its right, and a request that changes something must
//! come from our own page or from a program, never from a page of somebody else's.

mod origin;
mod rate;
mod tokens;

pub(crate) use tokens::random;
pub use tokens::{TokenError, Tokens};

use axum::http::header::{AUTHORIZATION, COOKIE, HOST};
use axum::http::{HeaderMap, Method};
use rate::Buckets;
use runtime::peer_user::PeerUser;
use schemars::JsonSchema;
use serde::Serialize;
use std::net::IpAddr;

/// Changes in a row, and how many more each second, from one address.
const CHANGES: (f64, f64) = (60.0, 30.0);

/// Wrong tokens in a row, and how many more each second, from one address.
const MISTAKES: (f64, f64) = (10.0, 0.2);

/// The header that a program sends with a request that changes something: no page of another site can.
pub const PROGRAM_HEADER: &str = "x-graver";

/// Headers that a proxy adds: whoever is behind it is not the one who connects.
const FORWARDED: [&str; 3] = ["forwarded", "x-forwarded-for", "via"];

/// What somebody may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Right {
    /// Look.
    Watch,
    /// Look, and move the machine.
    Operate,
}

/// Who is at the other end of a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Peer {
    /// The address.
    pub address: IpAddr,
    /// Whose process it is.
    pub user: PeerUser,
}

/// Why a request is not admitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Denied {
    /// Its `Host` is not ours.
    #[error("this server does not go by that name: use its address, or start it with --host NAME")]
    Host,
    /// It has no token.
    #[error("a token is needed: Authorization: Bearer TOKEN, or /login?token=TOKEN in a browser")]
    NoToken,
    /// Its token is none of ours.
    #[error("the token is wrong")]
    WrongToken,
    /// Its token is for watching.
    #[error("this token is for watching; operating needs the other one")]
    Watcher,
    /// It changes something and may come from a page of somebody else's.
    #[error(
        "a request that changes something needs an Origin that is this server, or the header X-Graver: 1"
    )]
    Foreign,
    /// There were too many.
    #[error("too many requests: wait a moment")]
    TooMany,
}

/// Who may do what on this server.
#[derive(Debug)]
pub struct Access {
    tokens: Tokens,
    /// Whether this computer's own user needs no token on a loopback address.
    trusts_own_user: bool,
    names: Vec<String>,
    cookie: String,
    changes: Buckets,
    mistakes: Buckets,
}

impl Access {
    /// Access by these tokens to a server at `port`, which also goes by `names`.
    pub fn new(tokens: Tokens, trusts_own_user: bool, names: &[String], port: u16) -> Self {
        Self {
            tokens,
            trusts_own_user,
            names: origin::own_names(names),
            // Browsers tell hosts apart by name, not by port.
            cookie: format!("graver_{port}"),
            changes: Buckets::new(CHANGES.0, CHANGES.1),
            mistakes: Buckets::new(MISTAKES.0, MISTAKES.1),
        }
    }

    /// What the sender of a request may do; `None` of one who may do nothing. The request itself is not looked at.
    ///
    /// # Errors
    /// A host that is not ours, a wrong token.
    pub fn right(&self, peer: &Peer, headers: &HeaderMap) -> Result<Option<Right>, Denied> {
        let host = headers.get(HOST).and_then(|host| host.to_str().ok());
        if !host.is_some_and(|host| origin::is_own(host, &self.names)) {
            return Err(Denied::Host);
        }
        let is_own = self.is_own(peer, headers);
        let own = is_own.then_some(Right::Operate);
        let Some(token) = self.presented(headers) else { return Ok(own) };
        if !is_own && !self.mistakes.has(peer.address) {
            return Err(Denied::TooMany);
        }
        match self.tokens.right(token) {
            Some(right) => Ok(Some(right)),
            // An old cookie does not lock the owner out.
            None if is_own => Ok(own),
            None => {
                self.mistakes.take(peer.address);
                Err(Denied::WrongToken)
            }
        }
    }

    /// Whether a request that changes something comes from where it may, and not too often.
    ///
    /// # Errors
    /// One that may come from a page of another site, or one too many.
    pub fn admit_change(&self, peer: &Peer, headers: &HeaderMap) -> Result<(), Denied> {
        if !origin::may_change(headers) {
            return Err(Denied::Foreign);
        }
        if self.changes.take(peer.address) { Ok(()) } else { Err(Denied::TooMany) }
    }

    /// Whether a connection for messages comes from our own page, or from a program.
    ///
    /// # Errors
    /// One from a page of another site.
    pub fn admit_live(&self, headers: &HeaderMap) -> Result<(), Denied> {
        if origin::may_connect(headers) { Ok(()) } else { Err(Denied::Foreign) }
    }

    /// Whether this method changes something.
    pub fn is_change(method: &Method) -> bool {
        !matches!(*method, Method::GET | Method::HEAD | Method::OPTIONS)
    }

    /// The cookie that a browser with this token is given; `None` of a wrong token.
    ///
    /// # Errors
    /// Too many wrong ones before.
    pub fn login(&self, peer: &Peer, token: &str) -> Result<String, Denied> {
        if !self.mistakes.has(peer.address) {
            return Err(Denied::TooMany);
        }
        match self.tokens.right(token) {
            Some(_) => Ok(format!(
                "{}={token}; HttpOnly; SameSite=Strict; Path=/; Max-Age=31536000",
                self.cookie
            )),
            None => {
                self.mistakes.take(peer.address);
                Err(Denied::WrongToken)
            }
        }
    }

    fn is_own(&self, peer: &Peer, headers: &HeaderMap) -> bool {
        let is_forwarded = FORWARDED.iter().any(|name| headers.contains_key(*name));
        let is_here = peer.address.to_canonical().is_loopback();
        self.trusts_own_user && is_here && peer.user == PeerUser::Own && !is_forwarded
    }

    /// The token in a request's headers.
    fn presented<'a>(&self, headers: &'a HeaderMap) -> Option<&'a str> {
        let bearer = headers.get(AUTHORIZATION).and_then(|it| it.to_str().ok());
        if let Some(token) = bearer.and_then(|it| it.strip_prefix("Bearer ")) {
            return Some(token.trim());
        }
        let cookies = headers.get_all(COOKIE).iter().filter_map(|it| it.to_str().ok());
        let mut cookies =
            cookies.flat_map(|it| it.split(';')).filter_map(|it| it.trim().split_once('='));
        cookies.find(|(name, _)| *name == self.cookie).map(|(_, token)| token)
    }
}

#[cfg(test)]
mod tests;
