//! What all machines of a fleet say.

use crate::address::Server;
use crate::connection::{Connection, PATIENCE};
use crate::error::{FleetError, words};
use crate::{now, streams};
use async_nats::jetstream::stream::Stream;
use futures_util::StreamExt;
use operator::fleet::{FleetMachine, FleetStatus, JobRecord};
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Messages that are read at a time.
const PART: usize = 256;

/// Records of jobs that are told, at most, and how many messages back they are looked for.
const RECORDS: u64 = 50;

/// A machine that has been silent for so many of its intervals is not heard.
const SILENCE: f64 = 3.0;

/// Asks a server for everything that its machines have said.
///
/// # Errors
/// No server, or one that does not answer.
pub fn survey(server: &Server) -> Result<FleetStatus, FleetError> {
    crate::runtime()?.block_on(async {
        let connection =
            Connection::open(server, "graver fleet status", Arc::new(|_: &str| {})).await?;
        let mut fleet = FleetStatus::default();
        for (subject, body) in messages(&connection.streams.machines, 1).await? {
            let mut parts = subject.split('.').skip(2);
            let (Some(name), Some(what)) = (parts.next(), parts.next()) else { continue };
            note(fleet.machines.entry(name.to_owned()).or_default(), what, &body);
        }
        fleet.machines.values_mut().for_each(|machine| judge(machine, now()));
        fleet.waiting = counts(&connection.streams.jobs, &streams::jobs("*")).await?;
        fleet.refused = counts(&connection.streams.refused, &streams::refused("*")).await?;
        let records = &connection.streams.records;
        let last = records.get_info().await.map_err(|error| FleetError::Silent(words(&error)))?;
        let start = last.state.last_sequence.saturating_sub(RECORDS - 1).max(1);
        let found = messages(records, start).await?;
        fleet.jobs = found.iter().filter_map(|(_, body)| parsed::<JobRecord>(body)).collect();
        Ok(fleet)
    })
}

/// Subjects and bodies of the messages in a stream, from message `start` on.
async fn messages(stream: &Stream, start: u64) -> Result<Vec<(String, Vec<u8>)>, FleetError> {
    let silent = |error: String| FleetError::Silent(error);
    let consumer = stream.create_consumer(streams::reader(start)).await;
    let consumer = consumer.map_err(|error| silent(words(&error)))?;
    // Asked for more than there is, the server would wait for it.
    let count = usize::try_from(consumer.cached_info().num_pending).unwrap_or(usize::MAX);
    let mut found = Vec::new();
    while found.len() < count {
        let before = found.len();
        let part = PART.min(count - before);
        let batch = consumer.batch().max_messages(part).expires(PATIENCE).messages().await;
        let mut batch = batch.map_err(|error| silent(words(&error)))?;
        while let Some(message) = batch.next().await {
            let message = message.map_err(|error| silent(words(&*error)))?;
            found.push((message.subject.to_string(), message.payload.to_vec()));
        }
        if found.len() == before {
            // Others have taken the place of what was counted.
            break;
        }
    }
    Ok(found)
}

/// How many messages lie on each subject, by the last part of it.
async fn counts(stream: &Stream, filter: &str) -> Result<BTreeMap<String, u64>, FleetError> {
    let silent = |error: String| FleetError::Silent(error);
    let mut subjects =
        stream.info_with_subjects(filter).await.map_err(|error| silent(words(&error)))?;
    let mut counts = BTreeMap::new();
    while let Some(subject) = subjects.next().await {
        let (subject, count) = subject.map_err(|error| silent(words(&error)))?;
        let last = subject.rsplit('.').next().unwrap_or_default().to_owned();
        counts.insert(last, count as u64);
    }
    Ok(counts)
}

/// What cannot be read is of another version, and is left out.
fn parsed<T: DeserializeOwned>(body: &[u8]) -> Option<T> {
    serde_json::from_slice(body).ok()
}

fn note(machine: &mut FleetMachine, what: &str, body: &[u8]) {
    match what {
        "state" => machine.state = parsed(body),
        "job" => machine.job = parsed(body),
        "metrics" => machine.metrics = parsed(body),
        "faults" => machine.faults = parsed(body),
        _ => {}
    }
}

/// Judges by the time of its state whether a machine is heard.
fn judge(machine: &mut FleetMachine, now: f64) {
    let Some(state) = &machine.state else { return };
    // Clocks of two computers differ.
    let age = (now - state.time).max(0.0);
    machine.age = Some(age);
    machine.is_heard = state.online && age <= SILENCE * state.interval;
}

#[cfg(test)]
mod tests {
    use super::*;
    use operator::fleet::MachineState;

    #[test]
    fn a_machine_is_heard_while_it_is_online_and_not_silent() {
        let of = |online, age: f64| {
            let state = MachineState {
                online,
                time: 1000.0 - age,
                interval: 5.0,
                ..MachineState::default()
            };
            let mut machine = FleetMachine { state: Some(state), ..FleetMachine::default() };
            judge(&mut machine, 1000.0);
            (machine.is_heard, machine.age)
        };
        assert_eq!(of(true, 4.0), (true, Some(4.0)));
        assert_eq!(of(true, 15.5), (false, Some(15.5)));
        assert_eq!(of(false, 1.0), (false, Some(1.0)));
        assert_eq!(of(true, -2.0), (true, Some(0.0)), "its clock is ahead");
        let mut never = FleetMachine::default();
        judge(&mut never, 1000.0);
        assert_eq!((never.is_heard, never.age), (false, None));
    }

    #[test]
    fn what_a_machine_says_is_noted_and_what_is_of_another_time_left_out() {
        let mut machine = FleetMachine::default();
        note(&mut machine, "state", b"{\"unknown\": 1}");
        note(&mut machine, "other", b"{}");
        assert_eq!(machine, FleetMachine::default());
        let job = operator::fleet::MachineJob { waiting: 3, ..Default::default() };
        note(&mut machine, "job", &serde_json::to_vec(&job).unwrap_or_default());
        assert_eq!(machine.job, Some(job));
    }
}
