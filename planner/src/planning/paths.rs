//! The beginning of a path: how the tool comes to its start, and at which speed.

use std::sync::Arc;

use machine::Mechanism;

use super::entry::Entry;
use super::parts::limit_at;
use super::windows::Timed;
use super::{Draft, Planning};
use crate::drawing::Note;
use crate::error::{Place, PlanError};
use crate::geometry::contour::{Contour, Demand};
use crate::geometry::path::Path;
use crate::joint_space::configuration::{
    Configuration, PathFunction, Refused, candidates, trail, walk,
};
use crate::joint_space::unwind::divide;
use crate::law::End;
use crate::law::row::Side;
use crate::law::time_law::TimeLaw;
use crate::law::windows::{even_speed, keeps_even};
use crate::light::Policy;
use crate::light::exposure::{change_speeds, source_speeds};
use crate::limits::along::{AlongPath, SpeedLimit};
use crate::limits::limit_id::LimitId;
use crate::limits::motion_limits::Scope;
use crate::limits::tightening::Tightening;
use crate::verify::checker::{LimitViolation, Quantity};

/// How much of the speed that an end allows it is passed at, so that its limits leave room to
/// begin to change it.
pub(super) const END_SHARE: f64 = 0.995;

/// How much slower an end is tried that cannot be met, and how often before it is met at rest.
pub(super) const END_SLOWER: f64 = 0.8;
pub(super) const END_TRIALS: usize = 14;

/// Notes of paths that are divided, at most.
const MOST_NOTES: usize = 100;

/// How often another configuration is timed where the one before cannot be reached.
const CONFIGURATIONS: usize = 7;

/// A path that is under way.
#[derive(Debug, Clone)]
pub(super) struct PathRun<const N: usize> {
    pub(super) contour: Arc<Contour>,
    pub(super) path: Arc<Path>,
    pub(super) trail: Arc<Vec<(f64, Configuration<N>)>>,
    pub(super) speeds: Arc<Vec<SpeedLimit>>,
    /// Where the next window begins [m], and how.
    pub(super) at: f64,
    pub(super) begin: End,
    /// How the path ends.
    pub(super) exit: End,
    /// The speed that its joints were smoothed for [m/s]; `None` for as wide as they may be.
    pub(super) smoothed_for: Option<f64>,
    /// The speed that it must keep all along, where the job leaves it open [m/s].
    pub(super) most: Option<f64>,
    /// The one speed of the path, where it has one [m/s].
    pub(super) even: Option<f64>,
    /// Whether the power follows the speed whatever the policy.
    pub(super) follows: bool,
    /// How far the next window goes, and at least [m].
    pub(super) reach: f64,
    pub(super) least_reach: f64,
    /// The way to rest from where the next window begins.
    pub(super) fallback: Option<TimeLaw>,
}

impl<const N: usize> PathRun<N> {
    /// Line of the job file at a place [m].
    pub(super) fn line_at(&self, place: f64) -> u64 {
        let demands = self.contour.demands();
        let after = demands.partition_point(|demand| demand.from <= place);
        demands.get(after.max(1) - 1).map_or(0, |demand| demand.line)
    }

    /// What a stop surely takes [m].
    pub(super) fn stopping_room(&self) -> f64 {
        10.0 * self.least_reach
    }

