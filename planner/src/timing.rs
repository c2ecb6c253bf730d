//! The legs of a job in their order, once the speed of each stroke is known: every leg ends where
//! the next begins, and all but strokes begin and end at rest or go into a stroke.

use std::borrow::Cow;
use std::sync::Arc;

use machine::PathLimits;
use machine::kinematics::Attitude;
use nalgebra::Vector3;

use crate::itinerary::{Dot, Feed, Item, Stop};
use crate::joint_move::JointMove;
use crate::law::SpeedLaw;
use crate::outline::Outline;
use crate::profile::Move;
use crate::run_in::{RunIn, RunOut};

/// Shorter free moves are not made [m].
const NOTHING: f64 = 1e-12;

/// Rest before and after an output changes [s]: a cycle each.
pub(crate) const OUTPUT_REST: f64 = signals::time::CYCLE_TIME;

/// Rest before a pause [s], so that the springs of the transmission have settled.
pub(crate) const PAUSE_REST: f64 = 0.1;

/// One leg with the time it takes.
#[derive(Debug, Clone)]
pub(crate) struct Leg<'a> {
    pub(crate) line: u64,
    pub(crate) duration: f64,
    pub(crate) way: Way<'a>,
    /// Where the joints stand, on a leg without motion of a machine that is planned by its joints.
    pub(crate) standing: Option<JointMove>,
}

impl<'a> Leg<'a> {
    /// A leg of the tool.
    pub(crate) fn new(line: u64, duration: f64, way: Way<'a>) -> Self {
        Self { line, duration, way, standing: None }
    }
}

/// What happens on a leg.
#[derive(Debug, Clone)]
pub(crate) enum Way<'a> {
    Rest(Vector3<f64>),
    Straight(Straight),
    Joints(JointMove),
    Feed(Cow<'a, Feed>),
    RunIn(RunIn),
    Stroke { outline: &'a Outline, speed: f64, law: Option<Arc<SpeedLaw>> },
    RunOut(RunOut),
    Dot(&'a Dot),
    Output { at: Vector3<f64>, bit: u32, on: bool },
    Pause(Vector3<f64>),
}

/// A straight move from rest to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Straight {
    pub(crate) from: Vector3<f64>,
    pub(crate) direction: Vector3<f64>,
    pub(crate) profile: Move,
}

impl Straight {
    pub(crate) fn new(from: Vector3<f64>, to: Vector3<f64>, limits: &PathLimits) -> Option<Self> {
        let way = to - from;
        let length = way.norm();
        let profile = Move::new(length, limits.rapid, limits.acceleration, limits.jerk);
        (length > NOTHING).then(|| Self { from, direction: way / length, profile })
    }

    /// The tool's motion at `time` since the start [s].
    pub fn at(&self, time: f64) -> machine::kinematics::ToolMotion {
        let along = self.profile.at(time);
        machine::kinematics::ToolMotion {
            position: self.from + self.direction * along.position,
            velocity: self.direction * along.velocity,
            acceleration: self.direction * along.acceleration,
            jerk: self.direction * along.jerk,
            attitude: Attitude::LEVEL,
        }
    }
}

/// Goes through `stops` from `start`, each stroke at the speed that `speed_of` gives for its number
/// among the strokes, and hands each leg to `sink`. Gives the time of all legs [s].
pub(crate) fn travel<'a>(
    start: Vector3<f64>,
    stops: &'a [Stop],
    limits: &PathLimits,
    mut speed_of: impl FnMut(usize) -> f64,
    mut sink: impl FnMut(Leg<'a>),
) -> f64 {
    let mut place = start;
    let mut strokes = 0;
    let mut total = 0.0;
    let mut go = |line: u64, duration: f64, way: Way<'a>| {
        total += duration;
        sink(Leg::new(line, duration, way));
    };
    for Stop { item, line } in stops {
        let line = *line;
        let mut approach = |to: Vector3<f64>, place: &mut Vector3<f64>| {
            if let Some(straight) = Straight::new(*place, to, limits) {
                go(line, straight.profile.duration(), Way::Straight(straight));
                *place = to;
            }
        };
        match item {
            Item::Stroke(outline) => {
                let speed = speed_of(strokes);
                strokes += 1;
                let run_in = RunIn::new(&outline.start(), speed, limits);
                let run_out = RunOut::new(&outline.end(), speed, limits);
                approach(run_in.from(), &mut place);
                go(line, run_in.duration(), Way::RunIn(run_in));
                go(line, outline.length() / speed, Way::Stroke { outline, speed, law: None });
                go(line, run_out.duration(), Way::RunOut(run_out));
                place = run_out.to();
            }
            Item::Rapid(to) => approach(*to, &mut place),
            Item::Feed(feed) => {
                approach(feed.track.at(0.0).point, &mut place);
                go(line, feed.duration(), Way::Feed(Cow::Borrowed(feed)));
                place = feed.track.at(feed.track.length()).point;
            }
            // Coming to rest is all that a rest without time asks for.
            Item::Rest(time) if *time <= 0.0 => {}
            Item::Rest(time) => go(line, *time, Way::Rest(place)),
            Item::Dot(dot) => {
                approach(dot.at, &mut place);
                let time = dot.exposures.iter().map(|(time, _)| time).sum();
                go(line, time, Way::Dot(dot));
            }
            Item::Output { bit, on } => {
                go(line, 2.0 * OUTPUT_REST, Way::Output { at: place, bit: *bit, on: *on });
            }
            Item::Pause => go(line, PAUSE_REST, Way::Pause(place)),
        }
    }
    total
}
