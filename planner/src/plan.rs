//! From a job to a checked stream of setpoints.

use std::cell::Cell;
use std::sync::Arc;

use machine::{Actuator, Axis, Machine, Mechanism, MechanismKind, MechanismVisitor};
use messages::Setpoint;
use messages::artwork::{Artwork, ArtworkLine};

use crate::error::PlanError;
use crate::job::Job;
use crate::joint_space::joint_move::JointMove;
use crate::limits::motion_limits::Scope;
use crate::planning::Window;
use crate::planning::outlet::Outlet;
use crate::planning::run::plan_windows;
use crate::sampling::sampler::Sampler;
use crate::trajectory::{Motion, Trajectory};

pub use messages::plan::{Binding, LimitUtilization, PlanFacts};

/// A job, planned and checked for one machine.
#[derive(Debug, Clone)]
pub struct Plan {
    /// What shall be marked: the measure of the marks.
    pub artwork: Artwork,
    /// What the plan comes to.
    pub facts: PlanFacts,
    /// The motion and the laser as functions of stream time.
    pub trajectory: Arc<Trajectory>,
    mechanism: MechanismKind,
    axes: Vec<Axis>,
    actuators: Vec<Actuator>,
    is_frame: bool,
}

/// Plans `job` for `machine` and checks every sample against the limits of path and axes.
///
/// # Errors
/// The first thing in it that no speed can do, with line, stroke, time, axis, value and limit.
pub fn plan(machine: &Machine, job: &Job) -> Result<Plan, PlanError> {
    plan_unless(machine, job, &|| false)
}

/// Plans as [`plan`], but gives up soon after `abandoned` says so.
pub(crate) fn plan_unless(
    machine: &Machine,
    job: &Job,
    abandoned: &dyn Fn() -> bool,
) -> Result<Plan, PlanError> {
    plan_within(machine, job, Scope::Machine, abandoned, &mut |_| ())
}

/// Plans as [`plan`], and tells `told` each window's setpoints as soon as they are checked.
///
/// # Errors
/// As [`plan`].
pub fn plan_telling(
    machine: &Machine,
    job: &Job,
    told: &mut dyn FnMut(&[Setpoint]),
) -> Result<Plan, PlanError> {
    plan_within(machine, job, Scope::Machine, &|| false, told)
}

/// Plans `job` and checks it against the limits of the path only: what the tool's motion would be
/// if the axes could follow.
///
/// # Errors
/// As [`plan`], without axes and area.
pub fn plan_ideal(machine: &Machine, job: &Job) -> Result<Plan, PlanError> {
    plan_within(machine, job, Scope::PathAlone, &|| false, &mut |_| ())
}

/// Plans `job` and hands its setpoints to `take`, checked, window by window, without keeping them: memory
/// does not grow with the job.
///
/// # Errors
/// As [`plan`]; what came before it has been handed over.
pub fn plan_through(
    machine: &Machine,
    job: &Job,
    mut take: impl FnMut(&[Setpoint]),
) -> Result<PlanFacts, PlanError> {
    let take = |stretch: PlannedStretch| take(&stretch.setpoints);
    plan_windows(machine, job, Scope::Machine, 1, &mut Through { take, has_ended: None })
}

/// A stretch of a plan, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedStretch {
    /// Its setpoints; each belongs to the stretch or to the one before.
    pub setpoints: Vec<Setpoint>,
    /// The lines and dots that begin in it, and parts of those that go on.
    pub strokes: Vec<ArtworkLine>,
}

/// Plans `job` window by window, as [`plan_through`], for as long as `take` says that it wants more; `None` where it
/// did not.
///
/// # Errors
/// As [`plan`]; what came before it has been handed over.
pub fn plan_while(
    machine: &Machine,
    job: &Job,
    mut take: impl FnMut(PlannedStretch) -> bool,
) -> Result<Option<PlanFacts>, PlanError> {
    let has_ended = Cell::new(false);
    let mut through = Through {
        take: |stretch: PlannedStretch| {
            let goes_on = !has_ended.get() && take(stretch);
            has_ended.set(!goes_on);
        },
        has_ended: Some(&has_ended),
    };
    match plan_windows(machine, job, Scope::Machine, 1, &mut through) {
        Err(PlanError::Abandoned) if has_ended.get() => Ok(None),
        planned => planned.map(Some),
    }
}

