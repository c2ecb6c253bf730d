//! When the laser changes along a path, and to which power.

use machine::LaserSource;
use messages::Nanoseconds;
use messages::time::CYCLE_TIME;

use crate::geometry::contour::{Contour, Demand, GAP};
use crate::law::time_law::TimeLaw;
use crate::light::Policy;
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
    /// How long it lasts [s].
    pub(crate) duration: f64,
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

    /// Lights a dot from `start` on, one exposure after the other: times [s] and powers.
    pub(crate) fn dot(&mut self, start: f64, exposures: &[(f64, f64)]) -> Result<(), TooShort> {
        self.stroke += 1;
        let duration: f64 = exposures.iter().map(|(time, _)| time).sum();
        let mut time = start;
        for (length, power) in exposures {
            self.to(time, *power);
            time += length;
        }
        self.off(time, duration)
    }

    /// Lights the stretches of `contour` that `law` goes through from `start` on [s]. Power that is
    /// asked for at a speed follows the true one where the policy, or the lack of room for a
    /// run-in, says so. `asked` gives the speed of a demand as the job has it [m/s], and how much faster it
    /// is asked for now, which the power makes up for.
    pub(crate) fn path(
        &mut self,
        contour: &Contour,
        law: &TimeLaw,
        start: f64,
        follows: bool,
        asked: &dyn Fn(&Demand) -> (f64, f64),
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
                    self.off(begin, f64::INFINITY)?;
                }
                continue;
            }
            if !self.is_lit {
                self.stroke += 1;
            }
            let (speed, faster) = asked(&demand);
            if follows {
                self.follow(
                    [demand.power, demand.power * faster],
                    speed,
                    law,
                    [start, begin, until],
                );
            } else {
                self.to(begin, demand.power * faster);
            }
        }
        if places.end >= contour.length() - GAP && self.is_lit {
            let duration = until_end(law, start) - self.last.time.seconds();
            self.off(start + law.duration(), duration)?;
        }
        Ok(())
    }

    /// Power in proportion to the mean speed of each cycle, `power` at the speed `asked` [m/s] and `most`
    /// at most, down to what the source and the policy leave.
    fn follow(
        &mut self,
        [power, most]: [f64; 2],
        asked: f64,
        law: &TimeLaw,
        [start, begin, until]: [f64; 3],
    ) {
        let LaserSource { min_power, proportional_floor, .. } = self.source;
        let least = (power * proportional_floor).max(min_power).min(power);
        let mut from = begin;
        while from < until {
            let border = ((from / CYCLE_TIME + 1e-6).floor() + 1.0) * CYCLE_TIME;
            let to = border.min(until);
            let [here, there] = [from, to].map(|time| law.at(time - start).position);
            let speed = (there - here) / (to - from);
            self.to(from, (power * speed / asked).min(most).max(least));
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
            return Err(TooShort { duration });
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

fn until_end(law: &TimeLaw, start: f64) -> f64 {
    start + law.duration()
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
