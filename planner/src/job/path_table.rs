//! The job file's table of a path in space.

use core::f64::consts::{PI, TAU};
use std::sync::Arc;

use machine::document::{Diagnostics, Point, Positive, Quantity, Span, Spanned};
use machine::kinematics::{Joints, KinematicsError};
use machine::quantity::{Angle, Length};
use machine::{Machine, Mechanism, MechanismVisitor, Pose, table};
use nalgebra::{Matrix3, Vector3};

use super::file::Reading;
use super::{Job, JobError};
use crate::drawing::{Action, Curve, Drawing, Power, Step};
use crate::geometry::attitude::{AttitudeLaw, turned};
use crate::geometry::posed_path::{Between, PathPose, PosedPath};
use crate::geometry::turning::logarithm;
use crate::joint_space::configuration::branches;

table! {
    /// A path in space, marked in one go: exactly one of `points`, `poses` and `circle`.
    pub struct PathTable {
        /// Where its origin lies as seen from the machine's home.
        pub at: Option<Point>,
        /// Corners [x, y] or [x, y, z] as seen from its origin, joined by straight lines.
        pub points: Option<Vec<Point>>,
        /// Places to pass, each with how the tool is turned there; joined like `points`.
        pub poses: Option<Vec<PoseTable>>,
        /// Whether a smooth curve goes through the points or poses instead of straight lines.
        pub smooth: Spanned<bool> = false,
        /// A circle around its origin.
        pub circle: Option<CircleTable>,
    }
}

table! {
    /// A place to pass, and how the tool is turned there: about x, then y, then z of the machine.
    pub struct PoseTable {
        /// The place [x, y] or [x, y, z] as seen from the path's origin.
        pub at: Point,
        /// About x.
        pub roll: Quantity<Angle> = "0 deg",
        /// About y.
        pub pitch: Quantity<Angle> = "0 deg",
        /// About z.
        pub yaw: Quantity<Angle> = "0 deg",
    }
}

table! {
    /// A circle, gone round once counter-clockwise from its own x.
    pub struct CircleTable {
        /// Its radius.
        pub radius: Quantity<Length, Positive>,
        /// How its plane is turned about x, before `pitch`.
        pub roll: Quantity<Angle> = "0 deg",
        /// How its plane is turned about y.
        pub pitch: Quantity<Angle> = "0 deg",
    }
}

/// The job that marks a path.
pub(super) fn read(table: &PathTable, mut reading: Reading<'_>) -> Result<Job, JobError> {
    let (surface, attitude) = (reading.beside.surface.is_some(), reading.beside.attitude.is_some());
    if surface && table.smooth.value {
        let text = "a smooth curve through points is not put on a surface".to_owned();
        let help = "leave `smooth` or [surface] out";
        reading.diagnostics.contradict(table.smooth.span, text, help);
    }
    if let Some(poses) = &table.poses {
        let given = [surface.then_some("[surface]"), attitude.then_some("[attitude]")];
        for other in given.into_iter().flatten() {
            let place = poses.first().map_or(table.span, |pose| pose.at.span);
            let text = format!("{other} and `poses` both say how the tool is turned");
            reading.diagnostics.contradict(place, text, "keep one of them");
        }
    }
    let (line, name) = (reading.line(table.span), reading.stem("path"));
    let marking = &reading.beside.marking;
    let job = job(table, &name, marking.level(), reading.machine, line, &mut reading.diagnostics);
    reading.finish(Job { marking: marking.marking(), ..job })
}

