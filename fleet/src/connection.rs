//! A connection to the server of a fleet that has been found fit.

use crate::address::{Credentials, Server};
use crate::error::{FleetError, OLDEST, words};
use crate::streams::Streams;
use async_nats::jetstream::context::{PublishErrorKind, RequestErrorKind};
use async_nats::jetstream::message::PublishMessage;
use async_nats::jetstream::stream::{LastRawMessageErrorKind, Stream};
use async_nats::jetstream::{self, Context};
use async_nats::{Client, ConnectOptions, Event, ServerAddr};
use operator::fleet::JobRecord;
use serde::Serialize;
use serde_json::Value;
use std::time::Duration;

/// How long the server may take for a connection, and for an answer.
pub(crate) const PATIENCE: Duration = Duration::from_secs(5);

/// How often a connection without traffic is tried.
const PING_PERIOD: Duration = Duration::from_secs(15);

/// The first and the longest pause between two tries to connect.
const FIRST_PAUSE: Duration = Duration::from_millis(250);
const LONGEST_PAUSE: Duration = Duration::from_secs(30);

/// What is left of a message for its headers [bytes].
pub(crate) const HEADERS: usize = 16 << 10;

/// The pause before the next try, after so many that failed.
pub(crate) fn pause(failed: usize) -> Duration {
    let doubled = 1_u32
        .checked_shl(u32::try_from(failed.saturating_sub(1)).unwrap_or(31))
        .unwrap_or(u32::MAX);
    FIRST_PAUSE.saturating_mul(doubled).min(LONGEST_PAUSE)
}

/// Whoever is told what becomes of a connection.
pub(crate) type Told = dyn Fn(&str) + Send + Sync;

/// A server that takes messages.
#[derive(Debug, Clone)]
pub(crate) struct Connection {
    pub(crate) client: Client,
    pub(crate) context: Context,
    pub(crate) streams: Streams,
}

impl Connection {
    /// Connects, and looks whether the server is fit. It connects again by itself from then on.
    pub(crate) async fn open(
        server: &Server,
        name: &str,
        told: std::sync::Arc<Told>,
    ) -> Result<Self, FleetError> {
        let address = &server.address;
        let mut options = ConnectOptions::new()
            .name(name)
            .connection_timeout(PATIENCE)
            .request_timeout(Some(PATIENCE))
            .ping_interval(PING_PERIOD)
            .reconnect_delay_callback(pause);
        let at = address.to_string();
        options = options.event_callback(move |event| {
            match &event {
                Event::Disconnected => told(&format!("{at} is away; it is tried again and again")),
                Event::ServerError(error) => told(&format!("{at} says: {error}")),
                _ => {}
            }
            async {}
        });
        let shown = match &server.credentials {
            None => "no credentials",
            Some(_) => "these credentials",
        };
        options = match server.credentials.clone() {
            None => options,
            // What the library says of them could repeat them.
            Some(Credentials::User(text)) => options.credentials(&text).map_err(|_| {
                FleetError::Credentials("the file of a NATS user has a token and a seed".to_owned())
            })?,
            Some(Credentials::Seed(seed)) => options.nkey(seed),
            Some(Credentials::Token(token)) => options.token(token),
            Some(Credentials::Password { user, password }) => {
                options.user_and_password(user, password)
            }
        };
        if let Some(path) = &server.authority {
            options = options.add_root_certificates(path.clone());
        }
        let to: ServerAddr = address.to_string().parse()?;
        let connected = tokio::time::timeout(2 * PATIENCE, options.connect(to)).await;
        let client = match connected {
            Ok(Ok(client)) => client,
            Ok(Err(error)) => return Err(FleetError::of_connection(address, &error, shown)),
            Err(_) => {
                let cause = "it does not answer as a NATS server".to_owned();
                return Err(FleetError::Unreachable { address: address.clone(), cause });
            }
        };
        let (major, minor, patch) = OLDEST;
        if !client.is_server_compatible(major, minor, patch) {
            let version = client.server_info().version.chars().take(40).collect();
            return Err(FleetError::TooOld { address: address.clone(), version });
        }
        let mut context = jetstream::new(client.clone());
        context.set_timeout(PATIENCE);
        ask_for_jetstream(server, &context).await?;
        let streams = Streams::open(&context).await?;
        Ok(Self { client, context, streams })
    }

