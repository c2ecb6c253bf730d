//! The evaluation of the marks: what the laser truly marked against what the job asked for.
//!
//! Matched stroke by stroke along the arc length, so that strokes which touch or cross in space do
//! not hide each other. All light names its stroke, and the tool's place along that stroke is
//! followed from sample to sample; in dark cycles, along the stroke that the command in force
//! names, so that light which comes late is found where it falls. A hold that backs up and resumes
//! adds a run of light to its stroke: a gap between the runs is missing, an overlap is double.
//!
//! A job that was not played to its end is judged by what it had come to: what was not due yet is *left*,
//! not missing.
//!
//! What passed while nobody recorded is *unrecorded*, from where the job had come before a gap to
//! where light first fell or was due after it: missing, because nobody saw it marked.
//!
//! The [`MarkEvaluator`] takes records as they come; it remembers runs of light, not samples, and of strokes that lie
//! far behind only what they came to.

pub mod coverage;
mod frontier;
pub mod line;
mod sight;
mod tally;
pub mod tool_path;

use crate::recording::CycleRecord;
use crate::recording::continuity::Succession;
use coverage::Coverage;
use frontier::{Frontier, Place, Unseen, first_light, last_light};
use line::{Foot, Line};
use messages::ControllerReport;
use messages::artwork::{Artwork, ArtworkLine, Stroke, distance};
use messages::time::{Period, SETPOINT_TIME};
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::VecDeque;
use tally::Tally;
use tool_path::{Interval, LitSpan, Moment, ToolPath};

/// How the tool's true position was known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The simulated plant's own tool position, or a sensor at the tool.
    Plant,
    /// The motors' encoders or counted pulses, by way of the mechanism.
    Encoders,
}

/// What was marked, compared with the job's geometry. Lengths in m, speeds in m/s.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Marks {
    /// Length of the tool's true path with the laser on [m].
    pub length: f64,
    /// Length that the job had come to and that is not known to be marked [m].
    pub missing: f64,
    /// How much of `missing` passed while nobody recorded [m]: it may be marked all the same.
    #[serde(default)]
    pub unrecorded: f64,
    /// Length marked more than once, beyond the end of a stroke, or without a stroke [m].
    pub double: f64,
    /// Largest distance of a marked point from its stroke's line [m].
    pub error_max: f64,
    /// Root mean square of that distance over the time lit [m].
    pub error_rms: f64,
    /// Largest distance of the tool from where it should have been at that time, while lit [m].
    pub tracking_max: f64,
    /// Root mean square of that distance over the time lit [m].
    pub tracking_rms: f64,
    /// The worst single stroke end that the job had come to and that was not marked [m]; a lost stroke counts whole.
    pub missing_end_max: f64,
    /// The longest mark beyond a single stroke end [m].
    pub double_end_max: f64,
    /// Smallest speed of the tool in cycles wholly lit, dots left out [m/s].
    pub speed_min: f64,
    /// Largest speed of the tool in cycles wholly lit, dots left out [m/s].
    pub speed_max: f64,
    /// How the tool's position was known.
    pub source: Source,
    /// Strokes, dots included, that the job was through with and that are known to have got no light at all.
    pub strokes_lost: u64,
    /// Length marked while no stroke was asked for [m]; counted in `length` and `double`.
    pub stray: f64,
}

/// The marks, and which of them passed while nobody recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct MarkEvaluation {
    /// The marks.
    pub marks: Marks,
    /// The first and the last stroke, from 1, of which not all was recorded.
    pub unrecorded_strokes: Option<(u64, u64)>,
    /// Lit cycles in which nobody knew where the tool was; they count as unrecorded.
    pub unknown: u64,
    /// Whether nobody can tell what light the job still had after its last record.
    pub open_end: bool,
    /// What the job had not come to when it ended; `None` of one that was played to its end.
    pub left: Option<Left>,
}

