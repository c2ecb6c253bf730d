//! A job as exact functions of time: pieces of motion, the instants at which the laser changes,
//! and those of outputs and pauses.
//!
//! Position, velocity and acceleration are continuous over all pieces; the jerk steps. Stream time
//! starts with [`BEFORE`] of rest.

use std::sync::Arc;

use machine::kinematics::ToolMotion;
use machine::{LaserSource, PathLimits, Pose};
use nalgebra::Vector3;
use signals::Nanoseconds;
use signals::time::CYCLE_TIME;

use crate::attitude::AttitudeLaw;
use crate::itinerary::{Feed, Stop};
use crate::joint_move::{JointMove, JointsAt};
use crate::law::SpeedLaw;
use crate::outline::Outline;
use crate::run_in::{RunIn, RunOut};
use crate::stroke::StrokePath;
use crate::timing::{Leg, OUTPUT_REST, Straight, Way, travel};

/// Rest at the start of a stream [s], so that its first samples are at rest.
pub const BEFORE: f64 = 2.0 * CYCLE_TIME;

/// A stretch of motion of one kind.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// When it starts, stream time [s].
    pub start: f64,
    /// [s].
    pub duration: f64,
    /// What happens.
    pub course: Course,
    /// Line of the job file, 0 for none.
    pub line: u64,
    /// The stroke or dot that it marks, leads to or comes from, from 1; 0 for none.
    pub stroke: u64,
}

/// The motion of a piece.
#[derive(Debug, Clone, PartialEq)]
pub enum Course {
    /// At rest.
    Rest(Vector3<f64>),
    /// Straight from rest to rest.
    Straight(Straight),
    /// Along a curve from rest to rest, in the dark.
    Feed(Box<Feed>),
    /// Into a stroke.
    RunIn(Box<RunIn>),
    /// Along a stroke.
    Stroke {
        /// The path.
        path: Arc<StrokePath>,
        /// The speed, with a law the largest that was asked for [m/s].
        speed: f64,
        /// How the speed changes on the way; `None` where it is constant.
        law: Option<Arc<SpeedLaw>>,
    },
    /// Out of a stroke.
    RunOut(Box<RunOut>),
    /// The joints together from rest to rest, or standing.
    Joints(JointMove),
}

/// What a piece of motion says at one instant.
// It lives on the stack for one look; a box would allocate four times a cycle.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reference {
    /// Where the tool shall be; the joints follow from it.
    Tool(ToolMotion),
    /// Where the joints shall be; the tool follows from them.
    Joints(JointsAt, JointMove),
}

/// A change of the laser.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaserChange {
    /// Stream time at which the source is told.
    pub time: Nanoseconds,
    /// Fraction of full scale from then on; 0 closes the gate.
    pub power: f64,
    /// The stroke that this lights, from 1; 0 with the gate closed.
    pub stroke: u64,
}

/// A job as functions of stream time.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// The pieces, each starting where the one before ends; never empty.
    pub pieces: Vec<Piece>,
    /// Changes of the laser in order.
    pub laser: Vec<LaserChange>,
    /// Stream times [s] from which all outputs are as given.
    pub outputs: Vec<(f64, u64)>,
    /// Stream times at which to wait for a person [s].
    pub pauses: Vec<f64>,
    /// How the tool is turned where it leads.
    pub attitude: AttitudeLaw,
}

/// A stroke shorter than the laser source can switch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TooShort {
    pub(crate) line: u64,
    pub(crate) duration: f64,
}

impl Trajectory {
    /// Goes through `stops` from `start` with the strokes at `speeds`.
    pub(crate) fn new(
        start: Vector3<f64>,
        stops: &[Stop],
        limits: &PathLimits,
        laser: &LaserSource,
        speeds: &[f64],
    ) -> Result<Self, TooShort> {
        Self::lay(Course::Rest(start), limits, laser, |sink| {
            travel(start, stops, limits, |stroke| speeds[stroke], sink);
        })
    }

