//! A path in windows: the time law of the next stretch, closed by a stop, of which the first part is
//! handed on.

use std::sync::Arc;

use machine::Mechanism;
use messages::artwork::{Artwork, ArtworkLine, Stroke};
use messages::time::CYCLE_TIME;
use nalgebra::Vector3;

use super::parts::limit_at;
use super::paths::{END_SHARE, END_SLOWER, END_TRIALS, PathRun};
use super::refusals::too_short;
use super::run_in_out::state;
use super::{Draft, Planning, Slowed, plateau};
use crate::error::PlanError;
use crate::geometry::contour::{Contour, Demand};
use crate::joint_space::configuration::Refused;
use crate::joint_space::follow_flight::uses;
use crate::law::time_law::TimeLaw;
use crate::law::windows::{between, keeps_even, straight};
use crate::law::{End, Infeasible};
use crate::limits::along::AlongPath;
use crate::limits::limit_id::{JointLimit, LimitId};
use crate::limits::motion_limits::Scope;
use crate::limits::tightening::Tightening;
use crate::trajectory::Motion;

/// The time that a window should take [s].
pub(super) const WINDOW: f64 = 1.2;

/// The longest law of a whole straight path that is one window [s]: what is longer goes by windows, so
/// that an override acts soon.
const LONGEST_STRAIGHT: f64 = 4.0;

/// How long the tool goes on at its speed where it cannot change it yet [s].
const STEP: f64 = 0.05;

/// The part of a window that is handed on, at least and at most; the rest, in which it comes to rest, is
/// planned anew with what follows.
const HANDED_ON: [f64; 2] = [0.6, 0.85];

/// A note names a line that is marked at less than this fraction of the speed asked for.
const SLOW: f64 = 0.99;

/// How far a chord may lie from the curve in the artwork [m]: a little less than promised, for
/// rounding.
const CHORD: f64 = Artwork::CHORD_ERROR * 0.8;

/// The last [`TAIL`] seconds of a stretch are sampled with the next stretch, when they can no longer be
/// changed. They are therefore checked when the stretch is planned, at [`TAIL_SAMPLES`] instants.
const TAIL: f64 = 4.0 * CYCLE_TIME;
const TAIL_SAMPLES: u32 = 32;
/// The fraction that the tail may use of a joint's limit, and of a limit of the tool.
const TAIL_JOINTS: f64 = 0.9997;
const TAIL_TOOL: f64 = 1.0005;
/// The fraction that a stretch is planned for again if its tail uses more, and how often that is tried.
const TAIL_GOAL: f64 = 0.998;
const TAIL_TRIALS: usize = 4;

