//! From a job to a checked stream of setpoints.

use std::sync::Arc;

use machine::kinematics::Joints;
use machine::{Axis, Machine, Mechanism, MechanismKind, MechanismVisitor, PathLimits, Pose};
use messages::artwork::Artwork;
use messages::axis::axis_array;
use messages::{AxisArray, Setpoint};
use nalgebra::Vector3;

use crate::drawing::Note;
use crate::error::{Place, PlanError};
use crate::geometry::operation::{Operation, OperationKind, Operations};
use crate::job::Job;
use crate::joint_space::directions::directions_near;
use crate::joint_space::joint_move::JointMove;
use crate::law::optimum::Speeds;
use crate::limits::motion_limits::Scope;
use crate::planning::{Planning, Task};
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
    match job.ideal_only {
        Some(reason) => Err(PlanError::IdealOnly(reason)),
        None => plan_within(machine, job, Scope::Machine, abandoned),
    }
}

/// Plans `job` and checks it against the limits of the path only: what the tool's motion would be
/// if the axes could follow.
///
/// # Errors
/// As [`plan`], without axes and area.
pub fn plan_ideal(machine: &Machine, job: &Job) -> Result<Plan, PlanError> {
    plan_within(machine, job, Scope::PathAlone, &|| false)
}

fn plan_within(
    machine: &Machine,
    job: &Job,
    scope: Scope,
    abandoned: &dyn Fn() -> bool,
) -> Result<Plan, PlanError> {
    let drawing = &job.drawing;
    let limits = PathLimits {
        rapid: job.rapid.unwrap_or(machine.path.rapid),
        tolerance: job.marking.tolerance.unwrap_or(machine.path.tolerance),
        ..machine.path
    };
    let surface = job.surface.as_ref();
    let operations = Operations::new(drawing.start, &limits, machine.corners, surface);
    let (operations, found) = operations.all(&drawing.steps).map_err(|(line, cause)| {
        PlanError::Unreachable { line, place: Place { stroke: 0, time: 0.0 }, cause }
    })?;
    let mut notes = [drawing.notes.as_slice(), &found].concat();
    let near = directions_near(machine, limits, job.attitude, scope);
    let speeds =
        Speeds::choose(drawing.start, &operations, &limits, &near, &job.marking, &mut notes);
    let standing = job
        .standing
        .unwrap_or_else(|| machine.mechanism.visit(Start { machine, start: drawing.start }));
    let task = Task {
        machine,
        limits,
        scope,
        speeds,
        turns: job.marking.turns,
        attitude: job.attitude,
        standing,
        abandoned,
    };
    let whole = Whole { task: &task, operations: &operations };
    let (trajectory, artwork, facts) = machine.mechanism.visit(whole)?;
    let facts = PlanFacts {
        name: drawing.name.clone(),
        strokes: artwork.strokes.len(),
        // From 0, since the sum of nothing is -0.
        length: lit_length(&operations).fold(0.0, |a, b| a + b),
        notes: [notes, facts.notes].concat(),
        ..facts
    };
    Ok(Plan {
        artwork,
        facts,
        trajectory: Arc::new(trajectory),
        mechanism: machine.mechanism.clone(),
        axes: machine.axes.clone(),
    })
}

fn lit_length(operations: &[Operation]) -> impl Iterator<Item = f64> + '_ {
    operations.iter().map(|operation| match &operation.kind {
        OperationKind::Path(contour) => contour.lit_length(),
        _ => 0.0,
    })
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

/// Plans all windows of a job and keeps their motion.
struct Whole<'a> {
    task: &'a Task<'a>,
    operations: &'a [Operation],
}

impl MechanismVisitor for Whole<'_> {
    type Output = Result<(Trajectory, Artwork, PlanFacts), PlanError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let Self { task, operations } = self;
        let mut planning = Planning::new(&mechanism, task, operations, 1)?;
        let attitude = task.attitude;
        let mut trajectory = Trajectory { attitude, ..Trajectory::default() };
        let mut artwork = Artwork::default();
        let mut samples = 0;
        while let Some(window) = planning.next_window()? {
            samples += window.setpoints.len() as u64;
            trajectory.append(&window.trajectory);
            artwork.strokes.extend(window.strokes);
        }
        let mut notes: Vec<Note> = planning.notes.clone();
        notes.extend(planning.slowed_note());
        let facts = PlanFacts {
            duration: trajectory.duration(),
            samples,
            speed: planning.speed,
            notes,
            uses: planning.utilization().clone(),
            binding: planning.shares.report(&task.machine.axes),
            ..PlanFacts::default()
        };
        Ok((trajectory, artwork, facts))
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
    let mut sampler = Sampler::new(mechanism, &plan.axes, rest.clone(), attitude, stream).ok()?;
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
