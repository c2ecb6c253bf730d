//! From a job to a checked stream of setpoints.

use std::sync::Arc;

use machine::kinematics::KinematicsError;
use machine::{Axis, Machine, Mechanism, MechanismKind, MechanismVisitor, PathLimits};
use nalgebra::Vector3;
use signals::artwork::Artwork;
use signals::time::{CYCLE_PERIOD, CYCLE_TIME};
use signals::{MAX_EDGES, Setpoint};

use crate::artwork::artwork;
use crate::between::Between;
use crate::check::{Breach, Checker, Scope};
use crate::itinerary::itinerary;
use crate::job::Job;
use crate::joint_plan::{IsLinear, PlanJoints, Routed, Task};
use crate::outline::Outline;
use crate::sampler::{Sampler, Unreachable};
use crate::speed;
use crate::trajectory::Trajectory;

pub use signals::plan::{PlanFacts, Uses};

/// Jobs that last longer are refused, most likely for a slip of the pen [s].
const LONGEST: f64 = 7.0 * 86_400.0;

/// Samples checked between two looks at whether anybody still waits for the plan.
const LOOK: u64 = 4096;

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

/// Why a job was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The job is a comparison on paper.
    #[error("this job can be planned, not run: {0}")]
    IdealOnly(&'static str),
    /// Whoever asked for the plan does not want it any more.
    #[error("planning was given up: the job was withdrawn")]
    Abandoned,
    /// A stroke bends so sharply that no speed is low enough.
    #[error(
        "this line turns too sharply to be marked without a stop: its curvature allows {speed:e} m/s"
    )]
    TooSharp {
        /// Line of the job file, 0 for none.
        line: u64,
        /// The speed that its curvature allows [m/s].
        speed: f64,
    },
    /// A motion that would not end while anybody waits for it.
    #[error("this job would take {:.1} days, more than a week", duration / 86_400.0)]
    TooLong {
        /// How long it lasts [s].
        duration: f64,
    },
    /// The laser source cannot switch on and off in the time of a stroke.
    #[error(
        "this stroke lasts {:.3} ms, too short for the laser's switching delays or too close to \
         the stroke before",
        duration * 1e3
    )]
    TooShort {
        /// Line of the job file, 0 for none.
        line: u64,
        /// How long it lasts [s].
        duration: f64,
    },
    /// The laser changes more often in one cycle than a setpoint can say.
    #[error("the laser would change more than {MAX_EDGES} times in the millisecond at {time:.3} s")]
    TooManyEdges {
        /// Line of the job file, 0 for none.
        line: u64,
        /// Stream time [s].
        time: f64,
    },
    /// The tool cannot get there.
    #[error("{place}: the tool cannot be there: {cause}")]
    Unreachable {
        /// Line of the job file, 0 for none.
        line: u64,
        /// Where in the job.
        place: Place,
        /// Why.
        cause: KinematicsError,
    },
    /// The joints would have to stand otherwise than they can.
    #[error(
        "{place}: of {tried} postures tried, none in which the axes can follow this stroke can be \
         reached from the one before; move the stroke, or mark it in parts"
    )]
    NoPosture {
        /// Line of the job file, 0 for none.
        line: u64,
        /// Where in the job.
        place: Place,
        /// How many were tried.
        tried: usize,
    },
    /// A limit of path, area, axis or motor.
    #[error(
        "{place}{}: {} of {:.6} {unit} is beyond the limit of {:.6} {unit}",
        breach.axis.as_ref().map(|axis| format!(", axis {axis}")).unwrap_or_default(),
        breach.quantity,
        breach.value,
        breach.limit,
        unit = breach.unit
    )]
    Limit {
        /// Line of the job file, 0 for none.
        line: u64,
        /// Where in the job.
        place: Place,
        /// Which limit, and by how much.
        breach: Breach,
    },
}

/// Where in a job something is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// The stroke that is marked, approached or left, from 1; 0 for none.
    pub stroke: u64,
    /// Stream time [s].
    pub time: f64,
}

impl core::fmt::Display for Place {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.stroke {
            0 => write!(formatter, "at {:.3} s", self.time),
            stroke => write!(formatter, "stroke {stroke}, at {:.3} s", self.time),
        }
    }
}

