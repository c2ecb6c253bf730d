//! Hands a job to a fleet.

use crate::address::Server;
use crate::connection::{Connection, HEADERS, Unpublished};
use crate::error::FleetError;
use crate::taker::TICKET;
use crate::{name, now, streams, taker};
use async_nats::jetstream::message::PublishMessage;
use operator::fleet::{JobTicket, VERSION};
use std::sync::Arc;
use std::time::Duration;

/// How often it is tried where no answer comes: the server knows a job that is sent once more by its number.
const TRIES: u32 = 3;

/// Hands the file called `file` with this content and these changes to the machines of `group`; the number of the job in the fleet.
///
/// # Errors
/// A name that is none, no server, and one that does not take it.
pub fn submit(
    server: &Server,
    group: &str,
    file: &str,
    set: &[String],
    content: Vec<u8>,
) -> Result<String, FleetError> {
    name::check(group).map_err(FleetError::Refused)?;
    let ticket = JobTicket {
        version: VERSION,
        id: name::new_id()?,
        name: file.to_owned(),
        set: set.to_vec(),
        submitted: now(),
    };
    taker::check(&ticket).map_err(FleetError::Refused)?;
    if content.is_empty() {
        return Err(FleetError::Refused("the file is empty".to_owned()));
    }
    crate::runtime()?.block_on(send(server, group, &ticket, content))?;
    Ok(ticket.id)
}

async fn send(
    server: &Server,
    group: &str,
    ticket: &JobTicket,
    content: Vec<u8>,
) -> Result<(), FleetError> {
    let connection =
        Connection::open(server, "graver fleet submit", Arc::new(|_: &str| {})).await?;
    let text =
        serde_json::to_string(ticket).map_err(|error| FleetError::Refused(error.to_string()))?;
    // A refusal needs as much room beside it.
    if text.len() > HEADERS / 2 {
        return Err(FleetError::Refused(format!(
            "the changes of the job have more than {} bytes: write them into a job file",
            HEADERS / 2
        )));
    }
    let most = connection.client.max_payload().saturating_sub(HEADERS);
    if content.len() > most {
        return Err(FleetError::TooLarge { size: content.len(), most });
    }
    let message = PublishMessage::build()
        .payload(content.into())
        .header(TICKET, text.as_str())
        .message_id(&ticket.id);
    let mut tried = 1;
    loop {
        match connection.publish(streams::jobs(group), message.clone()).await {
            Ok(()) => return Ok(()),
            Err(Unpublished::Failed(error)) if error.contains("maximum messages") => {
                let most = streams::MOST_JOBS;
                return Err(FleetError::Full(format!(
                    "{most} jobs wait in the fleet already; submit again later"
                )));
            }
            Err(Unpublished::Failed(error)) if tried == TRIES => {
                return Err(FleetError::Silent(error));
            }
            Err(Unpublished::Failed(_)) => {
                tried += 1;
                tokio::time::sleep(Duration::from_millis(500)).await;
            }
            Err(error) => return Err(FleetError::Refused(error.to_string())),
        }
    }
}
