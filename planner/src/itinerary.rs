//! A drawing as the tool will go through it: marks gathered into strokes, and what comes between.

use core::f64::consts::PI;

use machine::PathLimits;
use machine::kinematics::KinematicsError;
use machine::surface::Surface;
use nalgebra::Vector3;
use signals::math;

use crate::drawing::{Action, Curve, Drawing};
use crate::outline::Outline;
use crate::profile::Move;
use crate::projected;
use crate::track::Track;

/// Marks whose tangents meet within this angle are one stroke [rad].
pub const CORNER: f64 = PI / 180.0;

/// Shorter curves are dropped [m]: a thousandth of what an encoder can tell.
const NOTHING: f64 = 1e-9;

/// One thing to do, at rest before and after.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Item {
    /// Mark in one go.
    Stroke(Outline),
    /// Go there in the dark.
    Rapid(Vector3<f64>),
    /// Follow a curve in the dark.
    Feed(Feed),
    /// Stand still in the dark for some time [s].
    Rest(f64),
    /// Mark a dot.
    Dot(Dot),
    /// Switch an output.
    Output { bit: u32, on: bool },
    /// Wait for a person.
    Pause,
}

/// An item and the line of the job that it comes from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stop {
    pub(crate) item: Item,
    pub(crate) line: u64,
}

/// A curve followed in the dark from rest to rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Feed {
    pub(crate) track: Track,
    pub(crate) profile: Move,
    /// How many times slower than the profile, so that curvature leaves every limit kept [1].
    pub(crate) pace: f64,
}

/// Light while the tool stands still.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Dot {
    pub(crate) at: Vector3<f64>,
    /// Times [s] and powers [fraction of full scale], one after the other.
    pub(crate) exposures: Vec<(f64, f64)>,
}

impl Feed {
    fn new(track: Track, speed: f64, limits: &PathLimits) -> Self {
        /// Looks at each phase of the profile.
        const LOOKS: u32 = 64;
        /// How near to the ends of a phase to look, as a share of it.
        const INSIDE: f64 = 1e-9;
        let speed = speed.min(limits.rapid);
        let profile = Move::new(track.length(), speed, limits.acceleration, limits.jerk);
        let mut feed = Self { track, profile, pace: 1.0 };
        if matches!(feed.track, Track::Line { .. }) {
            return feed;
        }
        // Played c times slower, speed falls by c, acceleration by c² and jerk by c³. The jerk steps
        // between the phases of the profile, so each is looked at by itself, up to its very ends.
        let bend = feed.track.bend();
        let mut pace: f64 = 1.0;
        let mut start = 0.0;
        for (duration, _) in feed.profile.phases() {
            for index in 0..=LOOKS {
                let share = (f64::from(index) / f64::from(LOOKS)).clamp(INSIDE, 1.0 - INSIDE);
                let time = start + duration * share;
                let (acceleration, jerk) =
                    if let Track::Ellipse(_) | Track::Projected(_) = feed.track {
                        bend.demands(&feed.profile.at(time))
                    } else {
                        let motion = feed.at(time);
                        (motion.acceleration.norm(), motion.jerk.norm())
                    };
                pace = pace
                    .max((acceleration / limits.acceleration).sqrt())
                    .max(math::cbrt(jerk / limits.jerk));
            }
            start += duration;
        }
        // A top between two samples is higher than both by less than a thousandth.
        feed.pace = if pace > 1.0 { pace * 1.001 } else { 1.0 };
        feed
    }

    /// [s].
    pub fn duration(&self) -> f64 {
        self.profile.duration() * self.pace
    }

    /// The tool's motion at `time` since the start [s].
    pub fn at(&self, time: f64) -> machine::kinematics::ToolMotion {
        let rate = 1.0 / self.pace;
        let along = self.profile.at(time * rate);
        self.track.at(along.position).motion(
            along.velocity * rate,
            along.acceleration * rate * rate,
            along.jerk * rate * rate * rate,
        )
    }
}

/// Gathers the steps of `drawing`: marks that go on into each other become one stroke, free moves
/// that only lead to a stroke are left to its approach, and lit dwells in one place become one dot.
///
/// On a `surface` everything comes to lie on it.
///
/// # Errors
/// The line of what goes beyond an edge of the surface, and by how much.
pub(crate) fn itinerary(
    drawing: &Drawing,
    limits: &PathLimits,
    surface: Option<&Surface>,
) -> Result<Vec<Stop>, (u64, KinematicsError)> {
    let placed = |point: &Vector3<f64>, line: u64| match surface {
        None => Ok(*point),
        Some(surface) => projected::place(point, surface).map_err(|cause| (line, cause)),
    };
    let cosine = math::cos(CORNER);
    let mut stops: Vec<Stop> = Vec::new();
    let mut place = drawing.start;
    for step in &drawing.steps {
        let line = step.line;
        let item = match &step.action {
            Action::Mark { curve, speed, power } => {
                place = curve.to();
                if surface.is_some() && Track::new(curve).length() <= NOTHING {
                    continue;
                }
                let track = Track::on(curve, surface).map_err(|cause| (line, cause))?;
                if let Some(Stop { item: Item::Stroke(stroke), .. }) = stops.last_mut()
                    && stroke.speed == *speed
                    && stroke.extend(track.clone(), *power, cosine, limits.tolerance)
                {
                    continue;
                }
                if track.length() <= NOTHING {
                    continue;
                }
                if matches!(stops.last(), Some(Stop { item: Item::Rapid(_), .. })) {
                    stops.pop();
                }
                Item::Stroke(Outline::new(track, *speed, *power, line))
            }
            Action::Rapid { to } => {
                place = *to;
                Item::Rapid(placed(to, line)?)
            }
            Action::Feed { curve, speed } => {
                place = curve.to();
                if let Curve::Line { from, to } = curve
                    && (to - from).norm() <= NOTHING
                {
                    continue;
                }
                Item::Feed(Feed::new(
                    Track::on(curve, surface).map_err(|cause| (line, cause))?,
                    *speed,
                    limits,
                ))
            }
            Action::Dwell { time, lit: Some(power) } if *time > 0.0 && *power > 0.0 => {
                let exposure = (*time, *power);
                let place = placed(&place, line)?;
                if let Some(Stop { item: Item::Dot(dot), .. }) = stops.last_mut()
                    && dot.at == place
                {
                    dot.exposures.push(exposure);
                    continue;
                }
                Item::Dot(Dot { at: place, exposures: vec![exposure] })
            }
            Action::Dwell { time, .. } => Item::Rest(*time),
            Action::Output { bit, on } => Item::Output { bit: *bit, on: *on },
            Action::Pause => Item::Pause,
            Action::Corners(_) => continue,
        };
        stops.push(Stop { item, line });
    }
    Ok(stops)
}
