//! A job that is planned, window by window, a little ahead of who plays it: memory does not grow with the job.

use crate::exit::Failure;
use machine::Machine;
use messages::Setpoint;
use messages::artwork::ArtworkLine;
use planner::{Job, PlanError, PlanFacts, PlannedStretch};
use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Instant;
use workbench::simulation::{BrokenOff, SetpointSource};

/// Setpoints that are waited for before anything is played: what is wrong with a job of a quarter of a minute is told
/// before.
const BEGINNING: usize = 16_384;

/// Windows on their way.
const ON_THEIR_WAY: usize = 2;

/// What a plan comes to, and the time that it took [s].
type Outcome = Result<(PlanFacts, f64), PlanError>;

/// The stream of a job in the making.
pub(super) struct PlannedAhead {
    /// `None` once the last window has come.
    windows: Option<Receiver<PlannedStretch>>,
    setpoints: VecDeque<Setpoint>,
    strokes: Vec<ArtworkLine>,
    thread: Option<JoinHandle<Outcome>>,
    outcome: Option<Outcome>,
}

impl PlannedAhead {
    /// Begins to plan `job` on `machine`.
    ///
    /// # Errors
    /// When the operating system gives no thread.
    pub(super) fn start(machine: &Machine, job: Job) -> Result<Self, Failure> {
        let (sender, windows) = sync_channel(ON_THEIR_WAY);
        let machine = machine.clone();
        let thread = std::thread::Builder::new().name("plan".to_owned());
        let thread = thread.spawn(move || plan(&machine, &job, &sender));
        Ok(Self {
            windows: Some(windows),
            setpoints: VecDeque::new(),
            strokes: Vec::new(),
            thread: Some(thread.map_err(Failure::service)?),
            outcome: None,
        })
    }

    /// Waits for the first quarter of a minute of the job.
    ///
    /// # Errors
    /// What is wrong with it as far as that.
    pub(super) fn begin(&mut self) -> Result<(), PlanError> {
        while self.setpoints.len() < BEGINNING && self.next() {}
        match &self.outcome {
            Some(Err(error)) => Err(error.clone()),
            _ => Ok(()),
        }
    }

    /// What is marked in the setpoints that came since this was asked before, and just after them.
    pub(super) fn strokes(&mut self) -> Vec<ArtworkLine> {
        core::mem::take(&mut self.strokes)
    }

    /// What the whole plan comes to, and the time that it took [s]; hands what is marked in the rest of it to `drawn`.
    ///
    /// # Errors
    /// What is wrong with the job.
    pub(super) fn finish(mut self, mut drawn: impl FnMut(ArtworkLine)) -> Outcome {
        while self.next() {
            self.setpoints.clear();
            self.strokes().into_iter().for_each(&mut drawn);
        }
        self.strokes().into_iter().for_each(drawn);
        self.outcome.unwrap_or(Err(PlanError::Abandoned))
    }

    /// Takes the next window. Says whether there was one.
    fn next(&mut self) -> bool {
        let Some(windows) = &self.windows else { return false };
        if let Ok(PlannedStretch { setpoints, strokes }) = windows.recv() {
            self.setpoints.extend(setpoints);
            self.strokes.extend(strokes);
            return true;
        }
        self.windows = None;
        // A panic goes on here.
        self.outcome = self.thread.take().map(|thread| match thread.join() {
            Ok(outcome) => outcome,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        false
    }
}

impl SetpointSource for PlannedAhead {
    fn wait(&mut self, count: usize) -> Result<(), BrokenOff> {
        while self.setpoints.len() < count && self.next() {}
        if matches!(self.outcome, Some(Err(_))) { Err(BrokenOff) } else { Ok(()) }
    }

    fn take(&mut self, count: usize, setpoints: &mut Vec<Setpoint>) {
        setpoints.extend(self.setpoints.drain(..count.min(self.setpoints.len())));
    }
}

/// Plans `job`, and hands each window to who waits for it.
fn plan(machine: &Machine, job: &Job, sender: &SyncSender<PlannedStretch>) -> Outcome {
    let began = Instant::now();
    let mut waited = 0.0;
    let facts = planner::plan_while(machine, job, |stretch| {
        let asked = Instant::now();
        let is_wanted = sender.send(stretch).is_ok();
        waited += asked.elapsed().as_secs_f64();
        is_wanted
    })?;
    let facts = facts.ok_or(PlanError::Abandoned)?;
    Ok((facts, began.elapsed().as_secs_f64() - waited))
}
