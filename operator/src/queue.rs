//! The jobs of a pipeline: the one under way, those that wait, and those that have ended.

use serde::{Deserialize, Serialize};

/// All jobs that a pipeline knows of, as `graver queue list --json` prints them.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Queue {
    /// The job under way; null without one.
    pub running: Option<QueuedJob>,
    /// Those that wait, the next one first.
    pub waiting: Vec<QueuedJob>,
    /// The newest that have ended, the last one last.
    pub ended: Vec<QueuedJob>,
    /// Why those that wait do not begin until a person starts the queue; null while they begin one after the other.
    pub held: Option<String>,
}

/// A job in the queue.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct QueuedJob {
    /// Its number, which no other job of this instance has had.
    pub number: u64,
    /// Its name.
    pub name: String,
    /// The job file; null for the built-in job.
    pub file: Option<String>,
    /// Changes of the job, `KEY=VALUE`.
    pub set: Vec<String>,
    /// Whether it may read the files of its own folder only, as one that was uploaded.
    #[serde(default)]
    pub confined: bool,
    /// Its run folder; null before it has one.
    pub out: Option<String>,
    /// When it was submitted, in seconds since 1970.
    pub submitted: u64,
    /// When it was begun, in seconds since 1970; null before that.
    pub started: Option<u64>,
    /// When it ended, in seconds since 1970; null before that.
    pub ended: Option<u64>,
    /// How it ended, as the summary's `outcome`; null before that.
    pub outcome: Option<String>,
    /// Why it ended so, in words; null where there is nothing to say.
    pub message: Option<String>,
}

/// The answer to a job that is not followed, as `graver submit --detach --json` prints it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Submitted {
    /// The job's number.
    pub number: u64,
    /// Why the jobs that wait, and this one with them, do not begin until a person starts the queue; null while they
    /// begin one after the other.
    #[serde(default)]
    pub held: Option<String>,
}
