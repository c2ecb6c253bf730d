//! Plans a job window by window, as far ahead of the consumer as it allows, and plans the windows that it has
//! not taken again when the override rises.

use machine::kinematics::Joints;
use machine::{Machine, Mechanism, MechanismVisitor, PathLimits, Pose};
use messages::AxisArray;
use messages::axis::axis_array;
use nalgebra::Vector3;

use super::ahead::Ahead;
use super::operations::{OperationQueue, Steps};
use super::{Planning, Task, Window};
use crate::drawing::{Action, Note, Step};
use crate::error::PlanError;
use crate::geometry::attitude::AttitudeLaw;
use crate::geometry::operation::{Operation, Operations};
use crate::geometry::track::Track;
use crate::job::{Job, MarkingSpeed};
use crate::joint_space::directions::directions_near;
use crate::law::optimum::Speeds;
use crate::light::Policy;
use crate::limits::motion_limits::Scope;
use crate::verify::checker::{LimitViolation, Quantity};
use messages::plan::PlanFacts;

/// The consumer of a job's windows.
pub(crate) trait Outlet {
    /// Whether planning shall stop.
    fn is_abandoned(&self) -> bool;

    /// Notes that a window has been planned, which will be taken after those before it.
    fn note(&mut self, _window: &Window) {}

    /// Forgets the last `count` windows that were noted: they are planned anew.
    fn forget(&mut self, _count: usize) {}

    /// Takes the next window; gives it back when there is no room for it yet.
    fn take(&mut self, window: Box<Window>) -> Result<(), Box<Window>>;

    /// How many setpoints may be planned before they can be taken.
    fn ahead(&self) -> usize {
        0
    }

    /// How much faster than it asks for the job shall be marked, 1 as it asks.
    fn rate(&self) -> f64 {
        1.0
    }

    /// Waits a little for room.
    fn wait(&mut self) {}

    /// What the plan comes to so far, asked for after each window and, as `is_last`, after the last.
    fn heed(&mut self, _facts: &dyn Fn() -> PlanFacts, _is_last: bool) {}
}

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
    let limits = PathLimits {
        rapid: job.rapid.unwrap_or(machine.path.rapid),
        tolerance: job.marking.tolerance.unwrap_or(machine.path.tolerance),
        ..machine.path
    };
    let operations = || {
        Operations::new(drawing.start, &limits, machine.corners, job.surface.as_ref())
            .lit_by(machine.laser, job.marking)
    };
    let mut notes = drawing.notes.clone();
    let open = if leaves_speeds_open(job) {
        all(OperationQueue::new(held(job), operations()))?
    } else {
        Vec::new()
    };
    let near = directions_near(machine, limits, job.attitude, scope);
    let speeds = Speeds::choose(drawing.start, &open, &limits, &near, &job.marking, &mut notes);
    drop(open);
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
        standing,
        estimate,
        start: drawing.start,
    };
    let steps: Steps<'_> = Box::new(
        job.steps()
            .map_err(|error| PlanError::Unreadable { line: 0, message: error.to_string() })?,
    );
    let source = OperationQueue::new(steps, operations());
    let nothing = match job.program {
        Some(_) => "nothing is marked: no G1, G2 or G3 is made with M3 or M4 on and S above 0",
        None => "nothing is marked",
    };
    let facts = Facts { name: &drawing.name, notes, nothing };
    let done = machine.mechanism.visit(Run { task: &task, source, stream, outlet, facts });
    done.map_err(|error| at_its_step(error, job))
}