/// What of a job was not due yet when it ended, as far as it was planned.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Left {
    /// The stroke to go on with, from 1: the first that is not done.
    pub stroke: u64,
    /// How much of that stroke has been marked, or should have been [m].
    pub begun: f64,
    /// Where that is in the drawing; `None` behind the last stroke that was planned.
    pub place: Option<DrawnPlace>,
    /// Length that was not due yet [m]. What may have passed while nobody recorded is not counted.
    pub length: f64,
}

/// A place on a stroke.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawnPlace {
    /// Line of the job file that the stroke comes from, from 1; 0 when it has none.
    pub line: u64,
    /// The place, machine frame [m].
    pub position: [f64; 3],
    /// The lower and the upper corner of the box around the stroke [m].
    pub bounds: [[f64; 3]; 2],
}

impl DrawnPlace {
    /// The place on `stroke` at arc length `along` [m]; `None` of one without points.
    fn on(stroke: &Stroke, along: f64) -> Option<Self> {
        let first = stroke.points.first()?;
        let mut bounds = [*first; 2];
        let (mut position, mut left) = (*first, along);
        for pair in stroke.points.windows(2) {
            let [from, to] = pair else { continue };
            let length = distance(from, to);
            if left > 0.0 && length > 0.0 {
                let part = (left / length).min(1.0);
                position = std::array::from_fn(|axis| from[axis] + part * (to[axis] - from[axis]));
            }
            left -= length;
            for axis in 0..3 {
                bounds[0][axis] = bounds[0][axis].min(to[axis]);
                bounds[1][axis] = bounds[1][axis].max(to[axis]);
            }
        }
        Some(Self { line: stroke.line, position, bounds })
    }
}

/// What is known of the end of a job's stream.
#[derive(Debug, Clone, Copy)]
pub enum StreamEnd<'a> {
    /// The controller's final report says where the last light is told, and whether the job was
    /// completed.
    Reported(&'a ControllerReport),
    /// Drives died, and the recording has all that it said: what it had been told to light still
    /// fell, for some cycles, and no more.
    Silenced,
    /// Nobody says anything.
    Unknown,
}

impl<'a> StreamEnd<'a> {
    /// As the controller reports it, if it does.
    pub fn of(report: Option<&'a ControllerReport>) -> Self {
        report.map_or(Self::Unknown, Self::Reported)
    }
}

/// Why there is no evaluation at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Unevaluated {
    /// There are no records of the job's stream.
    #[error("the marks are not judged: nothing of the job was recorded")]
    Unrecorded,
    /// Nobody ever knew where the tool was.
    #[error("the marks are not judged: the tool position was never known")]
    ToolUnknown,
}

/// Evaluates marks record by record.
#[derive(Debug)]
pub struct MarkEvaluator<'a> {
    period: Period,
    path: ToolPath,
    newest: Option<Moment>,
    /// The strokes that are known and not yet far behind.
    strokes: VecDeque<StrokeState<'a>>,
    /// How many strokes were before those, and what they came to.
    behind: u64,
    tally: Tally,
    line: Option<(u64, Line)>,
    run: Option<Run>,
    whole_before: Option<u64>,
    sums: Sums,
    frontier: Frontier,
    unseen: Option<Unseen>,
    /// The fastest that the plan marks [m/s], if known.
    fastest: Option<f64>,
    /// Whether the job's stream has been seen.
    played: bool,
    /// Lit cycles without a tool position.
    unknown: u64,
}

/// How far a stroke has come.
#[derive(Debug, Clone)]
struct StrokeState<'a> {
    shape: Cow<'a, Stroke>,
    coverage: Coverage,
    followed: Option<Followed>,
    /// Whether a gap has left it unknown where along the stroke the tool is.
    blind: bool,
}

impl<'a> StrokeState<'a> {
    /// Before there was any light.
    fn of(shape: Cow<'a, Stroke>) -> Self {
        Self { shape, coverage: Coverage::default(), followed: None, blind: false }
    }
}

