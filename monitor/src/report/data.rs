//! What the page's script draws: curves, the way of the tool, what was to be marked, and what happened.
//!
//! All of it goes into the page as columns, in as many buckets as its budget allows. A header in JSON says what
//! they mean.

use super::column::{Column, Layout};
use super::{PictureError, Report};
use crate::trace::Trace;
use crate::trace::envelope::Envelope;
use crate::trace::event::{Event, EventKind};
use crate::trace::track::{Light, Track, TrackPoint};
use messages::artwork::distance;
use messages::hop::Hop;
use serde::Serialize;
use std::fmt::Write;
use std::io;

/// Step of places in the page [m]: far below what a laser spot shows.
const PLACE_STEP: f64 = 1e-7;
/// Step of deviations in the page [m].
const DEVIATION_STEP: f64 = 1e-8;
/// Step of times in the page [s].
const TIME_STEP: f64 = 1e-6;
/// Steps of a curve between its lowest and its highest value.
const CURVE_STEPS: f64 = 65_534.0;
/// Steps of the power from 0 to full scale.
const POWER_STEPS: f32 = 250.0;
/// How far what was to be marked may be from its picture [m].
const PLAN_TOLERANCE: f64 = 2e-7;
/// The most points of what was to be marked.
const PLAN_POINTS: usize = 200_000;
/// What the header and the tags around columns take at most [bytes].
const HEADER: usize = 100_000;
/// Curves are not drawn in fewer buckets than this, whatever the budget.
const FEWEST_BUCKETS: usize = 1 << 12;

/// What the columns mean; see `bytes.js`.
#[derive(Debug, Serialize)]
struct Header<'a> {
    /// Period of the cycle [s].
    period: f64,
    /// Cycles per bucket of a curve.
    stride: u64,
    /// Time from the first record to the last [s].
    time: f64,
    job: &'a str,
    strokes: u64,
    curves: Vec<CurveHeader<'a>>,
    track: TrackHeader,
    plan: PlanHeader,
    events: Vec<EventHeader>,
}

/// A curve; its columns are the lowest values, and, of buckets of several cycles, how far above them the highest
/// ones are. 0 is no value, 1 is `low`, and each more is a `step` more.
#[derive(Debug, Serialize)]
struct CurveHeader<'a> {
    /// The chart it belongs to.
    chart: &'static str,
    name: &'a str,
    /// In the unit of the chart.
    low: f64,
    step: f64,
    columns: Vec<usize>,
    layouts: Vec<Layout>,
}

/// The columns of the tool's way: time, x, y, z, deviation along each, light (0 unknown, 1 dark, from 2 on power),
/// stroke.
#[derive(Debug, Serialize)]
struct TrackHeader {
    time_step: f64,
    place_step: f64,
    deviation_step: f64,
    power_step: f64,
    /// How far the tool can have been beside it [m].
    tolerance: f64,
    columns: Vec<usize>,
    layouts: Vec<Layout>,
}

/// The columns of what was to be marked: x, y, z, stroke from 1; and the line of each stroke in the job file.
#[derive(Debug, Serialize)]
struct PlanHeader {
    place_step: f64,
    columns: Vec<usize>,
    layouts: Vec<Layout>,
}

#[derive(Debug, Serialize)]
struct EventHeader {
    time: f64,
    text: String,
}

/// Columns on their way into the page.
#[derive(Default)]
struct Columns {
    texts: Vec<String>,
}

impl Columns {
    fn add(&mut self, values: impl Iterator<Item = i64>) -> io::Result<(usize, Layout)> {
        let Column { layout, text } = Column::of(values)?;
        self.texts.push(text);
        Ok((self.texts.len() - 1, layout))
    }

    fn size(&self) -> usize {
        self.texts.iter().map(String::len).sum()
    }
}

/// A curve of the trace with its name and what one of its unit is in that of its chart.
struct Drawn<'a> {
    chart: &'static str,
    name: &'a str,
    scale: f64,
    envelope: &'a Envelope,
}

