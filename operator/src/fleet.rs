//! What the machines of a fleet say and are sent, as JSON: see `docs/fleet.md` and `docs/schema/fleet_*.json`.
//!
//! Times are in seconds since 1970, durations in seconds, latencies in nanoseconds, shares from 0 to 1. Who reads a message ignores
//! keys that it does not know; what it would misunderstand has another [`VERSION`].

use crate::PastFault;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The version of all messages.
pub const VERSION: u32 = 1;

/// What a machine is doing: the last value on `graver.machine.NAME.state`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MachineState {
    /// The version of this message: 1.
    pub version: u32,
    /// The machine's name in the fleet.
    pub machine: String,
    /// When this was said.
    pub time: f64,
    /// How often this is said anew; a machine that is silent for three times as long is not to be trusted [s].
    pub interval: f64,
    /// Whether it goes on saying so: false in the last message of a pipeline that ends in order.
    pub online: bool,
    /// The controller's state; `unknown` where the pipeline does not answer.
    pub state: String,
    /// Why the machine stands, in words; null where there is nothing to say.
    pub cause: Option<String>,
    /// The latched fault; null without one.
    pub fault: Option<String>,
    /// The machine file; null for the built-in machine.
    pub machine_file: Option<String>,
    /// Axes that have to be homed before a job.
    pub unhomed: Vec<String>,
    /// The group whose jobs it takes; null for none.
    pub group: Option<String>,
    /// Why it takes no job of the fleet now, in words; null where it waits for one, and where it has no group.
    pub busy: Option<String>,
}

/// What a machine has counted: the last value on `graver.machine.NAME.metrics`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MachineMetrics {
    /// The version of this message: 1.
    pub version: u32,
    /// The machine's name in the fleet.
    pub machine: String,
    /// When this was said.
    pub time: f64,
    /// When its monitor began to count.
    pub since: f64,
    /// Cycles that were seen.
    pub cycles: u64,
    /// Cycles without a fresh command in time.
    pub late_cycles: u64,
    /// Cycles whose work did not end before the next deadline.
    pub overruns: u64,
    /// Times that the watchdog closed an open gate.
    pub gate_faults: u64,
    /// Cycles that the monitor was too slow to see.
    pub unseen_cycles: u64,
    /// Messages that were never sent, for want of a server that takes them.
    pub unsent: u64,
    /// The latencies by the name of their hop.
    pub latency: BTreeMap<String, Latency>,
}

/// The distribution of a latency [ns].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Latency {
    /// How many were measured.
    pub count: u64,
    /// The median.
    pub p50: u64,
    /// 99 of 100 are at most this.
    pub p99: u64,
    /// 999 of 1000 are at most this.
    pub p999: u64,
    /// The longest.
    pub max: u64,
}

/// The job of a machine: the last value on `graver.machine.NAME.job`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MachineJob {
    /// The version of this message: 1.
    pub version: u32,
    /// The machine's name in the fleet.
    pub machine: String,
    /// When this was said.
    pub time: f64,
    /// The job under way; null without one.
    pub job: Option<JobProgress>,
    /// How many jobs wait in the machine's own queue.
    pub waiting: u64,
    /// Why they do not begin; null while they begin one after the other.
    pub held: Option<String>,
}

/// How far a job has come.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JobProgress {
    /// Its number in the machine's own queue.
    pub number: u64,
    /// Its name.
    pub name: String,
    /// Its number in the fleet; null of one that was submitted at the machine.
    pub id: Option<String>,
    /// How much of it has been played.
    pub share: f64,
    /// How long ago it was begun [s].
    pub elapsed: Option<f64>,
    /// How long it still takes, an estimate; null while that is not known [s].
    pub time_left: Option<f64>,
    /// The stroke being marked, from 1; 0 for none.
    pub stroke: u64,
    /// Its strokes; 0 while that is not known.
    pub strokes: u64,
    /// The rate at which it is played, 1 as planned.
    pub rate: f64,
    /// Whether it is held.
    pub held: bool,
}

/// The newest faults of a machine: the last value on `graver.machine.NAME.faults`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MachineFaults {
    /// The version of this message: 1.
    pub version: u32,
    /// The machine's name in the fleet.
    pub machine: String,
    /// When this was said.
    pub time: f64,
    /// The faults, the newest last.
    pub faults: Vec<PastFault>,
}

/// What a job for a group of machines is: the header `Graver-Job` of a message on `graver.jobs.GROUP`, whose body is the file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JobTicket {
    /// The version of this message: 1.
    pub version: u32,
    /// The job's number in the fleet: 16 hexadecimal digits that no other job has.
    pub id: String,
    /// The name of its file, without folders; the ending says what it is.
    pub name: String,
    /// Changes of the job, `KEY=VALUE`.
    #[serde(default)]
    pub set: Vec<String>,
    /// When it was submitted.
    pub submitted: f64,
}

/// What has become of a job: the last value on `graver.records.ID`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JobRecord {
    /// The version of this message: 1.
    pub version: u32,
    /// The job's number in the fleet.
    pub id: String,
    /// Its name.
    pub name: String,
    /// The machine that has it.
    pub machine: String,
    /// The group that it was for.
    pub group: String,
    /// When this was said.
    pub time: f64,
    /// `taken`: it is this machine's and no other's; `queued`: in its queue; `refused`; or how it ended, as a summary's `outcome`.
    pub state: String,
    /// Its number in the machine's own queue; null before it has one.
    pub number: Option<u64>,
    /// Why, in words; null where there is nothing to say.
    pub message: Option<String>,
}

/// Why a machine refused a job: the header `Graver-Refusal` of a message on `graver.refused.GROUP`, which is the job as it came.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct JobRefusal {
    /// The file at fault; null where it is none.
    pub file: Option<String>,
    /// Line from 1.
    pub line: Option<u64>,
    /// Column from 1.
    pub column: Option<u64>,
    /// What is wrong, and what would be right.
    pub message: String,
}

impl JobRefusal {
    /// One without a place.
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), ..Self::default() }
    }
}

impl std::fmt::Display for JobRefusal {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for part in [
            self.file.clone(),
            self.line.map(|it| it.to_string()),
            self.column.map(|it| it.to_string()),
        ] {
            let Some(part) = part else { break };
            write!(formatter, "{part}:")?;
        }
        let space = if self.file.is_some() { " " } else { "" };
        write!(formatter, "{space}{}", self.message)
    }
}

/// All that a fleet says of itself, as `graver fleet status --json` prints it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FleetStatus {
    /// The machines, by name.
    pub machines: BTreeMap<String, FleetMachine>,
    /// Jobs that no machine has taken yet, by group.
    pub waiting: BTreeMap<String, u64>,
    /// Jobs that were refused and lie there, by group.
    pub refused: BTreeMap<String, u64>,
    /// The newest records of jobs, the newest last.
    pub jobs: Vec<JobRecord>,
}

/// The answer to a job that was handed to a fleet, as `graver fleet submit --json` prints it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct FleetSubmitted {
    /// The job's number in the fleet.
    pub id: String,
}

/// What a machine said last.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FleetMachine {
    /// Whether it is online and has said so lately.
    pub is_heard: bool,
    /// How long ago it said what it is doing [s]; null where it never did.
    pub age: Option<f64>,
    /// What it is doing.
    pub state: Option<MachineState>,
    /// Its job.
    pub job: Option<MachineJob>,
    /// What it has counted.
    pub metrics: Option<MachineMetrics>,
    /// Its faults.
    pub faults: Option<MachineFaults>,
}
