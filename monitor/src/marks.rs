//! The judgement of the marks: what the laser truly marked against what the job asked for.
//!
//! Matched stroke by stroke along the arc length, so that strokes which touch or cross in space do
//! not hide each other. All light names its stroke, and the tool's place along that stroke is
//! followed from sample to sample; in dark cycles, along the stroke that the command in force
//! names, so that light which comes late is found where it falls. A hold that backs up and resumes
//! adds a run of light to its stroke: a gap between the runs is missing, an overlap is double.
//!
//! The [`Judge`] takes records as they come; it remembers runs of light, not samples.

pub mod coverage;
pub mod line;
pub mod tool_path;

use crate::recording::CycleRecord;
use coverage::Coverage;
use line::{Foot, Line};
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use signals::artwork::Artwork;
use signals::time::CYCLE_TIME;
use tool_path::{Interval, LitSpan, Moment, ToolPath};

/// How the tool's true position was known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The simulated plant's own tool position, or a sensor at the tool.
    Plant,
}

/// What was marked, compared with the job's geometry. Lengths in m, speeds in m/s.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Marks {
    /// Length of the tool's true path with the laser on [m].
    pub length: f64,
    /// Length of the job that was never marked [m].
    pub missing: f64,
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
    /// The worst single stroke end that was not marked [m]; a lost stroke counts whole.
    pub missing_end_max: f64,
    /// The longest mark beyond a single stroke end [m].
    pub double_end_max: f64,
    /// Smallest speed of the tool in cycles wholly lit, dots left out [m/s].
    pub speed_min: f64,
    /// Largest speed of the tool in cycles wholly lit, dots left out [m/s].
    pub speed_max: f64,
    /// How the tool's position was known.
    pub source: Source,
    /// Strokes, dots included, that got no light at all.
    pub strokes_lost: u64,
    /// Length marked while no stroke was asked for [m]; counted in `length` and `double`.
    pub stray: f64,
}

/// Why there is no judgement: it would be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Unjudged {
    /// Samples were lost on the way to the monitor.
    #[error("the marks are not judged: {count} samples were lost on the way to the monitor")]
    SamplesLost {
        /// How many, at least.
        count: u64,
    },
    /// The laser was on while nobody knew where the tool was.
    #[error("the marks are not judged: the tool position was unknown in lit cycle {cycle}")]
    ToolUnknown {
        /// The first such cycle.
        cycle: u64,
    },
}

/// Judges marks record by record.
#[derive(Debug)]
pub struct Judge<'a> {
    artwork: &'a Artwork,
    path: ToolPath,
    newest: Option<Moment>,
    strokes: Vec<StrokeState>,
    line: Option<(u64, Line)>,
    run: Option<Run>,
    whole_before: Option<u64>,
    sums: Sums,
    lost: u64,
    unknown: Option<u64>,
}

/// How far a stroke has come.
#[derive(Debug, Clone, Default)]
struct StrokeState {
    coverage: Coverage,
    followed: Option<Followed>,
}

/// Where along its stroke the tool was seen last.
#[derive(Debug, Clone, Copy)]
struct Followed {
    at: f64,
    tool: Vector3<f64>,
}

/// One run of light on one stroke, from edge to edge.
#[derive(Debug, Clone, Copy)]
struct Run {
    stroke: u64,
    tool: Vector3<f64>,
    error: f64,
    deviation: Option<f64>,
    length: f64,
    time: f64,
}

#[derive(Debug, Default)]
struct Sums {
    length: f64,
    stray: f64,
    error: MeanSquare,
    tracking: MeanSquare,
    speed: Option<(f64, f64)>,
    run_speed: Option<(f64, f64)>,
}

/// The largest of a quantity, and its mean square over time by the trapezoidal rule.
#[derive(Debug, Default)]
struct MeanSquare {
    largest: f64,
    sum: f64,
    time: f64,
}

impl MeanSquare {
    fn add(&mut self, from: f64, to: f64, time: f64) {
        self.largest = self.largest.max(from).max(to);
        self.sum += 0.5 * (from * from + to * to) * time;
        self.time += time;
    }

    fn root(&self) -> f64 {
        if self.time > 0.0 { (self.sum / self.time).sqrt() } else { 0.0 }
    }
}