impl Report<'_> {
    /// The data of the page as elements of HTML, in about `budget` bytes.
    ///
    /// # Errors
    /// [`PictureError`] when they cannot be written.
    pub(super) fn data(&self, budget: usize) -> Result<String, PictureError> {
        self.elements(budget.saturating_sub(HEADER)).map_err(|error| PictureError {
            title: "interactive report".to_owned(),
            reason: error.to_string(),
        })
    }

    fn elements(&self, budget: usize) -> io::Result<String> {
        let mut columns = Columns::default();
        let track = track(&self.trace.track, &mut columns)?;
        let plan = self.plan(&mut columns)?;
        let left = budget.saturating_sub(columns.size());
        let (stride, curves) = self.curves(left, &mut columns)?;
        let trace = self.trace;
        let header = Header {
            period: trace.period.seconds(),
            stride,
            time: trace.time(),
            job: &self.summary.job.name,
            strokes: self.artwork.strokes.len() as u64,
            curves,
            track,
            plan,
            events: events(trace),
        };
        // No text of a job can end the element.
        let header = serde_json::to_string(&header)?.replace('<', "\\u003c");
        let mut html = String::with_capacity(columns.size() + header.len() + HEADER);
        // Writing to a string cannot fail.
        let _ = writeln!(html, "<script type=\"application/json\" id=\"run\">{header}</script>");
        for (index, text) in columns.texts.iter().enumerate() {
            let _ =
                writeln!(html, "<script type=\"text/plain\" id=\"column-{index}\">{text}</script>");
        }
        Ok(html)
    }

    /// All curves that have a value.
    fn drawn(&self) -> Vec<Drawn<'_>> {
        let trace = self.trace;
        let mut drawn = vec![
            Drawn { chart: "deviation", name: "lit", scale: 1e6, envelope: &trace.deviation_lit },
            Drawn { chart: "deviation", name: "dark", scale: 1e6, envelope: &trace.deviation_dark },
            Drawn { chart: "speed", name: "tool", scale: 1.0, envelope: &trace.speed },
            Drawn { chart: "power", name: "laser", scale: 100.0, envelope: &trace.power },
        ];
        let constant = |index: usize| self.torque_constants.get(index).copied().unwrap_or(0.0);
        let actuators = || self.summary.machine.actuators.iter().enumerate();
        for (index, name) in actuators() {
            let Some(envelope) = trace.following_error.get(index) else { continue };
            drawn.push(Drawn { chart: "following", name, scale: 1e3, envelope });
        }
        for (index, name) in actuators() {
            let Some(envelope) = trace.current.get(index) else { continue };
            // A stepper's current says nothing of its torque.
            let (chart, scale) = match constant(index) {
                0.0 => ("current", 1.0),
                constant => ("torque", 1e3 * constant),
            };
            drawn.push(Drawn { chart, name, scale, envelope });
        }
        for (index, name) in actuators() {
            let Some(envelope) = trace.voltage.get(index) else { continue };
            drawn.push(Drawn { chart: "voltage", name, scale: 1.0, envelope });
        }
        for (hop, envelope) in Hop::ALL.into_iter().zip(&trace.latency) {
            drawn.push(Drawn { chart: "latency", name: hop.name(), scale: 1e6, envelope });
        }
        drawn.retain(|curve| curve.envelope.range().is_some());
        drawn
    }

    /// Adds the curves in as many buckets as `budget` allows, and says how many cycles are in one.
    fn curves(
        &self,
        budget: usize,
        columns: &mut Columns,
    ) -> io::Result<(u64, Vec<CurveHeader<'_>>)> {
        let drawn = self.drawn();
        let strides = drawn.iter().map(|curve| curve.envelope.stride());
        let mut stride = strides.max().unwrap_or(1);
        loop {
            let mut tried = Columns::default();
            let before = columns.texts.len();
            let mut headers = Vec::new();
            for curve in &drawn {
                headers.push(curve.add(stride, before, &mut tried)?);
            }
            let buckets = drawn.iter().map(|curve| curve.envelope.buckets().len()).max();
            if tried.size() <= budget || buckets.unwrap_or(0) <= FEWEST_BUCKETS {
                columns.texts.append(&mut tried.texts);
                return Ok((stride, headers));
            }
            stride *= tried.size().div_ceil(budget.max(1)).next_power_of_two().clamp(2, 64) as u64;
        }
    }

    /// Adds what was to be marked.
    fn plan(&self, columns: &mut Columns) -> io::Result<PlanHeader> {
        let strokes = &self.artwork.strokes;
        let mut track = Track::default();
        let mut way = 0.0;
        for (stroke, shape) in (1..).zip(strokes) {
            let mut before: Option<&[f64; 3]> = None;
            let last = shape.points.len().saturating_sub(1);
            for (index, point) in shape.points.iter().enumerate() {
                way += before.map_or(1.0, |before| distance(before, point));
                before = Some(point);
                // A stroke of one point is a dot.
                let light = if index == last && last > 0 {
                    Light::Unknown
                } else {
                    Light::Lit { stroke, power: 1.0 }
                };
                track.add(TrackPoint { time: way, tool: *point, deviation: [0.0; 3], light });
            }
        }
        let track = track.thinned_within(PLAN_TOLERANCE, PLAN_POINTS);
        let points = track.points();
        let mut added = Vec::new();
        for axis in 0..3 {
            added
                .push(columns.add(points.iter().map(|point| steps(point.tool[axis], PLACE_STEP)))?);
        }
        // What ends a stroke is of no stroke.
        added.push(columns.add(points.iter().map(|point| match point.light {
            Light::Lit { stroke, .. } => i64::from(stroke),
            Light::Dark | Light::Unknown => 0,
        }))?);
        added.push(columns.add(strokes.iter().map(|stroke| stroke.line as i64))?);
        let (columns, layouts) = added.into_iter().unzip();
        Ok(PlanHeader { place_step: PLACE_STEP, columns, layouts })
    }
}

