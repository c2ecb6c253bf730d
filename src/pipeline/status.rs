//! What operators see of a running pipeline.

use super::Latest;
use super::cause::cause;
use super::fault_history::FaultHistory;
use super::refusals::DIRECTIONS;
use super::slow;
use machine::operating::InputFunction;
use machine::{Directions, Machine};
use messages::{
    ControllerState, Fault, HoldCause, MAX_AXES, MotionEnd, Nanoseconds, PlannerPhase, Progress,
};
use monitor::summary::FaultSummary;
use operator::{AxisStatus, PastFault, Probed, Status};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// A notice board: the supervisor writes, operators' threads read.
#[derive(Debug, Default)]
pub struct StatusBoard {
    status: Mutex<Status>,
    /// The job under way.
    job: Mutex<Option<Job>>,
    /// The machine, once it is known, with the directions of its tool.
    machine: Mutex<Option<(Machine, Directions)>>,
    /// When the newest fault was found.
    newest: Mutex<Nanoseconds>,
    /// Whether a job is held by an interlock.
    is_interlocked: Mutex<bool>,
    history: Mutex<FaultHistory>,
}

/// The job under way.
#[derive(Debug)]
struct Job {
    /// Its run folder.
    folder: PathBuf,
    begun: Instant,
    /// What is done before it is played, and after.
    stage: Option<&'static str>,
}

/// The most faults in a status.
const MOST_FAULTS: usize = 32;

impl StatusBoard {
    /// Learns the names of the machine's axes and inputs, and where its file is.
    pub fn know(&self, machine: &Machine, file: Option<&Path>) {
        self.lock().machine_file = file.map(|file| file.display().to_string());
        *locked(&self.machine) = Some((machine.clone(), Directions::of(machine)));
    }

    /// Adds a fault that is new to those that are remembered.
    fn remember(&self, status: &mut Status, fault: &Fault) {
        let mut newest = locked(&self.newest);
        if !fault.is_some() || *newest == fault.at {
            return;
        }
        *newest = fault.at;
        let machine = locked(&self.machine);
        let told = machine.as_ref().and_then(|(machine, _)| FaultSummary::of(fault, machine));
        let code = fault.code().name().to_owned();
        let detail = told.map_or_else(|| code.clone(), |told| told.to_string());
        self.add(status, code, detail);
    }

    /// Adds an interlock that holds a job to the faults, once for each hold: who comes after a night reads why it stood.
    fn remember_interlock(&self, status: &mut Status, progress: &Progress) {
        let cause = HoldCause::from_wire(progress.hold_cause);
        let is_held =
            progress.state == ControllerState::Holding as u32 && cause == HoldCause::Interlock;
        let was_held = std::mem::replace(&mut *locked(&self.is_interlocked), is_held);
        if is_held && !was_held {
            let missing = slow::missing(&status.interlocks);
            self.add(status, "interlock".to_owned(), missing);
        }
    }

    fn add(&self, status: &mut Status, code: String, detail: String) {
        let time = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
        let mut history = locked(&self.history);
        history.add(PastFault { time, code, detail, job: status.job.clone() });
        note_faults(status, &history);
    }

    /// Goes on with the faults in the file at `path`.
    pub fn keep_faults(&self, path: Option<PathBuf>) {
        let history = FaultHistory::open(path);
        note_faults(&mut self.lock(), &history);
        *locked(&self.history) = history;
    }