    /// Publishes JSON, and waits until the server has it.
    pub(crate) async fn tell<T: Serialize>(
        &self,
        subject: String,
        value: &T,
    ) -> Result<(), Unpublished> {
        let body =
            serde_json::to_vec(value).map_err(|error| Unpublished::Failed(error.to_string()))?;
        self.publish(subject, PublishMessage::build().payload(body.into())).await
    }

    /// Publishes a message, and waits until the server has it.
    pub(crate) async fn publish(
        &self,
        subject: String,
        message: PublishMessage,
    ) -> Result<(), Unpublished> {
        let publish = async { self.context.send_publish(subject, message).await?.await };
        match tokio::time::timeout(2 * PATIENCE, publish).await {
            Ok(Ok(_)) => Ok(()),
            Ok(Err(error)) => Err(match error.kind() {
                PublishErrorKind::WrongLastSequence => Unpublished::NotFirst,
                PublishErrorKind::StreamNotFound => Unpublished::NoStream,
                PublishErrorKind::MaxPayloadExceeded => Unpublished::TooLarge,
                _ => Unpublished::Failed(words(&error)),
            }),
            Err(_) => Err(Unpublished::Failed("no answer".to_owned())),
        }
    }

    /// What has become of the job with this number; `None` where nobody has said anything.
    pub(crate) async fn record(&self, id: &str) -> Result<Option<JobRecord>, String> {
        let subject = crate::streams::record(id);
        match last(&self.streams.records, &subject).await? {
            None => Ok(None),
            Some(body) => serde_json::from_slice(&body)
                .map(Some)
                .map_err(|error| format!("the record {id} cannot be read: {error}")),
        }
    }
}

/// Whether the server keeps messages for this account.
async fn ask_for_jetstream(server: &Server, context: &Context) -> Result<(), FleetError> {
    // As it comes: servers of 2.9 leave out what the library takes for granted.
    let told: Result<Value, _> = context.request("INFO", &()).await;
    match told {
        Ok(told) if told["error"].is_null() => Ok(()),
        Err(error) if error.kind() == RequestErrorKind::TimedOut => {
            Err(FleetError::Silent(words(&error)))
        }
        Ok(_) | Err(_) => Err(FleetError::NoJetStream(server.address.clone())),
    }
}

/// The last message on `subject`.
async fn last(stream: &Stream, subject: &str) -> Result<Option<Vec<u8>>, String> {
    let asked =
        tokio::time::timeout(2 * PATIENCE, stream.get_last_raw_message_by_subject(subject)).await;
    match asked {
        Ok(Ok(message)) => Ok(Some(message.payload.to_vec())),
        Ok(Err(error)) if error.kind() == LastRawMessageErrorKind::NoMessageFound => Ok(None),
        Ok(Err(error)) => Err(words(&error)),
        Err(_) => Err("no answer".to_owned()),
    }
}

/// Why a message did not get to the server.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Unpublished {
    /// Another was there before it.
    #[error("another message was there before")]
    NotFirst,
    /// Nobody keeps it.
    #[error("there is no stream for it")]
    NoStream,
    /// It is larger than the server takes.
    #[error("it is larger than the server takes")]
    TooLarge,
    /// Anything else.
    #[error("{0}")]
    Failed(String),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_grow_and_are_bounded() {
        let pauses: Vec<u128> = (1..=4).map(|failed| pause(failed).as_millis()).collect();
        assert_eq!(pauses, [250, 500, 1000, 2000]);
        for failed in [8, 31, 40, usize::MAX] {
            assert_eq!(pause(failed), LONGEST_PAUSE);
        }
        assert_eq!(pause(0), FIRST_PAUSE);
    }
}
