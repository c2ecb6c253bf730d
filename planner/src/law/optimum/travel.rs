//! A drawing's time as a function of the speed that it leaves open.

use std::collections::BTreeMap;

use machine::PathLimits;
use messages::math;
use nalgebra::Vector3;

use super::line::{Line, LineEnd};
use super::search::refined;
use super::turn::{Spot, Turn, Turns};
use super::{Near, Speeds};
use crate::geometry::operation::{Operation, OperationKind};

/// Speeds are tried from the largest down, each by this factor below the one before, and so many.
const STEP: f64 = 1.25;
const TRIALS: usize = 60;

/// Steps of golden section between the neighbours of the best: to a part in 10⁷ of what is between them.
const REFINEMENTS: usize = 34;

/// Speeds nearer to each other than by this part take the same time.
const NEAR: f64 = 0.02;

/// Flights are sought of so many different turns; of a drawing with more, of some of them.
const MOST_FLOWN: usize = 48;

/// A drawing's moves, as far as their time depends on the speed of the open lines.
pub(crate) struct Travel<'a> {
    limits: &'a PathLimits,
    /// The largest marking speed [m/s].
    most: f64,
    lines: Vec<Line>,
    /// The turns that are not the same, and how often each is made.
    turns: Vec<(Turn, f64)>,
    /// Whether they are flown.
    flies: bool,
}

/// The best open speed of a drawing [m/s], and its time [s].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Best {
    pub(crate) speed: f64,
    pub(crate) time: f64,
}

/// A speed that was tried [m/s], and the time of all turns by way of a rest [s].
type Trial = [f64; 2];

impl<'a> Travel<'a> {
    /// Of `operations` from `start` on [m], by joints that leave what `near` says.
    pub(crate) fn new(
        start: Vector3<f64>,
        operations: &[Operation],
        limits: &'a PathLimits,
        near: &Near<'_>,
        speeds: &Speeds,
        flies: bool,
    ) -> Self {
        let (mut lines, mut turns) = (Vec::new(), Vec::new());
        let mut now = Spot::Rest(start);
        let mut go = |now: &mut Spot, to: Spot| {
            turns.push(Turn { from: *now, to });
            *now = to;
        };
        for operation in operations {
            match &operation.kind {
                OperationKind::Path(contour) if contour.is_entered_at_speed() => {
                    lines.push(Line::new(contour, limits, near, speeds));
                    let line = Spot::Line(lines.len() - 1);
                    if contour.goes_on_from_before() {
                        now = line;
                    } else {
                        go(&mut now, line);
                    }
                }
                OperationKind::Path(contour) => {
                    go(&mut now, Spot::Rest(contour.start().point));
                    now = Spot::Rest(contour.end().point);
                }
                OperationKind::Rapid(to) => go(&mut now, Spot::Rest(*to)),
                OperationKind::Dot(dot) => go(&mut now, Spot::Rest(dot.at)),
                OperationKind::Rest(_)
                | OperationKind::Output { .. }
                | OperationKind::Frequency(_)
                | OperationKind::Pause => {
                    if let Spot::Line(index) = now {
                        go(&mut now, Spot::Behind(index));
                    }
                }
            }
        }
        if let Spot::Line(index) = now {
            go(&mut now, Spot::Behind(index));
        }
        let turns = counted(&turns, &lines);
        Self { limits, most: speeds.most, lines, turns, flies }
    }

    /// The largest speed that an open line can be marked at [m/s], 0 where there is none.
    fn top(&self) -> f64 {
        self.lines.iter().map(Line::open_top).fold(0.0, f64::max).min(self.most)
    }

    /// The open speed of least time, the time of flights being looked at so many times; `None` where no
    /// line is open.
    pub(crate) fn best(&self, looks: usize) -> Option<Best> {
        let top = self.top();
        if top <= 0.0 {
            return None;
        }
        let trials = self.trials(top);
        if !self.flies {
            let time = |speed: f64| self.along(speed) + self.by_rest(speed);
            return Some(least(&trials, &|speed, by_rest| self.along(speed) + by_rest, &time));
        }
        // How long flights take of what the same turns take by way of a rest, by speed.
        let mut shares: Vec<Trial> = Vec::new();
        let mut best: Option<Best> = None;
        for _ in 0..looks {
            let of = |speed: f64, by_rest: f64| {
                self.along(speed) + by_rest * between(&shares, speed).unwrap_or(1.0)
            };
            let time = |speed: f64| of(speed, between(&trials, speed).unwrap_or(0.0));
            let Best { speed, .. } = least(&trials, &of, &time);
            let is_known = |[known, _]: &Trial| (known / speed - 1.0).abs() < NEAR;
            if shares.iter().any(is_known) {
                break;
            }
            let (share, by_rest) = (self.share(speed), self.by_rest(speed));
            let found = Best { speed, time: self.along(speed) + share * by_rest };
            // Of equal times the faster: it is what the limits allow.
            if best.is_none_or(|best| found.time < best.time) {
                best = Some(found);
            }
            let place = shares.partition_point(|[known, _]| *known < speed);
            shares.insert(place, [speed, share]);
        }
        best
    }

