//! The slow part of the service, on a thread of its own: files, reading, planning, checking. It is as far
//! ahead of what has been sent as memory for its setpoints allows, and gives up soon after nobody
//! listens any more.

use super::departure::approach;
use super::plan_files::PlanFiles;
use crate::planning::Window;
use crate::planning::outlet::Outlet;
use crate::planning::run::plan_windows;
use crate::request::{JobRequest, Refusal};
use crate::{Job, PlanError, PlanFacts};
use crossbeam::atomic::AtomicCell;
use crossbeam::channel::{Receiver, Sender, bounded};
use machine::Machine;
use messages::{AxisArray, Setpoint, run_folder};
use runtime::{ServiceError, message};
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use crate::limits::motion_limits::Scope;

/// Setpoints that may be planned before they can be sent: some 16 s.
const AHEAD: usize = 16_384;

/// How long it waits for room before it looks again.
const PAUSE: Duration = Duration::from_millis(1);

/// What comes of planning, piece by piece.
pub(super) enum Planned {
    /// The setpoints of the next window, checked, and what is known with them.
    Window(Vec<Setpoint>, Known),
    /// The plan is complete; all its windows came before.
    Complete(Box<PlanFacts>),
    /// The job cannot be done.
    Refused(Refusal),
}

/// What is known of a plan up to the end of a window.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Known {
    /// Stream time there [s], and an estimate of that at the end of the job.
    pub(super) end: f64,
    pub(super) estimate: f64,
    /// Lines and dots so far.
    pub(super) strokes: u64,
}

/// What the service and its planning thread share.
#[derive(Debug)]
struct Shared {
    abandoned: AtomicCell<bool>,
    /// How much faster than it asks for the job shall be marked.
    rate: AtomicCell<f64>,
}

/// A plan in the making; dropping this makes its thread give up.
pub(super) struct PlanningThread {
    planned: Receiver<Planned>,
    shared: Arc<Shared>,
}

impl PlanningThread {
    /// Plans the job of the run folder `folder`, whose files go on in `spare` where it takes no more, on `machine` from where the motors stand, load side [m
    /// or rad], as `stream`.
    ///
    /// # Errors
    /// When the operating system gives no thread.
    pub(super) fn start(
        (folder, spare): (&Path, &Path),
        machine: &Machine,
        standing: &AxisArray,
        stream: u64,
    ) -> Result<Self, ServiceError> {
        let shared =
            Arc::new(Shared { abandoned: AtomicCell::new(false), rate: AtomicCell::new(1.0) });
        // One window on its way; the others can still be planned anew.
        let (sender, planned) = bounded(1);
        let task = Task {
            folder: folder.to_owned(),
            spare: spare.to_owned(),
            machine: machine.clone(),
            standing: *standing,
            stream,
            shared: shared.clone(),
        };
        let thread = std::thread::Builder::new().name("plan".to_owned());
        let thread = thread.spawn(move || {
            let last = match task.plan(&sender) {
                Ok(facts) => Planned::Complete(Box::new(facts)),
                Err(refusal) => Planned::Refused(refusal),
            };
            // Nobody listens any more when the offer was withdrawn.
            let _ = sender.send(last);
        });
        thread.map_err(|source| ServiceError::thread("plan", source))?;
        Ok(Self { planned, shared })
    }

    /// What has been planned and not been taken yet.
    pub(super) fn planned(&self) -> &Receiver<Planned> {
        &self.planned
    }

    /// From the next window that was not taken on, marks at `rate` times the speeds asked for.
    pub(super) fn set_rate(&self, rate: f64) {
        self.shared.rate.store(rate);
    }
}

impl Drop for PlanningThread {
    fn drop(&mut self) {
        self.shared.abandoned.store(true);
    }
}

struct Task {
    folder: PathBuf,
    spare: PathBuf,
    machine: Machine,
    standing: AxisArray,
    stream: u64,
    shared: Arc<Shared>,
}

