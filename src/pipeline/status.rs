//! What operators see of a running pipeline.

use super::Latest;
use messages::{ControllerState, PlannerPhase};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A notice board: the supervisor writes, operators' threads read.
#[derive(Debug, Default)]
pub struct StatusBoard {
    status: Mutex<Status>,
    /// The run folder of the job.
    folder: Mutex<Option<PathBuf>>,
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
    /// The latched fault.
    pub fault: Option<String>,
    /// Cycles since drives started.
    pub cycles: u64,
    /// Overruns since drives started.
    pub overruns: u64,
    /// Process id of each service; null for one that does not run.
    pub services: BTreeMap<String, Option<i32>>,
}

impl StatusBoard {
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

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A reader that panicked cannot have left it half written.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