/// Where along its stroke the tool was seen last.
#[derive(Debug, Clone, Copy)]
struct Followed {
    at: f64,
    tool: Vector3<f64>,
    /// Stream time then [s], if known.
    time: Option<f64>,
}

/// One run of light on one stroke, from edge to edge.
#[derive(Debug, Clone, Copy)]
struct Run {
    stroke: u64,
    tool: Vector3<f64>,
    error: Option<f64>,
    deviation: Option<f64>,
    length: f64,
    time: f64,
    /// Whether a gap cut off its beginning or its end.
    cut: bool,
}

#[derive(Debug, Default)]
struct Sums {
    length: f64,
    stray: f64,
    error: MeanSquare,
    tracking: MeanSquare,
    speed: Option<(f64, f64)>,
    run_speed: Option<(f64, f64)>,
    /// Length [m] and stream time [s] of cycles wholly lit.
    pace: (f64, f64),
}

/// The largest of a quantity, and its mean square over time by the trapezoidal rule.
#[derive(Debug, Default)]
struct MeanSquare {
    largest: f64,
    sum: f64,
    time: f64,
}

impl MeanSquare {
    /// Takes a stretch of time, from one value to another; one that is not known is taken to be as
    /// the other.
    fn add(&mut self, from: Option<f64>, to: Option<f64>, time: f64) {
        let (Some(from), Some(to)) = (from.or(to), to.or(from)) else { return };
        self.largest = self.largest.max(from).max(to);
        self.sum += 0.5 * (from * from + to * to) * time;
        self.time += time;
    }

    fn root(&self) -> f64 {
        if self.time > 0.0 { (self.sum / self.time).sqrt() } else { 0.0 }
    }
}

/// Time between two points of light [s]: at 0.25 m/s one each 0.125 mm.
const STEP_TIME: f64 = SETPOINT_TIME / 2.0;

/// How far from its expected place on a stroke the tool is looked for at first [m].
const FIRST_REACH: f64 = 1e-3;

/// How much farther than the tool moved its foot may have moved along the stroke [m].
const REACH: f64 = 1e-4;

/// A run of light that begins farther from its stroke than this is looked for all along it [m].
const LOST_TRACK: f64 = 2e-4;

/// How many strokes behind the job may still get light: light comes a few cycles late, of a few strokes each.
const LATE: u64 = 256;

impl<'a> MarkEvaluator<'a> {
    /// An evaluator for `artwork` and cycles of this `period`, before the first record.
    pub fn new(artwork: &'a Artwork, period: Period) -> Self {
        let strokes = artwork.strokes.iter().map(|stroke| StrokeState::of(Cow::Borrowed(stroke)));
        Self { strokes: strokes.collect(), ..Self::growing(period) }
    }

    /// An evaluator for what [`MarkEvaluator::draw`] will tell, and cycles of this `period`, before the first record.
    pub fn growing(period: Period) -> Self {
        Self {
            period,
            path: ToolPath::default(),
            newest: None,
            strokes: VecDeque::new(),
            behind: 0,
            tally: Tally::default(),
            line: None,
            run: None,
            whole_before: None,
            sums: Sums::default(),
            frontier: Frontier::new(),
            unseen: None,
            fastest: None,
            played: false,
            unknown: 0,
        }
    }

    /// The same, knowing that the plan never marks faster than `speed` [m/s]: it bounds what can
    /// have been marked while nobody recorded. 0 says nothing.
    #[must_use]
    pub fn with_fastest(self, speed: f64) -> Self {
        Self { fastest: (speed > 0.0).then_some(speed), ..self }
    }

    /// Takes the next stroke, or what comes next of the last one: before the records in which that is marked, and those
    /// just before them.
    pub fn draw(&mut self, line: ArtworkLine) {
        let ArtworkLine { goes_on, stroke } = line;
        match self.strokes.back() {
            Some(_) if goes_on => {
                let number = self.behind + self.strokes.len() as u64;
                if let Some((_, line)) = self.line.as_mut().filter(|(loaded, _)| *loaded == number)
                {
                    line.extend(&stroke);
                }
                if let Some(last) = self.strokes.back_mut() {
                    last.shape.to_mut().points.extend(stroke.points.iter().skip(1));
                }
            }
            _ => self.strokes.push_back(StrokeState::of(Cow::Owned(stroke))),
        }
    }

