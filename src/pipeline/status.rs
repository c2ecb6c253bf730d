//! What operators see of a running pipeline.

use super::Latest;
use machine::Machine;
use messages::{ControllerState, Fault, MotionEnd, Nanoseconds, PlannerPhase, Progress};
use monitor::summary::FaultSummary;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

/// A notice board: the supervisor writes, operators' threads read.
#[derive(Debug, Default)]
pub struct StatusBoard {
    status: Mutex<Status>,
    /// The run folder of the job.
    folder: Mutex<Option<PathBuf>>,
    /// The machine, once it is known.
    machine: Mutex<Option<Machine>>,
    /// When the newest fault was found.
    newest: Mutex<Nanoseconds>,
}

/// What a pipeline is doing, as `graver status --json` prints it.
#[derive(Debug, Clone, Default, Serialize, schemars::JsonSchema)]
pub struct Status {
    /// The controller's state.
    pub state: String,
    /// What the planner is doing.
    pub planner: String,
    /// The stream being played, 0 for none.
    pub stream: u64,
    /// Its job, when it has one.
    pub job: Option<String>,
    /// Setpoints played so far.
    pub played: u64,
    /// Setpoints of the stream that were planned so far; all of them once the plan is complete.
    pub samples: u64,
    /// How long the job still takes at the present rate, an estimate until its plan is complete; null
    /// without a job under way [s].
    pub time_left: Option<f64>,
    /// Stroke being marked, from 1; 0 for none.
    pub stroke: u64,
    /// Rate at which the stream is played.
    pub rate: f64,
    /// Where the plan has the tool [m].
    pub tool: [f64; 3],
    /// Axes that know their place; all of a machine without homing.
    pub homed: Vec<String>,
    /// Axes that have to be homed before a job.
    pub unhomed: Vec<String>,
    /// The axes by name.
    pub axes: BTreeMap<String, AxisStatus>,
    /// The inputs of the machine file, and whether each is active.
    pub inputs: BTreeMap<String, bool>,
    /// Where the probe touched last; null before it has.
    pub probed: Option<Probed>,
    /// How the newest motion by hand ended: `reached`, `stopped`, `soft_limit`, `dead_man`, `door_open`, `interlock`,
    /// `not_touched`, `out_of_reach` or `fault`; `none` while it lasts and before the first.
    pub motion_end: String,
    /// How many requests the controller has accepted; a reply with a greater `number` does not show here yet.
    pub requests: u32,
    /// The latched fault.
    pub fault: Option<String>,
    /// The faults since the start, the newest last, with the time of day.
    pub faults: Vec<PastFault>,
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
}

/// The most faults that are remembered.
const MOST_FAULTS: usize = 32;

impl StatusBoard {
    /// Learns the names of the machine's axes and inputs.
    pub fn know(&self, machine: &Machine) {
        *locked(&self.machine) = Some(machine.clone());
    }

    /// Adds a fault that is new to those that are remembered.
    fn remember(&self, status: &mut Status, fault: &Fault) {
        let mut newest = locked(&self.newest);
        if !fault.is_some() || *newest == fault.at {
            return;
        }
        *newest = fault.at;
        let machine = locked(&self.machine);
        let told = machine.as_ref().and_then(|machine| FaultSummary::of(fault, machine));
        let time = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
        let code = fault.code().name().to_owned();
        let detail = told.map_or_else(|| code.clone(), |told| told.to_string());
        if status.faults.len() >= MOST_FAULTS {
            status.faults.remove(0);
        }
        status.faults.push(PastFault { time, code, detail });
    }

    /// Writes the latest samples; `held` when a person holds a job that is not played yet.
    pub fn post(&self, latest: &Latest, held: bool, pids: &[(&'static str, Option<i32>)]) {
        let mut status = self.lock();
        let Latest { progress, drives, planner, .. } = latest;
        let state = ControllerState::from_wire(progress.state);
        let state = if held { ControllerState::Holding } else { state };
        status.state = state.name().to_owned();
        status.planner = match PlannerPhase::from_wire(planner.phase) {
            PlannerPhase::Idle => "idle",
            PlannerPhase::Planning => "planning",
            PlannerPhase::Streaming => "streaming",
            PlannerPhase::Sent => "sent",
            PlannerPhase::Refused => "refused",
        }
        .to_owned();
        status.stream = progress.stream;
        status.played = progress.played;
        status.samples = if planner.stream == progress.stream { planner.samples } else { 0 };
        status.time_left = latest.time_left();
        status.stroke = progress.stroke;
        status.rate = progress.rate;
        status.tool = progress.tool;
        let fault = progress.fault;
        status.fault = fault.is_some().then(|| fault.code().name().to_owned());
        self.remember(&mut status, &fault);
        if let Some(machine) = locked(&self.machine).as_ref() {
            status.operated(progress, machine);
        }
        status.motion_end = MotionEnd::from_wire(progress.motion_end).name().to_owned();
        status.requests = progress.requests;
        status.cycles = drives.cycle.0;
        status.overruns = drives.overruns;
        status.services = pids.iter().map(|(name, pid)| ((*name).to_owned(), *pid)).collect();
    }

    /// Names the job that runs and its run folder, or none.
    pub fn name_job(&self, job: Option<(&str, &Path)>) {
        self.lock().job = job.map(|(name, _)| name.to_owned());
        *locked(&self.folder) = job.map(|(_, folder)| folder.to_owned());
    }

    /// The run folder of the job that runs.
    pub fn folder(&self) -> Option<PathBuf> {
        locked(&self.folder).clone()
    }

    /// What stands there now.
    pub fn read(&self) -> Status {
        self.lock().clone()
    }

    fn lock(&self) -> MutexGuard<'_, Status> {
        locked(&self.status)
    }
}

impl Status {
    /// What concerns axes and inputs of `machine`.
    fn operated(&mut self, progress: &Progress, machine: &Machine) {
        let axes = machine.axes.iter().zip(&progress.position).enumerate();
        let axes = axes.map(|(index, (axis, place))| {
            let limits = axis.limits.position.map(|limit| limit.is_finite().then_some(limit));
            let homed = progress.homed >> index & 1 == 1;
            let unit = axis.unit.name().to_owned();
            (axis.name.clone(), AxisStatus { position: *place, unit, homed, limits })
        });
        self.axes = axes.collect();
        let named = |is_homed: bool| {
            let axes = machine.axes.iter().map(|axis| &axis.name);
            axes.filter(|name| self.axes[*name].homed == is_homed).cloned().collect()
        };
        (self.homed, self.unhomed) = (named(true), named(false));
        let inputs = machine.operating.bits();
        let inputs = inputs.map(|(bit, input)| (input.name.clone(), progress.inputs & bit != 0));
        self.inputs = inputs.collect();
        let axis = (progress.probed_axis as usize).checked_sub(1);
        self.probed = axis.and_then(|index| machine.axes.get(index)).map(|axis| Probed {
            axis: axis.name.clone(),
            position: progress.probed,
            unit: axis.unit.name().to_owned(),
        });
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A reader that panicked cannot have left it half written.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