impl Task {
    fn plan(&self, sender: &Sender<Planned>) -> Result<PlanFacts, Refusal> {
        let file = self.folder.join(run_folder::REQUEST);
        let failed =
            |error: &dyn Display| Refusal::internal(format!("{}: {error}", file.display()));
        let text = std::fs::read(&file).map_err(|error| failed(&error))?;
        let request: JobRequest = serde_json::from_slice(&text).map_err(|error| failed(&error))?;
        let mut job = request.open(&self.machine)?;
        approach(&mut job, &self.machine, &self.standing).map_err(Refusal::internal)?;
        let refuse = |error: PlanError| request.refuse(&error);
        if !job.is_surely_within_reach(&self.machine) {
            // Refused as a whole, then, before anything moves.
            self.plan_to(&job, &mut Nowhere { shared: &self.shared }).map_err(refuse)?;
        }
        if self.shared.abandoned.load() {
            return Err(refuse(PlanError::Abandoned));
        }
        let files = PlanFiles::create(&self.folder, &self.spare)?;
        let mut sending = Sending { sender, shared: &self.shared, files, strokes: 0, failed: None };
        let facts = self.plan_to(&job, &mut sending);
        match sending.failed {
            Some(refusal) => Err(refusal),
            None => facts.map_err(refuse),
        }
    }

    fn plan_to(&self, job: &Job, outlet: &mut dyn Outlet) -> Result<PlanFacts, PlanError> {
        plan_windows(&self.machine, job, Scope::Machine, self.stream, outlet)
    }
}

/// Takes windows only to see that there is nothing to refuse.
struct Nowhere<'a> {
    shared: &'a Shared,
}

impl Outlet for Nowhere<'_> {
    fn is_abandoned(&self) -> bool {
        self.shared.abandoned.load()
    }

    fn take(&mut self, _window: Box<Window>) -> Result<(), Box<Window>> {
        Ok(())
    }
}

/// Hands windows to the service, and writes what others read of them.
struct Sending<'a> {
    sender: &'a Sender<Planned>,
    shared: &'a Shared,
    files: PlanFiles,
    strokes: u64,
    /// What could not be written.
    failed: Option<Refusal>,
}

impl Outlet for Sending<'_> {
    fn is_abandoned(&self) -> bool {
        self.shared.abandoned.load() || self.failed.is_some()
    }

    fn note(&mut self, window: &Window) {
        // What is marked can be judged only by an artwork that was there before.
        if !self.is_abandoned()
            && let Err(refusal) = self.files.add(&window.strokes)
        {
            self.failed = Some(refusal);
        }
    }

    fn forget(&mut self, count: usize) {
        if let Err(refusal) = self.files.take_back(count) {
            self.failed = Some(refusal);
        }
    }

    fn take(&mut self, window: Box<Window>) -> Result<(), Box<Window>> {
        if self.sender.is_full() {
            return Err(window);
        }
        self.files.keep();
        self.strokes += window.strokes.iter().filter(|line| !line.goes_on).count() as u64;
        let Window { setpoints, end, estimate, .. } = *window;
        let known = Known { end, estimate, strokes: self.strokes };
        // Nobody listens any more: it will be abandoned.
        let _ = self.sender.send(Planned::Window(setpoints, known));
        Ok(())
    }

    fn ahead(&self) -> usize {
        AHEAD
    }

    fn rate(&self) -> f64 {
        self.shared.rate.load()
    }

    fn wait(&mut self) {
        std::thread::sleep(PAUSE);
    }

    fn heed(&mut self, facts: &dyn Fn() -> PlanFacts, is_last: bool) {
        // The folder of a job that was withdrawn may be another one's by now.
        if self.is_abandoned() {
            return;
        }
        match self.files.note(facts, is_last) {
            Ok(()) => {}
            // All of the job has been handed on: its marks need no plan.
            Err(refusal) if is_last => message::tell(&refusal.message),
            Err(refusal) => self.failed = Some(refusal),
        }
    }
}
