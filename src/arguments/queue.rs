//! Arguments of what concerns the jobs that wait.

use super::InstanceArguments;
use clap::{Args, Subcommand};

/// What can be done with the jobs of a pipeline.
#[derive(Debug, Clone, Subcommand)]
pub enum QueueCommand {
    /// List the jobs: the newest that have ended, the one under way, those that wait.
    List(InstanceArguments),
    /// Take a job back: one that waits is gone at once, the one under way is stopped.
    Cancel(QueueJobArguments),
    /// Put a job that waits at another place.
    Move(QueueMoveArguments),
    /// Submit a job once more, under a new number and into a run folder of its own.
    Repeat(QueueJobArguments),
    /// Begin no other job that waits; the one under way goes on.
    Hold(InstanceArguments),
    /// Begin the jobs that wait, after a start of the pipeline, a fault, a stop or a hold of the queue.
    Start(InstanceArguments),
}

/// One job.
#[derive(Debug, Clone, Args)]
pub struct QueueJobArguments {
    /// The job's number.
    pub number: u64,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub instance: InstanceArguments,
}

/// One job and a place.
#[derive(Debug, Clone, Args)]
pub struct QueueMoveArguments {
    /// The job's number.
    pub number: u64,
    /// Its new place among those that wait; 1 is the next.
    pub place: usize,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub instance: InstanceArguments,
}
