//! Jobs on paper: how long a drawing would take by the speed profiles of the sources, to compare with
//! what Graver plans. Nothing here is ever run.
//!
//! A stroke is a curve of the drawing, with those after it that go on within 1° and at the same speed.
//! The profiles know the path's speed, acceleration and jerk along it; what bends ask for they ignore.

mod course;
mod samples;
mod strokes;

use machine::kinematics::{Attitude, ToolMotion};
use machine::{Machine, PathLimits};
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::Serialize;

use crate::drawing::Note;
use crate::error::PlanError;
use crate::geometry::attitude::AttitudeLaw;
use crate::job::{Job, MarkingSpeed};
use crate::law::optimum::fastest;
use crate::law::profile::{Move, Ramp};
use crate::trajectory::Reference;
use course::{Course, VelocityTrapezoid};
use strokes::{Item, NOTHING, Stroke, items};

/// How the speed of a stroke goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Profile {
    /// A trapezoid of acceleration (source 003 eq. 2.1 to 2.5, with their errata): each stroke has a straight run-in from rest
    /// before it and a run-out to rest behind it, and is marked at one speed.
    Trapezoid,
    /// A trapezoid of velocity (source 004 eq. 4.13 to 4.18, with their errata): each stroke goes from rest to rest along
    /// itself, and its acceleration jumps.
    Velocity,
}

/// What a drawing takes on paper.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PaperFacts {
    /// The profile.
    pub profile: Profile,
    /// All of it, from the first motion to the last [s].
    pub time: f64,
    /// The largest speed while the laser is on [m/s], 0 when nothing is drawn.
    pub speed: f64,
    /// The strokes in their order.
    pub strokes: Vec<StrokeTime>,
    /// The time of all of it by the speed of all strokes, up to the largest that the machine allows.
    pub times: Vec<SpeedTime>,
    /// The speed of all strokes with the least time; null when nothing is drawn.
    pub least: Option<SpeedTime>,
}

/// One stroke on paper.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct StrokeTime {
    /// Line of the job file, 0 for none.
    pub line: u64,
    /// What is marked of it [m].
    pub length: f64,
    /// Its largest speed [m/s].
    pub speed: f64,
    /// From rest to rest, run-in and run-out included [s].
    pub time: f64,
}

/// A speed and what all of a drawing takes with it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct SpeedTime {
    /// Of all strokes [m/s].
    pub speed: f64,
    /// All of it [s].
    pub time: f64,
}

/// A drawing by a profile.
#[derive(Debug, Clone, PartialEq)]
pub struct Paper {
    /// What it takes.
    pub facts: PaperFacts,
    /// What a person should know.
    pub notes: Vec<Note>,
    items: Vec<Item>,
    stretches: Vec<Stretch>,
}

/// From rest to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stretch {
    /// [s].
    start: f64,
    course: Course,
    way: Way,
}

/// Where a stretch goes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    /// Nowhere: at a place [m].
    Stay { at: Vector3<f64>, is_lit: bool },
    /// Straight in the dark from a place [m] in a direction.
    Free { from: Vector3<f64>, direction: Vector3<f64> },
    /// Along the stroke of an item, its `number` from 1, beginning `before` it [m].
    Stroke { item: usize, number: u64, before: f64 },
}

/// Speeds at which the time is told.
const SPEEDS: u32 = 25;

/// Puts `job` on paper for the path limits of `machine`.
///
/// # Errors
/// A job on a surface or with a tool that is not level, which the sources' profiles are not for; a file
/// that cannot be read on.
pub fn on_paper(machine: &Machine, job: &Job, profile: Profile) -> Result<Paper, PlanError> {
    if job.surface.is_some() || job.attitude != AttitudeLaw::Level {
        return Err(PlanError::NotOnPaper);
    }
    let limits = PathLimits { rapid: job.rapid.unwrap_or(machine.path.rapid), ..machine.path };
    let task = Task {
        start: job.drawing.start,
        items: items(job)?,
        limits,
        most: job.marking.max_speed.map_or(limits.speed, |most| most.min(limits.speed)),
        fixed: job.marking.speed,
        profile,
    };
    Ok(task.paper())
}