/// A stretch of a path, timed.
pub(super) struct Timed {
    pub(super) law: TimeLaw,
    /// How the next stretch begins; `None` where the path ends.
    pub(super) next: Option<End>,
    /// From there to rest.
    pub(super) fallback: Option<TimeLaw>,
}

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// Times the next stretch of `run`, such that its end keeps the limits.
    pub(super) fn time(
        &self,
        run: &PathRun<N>,
        shares: &Tightening,
    ) -> Result<Result<Timed, Infeasible>, Refused> {
        let mut own = shares.clone();
        let mut timed = self.time_within(run, &own)?;
        for _ in 0..TAIL_TRIALS {
            let Ok(found) = &timed else { break };
            if run.even.is_some() || !self.tighten_tail(run, &found.law, &mut own) {
                break;
            }
            let again = self.time_within(run, &own)?;
            if again.is_ok() || run.at == 0.0 {
                timed = again;
            } else {
                break;
            }
        }
        Ok(timed)
    }

    /// Leaves less of what the end of `law` takes too much of. Says whether there was anything.
    pub(super) fn tighten_tail(
        &self,
        run: &PathRun<N>,
        law: &TimeLaw,
        shares: &mut Tightening,
    ) -> bool {
        let all = Tightening::all(N);
        let path = &self.limits.path;
        let begin = law.duration() - TAIL;
        let mut tool_uses = [0.0_f64; 3];
        let mut joint_uses = [[0.0_f64; JointLimit::COUNT]; N];
        for look in 0..=TAIL_SAMPLES {
            let time = begin + TAIL * f64::from(look) / f64::from(TAIL_SAMPLES);
            let now = law.at(time.max(0.0));
            let tool = run.path.at(now.position).motion(now.velocity, now.acceleration, now.jerk);
            let speed = limit_at(&run.speeds, now.position).speed;
            let used = [
                tool.velocity.norm() / speed,
                tool.acceleration.norm() / path.acceleration,
                tool.jerk.norm() / path.jerk,
            ];
            tool_uses.iter_mut().zip(used).for_each(|(most, used)| *most = most.max(used));
            if self.limits.scope == Scope::PathAlone {
                continue;
            }
            let after = run.trail.partition_point(|(at, _)| *at <= now.position);
            let near = &run.trail[after.max(1) - 1].1;
            let Some(used) = uses(&self.limits, near, &tool, &all) else { continue };
            let both = joint_uses.iter_mut().flatten().zip(used.iter().flatten());
            both.for_each(|(most, used)| *most = most.max(*used));
        }
        let mut is_beyond = false;
        let mut hold = |used: f64, most: f64, share: &mut f64| {
            if used > most {
                *share *= (TAIL_GOAL / used).max(0.5);
                is_beyond = true;
            }
        };
        hold(tool_uses[0], TAIL_TOOL, &mut shares.speed);
        hold(tool_uses[1], TAIL_TOOL, &mut shares.acceleration);
        hold(tool_uses[2], TAIL_TOOL, &mut shares.jerk);
        for (used, axis) in joint_uses.into_iter().zip(&mut shares.axes) {
            let [velocity, acceleration, jerk, torque, voltage] = used;
            hold(velocity, TAIL_JOINTS, &mut axis.velocity);
            hold(acceleration, TAIL_JOINTS, &mut axis.acceleration);
            hold(jerk, TAIL_JOINTS, &mut axis.jerk);
            hold(torque, TAIL_JOINTS, &mut axis.torque);
            hold(voltage, TAIL_JOINTS, &mut axis.voltage);
        }
        is_beyond
    }

    fn time_within(
        &self,
        run: &PathRun<N>,
        shares: &Tightening,
    ) -> Result<Result<Timed, Infeasible>, Refused> {
        let length = run.path.length();
        let mut along = AlongPath::new(&self.limits, &run.path, &run.speeds, &run.trail, shares);
        let goes_on = self.front.goes_on;
        // What one speed takes too much of, that speed does not mend.
        if let Some(speed) = run.even
            && (run.at == 0.0 || *shares == Tightening::none(N))
        {
            let next = End::Moving { speed, acceleration: 0.0 };
            let to = run.at + speed * WINDOW;
            // The last window begins where there is still room for a stop.
            let to = if goes_on || to + run.stopping_room() < length { to } else { length };
            let law = TimeLaw::even(run.at, to, speed, run.speeds[0].source.0);
            if to >= length {
                return Ok(Ok(Timed { law, next: None, fallback: None }));
            }
            let fallback = plateau::rest_from(run, &mut along, to, next);
            return Ok(Ok(Timed { law, next: Some(next), fallback }));
        }
        let is_whole = !goes_on && run.at == 0.0 && run.begin == End::Rest && run.exit == End::Rest;
        if is_whole && run.path.is_straight() {
            along.is_exact = true;
            if let Some(law) = straight(&mut along, length)
                && law.duration() <= LONGEST_STRAIGHT
            {
                return Ok(Ok(Timed { law, next: None, fallback: None }));
            }
            along.is_exact = false;
        }
        if let Some(timed) = Self::plateau(run, &mut along) {
            return Ok(Ok(timed));
        }
        let ends = !goes_on && length - run.at <= 1.3 * run.reach;
        let to = if ends { length } else { (run.at + run.reach).min(length) };
        let end = if to < length { End::Rest } else { run.exit };
        if to < length
            && let Some(timed) = Self::onto_plateau(run, &mut along, to)
        {
            return Ok(Ok(timed));
        }
        let way = run.fallback.as_ref();
        let law = between(&mut along, run.at, to, [run.begin, end], way);
        if let Some(cause) = along.error {
            return Err(Refused::Kinematics(cause));
        }
        let law = match law {
            Ok(law) => law,
            Err(infeasible) => return Ok(Err(infeasible)),
        };
        if to >= length {
            return Ok(Ok(Timed { law, next: None, fallback: None }));
        }
        let part = 1.0 - run.stopping_room() / (to - run.at);
        Ok(Ok(cut(law, run.at + part.clamp(HANDED_ON[0], HANDED_ON[1]) * (to - run.at))))
    }

    /// Goes on along the path that is under way.
    pub(super) fn go_on(&mut self, draft: &mut Draft<'_>) -> Result<(), PlanError> {
        let Some(mut run) = self.front.run.take() else { return Ok(()) };
        self.lengthen(&mut run, draft)?;
        self.front.line = run.line_at(run.at);
        let timed = self.time_somehow(&mut run, draft.shares);
        let timed = timed.map_err(|cause| self.refusal(cause))?;
        let timed = timed.map_err(|found| self.stuck(&run, &found))?;
        self.add(run, timed, draft)
    }

    /// Times the next stretch of `run` as it shall end, or else as it can: with a slower end, with an end
    /// at rest, by the way to rest that is known, or a little way on as it is.
    fn time_somehow(
        &self,
        run: &mut PathRun<N>,
        shares: &Tightening,
    ) -> Result<Result<Timed, Infeasible>, Refused> {
        let found = match self.time(run, shares)? {
            Ok(timed) => return Ok(Ok(timed)),
            Err(found) => found,
        };
        let (exit, follows) = (run.exit, run.follows);
        if let (true, End::Moving { speed, .. }) = (found.at_end, exit) {
            let mut speed = speed * END_SHARE;
            for _ in 0..END_TRIALS {
                run.exit = End::Moving { speed, acceleration: 0.0 };
                if self.can_leave(run, speed, shares)
                    && let Ok(timed) = self.time(run, shares)?
                {
                    return Ok(Ok(timed));
                }
                speed *= END_SLOWER;
            }
        }
        if found.at_end || run.fallback.is_none() {
            (run.exit, run.follows) = (End::Rest, true);
            if let Ok(timed) = self.time(run, shares)? {
                return Ok(Ok(timed));
            }
            (run.exit, run.follows) = (exit, follows);
        }
        if let Some(law) = run.fallback.clone() {
            let next = if law.places().end < run.path.length() {
                Some(End::Rest)
            } else {
                run.exit = End::Rest;
                None
            };
            return Ok(Ok(Timed { law, next, fallback: None }));
        }
        Ok(self.step_evenly(run, shares).ok_or(found))
    }

    /// A little way on at the speed that the tool has, where there is no other yet: the limits that leave
    /// no room to change it here may do so there, or behind the end.
    fn step_evenly(&self, run: &mut PathRun<N>, shares: &Tightening) -> Option<Timed> {
        let begin @ End::Moving { speed, acceleration: 0.0 } = run.begin else { return None };
        let length = run.path.length();
        let to = (run.at + speed * STEP).min(length);
        let mut along = AlongPath::new(&self.limits, &run.path, &run.speeds, &run.trail, shares);
        along.is_tool_free = true;
        if !keeps_even(&mut along, run.at, to, speed) {
            return None;
        }
        let law = TimeLaw::even(run.at, to, speed, run.speeds[0].source.0);
        if to < length {
            return Some(Timed { law, next: Some(begin), fallback: None });
        }
        if self.front.goes_on || !self.can_leave(run, speed, shares) {
            return None;
        }
        run.exit = begin;
        Some(Timed { law, next: None, fallback: None })
    }

    /// A motion that cannot go on, which the plan of the window before excludes.
    fn stuck(&self, run: &PathRun<N>, found: &Infeasible) -> PlanError {
        self.refusal(Refused::Kinematics(machine::kinematics::KinematicsError {
            code: "no_time_law",
            axis: None,
            value: found.place,
            limit: run.path.length(),
            detail: "no speed was found at which the limits hold along this path",
        }))
    }

    /// Adds a timed stretch of `run` to the draft, with its light.
    pub(super) fn add(
        &mut self,
        mut run: PathRun<N>,
        timed: Timed,
        draft: &mut Draft<'_>,
    ) -> Result<(), PlanError> {
        let Timed { law, next, fallback } = timed;
        let duration = law.duration();
        if duration.is_nan() || duration >= super::LONGEST {
            return Err(PlanError::TooLong { duration });
        }
        let start = self.front.time;
        let before = self.front.light.stroke;
        let begins = run.at == 0.0;
        draft.is_fixed = run.fallback.as_ref() == Some(&law);
        // A stop in the light would burn.
        let stops = next == Some(End::Rest) || (run.at > 0.0 && run.begin == End::Rest);
        let follows = run.follows || stops;
        let speeds = &self.task.speeds;
        let asked = |demand: &Demand| speeds.asked(demand.speed);
        let light = &mut self.front.light;
        light.path(&run.contour, &law, start, follows, &asked, &run.speeds).map_err(too_short)?;
        let stroke = if run.contour.is_lit() {
            (before + 1).min(self.front.light.stroke.max(1))
        } else {
            before
        };
        if begins {
            self.note_drawn(&run.contour, false, draft);
        }
        if run.even.is_some_and(|speed| !law.is_even_at(speed)) {
            run.even = None;
        }
        self.account(&run, &law, draft);
        let places = law.places();
        let last = law.at(duration);
        run.reach = (WINDOW * (places.end - places.start) / duration).max(run.least_reach);
        let motion = Motion::Path {
            path: run.path.clone(),
            law: Arc::new(law),
            is_lit: run.contour.is_lit(),
        };
        self.push(duration, motion, stroke, draft);
        match next {
            Some(begin) => {
                run.at = places.end;
                run.begin = begin;
                run.fallback = fallback;
                self.front.run = Some(run);
            }
            None => self.leave(&run, last.velocity)?,
        }
        Ok(())
    }

    /// Notes what a contour draws, of which the first line goes on from the contour before if that
    /// `was_lit` at its end.
    pub(super) fn note_drawn(&self, contour: &Contour, was_lit: bool, draft: &mut Draft<'_>) {
        draft.strokes.extend(strokes(contour, was_lit));
        draft.length += contour.lit_length();
        for demand in contour.demands().iter().filter(|demand| demand.power > 0.0) {
            draft.asked.add(self.task.speeds.asked(demand.speed), demand.line);
        }
    }

    /// Ends a path: the joints are where it ends, at rest or moving at `speed` [m/s].
    fn leave(&mut self, run: &PathRun<N>, speed: f64) -> Result<(), PlanError> {
        let end = run.path.end();
        let tool = end.motion(1.0, 0.0, 0.0);
        let now = self.joints_at(&tool, &run.trail[run.trail.len() - 1].1);
        self.front.now = now.map_err(|cause| self.refusal(cause))?;
        self.front.moving = (run.exit != End::Rest).then(|| state(&end, speed));
        Ok(())
    }

    /// Notes what bound the law, and where light was slower than asked.
    fn account(&self, run: &PathRun<N>, law: &TimeLaw, draft: &mut Draft<'_>) {
        let mut slowest: Option<Slowed> = None;
        for part in law.binding() {
            let middle = (part.places.start + part.places.end) / 2.0;
            let line = run.line_at(middle);
            let position: Vector3<f64> = run.path.at(middle).point;
            if run.contour.is_lit() {
                draft.bound.add(LimitId(part.limit), part.duration, line, position.into());
            }
            let Some((demand, limit)) = run.lit_at(middle) else { continue };
            // What the machine's largest marking speed takes of it has a note of its own.
            let is_named = self.task.speeds.named(demand.speed).is_some();
            let asked = self.task.speeds.of(demand.speed) * self.faster(demand);
            let asked = if is_named { asked } else { limit };
            let mean = (part.places.end - part.places.start) / part.duration;
            let speed = run.even.unwrap_or(mean.min(limit));
            draft.speed = draft.speed.max(speed);
            let slowed = Slowed { line, asked, speed, place: position };
            let worse = slowest.is_none_or(|worst| speed / asked < worst.speed / worst.asked);
            if !run.follows && speed < SLOW * asked && worse {
                slowest = Some(slowed);
            }
        }
        draft.slowed.extend(slowest);
    }
}

