//! What can be wrong between a machine and its fleet, in words.

use crate::address::Address;
use async_nats::{ConnectError, ConnectErrorKind};
use std::error::Error;

/// The oldest server that does what is asked of it here.
pub const OLDEST: (i64, i64, i64) = (2, 9, 0);

/// Why a fleet is not reached, or does not do what is asked.
#[derive(Debug, thiserror::Error)]
pub enum FleetError {
    /// No connection.
    #[error("{address} cannot be reached: {cause}")]
    Unreachable {
        /// The server.
        address: Address,
        /// Why.
        cause: String,
    },
    /// The server wants other credentials.
    #[error("{address} lets nobody in with {what}")]
    NotAllowed {
        /// The server.
        address: Address,
        /// What was shown to it.
        what: &'static str,
    },
    /// The credentials themselves.
    #[error("the credentials are damaged: {0}")]
    Credentials(String),
    /// A server of another time.
    #[error(
        "{address} is NATS {version}, too old: {oldest} or later is needed",
        oldest = format!("{}.{}.{}", OLDEST.0, OLDEST.1, OLDEST.2)
    )]
    TooOld {
        /// The server.
        address: Address,
        /// What it says it is.
        version: String,
    },
    /// A server that keeps nothing.
    #[error(
        "{0} keeps no messages: start it with JetStream (`nats-server -js`), and allow it for this account"
    )]
    NoJetStream(Address),
    /// A stream that somebody else has made otherwise.
    #[error(
        "the stream {name} of the server is not as it must be: {what}; delete it, and it is made anew"
    )]
    Stream {
        /// Its name.
        name: &'static str,
        /// What is other.
        what: String,
    },
    /// A file that the server does not take.
    #[error(
        "the file has {size} bytes, and the server takes {most} in a message with its headers: raise `max_payload` in its configuration, or make the file smaller"
    )]
    TooLarge {
        /// The file [bytes].
        size: usize,
        /// What fits [bytes].
        most: usize,
    },
    /// The queue of the fleet.
    #[error("{0}")]
    Full(String),
    /// An answer that says no.
    #[error("the server does not do it: {0}")]
    Refused(String),
    /// No answer.
    #[error("the server does not answer: {0}")]
    Silent(String),
    /// A thread or a file of ours.
    #[error("{0}")]
    Io(#[from] std::io::Error),
}

impl FleetError {
    /// Why there is no connection, `shown` being what was shown to the server.
    pub(crate) fn of_connection(
        address: &Address,
        error: &ConnectError,
        shown: &'static str,
    ) -> Self {
        let address = address.clone();
        match error.kind() {
            ConnectErrorKind::AuthorizationViolation | ConnectErrorKind::Authentication => {
                Self::NotAllowed { address, what: shown }
            }
            ConnectErrorKind::TimedOut => Self::Unreachable {
                address,
                cause: "it does not answer as a NATS server".to_owned(),
            },
            kind => {
                let mut cause = kind.to_string();
                let mut source = error.source();
                while let Some(error) = source {
                    let text = error.to_string();
                    if !cause.contains(&text) {
                        cause = format!("{cause}: {text}");
                    }
                    source = error.source();
                }
                Self::Unreachable { address, cause }
            }
        }
    }
}

/// An error and what it comes from, in one line.
pub(crate) fn words(error: &(dyn Error + 'static)) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(error) = source {
        let more = error.to_string();
        if !text.contains(&more) {
            text = format!("{text}: {more}");
        }
        source = error.source();
    }
    text
}