impl<'a> Drawn<'a> {
    /// Adds the curve in buckets of `stride` cycles, to columns that come after so many others.
    fn add(
        &self,
        stride: u64,
        before: usize,
        columns: &mut Columns,
    ) -> io::Result<CurveHeader<'a>> {
        let curve = self.envelope.at_stride(stride);
        let (low, high) = curve.range().unwrap_or((0.0, 0.0));
        let step = ((high - low) / CURVE_STEPS).max(f64::MIN_POSITIVE);
        let place = |value: f64| 1 + steps(value - low, step);
        let ranges = || curve.buckets().iter().map(|bucket| bucket.range());
        let lowest = ranges().map(|range| range.map_or(0, |(low, _)| place(low)));
        let mut added = vec![columns.add(lowest)?];
        if stride > 1 {
            let above = |(low, high)| place(high) - place(low);
            added.push(columns.add(ranges().map(|range| range.map_or(0, above)))?);
        }
        let (columns, layouts): (Vec<usize>, _) = added.into_iter().unzip();
        Ok(CurveHeader {
            chart: self.chart,
            name: self.name,
            low: low * self.scale,
            step: step * self.scale,
            columns: columns.into_iter().map(|column| column + before).collect(),
            layouts,
        })
    }
}

/// Adds the tool's way.
fn track(track: &Track, columns: &mut Columns) -> io::Result<TrackHeader> {
    let points = track.points();
    let mut added = vec![columns.add(points.iter().map(|point| steps(point.time, TIME_STEP)))?];
    for axis in 0..3 {
        added.push(columns.add(points.iter().map(|point| steps(point.tool[axis], PLACE_STEP)))?);
    }
    for axis in 0..3 {
        let deviation = |point: &TrackPoint| f64::from(point.deviation[axis]);
        added
            .push(columns.add(points.iter().map(|point| steps(deviation(point), DEVIATION_STEP)))?);
    }
    added.push(columns.add(points.iter().map(|point| match point.light {
        Light::Unknown => 0,
        Light::Dark => 1,
        Light::Lit { power, .. } => 2 + (power.clamp(0.0, 1.0) * POWER_STEPS).round() as i64,
    }))?);
    // In the dark the stroke before stands: it costs nothing then.
    let mut newest = 0;
    added.push(columns.add(points.iter().map(|point| {
        if let Light::Lit { stroke, .. } = point.light {
            newest = i64::from(stroke);
        }
        newest
    }))?);
    let (columns, layouts) = added.into_iter().unzip();
    Ok(TrackHeader {
        time_step: TIME_STEP,
        place_step: PLACE_STEP,
        deviation_step: DEVIATION_STEP,
        power_step: 1.0 / f64::from(POWER_STEPS),
        tolerance: track.tolerance(),
        columns,
        layouts,
    })
}

fn events(trace: &Trace) -> Vec<EventHeader> {
    let time = |cycle: u64| trace.period.of(cycle).seconds();
    let told = |event: &Event| {
        let name = event.kind.name();
        let text = match event.kind {
            EventKind::State(_) => name.to_owned(),
            EventKind::Fault(_) => format!("fault: {name}"),
        };
        EventHeader { time: time(event.cycle), text }
    };
    trace.events.list().iter().map(told).collect()
}

fn steps(value: f64, step: f64) -> i64 {
    (value / step).round() as i64
}