/// `error` with the line of the very step that leaves the area, of all that are followed in one go, how far
/// that leads, and where the program has its zero.
fn at_its_step(mut error: PlanError, job: &Job) -> PlanError {
    /// How far a chord may lie from the curve [m].
    const CHORD: f64 = 1e-5;
    let PlanError::Limit { line, violation, zero, .. } = &mut error else { return error };
    let LimitViolation { quantity: Quantity::ToolPosition(row), value, limit, .. } = *violation
    else {
        return error;
    };
    if job.surface.is_some() {
        return error;
    }
    *zero = job.survey.as_ref().and_then(|survey| survey.zero).map(Box::new);
    let beyond = |point: &[f64; 3]| (point[row] - limit) * (value - limit).signum();
    // How far a step goes beyond: by less than a fitted curve strays it does not.
    let leaves = |step: Step| {
        let points = match &step.action {
            Action::Mark { curve, .. } | Action::Feed { curve, .. } => {
                let mut points = vec![curve.from().into()];
                Track::new(curve).sample(CHORD, &mut points);
                points
            }
            Action::Rapid { to } => vec![(*to).into()],
            _ => return None,
        };
        let farthest = points.iter().map(beyond).fold(0.0, f64::max);
        (farthest > (value - limit).abs() / 2.0).then_some((step.line, farthest))
    };
    let steps = job.steps().into_iter().flatten().map_while(Result::ok);
    let mut near = steps.skip_while(|step| step.line < *line);
    if let Some((step, farthest)) = near.find_map(leaves) {
        *line = step;
        violation.value = limit + farthest * (value - limit).signum();
    }
    error
}

/// Whether the speed of some line is for the planner to choose, so that it must know the job before
/// it begins.
fn leaves_speeds_open(job: &Job) -> bool {
    let is_open = |step: &Step| {
        let Action::Mark { speed, power, .. } = &step.action else { return false };
        speed.is_none() && job.marking.policy(power) == Policy::Constant
    };
    match job.marking.speed {
        Some(MarkingSpeed::Constant(_)) => false,
        Some(MarkingSpeed::Optimum) => true,
        None => job.drawing.steps.iter().any(is_open),
    }
}

/// The steps by which speeds are chosen: of a program that is too long to be held, its beginning.
fn held(job: &Job) -> Steps<'_> {
    match job.steps() {
        Ok(steps) => Box::new(steps.take(Job::HELD as usize)),
        Err(_) => Box::new(core::iter::empty()),
    }
}

fn all(mut source: OperationQueue<'_>) -> Result<Vec<Operation>, PlanError> {
    let mut operations = Vec::new();
    while let Some(operation) = source.get(operations.len())? {
        operations.push(operation.clone());
    }
    Ok(operations)
}

/// Where the joints stand when nobody says: at home, or where the drawing begins on a machine whose
/// joints follow from that.
struct Start<'a> {
    machine: &'a Machine,
    start: Vector3<f64>,
}

impl MechanismVisitor for Start<'_> {
    type Output = AxisArray;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> AxisArray {
        let home = axis_array(self.machine.home_joints.as_slice());
        if !mechanism.is_linear() {
            return home;
        }
        let near = Joints::<N>::from_fn(|axis, _| home[axis]);
        let joints = mechanism.inverse(&Pose::at(self.start), mechanism.branch(), &near);
        joints.map_or(home, |joints| axis_array(joints.as_slice()))
    }
}

/// What of the facts is known beforehand.
struct Facts<'a> {
    name: &'a str,
    notes: Vec<Note>,
    /// The note of a job that marks nothing.
    nothing: &'static str,
}

impl Facts<'_> {
    fn of<const N: usize, M: Mechanism<N>>(&self, planning: &Planning<'_, N, M>) -> PlanFacts {
        let account = &planning.account;
        let mut notes = [self.notes.clone(), planning.notes()].concat();
        if account.strokes == 0 && planning.is_complete() {
            notes.push(Note { line: 0, text: self.nothing.to_owned() });
        }
        PlanFacts {
            name: self.name.to_owned(),
            strokes: account.strokes as usize,
            length: account.length,
            duration: planning.duration(),
            samples: planning.samples(),
            speed: account.speed,
            speed_asked: account.asked.speed,
            speed_limit: planning.task.speeds.most,
            notes,
            uses: planning.utilization().clone(),
            binding: account.shares.report(&planning.task.machine.axes),
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