/// The job that marks a path at `power` on `machine`, named `name`, as asked for in `line` of its file;
/// what is wrong with the table goes to `diagnostics`.
fn job(
    table: &PathTable,
    name: &str,
    power: f64,
    machine: &Machine,
    line: u64,
    diagnostics: &mut Diagnostics,
) -> Job {
    let home = Vector3::from(machine.home);
    let origin = home + table.at.as_ref().map_or(Vector3::zeros(), |at| Vector3::from(at.value));
    let power = Power { level: power, follows_speed: false };
    let between = if table.smooth.value { Between::Curves } else { Between::Lines };
    let mut attitude = AttitudeLaw::Level;
    let actions = match (&table.points, &table.poses, &table.circle) {
        (Some(points), None, None) => {
            if points.len() < 2 {
                let help = "write points such as [[\"0 mm\", \"0 mm\"], [\"10 mm\", \"5 mm\"]]";
                let text = "a path needs at least two points".to_owned();
                diagnostics.contradict(table.span, text, help);
            }
            let corners: Vec<Vector3<f64>> =
                points.iter().map(|point| origin + Vector3::from(point.value)).collect();
            if between == Between::Curves {
                let level = |(point, at): (&Point, &Vector3<f64>)| {
                    let (position, rotation) = (*at, Matrix3::identity());
                    (
                        PathPose { position, rotation, line: line_of(diagnostics, point.span) },
                        point.span,
                    )
                };
                let poses: Vec<(PathPose, Span)> = points.iter().zip(&corners).map(level).collect();
                follow(&poses, between, diagnostics).map(|path| (path, power)).map(marks)
            } else {
                let lines = corners.windows(2);
                Some(
                    lines
                        .map(|pair| mark(Curve::Line { from: pair[0], to: pair[1] }, power))
                        .collect(),
                )
            }
        }
        (None, Some(poses), None) => {
            let poses: Vec<(PathPose, Span)> = poses
                .iter()
                .map(|pose| {
                    let rotation = turned(pose.roll.value, pose.pitch.value, pose.yaw.value);
                    let position = origin + Vector3::from(pose.at.value);
                    let line = line_of(diagnostics, pose.at.span);
                    (PathPose { position, rotation, line }, pose.at.span)
                })
                .collect();
            if poses.len() < 2 {
                let help = "add poses such as { at = [\"10 mm\", \"0 mm\"] }";
                let place = poses.first().map_or(table.span, |(_, span)| *span);
                let text = "a path needs at least two poses".to_owned();
                diagnostics.contradict(place, text, help);
            }
            can_be_taken(&poses, machine, diagnostics);
            follow(&poses, between, diagnostics).map(|path| {
                if path.is_turned() {
                    attitude = AttitudeLaw::AlongPath;
                }
                marks((path, power))
            })
        }
        (None, None, Some(circle)) => {
            if table.smooth.value {
                let text = "a circle is smooth as it is".to_owned();
                diagnostics.contradict(table.smooth.span, text, "leave `smooth` out");
            }
            let plane = turned(circle.roll.value, circle.pitch.value, 0.0);
            let curve = Curve::Arc {
                centre: origin,
                major: plane.column(0) * circle.radius.value,
                minor: plane.column(1) * circle.radius.value,
                start: 0.0,
                sweep: TAU,
                rise: Vector3::zeros(),
            };
            Some(vec![mark(curve, power)])
        }
        _ => {
            let text =
                "`[path]` needs exactly one of `points`, `poses` and `[path.circle]`".to_owned();
            diagnostics.contradict(table.span, text, "write one of them and leave out the others");
            None
        }
    };
    let steps = actions.into_iter().flatten().map(|action| Step { action, line }).collect();
    let drawing = Drawing { name: name.to_owned(), start: home, steps, notes: Vec::new() };
    Job { attitude, ..Job::of(drawing) }
}

fn mark(curve: Curve, power: Power) -> Action {
    Action::Mark { curve, speed: None, power }
}

fn marks((path, power): (PosedPath, Power)) -> Vec<Action> {
    vec![Action::Follow { path: Arc::new(path), power }]
}