/// A drawing that shall be put on paper.
struct Task {
    start: Vector3<f64>,
    items: Vec<Item>,
    limits: PathLimits,
    /// The largest speed while the laser is on [m/s].
    most: f64,
    fixed: Option<MarkingSpeed>,
    profile: Profile,
}

impl Task {
    fn paper(self) -> Paper {
        let strokes = || {
            self.items.iter().filter_map(|item| match item {
                Item::Stroke(stroke) if stroke.is_lit => Some(stroke),
                _ => None,
            })
        };
        let alike = |speed: f64| self.time(&|_: &Stroke| speed);
        let draws = strokes().next().is_some();
        let least = draws.then(|| {
            let speed = fastest(alike, self.most);
            SpeedTime { speed, time: alike(speed) }
        });
        // Of strokes that say their speed it is not the job's to find it.
        let open = match (self.fixed, least) {
            (Some(MarkingSpeed::Optimum), Some(least)) => least.speed,
            (None, Some(_)) if strokes().any(|stroke| stroke.asked.is_none()) => {
                fastest(|open| self.time(&|stroke: &Stroke| self.speed(stroke, open)), self.most)
            }
            _ => self.most,
        };
        let mut stretches = Vec::new();
        let mut times = Vec::new();
        let mut speed = 0.0_f64;
        let time = self.walk(&|stroke| self.speed(stroke, open), &mut |stretch| {
            if let Way::Stroke { item, .. } = stretch.way
                && let Item::Stroke(stroke) = &self.items[item]
                && stroke.is_lit
            {
                speed = speed.max(stretch.course.speed());
                times.push(StrokeTime {
                    line: stroke.line,
                    length: stroke.length,
                    speed: stretch.course.speed(),
                    time: stretch.course.duration(),
                });
            }
            stretches.push(stretch);
        });
        let curve = (1..=if draws { SPEEDS } else { 0 }).map(|index| {
            let speed = self.most * f64::from(index) / f64::from(SPEEDS);
            SpeedTime { speed, time: alike(speed) }
        });
        let facts = PaperFacts {
            profile: self.profile,
            time,
            speed,
            strokes: times,
            times: curve.collect(),
            least,
        };
        let notes = self.bends(&stretches).into_iter().collect();
        Paper { facts, notes, items: self.items, stretches }
    }

    /// The speed of a lit stroke with the open ones at `open` [m/s].
    fn speed(&self, stroke: &Stroke, open: f64) -> f64 {
        let speed = match self.fixed {
            Some(MarkingSpeed::Constant(speed)) => speed,
            Some(MarkingSpeed::Optimum) => open,
            None => stroke.asked.unwrap_or(open),
        };
        speed.min(self.most)
    }

    /// The time of all of it, lit strokes at what `speed` says [s].
    fn time(&self, speed: &dyn Fn(&Stroke) -> f64) -> f64 {
        self.walk(speed, &mut |_| ())
    }

