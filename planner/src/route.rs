//! The way of a job through the joints, for mechanisms on which the tool's straight line is no
//! straight line of theirs.
//!
//! Between strokes and dots the joints go together from where they are to the posture in which the
//! next can be gone whole: run-in, stroke and run-out within the soft limits and without a jump.
//! That takes the nearest turn of a table, unwinds it in the dark where its travel ends, and changes
//! the branch where it must. Along a stroke the speed is what the axes can follow.

mod stroke;

use std::borrow::Cow;

use machine::kinematics::{KinematicsError, Pose, ToolMotion};
use machine::{Mechanism, PathLimits, WorkArea};
use nalgebra::Vector3;

use crate::demand::Demands;
use crate::itinerary::{Dot, Feed, Item, Stop};
use crate::joint_move::JointMove;
use crate::posture::{Part, Posture, Refused, candidates, keeps_margins, walk};
use crate::timing::{Leg, OUTPUT_REST, PAUSE_REST, Straight, Way};

/// Postures tried for one stroke, the nearest first.
const TRIED: usize = 6;

/// Rounding allowed at the edge of the area [m].
const ROUNDING: f64 = 1e-9;

/// How much slower a move along a curve is made than the looks at it ask: between two looks it may
/// ask for a little more.
const BETWEEN_LOOKS: f64 = 1.01;

/// How much slower a straight move of the tool that the axes cannot follow is tried again, and how
/// often: at last a hundred and fifty times slower.
const STRAIGHT_SLOWER: f64 = 1.3;
const STRAIGHT_TRIALS: u32 = 20;

/// Places at which the way of a joint move is held to the area and to the margins. It is an arc or a
/// screw line of at most a few turns.
const LOOKS: u32 = 32;

/// Time between two looks at a motion of the tool [s], and the bounds of their number.
const LOOK: f64 = 1e-3;
const LOOK_COUNT: [f64; 2] = [32.0, 4000.0];

/// A way that cannot be gone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NoWay {
    pub(crate) line: u64,
    /// The stop that it leads to, from 0.
    pub(crate) stop: usize,
    /// The stroke that it leads to, from 1; 0 for none.
    pub(crate) stroke: u64,
    /// Time since the first motion [s].
    pub(crate) time: f64,
    pub(crate) cause: Refused,
}

/// A stroke that the axes slow down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slowed {
    pub(crate) line: u64,
    pub(crate) asked: f64,
    pub(crate) speed: f64,
    pub(crate) place: Vector3<f64>,
}

/// The way of a job.
#[derive(Debug, Clone)]
pub(crate) struct Route<'a> {
    pub(crate) first: JointMove,
    pub(crate) legs: Vec<Leg<'a>>,
    /// The number of the stop that each leg belongs to.
    pub(crate) owners: Vec<usize>,
    pub(crate) slowed: Vec<Slowed>,
    /// The largest speed of a stroke [m/s].
    pub(crate) speed: f64,
}

/// How fast a job is gone.
#[derive(Debug, Clone)]
pub(crate) struct Speeds {
    /// Of each stroke, what is asked for and allowed by its path [m/s], and the share that is used of
    /// what the axes seem to allow [1].
    pub(crate) strokes: Vec<(f64, f64)>,
    /// Of each stop, the share of its speed at which a move is made in the dark [1].
    pub(crate) moves: Vec<f64>,
}

/// Goes through `stops` from `start`.
pub(crate) fn route<'a, const N: usize, M: Mechanism<N>>(
    demands: &Demands<'_, N, M>,
    area: &WorkArea,
    start: Posture<N>,
    stops: &'a [Stop],
    speeds: &Speeds,
) -> Result<Route<'a>, NoWay> {
    let first = JointMove::standing(&start.joints, start.branch);
    let mut router = Router {
        demands,
        area,
        speeds,
        now: start,
        time: 0.0,
        line: 0,
        index: 0,
        stroke: 0,
        towards: 0,
        route: Route {
            first,
            legs: Vec::new(),
            owners: Vec::new(),
            slowed: Vec::new(),
            speed: 0.0,
        },
    };
    for (index, stop) in stops.iter().enumerate() {
        (router.line, router.index) = (stop.line, index);
        router.stop(stop).map_err(|cause| NoWay {
            line: stop.line,
            stop: index,
            stroke: router.towards,
            time: router.time,
            cause,
        })?;
    }
    Ok(router.route)
}

struct Router<'a, 'd, const N: usize, M: Mechanism<N>> {
    demands: &'d Demands<'d, N, M>,
    area: &'d WorkArea,
    speeds: &'d Speeds,
    now: Posture<N>,
    time: f64,
    line: u64,
    /// The stop that is under way, from 0.
    index: usize,
    /// Strokes without dots so far, and strokes and dots begun so far.
    stroke: usize,
    towards: u64,
    route: Route<'a>,
}

