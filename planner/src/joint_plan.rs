//! Planning for mechanisms whose joints do not go straight with the tool: the route, the check of
//! every sample, and a second look, slower, where the check finds a limit broken.

use std::sync::Arc;

use machine::kinematics::Joints;
use machine::{Machine, Mechanism, MechanismVisitor, PathLimits};
use signals::AxisArray;

use crate::attitude::AttitudeLaw;
use crate::check::Breach;
use crate::demand::Demands;
use crate::drawing::Note;
use crate::itinerary::Stop;
use crate::plan::{Place, PlanError};
use crate::posture::{Posture, Refused};
use crate::route::{NoWay, Route, Slowed, Speeds, route};
use crate::timing::Leg;
use crate::trajectory::{Course, Trajectory};

/// How much slower a stroke or a move that breaks a limit is tried again, and how often in a job.
const SLOWER: f64 = 0.85;
const TRIALS: u32 = 24;

/// What is to be planned.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Task<'a> {
    pub(crate) machine: &'a Machine,
    pub(crate) limits: PathLimits,
    pub(crate) stops: &'a [Stop],
    /// The speeds that job and path allow [m/s].
    pub(crate) speeds: &'a [f64],
    /// Where the joints stand [m or rad]; `None` for the machine's home.
    pub(crate) standing: Option<AxisArray>,
    pub(crate) attitude: AttitudeLaw,
}

/// A trajectory by the joints.
#[derive(Debug, Clone)]
pub(crate) struct Routed {
    pub(crate) trajectory: Arc<Trajectory>,
    pub(crate) notes: Vec<Note>,
    /// The largest speed of a stroke [m/s].
    pub(crate) speed: f64,
}

/// Whether a mechanism is planned by its tool alone.
pub(crate) struct IsLinear;

impl MechanismVisitor for IsLinear {
    type Output = bool;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> bool {
        mechanism.is_linear()
    }
}

/// Plans, checks with `check`, and plans again slower where that finds a breach.
pub(crate) struct PlanJoints<'a, F> {
    pub(crate) task: Task<'a>,
    pub(crate) check: F,
}

impl<F, T> MechanismVisitor for PlanJoints<'_, F>
where
    F: FnMut(&Arc<Trajectory>) -> Result<T, PlanError>,
{
    type Output = Result<(Routed, T), PlanError>;

    fn visit<const N: usize, M: Mechanism<N>>(mut self, mechanism: M) -> Self::Output {
        let Task { machine, limits, stops, speeds, standing, attitude } = self.task;
        let home = machine.home_joints.as_slice();
        let joints = Joints::<N>::from_fn(|axis, _| match standing {
            Some(standing) => standing[axis],
            None => home.get(axis).copied().unwrap_or(0.0),
        });
        let demands = Demands::new(&mechanism, &machine.axes, limits, &joints, attitude);
        let mut speeds =
            Speeds { strokes: speeds.to_vec(), shares: vec![1.0; speeds.len()], moves: 1.0 };
        let strokes = numbers(stops);
        let mut trial = 0;
        loop {
            trial += 1;
            let start = Posture { joints, branch: 0 };
            let routed = route(&demands, &machine.area, start, stops, &speeds)
                .map_err(|found| refusal(machine, found))?;
            let routed = lay(machine, &limits, routed, attitude)?;
            match (self.check)(&routed.trajectory) {
                Ok(checked) => return Ok((routed, checked)),
                Err(PlanError::Limit { place, breach, .. })
                    if trial < TRIALS && may_be_slower(&breach) =>
                {
                    let piece = routed.trajectory.piece_at(place.time);
                    let of_joints =
                        piece.is_none_or(|piece| matches!(piece.course, Course::Joints(_)));
                    let stroke = strokes.get((place.stroke as usize).wrapping_sub(1)).copied();
                    match stroke.flatten().filter(|_| !of_joints) {
                        Some(stroke) => speeds.shares[stroke] *= SLOWER,
                        None => speeds.moves *= SLOWER,
                    }
                }
                Err(error) => return Err(error),
            }
        }
    }
}

/// Whether less speed mends a breach.
fn may_be_slower(breach: &Breach) -> bool {
    const PLACES: [&str; 4] = ["joint position", "x of the tool", "y of the tool", "z of the tool"];
    !PLACES.contains(&breach.quantity)
}

/// For each stroke or dot in order, its number among the strokes; `None` for dots.
fn numbers(stops: &[Stop]) -> Vec<Option<usize>> {
    use crate::itinerary::Item;
    let mut count = 0;
    let number = |stop: &Stop| match stop.item {
        Item::Stroke(_) => {
            count += 1;
            Some(Some(count - 1))
        }
        Item::Dot(_) => Some(None),
        _ => None,
    };
    stops.iter().filter_map(number).collect()
}

fn refusal(machine: &Machine, found: NoWay) -> PlanError {
    let NoWay { line, stroke, time, cause } = found;
    let place = Place { stroke, time };
    match cause {
        Refused::Kinematics(cause) => PlanError::Unreachable { line, place, cause },
        Refused::Position { axis, value, limit } => {
            let axis = machine.axes.get(axis);
            let unit = axis.map_or("", |axis| axis.unit.name());
            let axis = axis.map(|axis| axis.name.clone());
            let quantity = "joint position";
            let breach = Breach { time, axis, quantity, value, limit, unit };
            PlanError::Limit { line, place, breach }
        }
    }
}

fn lay<'a>(
    machine: &Machine,
    limits: &PathLimits,
    route: Route<'a>,
    attitude: AttitudeLaw,
) -> Result<Routed, PlanError> {
    let Route { first, legs, slowed, speed } = route;
    let lay = |sink: &mut dyn FnMut(Leg<'a>)| legs.into_iter().for_each(sink);
    let mut trajectory = Trajectory::lay(Course::Joints(first), limits, &machine.laser, lay)
        .map_err(|short| PlanError::TooShort { line: short.line, duration: short.duration })?;
    trajectory.attitude = attitude;
    Ok(Routed { trajectory: Arc::new(trajectory), notes: notes(&slowed), speed })
}

/// One note for all strokes that the axes slow down.
fn notes(slowed: &[Slowed]) -> Vec<Note> {
    let Some(worst) = slowed
        .iter()
        .min_by(|one, other| (one.speed / one.asked).total_cmp(&(other.speed / other.asked)))
    else {
        return Vec::new();
    };
    let Slowed { line, asked, speed, place } = *worst;
    let mut text = format!(
        "slowed to {speed:.4} m/s instead of {asked:.4} m/s near x {:.3} mm, y {:.3} mm: the axes \
         can follow no faster there",
        place.x * 1e3,
        place.y * 1e3
    );
    if slowed.len() > 1 {
        text.push_str(&format!("; {} strokes are slowed somewhere", slowed.len()));
    }
    vec![Note { line, text }]
}
