//! The asking end of the operators' socket.

use crate::{Request, Status, VerbReply, direct};
use runtime::Instance;
use runtime::socket::{ANSWER_PATIENCE, OperatorClient, SocketError};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::time::Duration;

/// How long the holder may take to answer a stop or a hold.
const URGENT_PATIENCE: Duration = Duration::from_secs(1);

/// Why a request got no answer.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// The socket.
    #[error(transparent)]
    Socket(#[from] SocketError),
    /// Neither the holder answered nor the controller.
    #[error("{silent}; the controller could not be asked directly either: {error}")]
    Unheard {
        /// That the holder did not.
        silent: SocketError,
        /// Why the controller could not be asked.
        error: String,
    },
    /// The holder's words.
    #[error("{0}")]
    Refused(String),
    /// An answer that is none.
    #[error("the pipeline's answer cannot be read: {0}")]
    Unreadable(#[from] serde_json::Error),
}

/// Asks one pipeline, with a connection for each request: any thread may.
#[derive(Debug, Clone)]
pub struct Client {
    instance: Instance,
}

impl Client {
    /// Asks the pipeline of this instance.
    pub fn new(instance: Instance) -> Self {
        Self { instance }
    }

    /// Which pipeline it asks.
    pub fn instance(&self) -> &Instance {
        &self.instance
    }

    /// Asks, and waits for the answer: a second for a stop or a hold, else [`ANSWER_PATIENCE`]. A stop or a hold goes
    /// to the controller where the holder does not answer.
    ///
    /// # Errors
    /// No pipeline, one that does not answer, or one that says that it cannot do what is asked.
    pub fn ask(&self, request: &Request) -> Result<Value, ClientError> {
        let urgent = match request {
            Request::Verb { verb, value } if verb.is_urgent() => Some((*verb, *value)),
            _ => None,
        };
        let patience = if urgent.is_some() { URGENT_PATIENCE } else { ANSWER_PATIENCE };
        match (self.ask_holder(request, patience), urgent) {
            (
                Err(ClientError::Socket(silent @ SocketError::Silent { .. })),
                Some((verb, value)),
            ) => {
                let reply = direct::ask(&self.instance, (verb, value), &silent);
                Ok(json!(reply.map_err(|error| ClientError::Unheard { silent, error })?))
            }
            (answer, _) => answer,
        }
    }

    fn ask_holder(&self, request: &Request, patience: Duration) -> Result<Value, ClientError> {
        let mut socket = OperatorClient::connect(&self.instance)?;
        let reply = socket.request_within(&json!(request), patience)?;
        match reply["error"].as_str() {
            Some(error) if reply.get("outcome").is_none() => {
                Err(ClientError::Refused(error.to_owned()))
            }
            _ if reply.is_null() => {
                Err(ClientError::Refused("the pipeline ended before it answered".to_owned()))
            }
            _ => Ok(reply),
        }
    }

    /// Like [`Self::ask`], as what it is.
    ///
    /// # Errors
    /// As [`Self::ask`], and an answer of another form.
    pub fn ask_for<T: DeserializeOwned>(&self, request: &Request) -> Result<T, ClientError> {
        Ok(serde_json::from_value(self.ask(request)?)?)
    }

    /// Asks for a verb.
    ///
    /// # Errors
    /// As [`Self::ask_for`].
    pub fn verb(&self, request: &Request) -> Result<VerbReply, ClientError> {
        self.ask_for(request)
    }

    /// What the pipeline is doing.
    ///
    /// # Errors
    /// As [`Self::ask_for`].
    pub fn status(&self) -> Result<Status, ClientError> {
        self.ask_for(&Request::Status)
    }
}
