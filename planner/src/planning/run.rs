//! Plans a job window by window, as far ahead of the consumer as it allows, and plans the windows that it has
//! not taken again when the override rises.

use machine::{Machine, Mechanism, MechanismVisitor, PathLimits};
use messages::plan::{LayerFacts, PlanFacts};

use super::ahead::Ahead;
use super::open_speeds::{Chosen, choose};
use super::operations::{OperationQueue, Steps};
use super::outlet::Outlet;
use super::refusals::explained;
use super::standing::Start;
use super::{Planning, Task};
use crate::drawing::Note;
use crate::error::PlanError;
use crate::geometry::attitude::AttitudeLaw;
use crate::geometry::operations::Operations;
use crate::job::composition::Composition;
use crate::job::{Job, JobError};
use crate::limits::motion_limits::Scope;

/// Plans `job` for `machine` within `scope` and hands each window to `outlet`, checked; its setpoints
/// belong to `stream`.
///
/// # Errors
/// The first thing in it that no speed can do, with line, stroke, time, axis, value and limit.
pub(crate) fn plan_windows(
    machine: &Machine,
    job: &Job,
    scope: Scope,
    stream: u64,
    outlet: &mut dyn Outlet,
) -> Result<PlanFacts, PlanError> {
    if let (Some(reason), Scope::Machine) = (job.ideal_only, scope) {
        return Err(PlanError::IdealOnly(reason));
    }
    let drawing = &job.drawing;
    let limits = path_limits(machine, job);
    let mut notes = drawing.notes.clone();
    let Chosen { speeds, corners_at } = choose(machine, job, &limits, scope, &mut notes)?;
    let standing = job
        .standing
        .unwrap_or_else(|| machine.mechanism.visit(Start { machine, start: drawing.start }));
    let estimate = job.estimate(&limits, &|speed| speeds.of(speed));
    let task = Task {
        machine,
        limits,
        scope,
        speeds,
        turns: job.marking.turns,
        z_is_height: machine.mechanism.moves_in_z()
            && job.surface.is_none()
            && job.attitude == AttitudeLaw::Level,
        attitude: job.attitude,
        surface: job.surface,
        standing,
        frequency: job.marking.frequency.unwrap_or(0.0),
        estimate,
        is_dry: job.marking.is_dry,
        is_frame: job.shows_frame(),
        start: drawing.start,
    };
    let source = operations(machine, job, &limits, corners_at)?;
    let (stroke, along) = (job.marking.from_stroke, job.marking.from_along);
    if stroke > 1 || along > 0.0 {
        let along = match along {
            0.0 => String::new(),
            along => format!(", {:.4} mm along it", along * 1e3),
        };
        let text = format!("begins with stroke {stroke}{along}, as the job says");
        notes.push(Note { line: 0, text });
    }
    if job.marking.is_dry {
        notes.push(Note { line: 0, text: "dry run: the whole motion, and nothing lit".to_owned() });
    }
    let nothing = match job.program {
        Some(_) => "nothing is marked: no G1, G2 or G3 is made with M3 or M4 on and S above 0",
        None => "nothing is marked",
    };
    let is_dark = job.marking.is_dry || job.marking.frame.is_some();
    let layers = job.composition.as_ref().map(Composition::layers).unwrap_or_default();
    let facts = Facts { name: &drawing.name, notes, is_dark, nothing, layers };
    let done = machine.mechanism.visit(Run { task: &task, source, stream, outlet, facts });
    done.map_err(|error| explained(error, job))
}

/// The limits of `machine` along paths, as `job` has them.
pub(crate) fn path_limits(machine: &Machine, job: &Job) -> PathLimits {
    PathLimits {
        rapid: job.rapid.unwrap_or(machine.path.rapid),
        tolerance: job.marking.tolerance.unwrap_or(machine.path.tolerance),
        ..machine.path
    }
}