    /// Takes the next record, with the tool where drives reported it. A record without a tool
    /// position is as good as none.
    pub fn push(&mut self, record: &CycleRecord) {
        let moment = Moment::of(record, self.period);
        self.played |= moment.asked.stream != 0 || moment.laser.is_lit();
        if moment.tool_known {
            self.moment(moment);
        } else if moment.laser.is_lit() {
            self.unknown += 1;
        }
    }

    /// The evaluation, with what is known of the end of the stream.
    ///
    /// # Errors
    /// [`Unevaluated`] where there is nothing to judge.
    pub fn finish(mut self, end: StreamEnd<'_>) -> Result<MarkEvaluation, Unevaluated> {
        if let Some(interval) = self.path.finish() {
            self.interval(&interval);
        }
        self.end_run();
        if !self.played {
            return Err(Unevaluated::Unrecorded);
        }
        let Some(newest) = self.newest else { return Err(Unevaluated::ToolUnknown) };
        let completed = matches!(end, StreamEnd::Reported(report) if report.completed == 1);
        let (open_end, hidden) = self.hide_the_end(&newest, end);
        let due = match (completed, hidden) {
            (true, _) => self.end(),
            (false, Some(hidden)) => self.frontier.place.max(hidden),
            (false, None) => self.frontier.place,
        };
        let (speed_min, speed_max) = self.sums.speed.or(self.sums.run_speed).unwrap_or((0.0, 0.0));
        let reached = self.frontier.place;
        let mut left = Left { stroke: reached.stroke, ..Left::default() };
        for (number, state) in (self.behind + 1..).zip(&self.strokes) {
            let length = state.shape.length();
            let come_to = due.along(number, length);
            if number == reached.stroke {
                left.begun = reached.along(number, length);
                left.place = DrawnPlace::on(&state.shape, left.begun);
            }
            left.length += length - come_to;
            self.tally.add(number, &state.coverage, (length, come_to), number < due.stroke);
        }
        let Tally { missing, unrecorded, double, missing_end_max, double_end_max, lost, hidden } =
            self.tally;
        let marks = Marks {
            length: self.sums.length,
            missing,
            unrecorded,
            double: double + self.sums.stray,
            error_max: self.sums.error.largest,
            error_rms: self.sums.error.root(),
            tracking_max: self.sums.tracking.largest,
            tracking_rms: self.sums.tracking.root(),
            missing_end_max,
            double_end_max,
            speed_min,
            speed_max,
            source: Source::Plant,
            strokes_lost: lost,
            stray: self.sums.stray,
        };
        let left = (!completed).then_some(left);
        let unrecorded_strokes = hidden;
        Ok(MarkEvaluation { marks, unrecorded_strokes, unknown: self.unknown, open_end, left })
    }

    /// Lets go of strokes far behind, which get no light any more.
    fn let_go(&mut self) {
        if self.unseen.is_some() || self.run.is_some() {
            return;
        }
        while self.behind + 1 + LATE < self.frontier.place.stroke
            && let Some(state) = self.strokes.pop_front()
        {
            self.behind += 1;
            let length = state.shape.length();
            self.tally.add(self.behind, &state.coverage, (length, length), true);
        }
    }

    /// The place behind the last stroke.
    fn end(&self) -> Place {
        Place { stroke: self.behind + self.strokes.len() as u64 + 1, at: 0.0 }
    }