impl PlanError {
    /// Line of the job file that it concerns, from 1; 0 for none.
    pub fn line(&self) -> u64 {
        match self {
            Self::IdealOnly(_) | Self::Abandoned | Self::TooLong { .. } => 0,
            Self::TooSharp { line, .. }
            | Self::TooShort { line, .. }
            | Self::TooManyEdges { line, .. }
            | Self::Unreachable { line, .. }
            | Self::NoPosture { line, .. }
            | Self::Limit { line, .. } => *line,
        }
    }
}

/// Plans `job` for `machine` and checks every sample against the limits of path and axes.
///
/// # Errors
/// The first limit that it breaks, with line, stroke, time, axis, value and limit.
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
    let stops = itinerary(drawing, &limits, job.surface.as_ref()).map_err(|(line, cause)| {
        PlanError::Unreachable { line, place: Place { stroke: 0, time: 0.0 }, cause }
    })?;
    let chosen = speed::choose(drawing.start, &stops, &limits, &job.marking)
        .map_err(|sharp| PlanError::TooSharp { line: sharp.line, speed: sharp.speed })?;
    let task = Task {
        machine,
        limits,
        stops: &stops,
        speeds: &chosen.speeds,
        standing: job.standing,
        attitude: job.attitude,
    };
    let check =
        |trajectory: &Arc<Trajectory>| checked(machine, limits, trajectory, scope, abandoned);
    let (routed, (samples, uses)) =
        if scope == Scope::PathAlone || machine.mechanism.visit(IsLinear) {
            by_tool(drawing.start, &task, check)?
        } else {
            machine.mechanism.visit(PlanJoints { task, check })?
        };
    // Last, so that a drawing far beyond the area is refused before it is drawn point by point.
    let artwork = artwork(routed.stops.as_deref().unwrap_or(&stops));
    let notes = [drawing.notes.as_slice(), &chosen.notes, &routed.notes].concat();
    let facts = PlanFacts {
        name: drawing.name.clone(),
        strokes: artwork.strokes.len(),
        // From 0, since the sum of nothing is -0.
        length: speed::outlines(&stops).map(Outline::length).fold(0.0, |a, b| a + b),
        duration: routed.trajectory.duration(),
        samples,
        speed: routed.speed,
        notes,
        uses,
    };
    Ok(Plan {
        artwork,
        facts,
        trajectory: routed.trajectory,
        mechanism: machine.mechanism.clone(),
        axes: machine.axes.clone(),
    })
}

/// Plans a task by the tool alone, from `start` on, and checks it with `check`: for mechanisms whose
/// joints go straight with the tool, and for what is held to the path alone.
fn by_tool<T>(
    start: Vector3<f64>,
    task: &Task<'_>,
    check: impl FnOnce(&Arc<Trajectory>) -> Result<T, PlanError>,
) -> Result<(Routed, T), PlanError> {
    let Task { machine, limits, stops, speeds, standing: _, attitude } = *task;
    let mut trajectory = Trajectory::new(start, stops, &limits, &machine.laser, speeds)
        .map_err(|short| PlanError::TooShort { line: short.line, duration: short.duration })?;
    trajectory.attitude = attitude;
    let trajectory = Arc::new(trajectory);
    let found = check(&trajectory)?;
    let speed = speeds.iter().copied().fold(0.0, f64::max);
    Ok((Routed { trajectory, notes: Vec::new(), stops: None, speed }, found))
}

/// Samples a trajectory and holds it to the limits in `scope`: how many samples there are, and what
/// of the limits they use.
fn checked(
    machine: &Machine,
    limits: PathLimits,
    trajectory: &Arc<Trajectory>,
    scope: Scope,
    abandoned: &dyn Fn() -> bool,
) -> Result<(u64, Uses), PlanError> {
    if trajectory.end().is_nan() || trajectory.end() > LONGEST {
        return Err(PlanError::TooLong { duration: trajectory.duration() });
    }
    check_edges(trajectory)?;
    let checker = Checker::new(machine, limits, scope);
    let between = match scope {
        Scope::Machine => Some(Between::new(limits.tolerance)),
        Scope::PathAlone => None,
    };
    let axes = &machine.axes;
    machine.mechanism.visit(CheckAll { trajectory, axes, checker, between, abandoned })
}

