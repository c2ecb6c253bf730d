//! The streams of a fleet: made where they are not there yet, and held to what they must be.

use crate::error::{FleetError, words};
use async_nats::jetstream::Context;
use async_nats::jetstream::consumer::{AckPolicy, DeliverPolicy, pull};
use async_nats::jetstream::stream::{Config, DiscardPolicy, RetentionPolicy, StorageType, Stream};
use std::time::Duration;

/// The last value of each kind of message of each machine.
pub const MACHINES: &str = "GRAVER_MACHINES";
/// Jobs that no machine has yet.
pub const JOBS: &str = "GRAVER_JOBS";
/// What has become of each job.
pub const RECORDS: &str = "GRAVER_RECORDS";
/// Jobs that were refused.
pub const REFUSED: &str = "GRAVER_REFUSED";

/// Jobs that can wait in a fleet.
pub const MOST_JOBS: i64 = 1000;

/// How long records and refused jobs are kept.
const KEPT: Duration = Duration::from_secs(30 * 24 * 3600);

/// Within which time a job that is sent twice is one.
const TWICE: Duration = Duration::from_secs(3600);

/// The subject of what a machine says: `state`, `metrics`, `job` or `faults`.
pub fn machine(name: &str, what: &str) -> String {
    format!("graver.machine.{name}.{what}")
}

/// The subject of the jobs of a group.
pub fn jobs(group: &str) -> String {
    format!("graver.jobs.{group}")
}

/// The subject of what has become of a job.
pub fn record(id: &str) -> String {
    format!("graver.records.{id}")
}

/// The subject of jobs of a group that were refused.
pub fn refused(group: &str) -> String {
    format!("graver.refused.{group}")
}

/// All of them.
#[derive(Debug, Clone)]
pub(crate) struct Streams {
    pub(crate) machines: Stream,
    pub(crate) jobs: Stream,
    pub(crate) records: Stream,
    pub(crate) refused: Stream,
}

impl Streams {
    /// Finds or makes them.
    pub(crate) async fn open(context: &Context) -> Result<Self, FleetError> {
        Ok(Self {
            machines: open(context, MACHINES, config_of_machines()).await?,
            jobs: open(context, JOBS, config_of_jobs()).await?,
            records: open(context, RECORDS, config_of_records()).await?,
            refused: open(context, REFUSED, config_of_refused()).await?,
        })
    }
}

fn config_of_machines() -> Config {
    Config {
        subjects: vec![machine("*", "*")],
        max_messages_per_subject: 1,
        description: Some("The last of what each machine says of itself".to_owned()),
        ..Config::default()
    }
}

fn config_of_jobs() -> Config {
    Config {
        subjects: vec![jobs("*")],
        retention: RetentionPolicy::WorkQueue,
        // Whoever submits one too many is told; none that waits makes room.
        discard: DiscardPolicy::New,
        max_messages: MOST_JOBS,
        duplicate_window: TWICE,
        description: Some("Jobs that no machine has taken yet".to_owned()),
        ..Config::default()
    }
}

fn config_of_records() -> Config {
    Config {
        subjects: vec![record("*")],
        max_messages_per_subject: 1,
        max_age: KEPT,
        description: Some("Which machine has a job, and what has become of it".to_owned()),
        ..Config::default()
    }
}

fn config_of_refused() -> Config {
    Config {
        subjects: vec![refused("*")],
        max_messages: MOST_JOBS,
        max_age: KEPT,
        description: Some("Jobs that a machine refused, with its words".to_owned()),
        ..Config::default()
    }
}

/// The stream called `name`, made by `config` where there is none.
async fn open(context: &Context, name: &'static str, config: Config) -> Result<Stream, FleetError> {
    let config =
        Config { name: name.to_owned(), storage: StorageType::File, num_replicas: 1, ..config };
    let opened = context.get_or_create_stream(config.clone()).await;
    let stream = opened
        .map_err(|error| FleetError::Refused(format!("the stream {name}: {}", words(&error))))?;
    let found = &stream.cached_info().config;
    let differs = |what: &str| Err(FleetError::Stream { name, what: what.to_owned() });
    if found.retention != config.retention {
        return match config.retention {
            RetentionPolicy::WorkQueue => {
                differs("a message must be gone when it is acknowledged (retention \"workqueue\")")
            }
            _ => differs("messages must stay until others take their place (retention \"limits\")"),
        };
    }
    if config.max_messages_per_subject == 1 && found.max_messages_per_subject != 1 {
        return differs(
            "it must keep the last message of each subject alone (max_msgs_per_subject 1)",
        );
    }
    if !config.subjects.iter().all(|subject| found.subjects.contains(subject)) {
        return differs(&format!("its subjects must be {}", config.subjects.join(", ")));
    }
    Ok(stream)
}

/// The consumer by which the machines of `group` take jobs, one each.
pub(crate) fn takers(group: &str, ack_wait: Duration) -> pull::Config {
    pull::Config {
        durable_name: Some(format!("takers-{group}")),
        description: Some("The machines of the group".to_owned()),
        filter_subject: jobs(group),
        ack_policy: AckPolicy::Explicit,
        ack_wait,
        ..pull::Config::default()
    }
}

/// A consumer that reads what lies in a stream from message `start` on.
pub(crate) fn reader(start: u64) -> pull::Config {
    let deliver_policy = if start > 1 {
        DeliverPolicy::ByStartSequence { start_sequence: start }
    } else {
        DeliverPolicy::All
    };
    pull::Config {
        deliver_policy,
        ack_policy: AckPolicy::None,
        inactive_threshold: Duration::from_secs(10),
        memory_storage: true,
        ..pull::Config::default()
    }
}