    fn moment(&mut self, moment: Moment) {
        let succession = self.path.succession(&moment);
        if let Some(interval) = self.path.push(moment) {
            self.interval(&interval);
        }
        match (self.newest, succession) {
            (Some(_), Succession::Next) => {}
            (Some(before), Succession::After(gap)) => {
                self.lose_sight(Some(&before), &moment, Some(gap.cycles() + 1));
            }
            (Some(before), Succession::Apart) => self.lose_sight(Some(&before), &moment, None),
            // Nothing is lit before the stream's time runs.
            (None, _) if moment.asked.stream != 0 && moment.asked.stream_time > 0.0 => {
                self.lose_sight(None, &moment, None);
            }
            (None, _) => {}
        }
        if moment.asked.stream != 0 {
            // The stream begins only now: nothing of it passed before.
            self.unseen = self.unseen.filter(|unseen| !unseen.idle);
        }
        self.newest = Some(moment);
    }

    fn interval(&mut self, interval: &Interval) {
        if let (Some(unseen), Some(light)) = (self.unseen, first_light(interval)) {
            self.regain_sight(&unseen, interval, light);
        }
        let lit = interval.lit();
        let commanded = interval.commanded().map_or(0, |asked| asked.stroke);
        let whole = lit.is_whole();
        self.follow(commanded, interval.start.tool);
        let mut reached = 0.0;
        for &LitSpan { from, to, stroke } in lit.as_slice() {
            // Light that goes on across the deadline is the same run, unless the stroke changes.
            let goes_on = from == 0.0 && self.run.is_some_and(|run| run.stroke == stroke);
            if !goes_on {
                self.end_run();
            }
            if self.state(stroke).is_some_and(|state| state.blind) {
                continue;
            }
            self.light(interval, stroke, from, to);
            reached = to;
        }
        if reached < 1.0 {
            self.end_run();
        }
        self.follow(commanded, interval.end.tool);
        let stroke = last_light(interval).map_or(0, |light| light.stroke);
        let followed = self.state(stroke).and_then(|state| state.followed.as_mut());
        let at = followed.map(|followed| {
            followed.time = interval.end.stream_time();
            followed.at
        });
        self.frontier.advance(interval, at);
        self.measure_speed(interval, whole);
        self.let_go();
    }

    fn measure_speed(&mut self, interval: &Interval, whole: bool) {
        let stroke = self.run.map(|run| run.stroke).filter(|_| whole);
        if let Some(stroke) = stroke
            && self.is_line(stroke)
        {
            let played = interval.end.stream_time().zip(interval.start.stream_time());
            if let Some(played) = played.map(|(end, start)| end - start).filter(|time| *time > 0.0)
            {
                self.sums.pace.0 += interval.chord();
                self.sums.pace.1 += played;
            }
            if self.whole_before == Some(stroke) && interval.is_wide() {
                widen(&mut self.sums.speed, interval.speed_at_start());
            }
        }
        self.whole_before = stroke;
    }

    /// Marks from part `from` to part `to` of an interval.
    fn light(&mut self, interval: &Interval, stroke: u64, from: f64, to: f64) {
        let time = interval.time() / STEP_TIME;
        let steps = ((to - from) * time).ceil().max(1.0);
        let step = (to - from) / steps;
        for index in 0..=steps as u32 {
            let part = from + step * f64::from(index);
            let tool = interval.tool(part);
            let deviation = interval.deviation(part).map(|deviation| deviation.norm());
            let time = if index == 0 { 0.0 } else { step * interval.time() };
            // Beside a gap the path between the deadlines is not known well enough to be measured.
            let exact = interval.is_surrounded() || part == 0.0 || part == 1.0;
            let cut = interval.is_first();
            self.point(stroke, &Point { tool, deviation, exact, time, cut });
        }
    }