    /// The least open speed at which the lines alone take no longer than `time` [m/s].
    pub(crate) fn slowest(&self, time: f64) -> f64 {
        let (mut low, mut high) = (0.0, self.top());
        for _ in 0..40 {
            let middle = (low + high) / 2.0;
            if self.along(middle) > time {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    /// Speeds up to `top` that may be the best, rising.
    fn trials(&self, top: f64) -> Vec<Trial> {
        let mut trials = Vec::new();
        let (mut speed, mut least) = (top, f64::INFINITY);
        for _ in 0..TRIALS {
            let (along, by_rest) = (self.along(speed), self.by_rest(speed));
            trials.push([speed, by_rest]);
            least = least.min(along + by_rest);
            // Slower, the lines alone take longer than that.
            if along > least {
                break;
            }
            speed /= STEP;
        }
        trials.reverse();
        trials
    }

    /// The time along all lines [s].
    fn along(&self, open: f64) -> f64 {
        self.lines.iter().map(|line| line.time(open)).sum()
    }

    /// The time of all turns by way of a rest [s].
    fn by_rest(&self, open: f64) -> f64 {
        let turns = self.between_lines();
        self.turns.iter().map(|(turn, count)| count * turns.by_rest(turn, open)).sum()
    }

    /// What the flights take of the time by way of a rest [1].
    fn share(&self, open: f64) -> f64 {
        let turns = self.between_lines();
        let apart = self.turns.len().div_ceil(MOST_FLOWN).max(1);
        let looked_at = self.turns.iter().step_by(apart);
        let [flown, by_rest] = looked_at.fold([0.0; 2], |[flown, by_rest], (turn, count)| {
            [flown + count * turns.flown(turn, open), by_rest + count * turns.by_rest(turn, open)]
        });
        if by_rest > 0.0 { flown / by_rest } else { 1.0 }
    }

    fn between_lines(&self) -> Turns<'_> {
        Turns { lines: &self.lines, limits: self.limits, most: self.most }
    }
}

/// The best of `trials` by what `of` makes of each, refined between its neighbours by `time`.
fn least(trials: &[Trial], of: &impl Fn(f64, f64) -> f64, time: &impl Fn(f64) -> f64) -> Best {
    let (mut best, mut least) = (0, f64::INFINITY);
    for (index, [speed, by_rest]) in trials.iter().enumerate() {
        let found = of(*speed, *by_rest);
        // Of equal times the faster: it is what the limits allow.
        if found <= least {
            (best, least) = (index, found);
        }
    }
    let near = [best.saturating_sub(1), (best + 1).min(trials.len() - 1)];
    let speed = refined(time, near.map(|index| trials[index][0]), REFINEMENTS);
    let found = time(speed);
    if found < least {
        Best { speed, time: found }
    } else {
        Best { speed: trials[best][0], time: least }
    }
}

/// The value at `speed` between those of `known`, evenly in the logarithm of the speed, and as at the
/// nearest beyond them; `None` where none is known.
fn between(known: &[Trial], speed: f64) -> Option<f64> {
    let above = known.partition_point(|[other, _]| *other < speed);
    let (Some(low), Some(high)) = (above.checked_sub(1).map(|low| known[low]), known.get(above))
    else {
        return known.get(above.min(known.len().saturating_sub(1))).map(|[_, value]| *value);
    };
    let part = math::ln(speed / low[0]) / math::ln(high[0] / low[0]);
    Some(low[1] + part * (high[1] - low[1]))
}

/// The turns that are not the same, and how often each is made.
fn counted(turns: &[Turn], lines: &[Line]) -> Vec<(Turn, f64)> {
    let mut counted: Vec<(Turn, f64)> = Vec::new();
    let mut known: BTreeMap<Vec<i64>, usize> = BTreeMap::new();
    for turn in turns {
        let index = *known.entry(known_by(turn, lines)).or_insert(counted.len());
        match counted.get_mut(index) {
            Some((_, count)) => *count += 1.0,
            None => counted.push((*turn, 1.0)),
        }
    }
    counted
}

/// What a turn is known by: turns that differ by where they are made take the same time.
fn known_by(turn: &Turn, lines: &[Line]) -> Vec<i64> {
    /// How finely places [m], directions and what is a logarithm are told apart.
    const FINE: [f64; 3] = [1e-9, 1e-6, 1e-5];
    let mut key = Vec::new();
    let mut add = |value: f64, fine: f64| key.push((value / fine).round() as i64);
    let at = |spot: &Spot, end: usize| match spot {
        Spot::Rest(place) => (*place, None, 0.0),
        Spot::Line(index) => {
            (lines[*index].ends[end].jet.point, Some(&lines[*index].ends[end]), 1.0)
        }
        Spot::Behind(index) => (lines[*index].ends[1].jet.point, Some(&lines[*index].ends[1]), 2.0),
    };
    let ((from, first, leaves), (to, last, comes)) = (at(&turn.from, 1), at(&turn.to, 0));
    (to - from).iter().for_each(|part| add(*part, FINE[0]));
    [leaves, comes].into_iter().for_each(|kind| add(kind, 1.0));
    for end in [first, last].into_iter().flatten() {
        let LineEnd { jet, asked, top, limits, directions } = end;
        jet.first.iter().for_each(|part| add(*part, FINE[1]));
        jet.second.iter().for_each(|part| add(*part, FINE[1]));
        let sides = directions.iter().flat_map(|side| [side.speed, side.acceleration, side.jerk]);
        let own =
            [*top, asked.unwrap_or(f64::INFINITY), limits.speed, limits.acceleration, limits.jerk];
        own.into_iter().chain(sides).for_each(|value| add(math::ln(value), FINE[2]));
    }
    key
}