/// Hands windows on.
struct Through<'a, F> {
    take: F,
    /// Whether no more are wanted.
    has_ended: Option<&'a Cell<bool>>,
}

impl<F: FnMut(PlannedStretch)> Outlet for Through<'_, F> {
    fn is_abandoned(&self) -> bool {
        self.has_ended.is_some_and(Cell::get)
    }

    fn take(&mut self, window: Box<Window>) -> Result<(), Box<Window>> {
        let Window { setpoints, strokes, .. } = *window;
        (self.take)(PlannedStretch { setpoints, strokes });
        Ok(())
    }
}

fn plan_within(
    machine: &Machine,
    job: &Job,
    scope: Scope,
    abandoned: &dyn Fn() -> bool,
    told: &mut dyn FnMut(&[Setpoint]),
) -> Result<Plan, PlanError> {
    let mut whole = Whole::default();
    let mut taking = Taking { whole: &mut whole, abandoned, told };
    let facts = plan_windows(machine, job, scope, 1, &mut taking)?;
    let Whole { trajectory, artwork } = whole;
    Ok(Plan {
        artwork,
        facts,
        trajectory: Arc::new(trajectory),
        mechanism: machine.mechanism.clone(),
        axes: machine.axes.clone(),
        actuators: machine.actuators.clone(),
        is_frame: job.shows_frame(),
    })
}

/// Keeps the motion of all windows.
#[derive(Default)]
struct Whole {
    trajectory: Trajectory,
    artwork: Artwork,
}

struct Taking<'a> {
    whole: &'a mut Whole,
    abandoned: &'a dyn Fn() -> bool,
    told: &'a mut dyn FnMut(&[Setpoint]),
}

impl Outlet for Taking<'_> {
    fn is_abandoned(&self) -> bool {
        (self.abandoned)()
    }

    fn take(&mut self, window: Box<Window>) -> Result<(), Box<Window>> {
        (self.told)(&window.setpoints);
        self.whole.trajectory.attitude = window.trajectory.attitude;
        self.whole.trajectory.append(&window.trajectory);
        window.strokes.into_iter().for_each(|line| self.whole.artwork.add(line));
        Ok(())
    }
}

/// Makes the stream of a plan that was checked.
struct Stream<'a> {
    plan: &'a Plan,
    stream: u64,
}

impl MechanismVisitor for Stream<'_> {
    type Output = Box<dyn Iterator<Item = Setpoint> + Send>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        match sampler(self.plan, mechanism, self.stream) {
            Some(sampler) => Box::new(sampler),
            // Every sample of this plan has been made and checked.
            None => Box::new(core::iter::empty()),
        }
    }
}

/// The sampler of a whole plan.
pub(crate) fn sampler<const N: usize, M: Mechanism<N>>(
    plan: &Plan,
    mechanism: M,
    stream: u64,
) -> Option<Sampler<N, M>> {
    let trajectory = &plan.trajectory;
    let first = trajectory.pieces.first()?;
    let rest: &JointMove = match &first.motion {
        Motion::Rest(rest) => rest,
        _ => return None,
    };
    let attitude = trajectory.attitude;
    let (axes, actuators) = (&plan.axes, &plan.actuators);
    let sampler = Sampler::new(mechanism, axes, actuators, rest.clone(), attitude, stream);
    let mut sampler = sampler.ok()?;
    sampler.show_frame(plan.is_frame);
    sampler.extend(trajectory, true);
    Some(sampler)
}

impl Plan {
    /// The stream of setpoints, numbered `stream`, from the first to the one flagged as last.
    pub fn setpoints(&self, stream: u64) -> Box<dyn Iterator<Item = Setpoint> + Send> {
        self.visit(Stream { plan: self, stream })
    }

    pub(crate) fn visit<V: MechanismVisitor>(&self, visitor: V) -> V::Output {
        self.mechanism.visit(visitor)
    }
}