    /// One marked point.
    fn point(&mut self, stroke: u64, point: &Point) {
        let &Point { tool, deviation, exact, time, cut } = point;
        let begins = self.run.is_none();
        let foot = self.locate(stroke, tool, true, begins);
        if let (Some(foot), Some(state)) = (&foot, self.state(stroke)) {
            state.coverage.mark(foot.at);
        }
        // Light for a stroke that the job does not have has no line to be measured against.
        let stray = foot.is_none();
        let error = foot.filter(|_| exact).map(|foot| foot.distance);
        let deviation = deviation.filter(|_| exact);
        let first = Run { stroke, tool, error, deviation, length: 0.0, time: 0.0, cut };
        let run = self.run.get_or_insert(first);
        let step = (tool - run.tool).norm();
        run.length += step;
        run.time += time;
        self.sums.length += step;
        if stray {
            self.sums.stray += step;
        } else {
            self.sums.error.add(run.error, error, time);
            self.sums.tracking.add(run.deviation, deviation, time);
        }
        (run.tool, run.error, run.deviation) = (tool, error, deviation);
    }

    fn end_run(&mut self) {
        let Some(run) = self.run.take() else { return };
        if let Some(state) = self.state(run.stroke) {
            state.coverage.end();
        }
        if run.time > 0.0 && !run.cut && self.is_line(run.stroke) {
            widen(&mut self.sums.run_speed, run.length / run.time);
        }
    }

    /// Keeps track of the tool's place along the stroke in dark cycles; after a gap only once it is
    /// found again.
    fn follow(&mut self, stroke: u64, tool: Vector3<f64>) {
        if self.run.is_none() && self.unseen.is_none() {
            self.locate(stroke, tool, false, false);
        }
    }

    /// Where along `stroke` the tool is, from where it was before; `None` for no such stroke.
    fn locate(&mut self, stroke: u64, tool: Vector3<f64>, lit: bool, begins: bool) -> Option<Foot> {
        let index = self.stroke_index(stroke)?;
        self.load_line(index);
        let (_, line) = self.line.as_ref()?;
        let state = self.strokes.get_mut(index)?;
        let mut foot = match state.followed {
            Some(Followed { at, tool: before, .. }) => {
                let moved = (tool - before).norm();
                let expected = if lit { at + moved } else { at };
                line.foot(&tool, at, expected, 1.5 * moved + REACH)
            }
            None => line.foot(&tool, 0.0, 0.0, FIRST_REACH),
        };
        if begins && foot.distance > LOST_TRACK {
            let nearest = line.nearest(&tool);
            if nearest.distance < foot.distance {
                foot = nearest;
            }
        }
        state.followed = Some(Followed { at: foot.at, tool, time: None });
        Some(foot)
    }

    /// The index of a stroke that is known and not far behind.
    fn stroke_index(&self, stroke: u64) -> Option<usize> {
        let index = usize::try_from(stroke.checked_sub(self.behind + 1)?).ok()?;
        (index < self.strokes.len()).then_some(index)
    }

    /// Lays the line of the stroke with this index.
    fn load_line(&mut self, index: usize) {
        let number = self.behind + index as u64 + 1;
        if self.line.as_ref().is_none_or(|(loaded, _)| *loaded != number)
            && let Some(state) = self.strokes.get(index)
        {
            self.line = Some((number, Line::new(&state.shape)));
        }
    }

    fn state(&mut self, stroke: u64) -> Option<&mut StrokeState<'a>> {
        let index = self.stroke_index(stroke)?;
        self.strokes.get_mut(index)
    }

    /// Whether the stroke has a length; a dot has none.
    fn is_line(&self, stroke: u64) -> bool {
        self.line.as_ref().is_some_and(|(number, line)| *number == stroke && line.length() > 0.0)
    }
}

/// A point that was marked.
#[derive(Debug, Clone, Copy)]
struct Point {
    tool: Vector3<f64>,
    /// How far the tool is from its plan [m]; `None` where the plan is not known.
    deviation: Option<f64>,
    /// Whether `tool` is known well enough to be measured.
    exact: bool,
    /// Time since the point before in the same run [s].
    time: f64,
    /// Whether nothing before it was recorded.
    cut: bool,
}

fn widen(range: &mut Option<(f64, f64)>, value: f64) {
    let (low, high) = range.unwrap_or((value, value));
    *range = Some((low.min(value), high.max(value)));
}

#[cfg(test)]
mod tests;