/// What `job` does on `machine`, from the stroke on that it begins with, with corners that open lines pass
/// where they allow `corners_at` [m/s].
///
/// # Errors
/// A job whose file cannot be opened.
fn operations<'a>(
    machine: &Machine,
    job: &'a Job,
    limits: &PathLimits,
    corners_at: f64,
) -> Result<OperationQueue<'a>, PlanError> {
    let unreadable =
        |error: JobError| PlanError::Unreadable { line: 0, message: error.to_string() };
    let steps: Steps<'a> = Box::new(job.steps().map_err(unreadable)?);
    let queue = OperationQueue::new(steps, of_steps(machine, job, limits, corners_at));
    Ok(queue.beginning_with(job.marking.from_stroke, job.marking.from_along, limits))
}

/// As [`operations`], before any of it is planned. Where the job begins with a stroke other than the first, lines
/// end at the corners at which a plan ends them, so that strokes are counted alike.
///
/// # Errors
/// As of [`operations`], and a job that cannot be read.
pub(crate) fn unplanned<'a>(
    machine: &Machine,
    job: &'a Job,
    limits: &PathLimits,
) -> Result<OperationQueue<'a>, PlanError> {
    let begins_later = job.marking.from_stroke > 1 || job.marking.from_along > 0.0;
    let corners_at = match begins_later {
        true => choose(machine, job, limits, Scope::Machine, &mut Vec::new())?.corners_at,
        false => limits.speed,
    };
    operations(machine, job, limits, corners_at)
}

/// What makes operations of the steps of `job`, with corners that open lines pass where they allow
/// `corners_at` [m/s].
pub(super) fn of_steps<'a>(
    machine: &Machine,
    job: &'a Job,
    limits: &PathLimits,
    corners_at: f64,
) -> Operations<'a> {
    let (start, surface) = (job.drawing.start, job.surface.as_ref());
    let operations =
        Operations::new(start, limits, machine.corners, surface).corners_at(corners_at);
    operations.lit_by(machine.laser, machine.realtime.period, job.marking)
}

/// What of the facts is known beforehand.
struct Facts<'a> {
    name: &'a str,
    notes: Vec<Note>,
    /// Whether it is meant to mark nothing.
    is_dark: bool,
    /// The note of a job that marks nothing.
    nothing: &'static str,
    layers: Vec<LayerFacts>,
}

impl Facts<'_> {
    fn of<const N: usize, M: Mechanism<N>>(&self, planning: &Planning<'_, N, M>) -> PlanFacts {
        let account = &planning.account;
        let mut notes = [self.notes.clone(), planning.notes()].concat();
        let is_dry = planning.task.is_dry;
        if account.strokes == 0 && !self.is_dark && planning.is_complete() {
            notes.push(Note { line: 0, text: self.nothing.to_owned() });
        }
        PlanFacts {
            name: self.name.to_owned(),
            strokes: account.strokes as usize,
            passed_over: planning.passed_over().strokes,
            passed_along: planning.passed_over().along,
            is_whole: planning.is_complete(),
            length: account.length,
            duration: planning.duration(),
            samples: planning.samples(),
            speed: account.speed,
            speed_asked: account.asked.speed,
            speed_limit: planning.task.speeds.most,
            power: account.power,
            bounds: account.bounds,
            dry_run: is_dry,
            layers: self.layers.clone(),
            notes,
            uses: planning.utilization().clone(),
            interpolation: planning.interpolation(),
            binding: account.shares.report(planning.task.machine),
        }
    }
}

/// Plans a job on a mechanism.
struct Run<'a, 'o> {
    task: &'a Task<'a>,
    source: OperationQueue<'a>,
    stream: u64,
    outlet: &'o mut dyn Outlet,
    facts: Facts<'a>,
}

impl MechanismVisitor for Run<'_, '_> {
    type Output = Result<PlanFacts, PlanError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let Self { task, source, stream, outlet, facts } = self;
        let mut planning = Planning::new(&mechanism, task, source, stream)?;
        Ahead::default().run(&mut planning, outlet, &|planning| facts.of(planning))?;
        Ok(facts.of(&planning))
    }
}