    /// Writes the latest samples. `held` when a person holds a job that is not played yet; `queue_held` is why those
    /// that wait do not begin.
    pub fn post(
        &self,
        latest: &Latest,
        held: bool,
        queue_held: Option<String>,
        pids: &[(&'static str, Option<i32>)],
    ) {
        let mut status = self.lock();
        let Latest { progress, drives, planner, slow, .. } = latest;
        let state = ControllerState::from_wire(progress.state);
        let state = if held { ControllerState::Holding } else { state };
        let job = locked(&self.job);
        let stage = job.as_ref().and_then(|job| job.stage);
        let begun = job.as_ref().map(|job| job.begun);
        drop(job);
        status.elapsed = begun.map(|begun| begun.elapsed().as_secs_f64());
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
        status.share = latest.share();
        let is_planned = planner.stream == progress.stream;
        status.samples = if is_planned { planner.samples } else { 0 };
        let is_complete = is_planned && planner.is_complete == 1;
        status.strokes = if is_complete { planner.strokes } else { 0 };
        status.time_left = latest.time_left();
        status.stroke = progress.stroke;
        status.line = Some(progress.line).filter(|line| *line > 0);
        (status.speed, status.power) = (progress.speed, progress.power);
        status.lit = progress.lit == 1;
        status.held = state == ControllerState::Holding;
        status.rate = progress.rate;
        (status.rate_override, status.power_override) =
            (progress.override_rate, progress.power_override);
        status.rapid_override = progress.rapid_override;
        status.tool = progress.tool;
        let fault = progress.fault;
        // A controller that has died says nothing more: drives has stopped the machine, and says why.
        let is_lost = pids.contains(&("controller", None)) && drives.fault.is_some();
        let fault = if is_lost { drives.fault } else { fault };
        if is_lost {
            status.state = ControllerState::Faulted.name().to_owned();
            (status.speed, status.power, status.lit) = (0.0, 0.0, drives.lit == 1);
            status.held = false;
        }
        status.fault = fault.is_some().then(|| fault.code().name().to_owned());
        if let Some((machine, _)) = locked(&self.machine).as_ref() {
            let active = |function| slow::active(machine, function, progress.inputs, slow);
            status.interlocks = active(InputFunction::Interlock);
            status.warnings = active(InputFunction::Warning);
        }
        status.cause = match locked(&self.machine).as_ref() {
            _ if held => Some("feed hold before the first motion".to_owned()),
            Some((machine, _)) => cause(progress, &fault, machine, &status.interlocks),
            None => None,
        };
        let otherwise = match begun {
            Some(_) => stage.map(str::to_owned),
            None => queue_held.map(|why| format!("the queue is held: {why}")),
        };
        status.cause = status.cause.take().or(otherwise);
        self.remember(&mut status, &fault);
        self.remember_interlock(&mut status, progress);
        if let Some((machine, directions)) = locked(&self.machine).as_ref() {
            note_operated(&mut status, progress, machine, directions);
        }
        status.motion_end = MotionEnd::from_wire(progress.motion_end).name().to_owned();
        status.requests = progress.requests;
        if is_lost {
            status.outputs.values_mut().for_each(|on| *on = false);
        }
        status.cycles = drives.cycle.0;
        status.overruns = drives.overruns;
        status.services = pids.iter().map(|(name, pid)| ((*name).to_owned(), *pid)).collect();
    }

    /// Names the job that runs, and its run folder.
    pub fn begin_job(&self, number: u64, name: &str, folder: &Path, begun: Instant) {
        let mut status = self.lock();
        (status.job_number, status.job) = (Some(number), Some(name.to_owned()));
        status.run_folder = Some(folder.display().to_string());
        *locked(&self.job) = Some(Job { folder: folder.to_owned(), begun, stage: None });
    }

    /// Says what is done for the job while it is not played.
    pub fn note_stage(&self, stage: Option<&'static str>) {
        if let Some(job) = locked(&self.job).as_mut() {
            job.stage = stage;
        }
    }

    /// No job runs.
    pub fn end_job(&self) {
        let mut status = self.lock();
        (status.job_number, status.job, status.run_folder) = (None, None, None);
        status.elapsed = None;
        *locked(&self.job) = None;
    }

    /// The run folder of the job that runs.
    pub fn folder(&self) -> Option<PathBuf> {
        locked(&self.job).as_ref().map(|job| job.folder.clone())
    }

    /// What stands there now.
    pub fn read(&self) -> Status {
        self.lock().clone()
    }

    fn lock(&self) -> MutexGuard<'_, Status> {
        locked(&self.status)
    }
}

fn note_faults(status: &mut Status, history: &FaultHistory) {
    status.faults = history.newest(MOST_FAULTS);
    status.faults_file = history.path().map(|path| path.display().to_string());
}

/// What concerns axes and inputs of `machine`.
fn note_operated(
    status: &mut Status,
    progress: &Progress,
    machine: &Machine,
    directions: &Directions,
) {
    let axes = machine.axes.iter().zip(&progress.position).enumerate();
    let axes = axes.map(|(index, (axis, place))| {
        let limits = axis.limits.position.map(|limit| limit.is_finite().then_some(limit));
        let homed = progress.homed >> index & 1 == 1;
        let unit = axis.unit.name().to_owned();
        (axis.name.clone(), AxisStatus { position: *place, unit, homed, limits })
    });
    status.axes = axes.collect();
    let is_homed = machine.axes.iter().all(|axis| status.axes[&axis.name].homed);
    for (direction, name) in DIRECTIONS.iter().enumerate() {
        let is_axis = machine.axes.iter().any(|axis| axis.name == *name);
        if directions.lever(direction).is_none() || is_axis {
            continue;
        }
        let area = [machine.area.lower[direction], machine.area.upper[direction]];
        let (position, unit) = (progress.tool[direction], "m".to_owned());
        let place = AxisStatus { position, unit, homed: is_homed, limits: area.map(Some) };
        status.axes.insert((*name).to_owned(), place);
    }
    let named = |is_homed: bool| {
        let axes = machine.axes.iter().map(|axis| &axis.name);
        axes.filter(|name| status.axes[*name].homed == is_homed).cloned().collect()
    };
    (status.homed, status.unhomed) = (named(true), named(false));
    let inputs = machine.operating.bits();
    let inputs = inputs.map(|(bit, input)| (input.name.clone(), progress.inputs & bit != 0));
    status.inputs = inputs.collect();
    let outputs = machine.operating.output_bits();
    let outputs = outputs.map(|(bit, output)| (output.name.clone(), progress.outputs & bit != 0));
    status.outputs = outputs.collect();
    let axis = (progress.probed_axis as usize).checked_sub(1);
    let probed = |name: &str, unit: &str| Probed {
        axis: name.to_owned(),
        position: progress.probed,
        unit: unit.to_owned(),
    };
    status.probed = axis.and_then(|index| match machine.axes.get(index) {
        Some(axis) => Some(probed(&axis.name, axis.unit.name())),
        None => Some(probed(DIRECTIONS.get(index.checked_sub(MAX_AXES)?)?, "m")),
    });
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A reader that panicked cannot have left it half written.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
