//! Planning for mechanisms whose joints do not go straight with the tool: the route, the check of
//! every sample, and a second look, slower, where the check finds a limit broken.

use std::sync::Arc;

use machine::kinematics::Joints;
use machine::{Machine, Mechanism, MechanismVisitor, PathLimits};
use signals::AxisArray;

use crate::attitude::AttitudeLaw;
use crate::check::{Breach, Quantity};
use crate::demand::Demands;
use crate::drawing::Note;
use crate::itinerary::Stop;
use crate::plan::{Place, PlanError};
use crate::posture::{Posture, Refused};
use crate::retry::Retry;
use crate::route::{NoWay, Route, Slowed, Speeds, route};
use crate::timing::Leg;
use crate::trajectory::{Course, Trajectory};
use crate::unwind::divide;

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
    /// What is gone through, where that is not what was asked for: strokes in parts.
    pub(crate) stops: Option<Vec<Stop>>,
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
        let mut speeds = Speeds {
            strokes: speeds.iter().map(|speed| (*speed, 1.0)).collect(),
            moves: vec![1.0; stops.len()],
        };
        let mut retry = Retry::default();
        let mut divided: Option<Vec<Stop>> = None;
        loop {
            let stops = divided.as_deref().unwrap_or(stops);
            let start = Posture { joints, branch: 0 };
            let mut routed = match route(&demands, &machine.area, start, stops, &speeds) {
                Ok(routed) => routed,
                Err(found) => {
                    let Some((parts, part_speeds)) =
                        parts(&demands, &joints, stops, &speeds, &found)
                    else {
                        return Err(refusal(machine, found));
                    };
                    speeds = part_speeds;
                    divided = Some(parts);
                    continue;
                }
            };
            let owners = core::mem::take(&mut routed.owners);
            let mut routed = lay(machine, &limits, routed, attitude)?;
            let error = match (self.check)(&routed.trajectory) {
                Ok(checked) => {
                    let notes = notes_of_parts(self.task.stops, divided.as_deref());
                    routed.notes.extend(notes);
                    routed.stops = divided;
                    return Ok((routed, checked));
                }
                Err(error) => error,
            };
            let PlanError::Limit { place, breach, .. } = &error else { return Err(error) };
            let found = (&*routed.trajectory, owners.as_slice());
            if !retry.slow(&mut speeds, stops, found, (place, breach)) {
                return Err(error);
            }
        }
    }
}

/// The stops with the stroke divided for which a table cannot turn as far as `found` says.
fn parts<const N: usize, M: Mechanism<N>>(
    demands: &Demands<'_, N, M>,
    near: &Joints<N>,
    stops: &[Stop],
    speeds: &Speeds,
    found: &NoWay,
) -> Option<(Vec<Stop>, Speeds)> {
    let Refused::Position { axis, .. } = found.cause else { return None };
    divide(demands, near, (stops, found.stop), speeds, axis)
}

/// A note for each stroke that is marked in parts.
fn notes_of_parts(asked: &[Stop], gone: Option<&[Stop]>) -> Vec<Note> {
    let Some(gone) = gone else { return Vec::new() };
    let mut notes = Vec::new();
    let mut rest = gone;
    for (index, stop) in asked.iter().enumerate() {
        let next = asked.get(index + 1);
        let is_part = |found: &&Stop| Some(*found) != next && found.line == stop.line;
        let parts =
            if rest.first() == Some(stop) { 1 } else { rest.iter().take_while(is_part).count() };
        if parts > 1 {
            let text = format!(
                "marked in {parts} parts: between them an axis is turned back in the dark, whose travel \
                 is less than the stroke winds up"
            );
            notes.push(Note { line: stop.line, text });
        }
        rest = &rest[parts.min(rest.len())..];
    }
    notes
}