    /// What the job asks for at a place that is marked, and the speed limit there [m/s]; `None` in the
    /// dark.
    pub(super) fn lit_at(&self, place: f64) -> Option<(&Demand, f64)> {
        let demands = self.contour.demands();
        let after = demands.partition_point(|demand| demand.from <= place);
        let demand = demands.get(after.max(1) - 1).filter(|demand| demand.power > 0.0)?;
        Some((demand, limit_at(&self.speeds, place).speed))
    }
}

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// Begins a path and times its first window.
    pub(super) fn begin_path(
        &mut self,
        contour: Arc<Contour>,
        draft: &mut Draft<'_>,
    ) -> Result<(), PlanError> {
        self.stays_inside(&contour)?;
        let speeds = self.speed_limits(&contour);
        let fastest = speeds.iter().map(|speed| speed.speed).fold(0.0, f64::max);
        // Told before all of it is timed and sampled.
        let duration = self.front.time + contour.length() / fastest;
        if duration.is_nan() || duration >= super::LONGEST {
            return Err(PlanError::TooLong { duration });
        }
        if contour.policy == Policy::Constant && contour.is_lit() {
            self.begin_constant(contour, draft)
        } else {
            self.begin_from_rest(contour, draft)
        }
    }

    /// That what is drawn lies within the area: told by the tool's place before anything is told by
    /// joints.
    pub(super) fn stays_inside(&self, contour: &Contour) -> Result<(), PlanError> {
        /// How far a chord may lie from the curve [m].
        const CHORD: f64 = 1e-5;
        /// Rounding at the edge [m].
        const ROUNDING: f64 = 1e-9;
        if self.limits.scope == Scope::PathAlone {
            return Ok(());
        }
        let (lower, upper) = (&self.area.lower, &self.area.upper);
        for point in contour.points(0.0, contour.length(), CHORD) {
            for row in 0..3 {
                let limit = point[row].clamp(lower[row], upper[row]);
                if (point[row] - limit).abs() > ROUNDING {
                    let time = self.front.time;
                    let place = Place { stroke: self.front.light.stroke + 1, time };
                    let quantity = Quantity::ToolPosition(row);
                    let value = point[row];
                    let violation =
                        LimitViolation { time, axis: None, quantity, value, limit, unit: "m" };
                    return Err(PlanError::Limit {
                        line: contour.line,
                        place,
                        violation,
                        zero: None,
                    });
                }
            }
        }
        Ok(())
    }

    /// How much faster than the job asks for a stretch of light is marked: as much as the override says,
    /// the largest speed allows, and the power can make up for.
    pub(super) fn faster(&self, demand: &Demand) -> f64 {
        let speeds = &self.task.speeds;
        let asked = speeds.of(demand.speed);
        (asked * self.rate.min(1.0 / demand.power)).min(speeds.most) / asked
    }

    /// The speed limits along a contour, stretch by stretch.
    pub(super) fn speed_limits(&self, contour: &Contour) -> Vec<SpeedLimit> {
        let path = &self.limits.path;
        let by_source = source_speeds(contour, &self.task.machine.laser);
        let by_light = by_source.into_iter().zip(change_speeds(contour));
        let by_light = by_light.map(|(source, changes)| source.min(changes));
        let mut limits: Vec<SpeedLimit> = Vec::new();
        for (demand, least) in contour.demands().iter().zip(by_light) {
            let (speed, source) = if demand.power > 0.0 {
                let most = self.task.speeds.most;
                let asked = self.task.speeds.of(demand.speed) * self.faster(demand);
                (asked, if asked < most { LimitId::FEED } else { LimitId::MARKING_SPEED })
            } else {
                match demand.speed {
                    Some(speed) if speed * self.rate < path.rapid => {
                        (speed * self.rate, LimitId::FEED)
                    }
                    _ => (path.rapid, LimitId::RAPID),
                }
            };
            let speed = speed.min(least);
            if limits.last().is_none_or(|last| last.speed != speed || last.source != source) {
                limits.push(SpeedLimit { from: demand.from, speed, source });
            }
        }
        limits
    }

    /// The speed limits along a contour of which the job leaves the speed open, up to `most` [m/s].
    pub(super) fn limits_for(&self, contour: &Contour, most: Option<f64>) -> Vec<SpeedLimit> {
        let mut limits = self.speed_limits(contour);
        if let Some(most) = most {
            // One speed all along.
            let source = LimitId::TOOL_ACCELERATION;
            limits.iter_mut().for_each(|limit| {
                (limit.speed, limit.source) = (limit.speed.min(most), source);
            });
        }
        limits
    }

    /// The least way of a window, a tenth of what surely leads to rest [m].
    pub(super) fn least_reach(&self, speeds: &[SpeedLimit]) -> f64 {
        let limits = &self.limits.path;
        let top = speeds.iter().map(|speed| speed.speed).fold(0.0, f64::max);
        // Twice the way to rest, at least.
        let rest = top * top / limits.acceleration + top * limits.acceleration / limits.jerk + 1e-5;
        rest * 0.1
    }

    fn run(
        &self,
        contour: Arc<Contour>,
        path: Path,
        trail: Vec<(f64, Configuration<N>)>,
        speeds: Vec<SpeedLimit>,
    ) -> PathRun<N> {
        let top = speeds.iter().map(|speed| speed.speed).fold(0.0, f64::max);
        let least_reach = self.least_reach(&speeds);
        let fraction = if path.is_straight() { 1.0 } else { 0.5 };
        PathRun {
            contour,
            path: Arc::new(path),
            trail: Arc::new(trail),
            speeds: Arc::new(speeds),
            at: 0.0,
            begin: End::Rest,
            exit: End::Rest,
            smoothed_for: None,
            most: None,
            even: None,
            follows: true,
            reach: (fraction * top).max(10.0 * least_reach),
            least_reach,
            fallback: None,
        }
    }

    /// A path from rest to rest.
    fn begin_from_rest(
        &mut self,
        contour: Arc<Contour>,
        draft: &mut Draft<'_>,
    ) -> Result<(), PlanError> {
        self.halt(draft)?;
        let path = contour.trace(None, &self.limits.path);
        let length = path.length();
        let along = |share: f64| path.at(length * share).motion(1.0, 0.0, 0.0);
        let first = along(0.0);
        let found = self.router(draft.shares).approach(&first, &[&along]);
        let approach = match found {
            Ok(approach) => approach,
            Err(cause) => return self.in_parts(&contour, cause, draft),
        };
        if let Some((duration, motion)) = approach.motion {
            let stroke = self.front.light.stroke + u64::from(contour.is_lit());
            self.push(duration, motion, stroke, draft);
        }
        self.front.now = approach.start;
        self.settle_at(&first)?;
        let trail = trail(&self.limits, &self.front.now, &path)
            .map_err(|cause| self.refusal(Refused::Kinematics(cause)))?;
        let speeds = self.speed_limits(&contour);
        self.front.run = Some(self.run(contour, path, trail, speeds));
        self.go_on(draft)
    }

    /// Divides a path for which a table cannot turn far enough, or says why it cannot be gone.
    fn in_parts(
        &mut self,
        contour: &Arc<Contour>,
        cause: Refused,
        draft: &mut Draft<'_>,
    ) -> Result<(), PlanError> {
        let Refused::Position { axis, .. } = cause else { return Err(self.refusal(cause)) };
        let Some(parts) = divide(&self.limits, &self.front.now.joints, contour, axis) else {
            return Err(self.refusal(cause));
        };
        let text = format!(
            "marked in {} parts: between them an axis is turned back in the dark, whose travel is less \
             than the stroke winds up",
            parts.len()
        );
        if self.account.notes.len() < MOST_NOTES {
            draft.notes.push(Note { line: contour.line, text });
        }
        self.front.parts.extend(parts.into_iter().map(Arc::new));
        self.front.goes_on = false;
        Ok(())
    }

    /// A path at one speed, entered and left at it.
    fn begin_constant(
        &mut self,
        contour: Arc<Contour>,
        draft: &mut Draft<'_>,
    ) -> Result<(), PlanError> {
        let top = contour.top_speed(&self.limits.path);
        let speeds = self.speed_limits(&contour);
        let fastest = speeds.iter().map(|speed| speed.speed).fold(0.0, f64::max);
        let is_open = contour.demands().iter().all(|demand| demand.speed.is_none());
        let most = (is_open && top < fastest).then_some(top);
        let speeds = self.limits_for(&contour, most);
        let fastest = speeds.iter().map(|speed| speed.speed).fold(0.0, f64::max);
        let smoothed_for = Some(fastest.min(top));
        let path = contour.trace(smoothed_for, &self.limits.path);
        let length = path.length();
        let middle = |share: f64| path.at(length * share).motion(1.0, 0.0, 0.0);
        let mut wanted = match self.wanted(&path, &middle) {
            Ok(wanted) => wanted,
            Err(cause) => return self.in_parts(&contour, cause, draft),
        };
        let mut ends = [true; 2];
        for _ in 0..CONFIGURATIONS {
            let trail = trail(&self.limits, &wanted, &path)
                .map_err(|cause| self.refusal(Refused::Kinematics(cause)))?;
            let mut run = self.run(contour.clone(), path.clone(), trail, speeds.clone());
            (run.follows, run.smoothed_for, run.most) = (false, smoothed_for, most);
            let evenly = speeds.len() == 1 && fastest <= top;
            let timed = self
                .time_constant(&mut run, evenly, &mut ends, draft.shares)
                .map_err(|cause| self.refusal(cause))?;
            match self.enter(&run, &middle, draft.shares) {
                Ok(entry) if entry.start.is_like(&wanted) => {
                    return self.add_constant(run, timed, entry, draft);
                }
                Ok(entry) => wanted = entry.start,
                // There is no room to come to speed.
                Err(_) if ends[0] => ends[0] = false,
                Err(cause) => return Err(self.refusal(cause)),
            }
        }
        Err(self.refusal(Refused::NoConfiguration { tried: CONFIGURATIONS }))
    }

    fn add_constant(
        &mut self,
        run: PathRun<N>,
        timed: Timed,
        entry: Entry<N>,
        draft: &mut Draft<'_>,
    ) -> Result<(), PlanError> {
        if run.follows {
            let text =
                "marked with power in proportion to the speed near its ends: there is no room to \
                        come to speed in the dark"
                    .to_owned();
            let told = |notes: &[Note]| notes.iter().any(|note| note.text == text);
            if !told(&self.account.notes) && !told(&draft.notes) {
                draft.notes.push(Note { line: run.contour.line, text });
            }
        }
        let stroke = self.front.light.stroke + 1;
        for (duration, motion) in entry.motions {
            self.push(duration, motion, stroke, draft);
        }
        self.front.moving = None;
        self.front.now = entry.start;
        self.add(run, timed, draft)
    }

    /// The configuration at the start of a path from which it can be gone, the nearest.
    fn wanted(&self, path: &Path, middle: &PathFunction<'_>) -> Result<Configuration<N>, Refused> {
        if self.limits.scope == Scope::PathAlone {
            return Ok(self.front.now);
        }
        let first = path.at(0.0).motion(1.0, 0.0, 0.0);
        if self.limits.mechanism.is_linear() {
            let start = self.joints_at(&first, &self.front.now)?;
            walk(&self.limits, start, &[middle])?.within(&self.limits)?;
            return Ok(start);
        }
        let found = candidates(&self.limits, &self.front.now, &first, &[middle])?;
        found.first().map(|(start, _)| *start).ok_or(Refused::NoConfiguration { tried: 0 })
    }

    /// Times the first window of a path that is entered and left at speed, as far as `ends` say; sets
    /// them to false where it must be at rest.
    fn time_constant(
        &self,
        run: &mut PathRun<N>,
        evenly: bool,
        ends: &mut [bool; 2],
        shares: &Tightening,
    ) -> Result<Timed, Refused> {
        let length = run.path.length();
        let fastest = run.speeds[0].speed;
        let mut speeds = [0.0; 2];
        {
            let mut along =
                AlongPath::new(&self.limits, &run.path, &run.speeds, &run.trail, shares);
            along.is_tool_free = true;
            let even = fastest * shares.speed;
            if evenly && *ends == [true; 2] && keeps_even(&mut along, 0.0, length, even) {
                run.even = Some(even);
            }
            if let Some(cause) = along.error {
                return Err(Refused::Kinematics(cause));
            }
            (along.is_tool_free, along.is_exact) = (false, true);
            for (end, (place, side)) in
                [(0.0, Side::After), (length, Side::Before)].into_iter().enumerate()
            {
                let most = self.limits.path.rapid.max(self.limits.path.speed) * 2.0;
                let allowed = even_speed(&mut along, place, side, most);
                let demand =
                    if end == 0 { run.speeds[0] } else { run.speeds[run.speeds.len() - 1] };
                let asked = shares.speed * demand.speed;
                // The speed asked for needs no room to begin to change: it is held.
                let is_asked = allowed >= asked * (1.0 - 1e-9);
                speeds[end] = if is_asked { asked } else { END_SHARE * allowed };
            }
        }
        if let Some(speed) = run.even {
            run.begin = End::Moving { speed, acceleration: 0.0 };
            run.exit = run.begin;
            // The way to rest is there from the end of the path at this speed, or else from rest.
            let law = TimeLaw::even(0.0, length, speed, 0);
            let keeps = || !self.tighten_tail(run, &law, &mut shares.clone());
            let leaves = || self.can_leave(run, speed, shares);
            if self.front.goes_on || (keeps() && leaves()) {
                return self.time(run, shares)?.map_err(|_| Refused::NoConfiguration { tried: 1 });
            }
            run.even = None;
        }
        let mut trials = [0; 2];
        loop {
            for end in 0..2 {
                ends[end] &= trials[end] < END_TRIALS;
            }
            let [begin, exit] = [0, 1].map(|end| match ends[end] {
                true => End::Moving { speed: speeds[end], acceleration: 0.0 },
                false => End::Rest,
            });
            (run.begin, run.exit) = (begin, exit);
            run.follows = ends.contains(&false);
            // What goes on has no end yet.
            if ends[1] && !self.front.goes_on && !self.can_leave(run, speeds[1], shares) {
                trials[1] += 2;
                speeds[1] *= END_SLOWER * END_SLOWER;
                continue;
            }
            match self.time(run, shares)? {
                Ok(timed) => return Ok(timed),
                Err(found) => {
                    let end = usize::from(found.at_end);
                    let end = if ends[end] { end } else { 1 - end };
                    if !ends[end] {
                        return Err(Refused::NoConfiguration { tried: 1 });
                    }
                    speeds[end] *= if trials[end] == 0 { END_SHARE } else { END_SLOWER };
                    trials[end] += 1;
                }
            }
        }
    }
}