/// The way to where something begins.
struct Approach<'a, const N: usize> {
    /// What to do, and how long it takes [s]; `None` where the joints stand there already.
    way: Option<(f64, Way<'a>)>,
    /// The posture in which it begins, and the one in which it ends.
    start: Posture<N>,
    end: Posture<N>,
}

impl<'a, const N: usize, M: Mechanism<N>> Router<'a, '_, N, M> {
    fn stop(&mut self, stop: &'a Stop) -> Result<(), Refused> {
        self.towards = match stop.item {
            Item::Stroke(_) | Item::Dot(_) => self.towards + 1,
            _ => self.towards,
        };
        match &stop.item {
            Item::Stroke(outline) => self.mark(outline)?,
            Item::Rapid(to) => self.go_to(&still(*to), &[]).map(|_| ())?,
            Item::Feed(feed) => self.feed(feed)?,
            Item::Dot(dot) => self.dot(dot)?,
            Item::Rest(time) if *time <= 0.0 => {}
            Item::Rest(time) => self.stand(*time, Way::Rest)?,
            Item::Output { bit, on } => {
                let (bit, on) = (*bit, *on);
                self.stand(2.0 * OUTPUT_REST, |at| Way::Output { at, bit, on })?;
            }
            Item::Pause => self.stand(PAUSE_REST, Way::Pause)?,
        }
        Ok(())
    }

    /// The share of its speed at which a move of this stop is made in the dark [1].
    fn share(&self) -> f64 {
        self.speeds.moves[self.index]
    }

    fn push(&mut self, duration: f64, way: Way<'a>) {
        self.time += duration;
        self.route.legs.push(Leg::new(self.line, duration, way));
        self.route.owners.push(self.index);
    }

    /// Stands where the joints are.
    fn stand(
        &mut self,
        duration: f64,
        way: impl FnOnce(Vector3<f64>) -> Way<'a>,
    ) -> Result<(), Refused> {
        let standing = Some(JointMove::standing(&self.now.joints, self.now.branch));
        let way = way(self.tool()?.position);
        self.time += duration;
        self.route.legs.push(Leg { line: self.line, duration, way, standing });
        self.route.owners.push(self.index);
        Ok(())
    }

    fn tool(&self) -> Result<Pose, KinematicsError> {
        let assembly = self.demands.assemble(&self.now.joints, self.now.branch, None)?;
        Ok(self.demands.mechanism.pose(&assembly))
    }

    fn dot(&mut self, dot: &'a Dot) -> Result<(), Refused> {
        self.go_to(&still(dot.at), &[])?;
        let time = dot.exposures.iter().map(|(time, _)| time).sum();
        self.stand(time, |_| Way::Dot(dot))
    }

    fn feed(&mut self, feed: &'a Feed) -> Result<(), Refused> {
        let mut feed = feed.clone();
        let first = feed.at(0.0);
        let start = {
            let part = |share: f64| along(&feed.track, share);
            self.go_to(&first, &[&part])?
        };
        let duration = feed.duration();
        let pace = self.pace(start, duration, &|time| feed.at(time))?;
        feed.pace *= if pace > 1.0 { pace * BETWEEN_LOOKS } else { 1.0 } / self.share();
        self.push(feed.duration(), Way::Feed(Cow::Owned(feed)));
        Ok(())
    }

    /// Goes to where `first` is and on along `parts`, which the caller then adds. Gives the posture at
    /// `first`.
    fn go_to(&mut self, first: &ToolMotion, parts: &[&Part<'_>]) -> Result<Posture<N>, Refused> {
        let approach = self.choose(first, parts, None)?;
        let start = approach.start;
        self.take(approach);
        Ok(start)
    }

    /// Goes as was chosen, and counts what comes after as gone.
    fn take(&mut self, approach: Approach<'a, N>) {
        if let Some((duration, way)) = approach.way {
            self.push(duration, way);
        }
        self.now = approach.end;
    }

    /// The way to a posture from which `parts` can be gone, one like `wanted` if it can be.
    fn choose(
        &self,
        first: &ToolMotion,
        parts: &[&Part<'_>],
        wanted: Option<&Posture<N>>,
    ) -> Result<Approach<'a, N>, Refused> {
        let mut found = candidates(self.demands, &self.now, first, parts)?;
        if let Some(wanted) = wanted {
            // Stable, so that the nearer ones stay before.
            found.sort_by_key(|(start, _)| !start.is_like(wanted));
        }
        let mut refused = None;
        for (start, end) in found.into_iter().take(TRIED) {
            match self.joint_move(&start) {
                Ok(step) => {
                    let way = step.map(|step| (step.duration(), Way::Joints(step)));
                    return Ok(Approach { way, start, end });
                }
                Err(cause) => {
                    refused.get_or_insert(cause);
                }
            }
        }
        self.straight(first, parts).map_err(|cause| refused.map_or(cause, Refused::Kinematics))
    }

    /// The joint move to `to`, if it stays inside the area and away from collisions.
    fn joint_move(&self, to: &Posture<N>) -> Result<Option<JointMove>, KinematicsError> {
        let demands = self.demands;
        // The chain must be closed in the same way before and after.
        let branch = to.branch;
        let here = demands.mechanism.pose(&demands.assemble(&self.now.joints, branch, None)?);
        let off = (here.position - self.tool()?.position).norm();
        if off > ROUNDING {
            return Err(KinematicsError {
                code: "assembly_mode",
                axis: None,
                value: off,
                limit: ROUNDING,
                detail: "the chain would have to be taken apart to close in the other way",
            });
        }
        let Some(mut step) = JointMove::new(demands, &self.now.joints, &to.joints, branch)? else {
            return Ok(None);
        };
        step.slow(self.share());
        self.check(&step)?;
        Ok(Some(step))
    }

    /// That the tool stays inside the area during `step`, and the mechanism away from collisions.
    fn check(&self, step: &JointMove) -> Result<(), KinematicsError> {
        let way = step.way::<N>();
        let mut near = None;
        for index in 0..=LOOKS {
            let joints = way.from + way.change * (f64::from(index) / f64::from(LOOKS));
            let assembly = self.demands.assemble(&joints, step.branch, near.as_ref())?;
            let tool = self.demands.mechanism.pose(&assembly).position;
            for row in 0..3 {
                let inside = tool[row].clamp(self.area.lower[row], self.area.upper[row]);
                if (tool[row] - inside).abs() > ROUNDING {
                    return Err(KinematicsError {
                        code: "area",
                        axis: None,
                        value: tool[row],
                        limit: inside,
                        detail: "on the way of the joints the tool leaves the area",
                    });
                }
            }
            keeps_margins(self.demands.mechanism, &assembly)?;
            near = Some(assembly);
        }
        Ok(())
    }

    /// The way straight with the tool to where `parts` begin.
    fn straight(
        &self,
        first: &ToolMotion,
        parts: &[&Part<'_>],
    ) -> Result<Approach<'a, N>, Refused> {
        let from = self.tool()?.position;
        let to = first.position;
        let line =
            |share: f64| ToolMotion { velocity: to - from, ..still(from + (to - from) * share) };
        let start = walk(self.demands, self.now, &[&line])?.end;
        let whole = walk(self.demands, start, parts)?;
        whole.within(self.demands)?;
        let mut limits = slower(&self.demands.path, 1.0 / self.share());
        let mut trials = 0;
        let mut way = None;
        while let Some(straight) = Straight::new(from, to, &limits) {
            let duration = straight.profile.duration();
            let pace = self.pace(self.now, duration, &|time| straight.at(time))?;
            if pace <= 1.0 {
                way = Some((duration, Way::Straight(straight)));
                break;
            }
            trials += 1;
            if trials >= STRAIGHT_TRIALS {
                return Err(Refused::Kinematics(KinematicsError {
                    code: "overload",
                    axis: None,
                    value: pace,
                    limit: 1.0,
                    detail: "a straight move to here would have to be so many times slower still for \
                             the axes to follow",
                }));
            }
            limits = slower(&limits, STRAIGHT_SLOWER);
        }
        Ok(Approach { way, start, end: whole.end })
    }

    /// How many times slower a motion of the tool must be for the axes.
    fn pace(
        &self,
        start: Posture<N>,
        duration: f64,
        tool: &dyn Fn(f64) -> ToolMotion,
    ) -> Result<f64, KinematicsError> {
        let [least, most] = LOOK_COUNT;
        let count = (duration / LOOK).ceil().clamp(least, most) as usize;
        let Posture { mut joints, mut branch } = start;
        let mut pace: f64 = 0.0;
        for index in 0..=count {
            let tool = tool(duration * index as f64 / count as f64);
            let demands = self.demands;
            let motion = demands.follow(&tool, &mut branch, &joints)?;
            let assembly = demands.assemble(&motion.position, branch, None)?;
            pace = demands.pace_of_axes(pace, &motion, &assembly)?;
            joints = motion.position;
        }
        Ok(pace)
    }
}

/// Limits of a motion that is `factor` times slower.
fn slower(limits: &PathLimits, factor: f64) -> PathLimits {
    PathLimits {
        rapid: limits.rapid / factor,
        acceleration: limits.acceleration / (factor * factor),
        jerk: limits.jerk / (factor * factor * factor),
        ..*limits
    }
}

fn still(place: Vector3<f64>) -> ToolMotion {
    ToolMotion::rest(&Pose::at(place))
}

fn along(track: &crate::track::Track, share: f64) -> ToolMotion {
    track.at(track.length() * share).motion(1.0, 0.0, 0.0)
}
