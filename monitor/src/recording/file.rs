//! `samples.mcap`: the recording of a run, a message a cycle, in a container that other programs read.
//!
//! MCAP with protobuf messages: <https://mcap.dev/spec>. There are no chunks: whatever of the file has been
//! written can be read, wherever it ends. What describes the run comes first: its properties, and the machine as it
//! was built. A file that has grown large is closed and another part begins, as it does when another
//! process goes on with the recording; every part is a recording by itself.

pub mod parts;
pub mod reader;
pub mod reduce;
pub mod writer;

use super::wire::Malformed;
use messages::time::Period;
use std::io;

/// The topic of the records.
pub const CYCLES: &str = "/cycle";

/// The topic of the events.
pub const EVENTS: &str = "/event";

/// The topic of what the controller did before the job: cycles with which a replay begins, and nothing is judged by.
pub const LEAD: &str = "/lead";

/// The name of the metadata that describe a run.
const PROPERTIES: &str = "graver";

/// The attachment that the machine is built from, as JSON.
pub const MACHINE: &str = "machine.json";

/// What a recording says of itself before its first record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Description {
    /// The period of the cycle.
    pub period: Period,
    /// The stream that it records.
    pub stream: u64,
    /// Whether the log times are those of a simulation.
    pub simulated: bool,
    /// The seed of the simulated plant.
    pub seed: u64,
    /// The names of the actuators.
    pub actuators: Vec<String>,
    /// What the machine is built from, as JSON; empty where it is not known.
    pub machine: String,
}

impl Description {
    /// Of a run in real time of which nothing but the period is known.
    pub fn of(period: Period) -> Self {
        Self {
            period,
            stream: 0,
            simulated: false,
            seed: 0,
            actuators: Vec::new(),
            machine: String::new(),
        }
    }
}

/// Why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The operating system refused.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The file does not begin like a recording.
    #[error("not a recording: it does not begin like a samples.mcap of Graver")]
    NotARecording,
    /// The file was written by a build with other samples.
    #[error(
        "recorded with {recorded} (layout {recorded_layout:016x}), but this build has {expected} \
         (layout {expected_layout:016x}): read it with the build that wrote it"
    )]
    OtherLayout {
        /// The sample in the file.
        recorded: String,
        /// Its layout hash.
        recorded_layout: u64,
        /// The sample of this build.
        expected: String,
        /// Its layout hash.
        expected_layout: u64,
    },
    /// A message or a record is not what it should be.
    #[error("the recording is damaged behind record {record}: {reason}")]
    Damaged {
        /// Whole records before it.
        record: u64,
        /// What is wrong.
        reason: String,
    },
    /// The file ends without its end: whoever wrote it was stopped.
    #[error("the recording ends inside record {record}: its writer was killed")]
    Truncated {
        /// The incomplete record, from 0.
        record: u64,
    },
}

impl RecordingError {
    fn damaged(record: u64) -> impl FnOnce(Malformed) -> Self {
        move |error| Self::Damaged { record, reason: error.to_string() }
    }
}

#[cfg(test)]
mod tests;