    /// Lays the legs that `legs` hands to its sink end to end, after a rest at `first`.
    pub(crate) fn lay<'a>(
        first: Course,
        limits: &PathLimits,
        laser: &LaserSource,
        legs: impl FnOnce(&mut dyn FnMut(Leg<'a>)),
    ) -> Result<Self, TooShort> {
        // Whole cycles, so that a source that is told ahead of the first light is told at rest.
        let cycles = (laser.on_delay / CYCLE_TIME).ceil();
        let before = BEFORE + cycles * CYCLE_TIME;
        let rest = Piece { start: 0.0, duration: before, course: first, line: 0, stroke: 0 };
        let mut builder = Builder {
            trajectory: Self {
                pieces: vec![rest],
                laser: Vec::new(),
                outputs: Vec::new(),
                pauses: Vec::new(),
                attitude: AttitudeLaw::default(),
            },
            time: before,
            stroke: 0,
            outputs: 0,
            limits: *limits,
            laser: *laser,
            refused: None,
        };
        legs(&mut |leg| builder.add(leg));
        match builder.refused {
            Some(refused) => Err(refused),
            None => Ok(builder.trajectory),
        }
    }

    /// When the last piece ends, stream time [s].
    pub fn end(&self) -> f64 {
        self.pieces.last().map_or(0.0, |piece| piece.start + piece.duration)
    }

    /// From the first motion to the last, or to the last dot [s].
    pub fn duration(&self) -> f64 {
        self.end() - self.pieces.first().map_or(0.0, |piece| piece.duration)
    }

    /// The motion at `time` [s]; at rest before the start and after the end. `cursor` is the piece to
    /// look at first: searching goes on from there in either direction.
    pub fn at(&self, time: f64, cursor: &mut usize) -> Reference {
        let last = self.pieces.len() - 1;
        let mut index = (*cursor).min(last);
        while index > 0 && time < self.pieces[index].start {
            index -= 1;
        }
        while index < last && time >= self.pieces[index + 1].start {
            index += 1;
        }
        *cursor = index;
        let piece = &self.pieces[index];
        let since = time - piece.start;
        if index == last && since >= piece.duration {
            return match piece.course.at(piece.duration) {
                Reference::Tool(tool) => Reference::Tool(rest(tool.position)),
                joints @ Reference::Joints(..) => joints,
            };
        }
        piece.course.at(since.max(0.0))
    }

    /// The piece at `time` [s].
    pub fn piece_at(&self, time: f64) -> Option<&Piece> {
        let after = self.pieces.partition_point(|piece| piece.start <= time);
        self.pieces.get(after.max(1) - 1)
    }
}

fn rest(position: Vector3<f64>) -> ToolMotion {
    ToolMotion::rest(&Pose::at(position))
}

impl Reference {
    /// The tool's motion, where it is what is said.
    pub fn tool(&self) -> Option<&ToolMotion> {
        match self {
            Self::Tool(tool) => Some(tool),
            Self::Joints(..) => None,
        }
    }
}

impl Course {
    /// The motion at `time` since the start of the piece [s].
    pub fn at(&self, time: f64) -> Reference {
        Reference::Tool(match self {
            Self::Rest(place) => rest(*place),
            Self::Straight(straight) => straight.at(time),
            Self::Feed(feed) => feed.at(time),
            Self::RunIn(run_in) => run_in.at(time),
            Self::Stroke { path, speed, law: None } => {
                path.at(time * speed).motion(*speed, 0.0, 0.0)
            }
            Self::Stroke { path, law: Some(law), .. } => {
                let along = law.at(time);
                path.at(along.position).motion(along.velocity, along.acceleration, along.jerk)
            }
            Self::RunOut(run_out) => run_out.at(time),
            Self::Joints(joints) => return Reference::Joints(joints.at(time), *joints),
        })
    }
}

/// Lays legs end to end.
struct Builder {
    trajectory: Trajectory,
    time: f64,
    stroke: u64,
    outputs: u64,
    limits: PathLimits,
    laser: LaserSource,
    refused: Option<TooShort>,
}

impl Builder {
    fn add(&mut self, leg: Leg<'_>) {
        let Leg { line, duration, way, standing } = leg;
        let start = self.time;
        let mut stroke = 0;
        let resting = |place| standing.map_or(Course::Rest(place), Course::Joints);
        let course = match way {
            Way::Rest(place) => resting(place),
            Way::Joints(joints) => Course::Joints(joints),
            Way::Straight(straight) => Course::Straight(straight),
            Way::Feed(feed) => Course::Feed(Box::new(feed.into_owned())),
            Way::RunIn(run_in) => {
                stroke = self.stroke + 1;
                Course::RunIn(Box::new(run_in))
            }
            Way::Stroke { outline, speed, law } => {
                self.stroke += 1;
                stroke = self.stroke;
                match &law {
                    None => self.light(line, start, duration, exposures(outline, speed)),
                    Some(law) => {
                        let exposures = slowed_exposures(outline, speed, law);
                        self.light(line, start, duration, exposures.into_iter());
                    }
                }
                let path = Arc::new(outline.trace(speed, &self.limits));
                Course::Stroke { path, speed, law }
            }
            Way::RunOut(run_out) => {
                stroke = self.stroke;
                Course::RunOut(Box::new(run_out))
            }
            Way::Dot(dot) => {
                self.stroke += 1;
                stroke = self.stroke;
                self.light(line, start, duration, dot.exposures.iter().copied());
                resting(dot.at)
            }
            Way::Output { at, bit, on } => {
                let mask = 1_u64.checked_shl(bit).unwrap_or(0);
                self.outputs = if on { self.outputs | mask } else { self.outputs & !mask };
                self.trajectory.outputs.push((start + OUTPUT_REST, self.outputs));
                resting(at)
            }
            Way::Pause(place) => {
                // One cycle before the end, so that the sample that pauses is at rest.
                self.trajectory.pauses.push(start + duration - CYCLE_TIME);
                resting(place)
            }
        };
        self.trajectory.pieces.push(Piece { start, duration, course, line, stroke });
        self.time += duration;
    }

