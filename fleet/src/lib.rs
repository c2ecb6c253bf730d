//! The machines of a fleet over NATS JetStream: each says what it is doing, and takes jobs that are for its group.
//!
//! The monitor publishes ([`publisher`]), never the controller. It counts what the hub hands on, and a thread of its own speaks
//! with the server: one that is slow or away costs messages, and nobody waits for it. Whether a machine takes a job, and how
//! none is lost or done twice, stands in `taker`. What is said is in [`operator::fleet`], and described in `docs/fleet.md`.

pub mod address;
mod connection;
mod counts;
pub mod error;
pub mod name;
pub mod pipeline;
pub mod publisher;
pub mod send;
mod spool;
mod station;
pub mod streams;
pub mod survey;
mod taker;

pub use address::{Address, Credentials, Server};
pub use error::FleetError;
pub use pipeline::{Pipeline, Verdict};
pub use publisher::{Options, Pace, Publisher};

use std::time::SystemTime;

/// Seconds since 1970.
fn now() -> f64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_secs_f64()
}

/// A runtime for one thread.
fn runtime() -> std::io::Result<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build()
}