/// Sub-steps of a lit cycle: at 0.25 m/s a point each 0.125 mm.
const STEPS: f64 = 2.0;

/// How far from its expected place on a stroke the tool is looked for at first [m].
const FIRST_REACH: f64 = 1e-3;

/// How much farther than the tool moved its foot may have moved along the stroke [m].
const REACH: f64 = 1e-4;

/// A run of light that begins farther from its stroke than this is looked for all along it [m].
const LOST_TRACK: f64 = 2e-4;

impl<'a> Judge<'a> {
    /// A judge of the marks of `artwork`, before the first record.
    pub fn new(artwork: &'a Artwork) -> Self {
        Self {
            artwork,
            path: ToolPath::default(),
            newest: None,
            strokes: vec![StrokeState::default(); artwork.strokes.len()],
            line: None,
            run: None,
            whole_before: None,
            sums: Sums::default(),
            lost: 0,
            unknown: None,
        }
    }

    /// Takes the next record, with the tool where drives reported it.
    pub fn push(&mut self, record: &CycleRecord) {
        self.moment(Moment::of(record));
    }

    /// The judgement.
    ///
    /// # Errors
    /// [`Unjudged`] where records were missing in between, or where the tool was not known while
    /// lit.
    pub fn finish(mut self) -> Result<Marks, Unjudged> {
        if let Some(interval) = self.path.finish() {
            self.interval(&interval);
        }
        self.end_run();
        if self.lost > 0 {
            return Err(Unjudged::SamplesLost { count: self.lost });
        }
        if let Some(cycle) = self.unknown {
            return Err(Unjudged::ToolUnknown { cycle });
        }
        let (speed_min, speed_max) = self.sums.speed.or(self.sums.run_speed).unwrap_or((0.0, 0.0));
        let mut marks = Marks {
            length: self.sums.length,
            missing: 0.0,
            double: self.sums.stray,
            error_max: self.sums.error.largest,
            error_rms: self.sums.error.root(),
            tracking_max: self.sums.tracking.largest,
            tracking_rms: self.sums.tracking.root(),
            missing_end_max: 0.0,
            double_end_max: 0.0,
            speed_min,
            speed_max,
            source: Source::Plant,
            strokes_lost: 0,
            stray: self.sums.stray,
        };
        for (stroke, state) in self.artwork.strokes.iter().zip(&self.strokes) {
            let extent = state.coverage.extent(stroke.length());
            if state.coverage.is_empty() {
                marks.strokes_lost += 1;
            }
            marks.missing += extent.missing;
            // A dot has no length to mark twice; straying from it is its error.
            if stroke.length() > 0.0 {
                marks.double += extent.double;
                for end in extent.double_ends {
                    marks.double_end_max = marks.double_end_max.max(end);
                }
            }
            for end in extent.missing_ends {
                marks.missing_end_max = marks.missing_end_max.max(end);
            }
        }
        Ok(marks)
    }

    fn moment(&mut self, moment: Moment) {
        if let Some(newest) = self.newest {
            if !moment.follows(&newest) {
                let due = newest.cycle.saturating_add(moment.elapsed);
                self.lost += moment.cycle.checked_sub(due).unwrap_or(1);
            } else if newest.planned.is_none() && moment.in_force == Some(newest.cycle) {
                // Drives had an answer to the cycle before that is not in the records.
                self.lost += 1;
            }
        }
        self.newest = Some(moment);
        if let Some(interval) = self.path.push(moment) {
            self.interval(&interval);
        }
    }

    fn interval(&mut self, interval: &Interval) {
        let lit = interval.lit();
        let commanded = interval.commanded_stroke();
        let whole = lit.is_whole();
        self.follow(commanded, interval.start.tool);
        if !lit.as_slice().is_empty() && !interval.tool_known() {
            self.unknown = self.unknown.or(Some(interval.end.cycle));
        }
        let mut reached = 0.0;
        for &LitSpan { from, to, stroke } in lit.as_slice() {
            // Light that goes on across the deadline is the same run, unless the stroke changes.
            let goes_on = from == 0.0 && self.run.is_some_and(|run| run.stroke == stroke);
            if !goes_on {
                self.end_run();
            }
            self.light(interval, stroke, from, to);
            reached = to;
        }
        if reached < 1.0 {
            self.end_run();
        }
        self.follow(commanded, interval.end.tool);
        self.measure_speed(interval, whole);
    }