fn refusal(machine: &Machine, found: NoWay) -> PlanError {
    let NoWay { line, stop: _, stroke, time, cause } = found;
    let place = Place { stroke, time };
    match cause {
        Refused::Kinematics(cause) => PlanError::Unreachable { line, place, cause },
        Refused::NoPosture { tried } => PlanError::NoPosture { line, place, tried },
        Refused::Position { axis, value, limit } => {
            let axis = machine.axes.get(axis);
            let unit = axis.map_or("", |axis| axis.unit.name());
            let axis = axis.map(|axis| axis.name.clone());
            let quantity = Quantity::JointPosition;
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
    let Route { first, legs, owners: _, slowed, speed } = route;
    let lay = |sink: &mut dyn FnMut(Leg<'a>)| legs.into_iter().for_each(sink);
    let mut trajectory = Trajectory::lay(Course::Joints(first), limits, &machine.laser, lay)
        .map_err(|short| PlanError::TooShort { line: short.line, duration: short.duration })?;
    trajectory.attitude = attitude;
    Ok(Routed { trajectory: Arc::new(trajectory), notes: notes(&slowed), stops: None, speed })
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::drawing::{Action, Curve, Drawing, Step};
    use crate::itinerary::itinerary;
    use nalgebra::Vector3;

    const POLAR: &str = include_str!("../../machines/polar.toml");

    /// Plans moves by the joints, along a curve and straight, with a check that finds `quantity` in
    /// excess in the middle of piece `bad` the first `times` times. The pieces at the last check.
    fn pieces_with(
        quantity: Quantity,
        bad: usize,
        times: usize,
    ) -> Result<Vec<(String, f64)>, PlanError> {
        let mut machine = Machine::parse("polar.toml", POLAR, &[]).unwrap();
        // So narrow that the joints cannot go along their arc at the end, nor through the centre.
        machine.area.upper[0] = 0.062;
        let side = machine.home_joints[0].signum();
        machine.axes[0].limits.position = if side > 0.0 { [0.01, 0.62] } else { [-0.62, -0.01] };
        let at = |x: f64, y: f64| Vector3::new(x, y, 0.05);
        let actions = [
            Action::Rapid { to: at(0.03, 0.02) },
            Action::Feed {
                curve: Curve::Line { from: at(0.03, 0.02), to: at(0.06, -0.04) },
                speed: 0.05,
            },
            Action::Rapid { to: at(0.06, 0.04) },
        ];
        let steps = actions.map(|action| Step { action, line: 1 }).to_vec();
        let start = Vector3::from(machine.home);
        let drawing = Drawing { name: String::new(), start, steps, notes: Vec::new() };
        let stops = itinerary(&drawing, &machine.path, None).unwrap();
        let task = Task {
            machine: &machine,
            limits: machine.path,
            stops: &stops,
            speeds: &[],
            standing: None,
            attitude: AttitudeLaw::Level,
        };
        let mut pieces = Vec::new();
        let mut trial = 0;
        let check = |trajectory: &Arc<Trajectory>| {
            let name = |course: &Course| format!("{course:?}").chars().take(5).collect();
            let found = trajectory.pieces.iter().map(|piece| (name(&piece.course), piece.duration));
            pieces = found.collect();
            trial += 1;
            if trial > times {
                return Ok(());
            }
            let piece = &trajectory.pieces[bad];
            let time = piece.start + piece.duration / 2.0;
            let breach = Breach { time, axis: None, quantity, value: 2.0, limit: 1.0, unit: "A" };
            Err(PlanError::Limit { line: 1, place: Place { stroke: 0, time }, breach })
        };
        machine.mechanism.visit(PlanJoints { task, check })?;
        Ok(pieces)
    }

    #[test]
    fn what_breaks_a_limit_in_the_dark_is_slowed_and_nothing_else() {
        let before = pieces_with(Quantity::MotorCurrent, 0, 0).unwrap();
        let kinds: Vec<&str> = before.iter().map(|(kind, _)| kind.as_str()).collect();
        assert_eq!(kinds, ["Joint", "Joint", "Feed(", "Strai"]);
        for bad in 1..=3 {
            let after = pieces_with(Quantity::MotorCurrent, bad, 2).unwrap();
            for (index, ((_, was), (kind, is))) in before.iter().zip(&after).enumerate() {
                let slower = if index == bad { 1.0 / (0.85 * 0.85) } else { 1.0 };
                assert!((is / was - slower).abs() < 1e-6, "{kind}: {was} s, then {is} s");
            }
        }
    }

    #[test]
    fn a_breach_that_adds_up_slows_everything() {
        let before = pieces_with(Quantity::HeatingCurrent, 0, 0).unwrap();
        let after = pieces_with(Quantity::HeatingCurrent, 2, 1).unwrap();
        for ((kind, was), (_, is)) in before.iter().zip(&after).skip(1) {
            assert!((is / was - 1.0 / 0.85).abs() < 1e-6, "{kind}: {was} s, then {is} s");
        }
    }

    #[test]
    fn a_place_out_of_limits_is_refused_at_once() {
        let mut refused = 0;
        for bad in 1..=3 {
            refused += usize::from(pieces_with(Quantity::JointPosition, bad, 1).is_err());
        }
        assert_eq!(refused, 3);
    }

    /// The words of a refusal say what was tried, and what would help.
    #[test]
    fn the_lack_of_a_posture_is_told_by_what_was_tried() {
        let machine = Machine::parse("polar.toml", POLAR, &[]).unwrap();
        let cause = Refused::NoPosture { tried: 7 };
        let error = refusal(&machine, NoWay { line: 3, stop: 1, stroke: 2, time: 0.5, cause });
        assert_eq!(error.line(), 3);
        assert_eq!(
            error.to_string(),
            "stroke 2, at 0.500 s: of 7 postures tried, none in which the axes can follow this stroke \
             can be reached from the one before; move the stroke, or mark it in parts"
        );
    }
}
