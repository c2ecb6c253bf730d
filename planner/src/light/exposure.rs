//! When the laser changes along a path, and to which power.

use machine::LaserSource;
use messages::time::{Period, SETPOINT_TIME};
use messages::{MAX_EDGES, Nanoseconds};

use crate::geometry::contour::{Contour, Demand, GAP};
use crate::law::time_law::TimeLaw;
use crate::light::Policy;
use crate::limits::along::SpeedLimit;
use crate::trajectory::LaserChange;

/// The laser along a job so far.
#[derive(Debug, Clone)]
pub(crate) struct Light {
    source: LaserSource,
    /// Strokes and dots so far.
    pub(crate) stroke: u64,
    /// Whether the stroke goes on.
    is_lit: bool,
    changes: Vec<LaserChange>,
    /// The last change of all, of those handed on too.
    last: LaserChange,
}

/// Light that is shorter than the source can switch, or its pause.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TooShort {
    /// Line of the job file, 0 for none.
    pub(crate) line: u64,
    /// How long it lasts [s].
    pub(crate) duration: f64,
}

impl TooShort {
    fn at(self, line: u64) -> Self {
        Self { line, ..self }
    }
}

impl Light {
    pub(crate) fn new(source: LaserSource) -> Self {
        let last = LaserChange { time: Nanoseconds(i64::MIN / 2), power: 0.0, stroke: 0 };
        Self { source, stroke: 0, is_lit: false, changes: Vec::new(), last }
    }

    /// Takes the laser changes that motion after `time` [s] can no longer affect. Later motion can move a change
    /// forward, by the source's delay, or delete one, where a pause is too short for the source.
    pub(crate) fn take(&mut self, time: f64) -> Vec<LaserChange> {
        let first = Nanoseconds::from_seconds(time - told_ahead(&self.source));
        let count = self.changes.iter().take_while(|change| change.time < first).count();
        self.changes.drain(..count).collect()
    }

    /// Hands on all changes, at the end of the job.
    pub(crate) fn take_all(&mut self) -> Vec<LaserChange> {
        core::mem::take(&mut self.changes)
    }

    /// Lights the dot of a line of the job file from `start` on, one exposure after the other: times [s] and
    /// powers.
    pub(crate) fn dot(
        &mut self,
        start: f64,
        exposures: &[(f64, f64)],
        line: u64,
    ) -> Result<(), TooShort> {
        self.stroke += 1;
        let duration: f64 = exposures.iter().map(|(time, _)| time).sum();
        let mut time = start;
        for (length, power) in exposures {
            self.to(time, *power);
            time += length;
        }
        self.off(time, duration).map_err(|short| short.at(line))
    }

    /// Lights the stretches of `contour` that `law` goes through from `start` on [s]. Power that is
    /// asked for at a speed follows the true one where the policy, or the lack of room for a
    /// run-in, says so. Where the `limits` in force allow more than the job asks for, as `asked` gives it
    /// for a demand [m/s], power makes up for what the tool is faster.
    pub(crate) fn path(
        &mut self,
        contour: &Contour,
        law: &TimeLaw,
        start: f64,
        follows: bool,
        asked: &dyn Fn(&Demand) -> f64,
        limits: &[SpeedLimit],
    ) -> Result<(), TooShort> {
        let places = law.places();
        let follows = follows || contour.policy == Policy::Proportional;
        for (demand, end) in contour.stretches_in(&places) {
            let (from, to) = (demand.from.max(places.start), end.min(places.end));
            if to - from <= 0.0 {
                continue;
            }
            let [begin, until] = [from, to].map(|place| start + law.time_at(place));
            if demand.power <= 0.0 {
                if self.is_lit && to - from > GAP {
                    self.off(begin, f64::INFINITY).map_err(|short| short.at(demand.line))?;
                }
                continue;
            }
            if !self.is_lit {
                self.stroke += 1;
            }
            let power = demand.power;
            let exposure = Exposure { power, speed: asked(&demand), limits };
            let LaserSource { min_power, proportional_floor, .. } = self.source;
            if follows {
                let least = (power * proportional_floor).max(min_power).min(power);
                self.follow(&exposure, least, law, [start, begin, until]);
            } else if exposure.most([from, to]) > power {
                self.follow(&exposure, power, law, [start, begin, until]);
            } else {
                self.to(begin, power);
            }
        }
        if places.end >= contour.length() - GAP && self.is_lit {
            let end = start + law.duration();
            let duration = end - self.last.time.seconds();
            let line = contour.demands().last().map_or(contour.line, |demand| demand.line);
            self.off(end, duration).map_err(|short| short.at(line))?;
        }
        Ok(())
    }