    fn measure_speed(&mut self, interval: &Interval, whole: bool) {
        let stroke = self.run.map(|run| run.stroke).filter(|_| whole);
        if let Some(stroke) = stroke
            && self.whole_before == Some(stroke)
            && self.is_line(stroke)
        {
            widen(&mut self.sums.speed, interval.speed_at_start());
        }
        self.whole_before = stroke;
    }

    /// Marks from part `from` to part `to` of an interval.
    fn light(&mut self, interval: &Interval, stroke: u64, from: f64, to: f64) {
        let cycles = interval.time() / CYCLE_TIME;
        let steps = ((to - from) * cycles * STEPS).ceil().max(1.0);
        let step = (to - from) / steps;
        for index in 0..=steps as u32 {
            let part = from + step * f64::from(index);
            let tool = interval.tool(part);
            let deviation = interval.deviation(part).map(|deviation| deviation.norm());
            let time = if index == 0 { 0.0 } else { step * interval.time() };
            self.point(stroke, tool, deviation, time);
        }
    }

    /// One marked point, `time` [s] after the one before in the same run.
    fn point(&mut self, stroke: u64, tool: Vector3<f64>, deviation: Option<f64>, time: f64) {
        let begins = self.run.is_none();
        let foot = self.locate(stroke, tool, true, begins);
        if let (Some(foot), Some(state)) = (&foot, self.state(stroke)) {
            state.coverage.mark(foot.at);
        }
        // Light for a stroke that the job does not have has no line to be measured against.
        let stray = foot.is_none();
        let error = foot.map_or(0.0, |foot| foot.distance);
        let run =
            self.run.get_or_insert(Run { stroke, tool, error, deviation, length: 0.0, time: 0.0 });
        let step = (tool - run.tool).norm();
        run.length += step;
        run.time += time;
        self.sums.length += step;
        if stray {
            self.sums.stray += step;
        } else {
            self.sums.error.add(run.error, error, time);
            if let Some(to) = deviation {
                self.sums.tracking.add(run.deviation.unwrap_or(to), to, time);
            }
        }
        (run.tool, run.error, run.deviation) = (tool, error, deviation);
    }

    fn end_run(&mut self) {
        let Some(run) = self.run.take() else { return };
        if let Some(state) = self.state(run.stroke) {
            state.coverage.end();
        }
        if run.time > 0.0 && self.is_line(run.stroke) {
            widen(&mut self.sums.run_speed, run.length / run.time);
        }
    }

    /// Keeps track of the tool's place along the stroke in dark cycles.
    fn follow(&mut self, stroke: u64, tool: Vector3<f64>) {
        if self.run.is_none() {
            self.locate(stroke, tool, false, false);
        }
    }

    /// Where along `stroke` the tool is, from where it was before; `None` for no such stroke.
    fn locate(&mut self, stroke: u64, tool: Vector3<f64>, lit: bool, begins: bool) -> Option<Foot> {
        let index = usize::try_from(stroke).ok()?.checked_sub(1)?;
        let shape = self.artwork.strokes.get(index)?;
        if self.line.as_ref().is_none_or(|(number, _)| *number != stroke) {
            self.line = Some((stroke, Line::new(shape)));
        }
        let (_, line) = self.line.as_ref()?;
        let state = self.strokes.get_mut(index)?;
        let mut foot = match state.followed {
            Some(Followed { at, tool: before }) => {
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
        state.followed = Some(Followed { at: foot.at, tool });
        Some(foot)
    }

    fn state(&mut self, stroke: u64) -> Option<&mut StrokeState> {
        self.strokes.get_mut(usize::try_from(stroke).ok()?.checked_sub(1)?)
    }

    /// Whether the stroke has a length; a dot has none.
    fn is_line(&self, stroke: u64) -> bool {
        self.line.as_ref().is_some_and(|(number, line)| *number == stroke && line.length() > 0.0)
    }
}

fn widen(range: &mut Option<(f64, f64)>, value: f64) {
    let (low, high) = range.unwrap_or((value, value));
    *range = Some((low.min(value), high.max(value)));
}

#[cfg(test)]
mod tests;
