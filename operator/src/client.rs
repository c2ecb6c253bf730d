//! The asking end of the operators' socket.

use crate::{Request, Status, VerbReply};
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

    /// Asks, and waits for the answer: a second for a stop or a hold, else [`ANSWER_PATIENCE`].
    ///
    /// # Errors
    /// No pipeline, one that does not answer, or one that says that it cannot do what is asked.
    pub fn ask(&self, request: &Request) -> Result<Value, ClientError> {
        let urgent = matches!(request, Request::Verb { verb, .. } if verb.is_urgent());
        let patience = if urgent { URGENT_PATIENCE } else { ANSWER_PATIENCE };
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