/// The part of a law up to `place` that is handed on, and what is left of it as the way to rest.
fn cut(law: TimeLaw, place: f64) -> Timed {
    let (first, rest) = law.split(place);
    if first.is_empty() || rest.is_empty() {
        return Timed { law, next: Some(End::Rest), fallback: None };
    }
    let now = rest.at(0.0);
    let next = if now.velocity > 0.0 {
        End::Moving { speed: now.velocity, acceleration: now.acceleration }
    } else {
        End::Rest
    };
    Timed { law: first, next: Some(next), fallback: Some(rest) }
}

/// A dot of the artwork.
pub(super) fn dot(at: &Vector3<f64>, line: u64) -> ArtworkLine {
    ArtworkLine { goes_on: false, stroke: Stroke { points: vec![(*at).into()], line } }
}

/// The lines that a contour marks, each from light to dark; the first goes on from the contour before if
/// that `was_lit` at its end.
fn strokes(contour: &Contour, was_lit: bool) -> Vec<ArtworkLine> {
    let mut strokes = Vec::new();
    let mut open: Option<(f64, f64, u64)> = None;
    let mut close = |(from, to, line): (f64, f64, u64)| {
        let stroke = Stroke { points: contour.points(from, to, CHORD), line };
        strokes.push(ArtworkLine { goes_on: was_lit && from == 0.0, stroke });
    };
    for (demand, to) in contour.stretches() {
        open = match (open, demand.power > 0.0) {
            (Some((from, _, line)), true) => Some((from, to, line)),
            (None, true) => Some((demand.from, to, demand.line)),
            (Some(line), false) => {
                close(line);
                None
            }
            (None, false) => None,
        };
    }
    open.into_iter().for_each(&mut close);
    strokes
}