    /// Gives `each` the stretches in their order, lit strokes at what `speed` says, and gives back the
    /// time of all of it [s].
    fn walk(&self, speed: &dyn Fn(&Stroke) -> f64, each: &mut dyn FnMut(Stretch)) -> f64 {
        let PathLimits { rapid, acceleration, jerk, .. } = self.limits;
        let rest_to_rest = |length: f64, speed: f64| match self.profile {
            Profile::Trapezoid => Course::Jerk(Move::new(length, speed, acceleration, jerk)),
            Profile::Velocity => {
                Course::Velocity(VelocityTrapezoid::new(length, speed, acceleration))
            }
        };
        let (mut place, mut time, mut number) = (self.start, 0.0, 0);
        let mut go_on = |course: Course, way: Way| {
            each(Stretch { start: time, course, way });
            time += course.duration();
        };
        for (item, what) in self.items.iter().enumerate() {
            let target = match what {
                Item::Rest { time, is_lit } => {
                    go_on(Course::Rest(*time), Way::Stay { at: place, is_lit: *is_lit });
                    continue;
                }
                Item::Go(to) => (*to, None),
                Item::Stroke(stroke) if stroke.is_lit => {
                    number += 1;
                    let speed = speed(stroke);
                    let course = match self.profile {
                        Profile::Trapezoid => {
                            let ramp = Ramp::to_speed(speed, acceleration, jerk);
                            let cruise = stroke.length / speed;
                            let length = stroke.length + 2.0 * ramp.length();
                            Course::Jerk(Move { ramp, cruise, length })
                        }
                        Profile::Velocity => rest_to_rest(stroke.length, speed),
                    };
                    let before = (course.length() - stroke.length) / 2.0;
                    (stroke.at(-before).point, Some((course, stroke, number, before)))
                }
                Item::Stroke(stroke) => {
                    let speed = stroke.asked.map_or(rapid, |asked| asked.min(rapid));
                    let course = rest_to_rest(stroke.length, speed);
                    (stroke.at(0.0).point, Some((course, stroke, 0, 0.0)))
                }
            };
            let (to, along) = target;
            let way = to - place;
            let length = way.norm();
            if length > NOTHING {
                let direction = way / length;
                go_on(rest_to_rest(length, rapid), Way::Free { from: place, direction });
            }
            place = to;
            if let Some((course, stroke, number, before)) = along {
                go_on(course, Way::Stroke { item, number, before });
                place = stroke.at(stroke.length + before).point;
            }
        }
        time
    }

    /// A note where a bend by itself takes more than the path's acceleration.
    fn bends(&self, stretches: &[Stretch]) -> Option<Note> {
        let mut worst: Option<(f64, u64)> = None;
        for stretch in stretches {
            if let Way::Stroke { item, .. } = stretch.way
                && let Item::Stroke(stroke) = &self.items[item]
            {
                let speed = stretch.course.speed();
                let across = speed * speed * stroke.curvature;
                if across > worst.map_or(self.limits.acceleration, |(most, _)| most) {
                    worst = Some((across, stroke.line));
                }
            }
        }
        let (across, line) = worst?;
        let text = format!(
            "on paper this bend takes {across:.3} m/s² across the path, more than the {:.3} m/s² of the \
             machine, which the profile does not know",
            self.limits.acceleration
        );
        Some(Note { line, text })
    }
}

impl Paper {
    /// The tool at `time` since the start [s], the stroke that is marked, from 1, or 0, and whether the
    /// laser is on; at rest before and after.
    fn at(&self, time: f64) -> (ToolMotion, u64, bool) {
        let after = self.stretches.partition_point(|stretch| stretch.start <= time);
        let Some(stretch) = self.stretches.get(after.max(1) - 1) else {
            return (ToolMotion::rest(&machine::Pose::at(Vector3::zeros())), 0, false);
        };
        let along = stretch.course.at(time - stretch.start);
        match &stretch.way {
            Way::Stay { at, is_lit } => {
                let over = time - stretch.start > stretch.course.duration();
                (ToolMotion::rest(&machine::Pose::at(*at)), 0, *is_lit && !over)
            }
            Way::Free { from, direction } => {
                let tool = ToolMotion {
                    position: from + direction * along.position,
                    velocity: direction * along.velocity,
                    acceleration: direction * along.acceleration,
                    jerk: direction * along.jerk,
                    attitude: Attitude::LEVEL,
                };
                (tool, 0, false)
            }
            Way::Stroke { item, number, before } => {
                let Item::Stroke(stroke) = &self.items[*item] else {
                    return (ToolMotion::rest(&machine::Pose::at(Vector3::zeros())), 0, false);
                };
                let place = along.position - before;
                let jet = stroke.at(place);
                let tool = jet.motion(along.velocity, along.acceleration, along.jerk);
                let is_inside = time - stretch.start <= stretch.course.duration();
                let is_lit = stroke.is_lit && is_inside && (0.0..=stroke.length).contains(&place);
                (tool, *number, is_lit)
            }
        }
    }

    /// The tool's motion `time` after the start [s]; at rest before and after.
    pub fn reference(&self, time: f64) -> Reference {
        Reference::Tool(self.at(time).0)
    }
}
