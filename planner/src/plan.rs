//! From a job to a checked stream of setpoints.

use std::sync::Arc;

use machine::kinematics::KinematicsError;
use machine::{Axis, Machine, Mechanism, MechanismKind, MechanismVisitor, PathLimits};
use signals::artwork::Artwork;
use signals::time::CYCLE_PERIOD;
use signals::{MAX_EDGES, Setpoint};

use crate::artwork::artwork;
use crate::check::{Breach, Checker};
use crate::itinerary::itinerary;
use crate::job::Job;
use crate::joint_plan::{IsLinear, PlanJoints, Task};
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
        None => plan_within(machine, job, false, abandoned),
    }
}

/// Plans `job` and checks it against the limits of the path only: what the tool's motion would be
/// if the axes could follow.
///
/// # Errors
/// As [`plan`], without axes and area.
pub fn plan_ideal(machine: &Machine, job: &Job) -> Result<Plan, PlanError> {
    plan_within(machine, job, true, &|| false)
}

fn plan_within(
    machine: &Machine,
    job: &Job,
    ideal: bool,
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
    let mut plan = Plan {
        artwork: Artwork::default(),
        facts: PlanFacts {
            name: drawing.name.clone(),
            strokes: 0,
            // From 0, since the sum of nothing is -0.
            length: speed::outlines(&stops)
                .map(crate::outline::Outline::length)
                .fold(0.0, |a, b| a + b),
            duration: 0.0,
            samples: 0,
            speed: chosen.speeds.iter().copied().fold(0.0, f64::max),
            notes: drawing.notes.iter().cloned().chain(chosen.notes).collect(),
            uses: Uses::default(),
        },
        trajectory: Arc::default(),
        mechanism: machine.mechanism.clone(),
        axes: machine.axes.clone(),
    };
    let check = |trajectory: &Arc<Trajectory>| {
        if trajectory.end().is_nan() || trajectory.end() > LONGEST {
            return Err(PlanError::TooLong { duration: trajectory.duration() });
        }
        check_edges(trajectory)?;
        let checker = Checker::new(machine, limits, ideal);
        machine.mechanism.visit(CheckAll { trajectory, axes: &machine.axes, checker, abandoned })
    };
    let mut gone = None;
    let (samples, uses) = if ideal || machine.mechanism.visit(IsLinear) {
        let mut trajectory =
            Trajectory::new(drawing.start, &stops, &limits, &machine.laser, &chosen.speeds)
                .map_err(|short| PlanError::TooShort {
                    line: short.line,
                    duration: short.duration,
                })?;
        trajectory.attitude = job.attitude;
        plan.trajectory = Arc::new(trajectory);
        check(&plan.trajectory)?
    } else {
        let task = Task {
            machine,
            limits,
            stops: &stops,
            speeds: &chosen.speeds,
            standing: job.standing,
            attitude: job.attitude,
        };
        let (routed, checked) = machine.mechanism.visit(PlanJoints { task, check })?;
        plan.trajectory = routed.trajectory;
        plan.facts.notes.extend(routed.notes);
        plan.facts.speed = routed.speed;
        gone = routed.stops;
        checked
    };
    plan.facts.duration = plan.trajectory.duration();
    plan.facts.samples = samples;
    plan.facts.uses = uses;
    // Last, so that a drawing far beyond the area is refused before it is drawn point by point.
    plan.artwork = artwork(gone.as_deref().unwrap_or(&stops));
    plan.facts.strokes = plan.artwork.strokes.len();
    Ok(plan)
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
    abandoned: &'a dyn Fn() -> bool,
}

impl MechanismVisitor for CheckAll<'_> {
    type Output = Result<(u64, Uses), PlanError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let Self { trajectory, axes, mut checker, abandoned } = self;
        let refuse = |found| unreachable(trajectory, found);
        let mut sampler =
            Sampler::new(mechanism, axes, Arc::clone(trajectory), 1).map_err(refuse)?;
        let mut samples: u64 = 0;
        for setpoint in sampler.by_ref() {
            samples += 1;
            if samples.is_multiple_of(LOOK) && abandoned() {
                return Err(PlanError::Abandoned);
            }
            checker.look(&setpoint).map_err(|breach| {
                let (line, place) = place(trajectory, breach.time);
                PlanError::Limit { line, place, breach }
            })?;
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
