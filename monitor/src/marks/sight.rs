//! The evaluator over stretches of time that nobody recorded: what passed in them, and where in the job
//! the light is found again.

use super::frontier::{FirstLight, Place, Unseen, is_idle};
use super::line::{Foot, Passage};
use super::tool_path::{Interval, Moment};
use super::{FIRST_REACH, Followed, MarkEvaluator, REACH, StreamEnd};
use crate::conclusion::LIGHT_LAG;

/// How far from the line of a stroke a point that the plan has on it may be found, after a gap [m].
const ON_PLAN: f64 = 5e-6;

/// The same of a point where the tool truly was [m].
const ON_TOOL: f64 = 5e-5;

/// How many times nearer to where the tool is expected after a gap than the next one a place must
/// be to be believed.
const BELIEVED: f64 = 4.0;

/// The fastest that a stream is played, against its plan.
const FASTEST_RATE: f64 = 2.0;

impl MarkEvaluator<'_> {
    /// Nobody recorded between the moment `before`, if there was one, and the moment `after`.
    pub(super) fn lose_sight(
        &mut self,
        before: Option<&Moment>,
        after: &Moment,
        cycles: Option<u64>,
    ) {
        if let Some(run) = &mut self.run {
            run.cut = true;
        }
        self.end_run();
        self.whole_before = None;
        let idle = before.is_some_and(is_idle) && is_idle(after);
        let unseen = match self.unseen {
            Some(unseen) => Unseen {
                cycles: unseen.cycles.zip(cycles).map(|(one, other)| one + other),
                idle: unseen.idle && idle,
                ..unseen
            },
            None => Unseen {
                after: before.map(|before| before.stamp.cycle),
                from: self.frontier.place,
                cycles,
                idle,
            },
        };
        self.unseen = Some(unseen);
    }

    /// The first light after a gap falls or is due: what lies before it and was not seen is hidden.
    pub(super) fn regain_sight(&mut self, unseen: &Unseen, interval: &Interval, light: FirstLight) {
        let Some(shape) = self.stroke_index(light.stroke) else { return };
        if light.stroke < unseen.from.stroke {
            return;
        }
        let found = self.find(unseen, interval, light);
        let place = Place { stroke: light.stroke, at: found.map_or(0.0, |foot| foot.at) };
        let place = if found.is_some() { place } else { place.next_stroke() };
        if let Some(state) = self.strokes.get_mut(shape) {
            state.blind = found.is_none();
        }
        self.hide(unseen.from, place);
        self.frontier.pass(place);
        self.unseen = None;
    }

    /// Where along its stroke the first light after a gap is. `None` where the line comes by more
    /// than once and nothing says which passage it is.
    fn find(&mut self, unseen: &Unseen, interval: &Interval, light: FirstLight) -> Option<Foot> {
        let index = self.stroke_index(light.stroke)?;
        self.load_line(index);
        let (_, line) = self.line.as_ref()?;
        let tool = interval.tool(light.from);
        // The plan goes along the line exactly, the tool nearly.
        let (point, tolerance) = match interval.deviation(light.from) {
            Some(deviation) => (tool - deviation, ON_PLAN),
            None => (tool, ON_TOOL),
        };
        let onward = interval.planned_step();
        let ahead = |passage: &Passage| passage.direction.dot(&onward) > 0.0;
        let mut passages = line.passages(&point, tolerance);
        if passages.len() > 1 && passages.iter().any(ahead) {
            passages.retain(ahead);
        }
        // Light comes again where it ended, and went on from there as fast as it can at most.
        let farthest = self.farthest(unseen.from, unseen.cycles);
        let possible = |passage: &Passage| {
            let place = |at| Place { stroke: light.stroke, at };
            unseen.from.is_before(place(passage.foot.at + REACH))
                && place(passage.foot.at - REACH).is_before(farthest)
        };
        if passages.len() > 1 && passages.iter().any(possible) {
            passages.retain(possible);
        }
        let followed = self.strokes.get(index)?.followed;
        // What begins in a recorded cycle, on a stroke not met before, begins at its start.
        let begins = followed.is_none() && (light.from > 0.0 || !interval.is_first());
        let expected = followed.and_then(|followed| {
            let (length, lit) = self.sums.pace;
            let played = interval.start.stream_time()? - followed.time?;
            Some(followed.at + if lit > 0.0 { length / lit * played } else { 0.0 })
        });
        let at = match passages.as_slice() {
            // A dot.
            [] => 0.0,
            [one] => one.foot.at,
            [first, ..] if begins && first.foot.at < FIRST_REACH => first.foot.at,
            several => nearest(several, expected?)?,
        };
        let foot = line.foot(&tool, at, at, REACH);
        self.strokes.get_mut(index)?.followed = Some(Followed { at: foot.at, tool, time: None });
        Some(foot)
    }

    /// What passed between two places of the job was not recorded.
    fn hide(&mut self, from: Place, to: Place) {
        for (number, state) in (self.behind + 1..).zip(&mut self.strokes) {
            if number < from.stroke || number > to.stroke {
                continue;
            }
            let length = state.shape.length();
            let low = if number == from.stroke { from.at } else { 0.0 };
            let high = if number == to.stroke { to.at.min(length) } else { length };
            let is_dot = length == 0.0 && number < to.stroke;
            if low < high || is_dot {
                state.coverage.hide(low, high);
            }
        }
    }

    /// Hides what the job may still have marked after its last record, and in a gap after which
    /// nothing was lit; whether nobody can tell how far that was, and up to where it was hidden.
    pub(super) fn hide_the_end(
        &mut self,
        newest: &Moment,
        end: StreamEnd<'_>,
    ) -> (bool, Option<Place>) {
        let last = newest.stamp.cycle;
        let (last_cycle, completed) = match end {
            StreamEnd::Reported(report) => (Some(report.last_cycle.0), report.completed == 1),
            StreamEnd::Silenced => (Some(last), false),
            StreamEnd::Unknown => (None, false),
        };
        let told = last_cycle.map(|cycle| cycle.saturating_add(LIGHT_LAG));
        // Without a report nothing more is lit where drives has closed the gate by itself.
        let lacking = match told {
            Some(told) => told.saturating_sub(last),
            None => u64::from(!newest.kept_dark),
        };
        let over = |unseen: &Unseen| told.zip(unseen.after).is_some_and(|(told, it)| told <= it);
        let unseen = self.unseen.take().filter(|unseen| !over(unseen));
        let (from, cycles) = match (unseen, lacking) {
            (None, 0) => return (false, None),
            (None, lacking) => (self.frontier.place, told.map(|_| lacking)),
            (Some(unseen), lacking) => {
                let cycles = unseen.cycles.filter(|_| lacking == 0 || told.is_some());
                (unseen.from, cycles.map(|cycles| cycles + lacking))
            }
        };
        let bound = cycles.filter(|_| !completed);
        let to = self.farthest(from, bound);
        self.hide(from, to);
        let bounded = bound.and(self.fastest).is_some();
        (!bounded && !completed && from.is_before(to), Some(to))
    }

    /// How far the job can have come from a place in so many cycles; `None` is any number.
    fn farthest(&self, from: Place, cycles: Option<u64>) -> Place {
        match cycles.zip(self.fastest) {
            Some((cycles, speed)) => {
                let time = self.period.of(cycles).seconds();
                let before = from.stroke.saturating_sub(self.behind + 1) as usize;
                let lengths = self.strokes.iter().skip(before).map(|state| state.shape.length());
                from.after(speed * FASTEST_RATE * time, lengths)
            }
            None => self.end(),
        }
    }
}

/// The arc length of the passage nearest to where the tool is expected; `None` where another one is
/// nearly as near.
fn nearest(passages: &[Passage], expected: f64) -> Option<f64> {
    let surprise = |passage: &Passage| (passage.foot.at - expected).abs();
    let mut ordered: Vec<&Passage> = passages.iter().collect();
    ordered.sort_by(|a, b| surprise(a).total_cmp(&surprise(b)));
    match ordered.as_slice() {
        [one] => Some(one.foot.at),
        [best, next, ..] if surprise(best) * BELIEVED < surprise(next) => Some(best.foot.at),
        _ => None,
    }
}