/// That no cycle needs more changes of the laser than a sample can hold.
fn check_edges(trajectory: &Trajectory) -> Result<(), PlanError> {
    let cycle = |index: usize| trajectory.laser[index].time.0.div_euclid(CYCLE_PERIOD.0);
    for last in MAX_EDGES..trajectory.laser.len() {
        if cycle(last) == cycle(last - MAX_EDGES) {
            let time = trajectory.laser[last].time.seconds();
            let line = trajectory.piece_at(time).map_or(0, |piece| piece.line);
            return Err(PlanError::TooManyEdges { line, time });
        }
    }
    Ok(())
}

/// Samples the whole plan and checks every sample.
struct CheckAll<'a> {
    trajectory: &'a Arc<Trajectory>,
    axes: &'a [Axis],
    checker: Checker<'a>,
    /// Where the axes have to follow, so that what lies between two setpoints depends on them.
    between: Option<Between>,
    abandoned: &'a dyn Fn() -> bool,
}

impl MechanismVisitor for CheckAll<'_> {
    type Output = Result<(u64, Uses), PlanError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let Self { trajectory, axes, mut checker, between, abandoned } = self;
        let refuse = |found| unreachable(trajectory, found);
        // On straight joints the cubic is the tool's own.
        let is_linear = mechanism.is_linear();
        let mut sampler =
            Sampler::new(mechanism, axes, Arc::clone(trajectory), 1).map_err(refuse)?;
        let mut between = between.filter(|_| !is_linear);
        let refuse_breach = |breach: Breach| {
            let (line, place) = place(trajectory, breach.time);
            PlanError::Limit { line, place, breach }
        };
        let mut samples: u64 = 0;
        while let Some(setpoint) = sampler.next() {
            samples += 1;
            if samples.is_multiple_of(LOOK) && abandoned() {
                return Err(PlanError::Abandoned);
            }
            checker.look(&setpoint).map_err(refuse_breach)?;
            if let Some(between) = &mut between {
                let time = setpoint.sequence as f64 * CYCLE_TIME;
                let breach = between
                    .look(&setpoint, &sampler, trajectory)
                    .map_err(|cause| refuse(Unreachable { time, cause }))?;
                if let Some(breach) = breach {
                    return Err(refuse_breach(breach));
                }
            }
        }
        match sampler.broken() {
            Some(found) => Err(refuse(found)),
            None => Ok((samples, checker.uses())),
        }
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
        let trajectory = Arc::clone(&self.plan.trajectory);
        match Sampler::new(mechanism, &self.plan.axes, trajectory, self.stream) {
            Ok(sampler) => Box::new(sampler),
            // The checker has made every sample of this plan.
            Err(_) => Box::new(core::iter::empty()),
        }
    }
}

impl Plan {
    /// The stream of setpoints, numbered `stream`, from the first to the one flagged as last.
    pub fn setpoints(&self, stream: u64) -> Box<dyn Iterator<Item = Setpoint> + Send> {
        self.visit(Stream { plan: self, stream })
    }

    pub(crate) fn axes(&self) -> &[Axis] {
        &self.axes
    }

    pub(crate) fn visit<V: MechanismVisitor>(&self, visitor: V) -> V::Output {
        self.mechanism.visit(visitor)
    }
}

/// What a sample that cannot be made means for the job.
pub(crate) fn unreachable(trajectory: &Trajectory, found: Unreachable) -> PlanError {
    let (line, place) = place(trajectory, found.time);
    PlanError::Unreachable { line, place, cause: found.cause }
}

/// Line and place in the job at `time` [s].
pub(crate) fn place(trajectory: &Trajectory, time: f64) -> (u64, Place) {
    let piece = trajectory.piece_at(time);
    let stroke = piece.map_or(0, |piece| piece.stroke);
    (piece.map_or(0, |piece| piece.line), Place { stroke, time })
}