    /// Power in proportion to the mean speed of each cycle, not below `least`.
    fn follow(
        &mut self,
        exposure: &Exposure<'_>,
        least: f64,
        law: &TimeLaw,
        [start, begin, until]: [f64; 3],
    ) {
        let mut from = begin;
        while from < until {
            let border = ((from / SETPOINT_TIME + 1e-6).floor() + 1.0) * SETPOINT_TIME;
            let to = border.min(until);
            let [here, there] = [from, to].map(|time| law.at(time - start).position);
            let speed = (there - here) / (to - from);
            let most = exposure.most([here, there]);
            self.to(from, (exposure.power * speed / exposure.speed).min(most).max(least));
            from = to;
        }
    }

    /// Tells the source to change its power, ahead of time by its own delay.
    fn to(&mut self, time: f64, power: f64) {
        if self.is_lit && power == self.last.power {
            return;
        }
        let time = Nanoseconds::from_seconds(time - self.source.on_delay);
        // A pause that is shorter than the source needs to go dark is none.
        if !self.is_lit && self.last.power == 0.0 && time < self.last.time {
            self.changes.pop();
        }
        self.push(LaserChange { time, power: power.max(f64::MIN_POSITIVE), stroke: self.stroke });
        self.is_lit = true;
    }

    fn off(&mut self, time: f64, duration: f64) -> Result<(), TooShort> {
        let time = Nanoseconds::from_seconds(time - self.source.off_delay);
        self.is_lit = false;
        let on = self.changes.iter().rev().take_while(|change| change.stroke == self.stroke).last();
        if on.is_some_and(|on| time <= on.time) {
            return Err(TooShort { line: 0, duration });
        }
        while self.changes.last().is_some_and(|change| change.time >= time) {
            self.changes.pop();
        }
        self.push(LaserChange { time, power: 0.0, stroke: 0 });
        Ok(())
    }

    fn push(&mut self, change: LaserChange) {
        self.last = change;
        self.changes.push(change);
    }
}

/// How long before the motion that it belongs to the source may be told of a change [s].
pub(crate) fn told_ahead(source: &LaserSource) -> f64 {
    source.on_delay.max(source.off_delay)
}

/// What a job asks for: so much power at a speed [m/s].
struct Exposure<'a> {
    power: f64,
    speed: f64,
    /// The limits of the speed that are in force.
    limits: &'a [SpeedLimit],
}

impl Exposure<'_> {
    /// The power that makes up for the largest speed that is allowed between two places [m], never less
    /// than what is asked for and never more than there is.
    fn most(&self, [from, to]: [f64; 2]) -> f64 {
        /// What rounding may add to a speed that is as asked for.
        const ROUNDING: f64 = 1e-9;
        // What begins where this ends is asked for by another stretch.
        let first = self.limits.partition_point(|limit| limit.from <= from + GAP).max(1) - 1;
        let others = self.limits[first + 1..].iter().take_while(|limit| limit.from < to - GAP);
        let fastest = others.fold(self.limits[first].speed, |most, limit| most.max(limit.speed));
        if fastest > self.speed * (1.0 + ROUNDING) {
            (self.power * fastest / self.speed).min(1.0)
        } else {
            self.power
        }
    }
}

/// The speed at which each stretch of light, and each pause between two, lasts long enough for the
/// source [m/s]: by stretch, infinite where there is no such need.
pub(crate) fn source_speeds(contour: &Contour, source: &LaserSource) -> Vec<f64> {
    /// What is left between two changes [s].
    const APART: f64 = 2e-6;
    let lag = source.off_delay - source.on_delay;
    let count = contour.demands().len();
    contour
        .stretches()
        .enumerate()
        .map(|(index, (demand, to))| {
            let is_lit = demand.power > 0.0;
            let between = index > 0 && index + 1 < count;
            let least = if is_lit { lag } else { -lag };
            if least <= 0.0 || (!is_lit && !between) {
                return f64::INFINITY;
            }
            (to - demand.from) / (least + APART)
        })
        .collect()
}

/// How many changes of the light a control cycle of this `period` has room for beside the two in every
/// setpoint that follow the speed, and in what time [s]: in that of a setpoint, or of the cycle where
/// that is longer.
fn room_for_changes(period: Period) -> (usize, f64) {
    let setpoints = Period::OF_SETPOINTS.cycles_for(period.time());
    let following = usize::try_from(setpoints).unwrap_or(MAX_EDGES).saturating_mul(2);
    (MAX_EDGES.saturating_sub(following).max(1), Period::OF_SETPOINTS.of(setpoints).seconds())
}

/// The speed at which the light changes no more often than a control cycle of `period` can say [m/s]: by
/// stretch, infinite where there is no such need.
pub(crate) fn change_speeds(contour: &Contour, period: Period) -> Vec<f64> {
    let (changes, time) = room_for_changes(period);
    let demands = contour.demands();
    let mut speeds = vec![f64::INFINITY; demands.len()];
    for first in 0..demands.len().saturating_sub(changes) {
        let room = demands[first + changes].from - demands[first].from;
        for speed in &mut speeds[first..first + changes] {
            *speed = speed.min(room / time);
        }
    }
    speeds
}
