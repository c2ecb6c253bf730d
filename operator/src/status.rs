//! What a running pipeline is doing.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What a pipeline is doing, as `graver status --json` prints it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Status {
    /// The controller's state.
    pub state: String,
    /// Why the machine stands, or does not go on, in words; null where there is nothing to say.
    pub cause: Option<String>,
    /// What the planner is doing.
    pub planner: String,
    /// The machine file; null for the built-in machine.
    pub machine_file: Option<String>,
    /// The stream being played, 0 for none.
    pub stream: u64,
    /// Its job, when it has one.
    pub job: Option<String>,
    /// The number of the job under way; null without one.
    pub job_number: Option<u64>,
    /// The run folder of the job under way; null without one.
    pub run_folder: Option<String>,
    /// How long ago the job under way was begun; null without one [s].
    pub elapsed: Option<f64>,
    /// How much of the job has been played, 0 to 1.
    pub share: f64,
    /// Setpoints played so far.
    pub played: u64,
    /// Setpoints of the stream that were planned so far; all of them once the plan is complete.
    pub samples: u64,
    /// How long the job still takes at the present rate, an estimate until its plan is complete; null
    /// without a job under way [s].
    pub time_left: Option<f64>,
    /// Stroke being marked, from 1; 0 for none.
    pub stroke: u64,
    /// Strokes of the job; 0 while that is not known.
    pub strokes: u64,
    /// Line of the job file where the motion under way begins; null where it has none.
    pub line: Option<u64>,
    /// Speed that the plan gives the tool along its path now [m/s].
    pub speed: f64,
    /// Laser power that is commanded now, 0 to 1.
    pub power: f64,
    /// Whether the laser marks right now.
    pub lit: bool,
    /// Whether the job under way is held, by a person, its program, a door, or for want of setpoints.
    pub held: bool,
    /// Rate at which the stream is played.
    pub rate: f64,
    /// The rate that is asked for, 1 as planned; the stream is played at it where nothing holds it up.
    pub rate_override: f64,
    /// So many times the power that the job asks for is given, until it ends.
    pub power_override: f64,
    /// The most of the rate at which the tool flies from mark to mark, 1 as planned.
    pub rapid_override: f64,
    /// Where the plan has the tool [m].
    pub tool: [f64; 3],
    /// Axes that know their place; all of a machine without homing.
    pub homed: Vec<String>,
    /// Axes that have to be homed before a job.
    pub unhomed: Vec<String>,
    /// The axes by name, and the directions of the tool that can be jogged and are no axis.
    pub axes: BTreeMap<String, AxisStatus>,
    /// The inputs of the machine file, and whether each is active.
    pub inputs: BTreeMap<String, bool>,
    /// What keeps the light off: the missing interlocks, each with the device, register, value and limit that it comes from.
    pub interlocks: Vec<String>,
    /// What people should see to, in the same words; it stops nothing.
    pub warnings: Vec<String>,
    /// The outputs of the machine file, and whether each is on.
    pub outputs: BTreeMap<String, bool>,
    /// Where the probe touched last; null before it has.
    pub probed: Option<Probed>,
    /// How the newest motion by hand ended: `reached`, `stopped`, `soft_limit`, `dead_man`, `door_open`, `interlock`,
    /// `not_touched`, `out_of_reach` or `fault`; `none` while it lasts and before the first.
    pub motion_end: String,
    /// How many requests the controller has accepted; a reply with a greater `number` does not show here yet.
    pub requests: u32,
    /// The latched fault.
    pub fault: Option<String>,
    /// The newest faults, the newest last; also those of before the start where they are kept.
    pub faults: Vec<PastFault>,
    /// Where all of them are kept; null where they are not.
    pub faults_file: Option<String>,
    /// Cycles since drives started.
    pub cycles: u64,
    /// Overruns since drives started.
    pub overruns: u64,
    /// Process id of each service; null for one that does not run.
    pub services: BTreeMap<String, Option<i32>>,
}

/// Where an axis is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct AxisStatus {
    /// Where the joint is, in its unit.
    pub position: f64,
    /// `m` where it slides, `rad` where it turns.
    pub unit: String,
    /// Whether it knows its place.
    pub homed: bool,
    /// Its lower and its upper soft limit; null at an end that it does not have.
    pub limits: [Option<f64>; 2],
}

/// Where the probe touched.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Probed {
    /// The axis that was moved.
    pub axis: String,
    /// Where its joint was, in its unit.
    pub position: f64,
    /// `m` where it slides, `rad` where it turns.
    pub unit: String,
}

/// A fault that was latched.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PastFault {
    /// When, in seconds since 1970.
    pub time: u64,
    /// Its code.
    pub code: String,
    /// What was found, in words.
    pub detail: String,
    /// The job that was under way; null without one.
    pub job: Option<String>,
}