    /// Lights the stroke from `start` on with the given times and powers, dark after `duration`.
    /// The source is told ahead of time by its own delays.
    fn light(
        &mut self,
        line: u64,
        start: f64,
        duration: f64,
        exposures: impl Iterator<Item = (f64, f64)>,
    ) {
        let LaserSource { on_delay, off_delay } = self.laser;
        let stroke = self.stroke;
        let on = Nanoseconds::from_seconds(start - on_delay);
        let off = Nanoseconds::from_seconds(start + duration - off_delay);
        let previous = self.trajectory.laser.last().map_or(Nanoseconds(0), |change| change.time);
        if off <= on || on < previous {
            self.refused.get_or_insert(TooShort { line, duration });
            return;
        }
        let mut since = 0.0;
        let mut level = 0.0;
        for (time, power) in exposures {
            if power != level {
                let at = Nanoseconds::from_seconds(start + since - on_delay).max(on).min(off);
                self.trajectory.laser.push(LaserChange { time: at, power, stroke });
                level = power;
            }
            since += time;
        }
        self.trajectory.laser.push(LaserChange { time: off, power: 0.0, stroke: 0 });
    }
}

/// Times and powers along a stroke at `speed`, track by track.
fn exposures(outline: &Outline, speed: f64) -> impl Iterator<Item = (f64, f64)> {
    let asked = outline.speed;
    outline.tracks().iter().zip(&outline.powers).map(move |(track, power)| {
        // Power that follows the speed is told for the speed that was asked for.
        let share =
            if power.follows_speed { asked.map_or(1.0, |asked| speed / asked) } else { 1.0 };
        (track.length() / speed, (power.level * share).min(1.0))
    })
}

/// Times and powers along a stroke that is slowed by `law` from `speed`. Power that follows the speed
/// does so in steps.
fn slowed_exposures(outline: &Outline, speed: f64, law: &SpeedLaw) -> Vec<(f64, f64)> {
    let asked = outline.speed.unwrap_or(speed);
    let instants = law.instants(speed);
    let mut exposures = Vec::with_capacity(outline.tracks().len());
    let (mut since, mut way) = (0.0, 0.0);
    for (track, power) in outline.tracks().iter().zip(&outline.powers) {
        way += track.length();
        let until = law.time_at(way);
        if power.follows_speed {
            let inside = instants.iter().filter(|instant| **instant > since && **instant < until);
            let mut marks = vec![since];
            marks.extend(inside);
            marks.push(until);
            for pair in marks.windows(2) {
                let share = law.at((pair[0] + pair[1]) / 2.0).velocity / asked;
                exposures.push((pair[1] - pair[0], (power.level * share).min(1.0)));
            }
        } else {
            exposures.push((until - since, power.level));
        }
        since = until;
    }
    exposures
}