/// The path through `poses`, if there is one.
fn follow(
    poses: &[(PathPose, Span)],
    between: Between,
    diagnostics: &mut Diagnostics,
) -> Option<PosedPath> {
    /// Nearer to each other two places are one [m].
    const APART: f64 = 1e-7;
    /// A turn that differs from half a turn by less has no one way [rad].
    const CLEAR: f64 = 1e-6;
    let [_, _, ..] = poses else { return None };
    let mut is_sound = true;
    for (index, pair) in poses.windows(2).enumerate() {
        let [(before, _), (here, span)] = pair else { continue };
        let [one, other] = [index + 1, index + 2];
        if (here.position - before.position).norm() < APART {
            is_sound = false;
            diagnostics.contradict(
                *span,
                format!("points {one} and {other} of the path are at the same place"),
                "leave one of them out, or move it by a micrometre at least",
            );
        }
        let turn = logarithm(&before.rotation.tr_mul(&here.rotation)).norm();
        if turn > PI - CLEAR {
            is_sound = false;
            diagnostics.contradict(
                *span,
                format!(
                    "from pose {one} to pose {other} the tool turns by {:.4} deg; at half a turn the \
                     direction is not determined",
                    turn.to_degrees()
                ),
                "put a pose between them",
            );
        }
    }
    if !is_sound {
        return None;
    }
    let all: Vec<PathPose> = poses.iter().map(|(pose, _)| *pose).collect();
    let refuse = |reversals: Vec<usize>| {
        for index in reversals {
            diagnostics.contradict(
                poses[index].1,
                format!("the smooth curve turns back on itself at point {}", index + 1),
                "leave out `smooth`, or put points beside it that lead round",
            );
        }
    };
    PosedPath::new(&all, between).map_err(refuse).ok()
}

/// That each pose is one that the machine can take: what no speed can do is told at its line.
fn can_be_taken(poses: &[(PathPose, Span)], machine: &Machine, diagnostics: &mut Diagnostics) {
    /// Rounding at the edge of the area [m].
    const ROUNDING: f64 = 1e-9;
    let is_turned = |pose: &PathPose| pose.rotation != Matrix3::identity();
    for (index, (pose, span)) in poses.iter().enumerate() {
        let number = index + 1;
        if is_turned(pose) && !machine.mechanism.turns_its_tool() {
            diagnostics.contradict(
                *span,
                format!(
                    "pose {number} turns the tool, which the mechanism `{}` cannot",
                    machine.mechanism.name()
                ),
                "leave roll, pitch and yaw out, or use a machine that can turn its tool, such as \
                 tri_planar, mcm or a serial arm",
            );
            return;
        }
        let area = &machine.area;
        for (row, name) in ["x", "y", "z"].into_iter().enumerate() {
            let (place, lower, upper) = (pose.position[row], area.lower[row], area.upper[row]);
            let inside = place >= lower - ROUNDING && place <= upper + ROUNDING;
            if !inside {
                diagnostics.contradict(
                    *span,
                    format!(
                        "{name} of pose {number} would be {:.3} mm in machine coordinates, outside the area",
                        place * 1e3
                    ),
                    &format!("keep {name} from {:.3} mm to {:.3} mm there", lower * 1e3, upper * 1e3),
                );
            }
        }
        let target = Pose { position: pose.position, rotation: pose.rotation };
        if let Err(cause) = machine.mechanism.visit(Reached { machine, target }) {
            diagnostics.contradict(
                *span,
                format!("the tool cannot take pose {number}: {cause}"),
                "turn it less there, or move it to where the mechanism has room",
            );
        }
    }
}

/// Whether a pose can be reached on some branch.
struct Reached<'a> {
    machine: &'a Machine,
    target: Pose,
}

impl MechanismVisitor for Reached<'_> {
    type Output = Result<(), KinematicsError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let home = Joints::<N>::from_fn(|axis, _| self.machine.home_joints[axis]);
        let mut refused = Ok(());
        for branch in branches(&mechanism, &home) {
            match mechanism.inverse(&self.target, branch, &home) {
                Ok(_) => return Ok(()),
                Err(cause) => refused = refused.and(Err(cause)),
            }
        }
        refused
    }
}

fn line_of(diagnostics: &Diagnostics, place: Span) -> u64 {
    diagnostics.position(place).map_or(0, |(line, _)| line as u64)
}
