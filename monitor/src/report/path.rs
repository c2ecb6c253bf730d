//! The picture of the path: what was to be marked, what was marked, and the way in the dark.

use super::chart::{
    CURVES, Canvas, FINE, Failure, MARGINS, WIDTH, centred, draw, frame, legend, short, span,
    styled,
};
use super::{PictureError, Report};
use crate::trace::track::{Light, Track, TrackPoint};
use messages::artwork::Artwork;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

/// Metres to millimetres, the unit of the picture.
pub(super) const MILLIMETRES: f64 = 1e3;

/// The most points of the plan drawn; more are thinned evenly.
const PLAN_POINTS: usize = 40_000;

/// The most points of the way of the tool drawn.
const TRACK_POINTS: usize = 40_000;

/// A line that stays within this is a dot [mm].
const DOT: f64 = 0.02;

/// Share of the drawing's size that the largest magnified deviation takes.
const MAGNIFIED: f64 = 0.03;

impl Report<'_> {
    /// Planned and truly marked path, equal scales, as an SVG that stands alone.
    ///
    /// # Errors
    /// [`PictureError`] when the numbers cannot be drawn.
    pub fn picture(&self) -> Result<String, PictureError> {
        self.draw_path("path", None)
    }

    /// The same with the deviation from the plan magnified, and how many times.
    ///
    /// # Errors
    /// [`PictureError`] when the numbers cannot be drawn.
    pub fn magnified_picture(&self) -> Result<(String, f64), PictureError> {
        let gain = self.gain();
        Ok((self.draw_path("magnified deviation", Some(gain))?, gain))
    }

    /// Whether there was any light.
    pub(super) fn anything_marked(&self) -> bool {
        self.trace.track.points().iter().any(|point| point.light.is_lit())
    }

    /// A round number by which the largest deviation becomes visible.
    fn gain(&self) -> f64 {
        let largest = self.trace.deviation_lit.range().map_or(0.0, |(_, high)| high);
        let ([low_x, high_x], [low_y, high_y]) = self.extent();
        let size = (high_x - low_x).max(high_y - low_y);
        let wanted = MAGNIFIED * size / largest.max(1e-9);
        let mut gain = 1.0;
        for step in [2.0, 2.5, 2.0].into_iter().cycle().take(15) {
            if gain * step > wanted {
                break;
            }
            gain *= step;
        }
        gain
    }

    /// The rectangle around the plan and the marks [m].
    fn extent(&self) -> ([f64; 2], [f64; 2]) {
        let plan = || self.artwork.strokes.iter().flat_map(|stroke| &stroke.points);
        let marks = || self.trace.track.points().iter().filter(|point| point.light.is_lit());
        let along = |axis: usize| {
            let planned = plan().filter_map(move |point| point.get(axis).copied());
            let marked = marks().filter_map(move |point| point.tool.get(axis).copied());
            let (low, high) = span(planned.chain(marked)).unwrap_or((0.0, 0.01));
            [low, high.max(low + 1e-3)]
        };
        (along(0), along(1))
    }

    fn draw_path(&self, title: &str, gain: Option<f64>) -> Result<String, PictureError> {
        let (x, y) = self.extent();
        let sheet = Sheet::around(x, y);
        let Sheet { x, y, height, .. } = sheet;
        let plan = thinned(self.artwork);
        let track = self.trace.track.thinned(TRACK_POINTS);
        draw(title, height, |area| {
            let mut chart = frame(area).build_cartesian_2d(
                x[0] * MILLIMETRES..x[1] * MILLIMETRES,
                y[0] * MILLIMETRES..y[1] * MILLIMETRES,
            )?;
            sheet.axes(&mut chart, PLACE)?;
            // Magnified, the way in the dark would only be in the way.
            let dark = CURVES[7].mix(0.7).stroke_width(FINE);
            if gain.is_none() {
                for path in paths(&track, |light| light == Light::Dark) {
                    curve(&mut chart, dark, millimetres(&path, 0.0))?;
                }
            }
            let planned = match gain {
                None => CURVES[1].mix(0.5).stroke_width(5 * FINE),
                Some(_) => CURVES[1].stroke_width(FINE),
            };
            for line in plan {
                curve(&mut chart, planned, line)?;
            }
            let marked = CURVES[0].stroke_width(FINE + 1);
            for path in paths(&track, Light::is_lit) {
                curve(&mut chart, marked, millimetres(&path, gain.map_or(0.0, |gain| gain - 1.0)))?;
            }
            if !self.anything_marked() {
                let middle = ((WIDTH * FINE / 2) as i32, (height * FINE / 2) as i32);
                area.draw(&Text::new("nothing was marked", middle, centred()))?;
            }
            let name = gain.map_or("marked".to_owned(), |gain| format!("error × {gain}"));
            let dark = if gain.is_none() { ("in the dark", dark) } else { ("", dark) };
            legend(area, &[(&name, marked), ("planned", planned), dark])
        })
    }
}

/// The names of axes that are places.
pub const PLACE: [&str; 2] = ["x [mm]", "y [mm]"];

/// A piece of the plane as a picture shows it: equal scales, air around what matters.
#[derive(Debug, Clone, Copy)]
pub struct Sheet {
    /// From and to, in one unit with y.
    pub x: [f64; 2],
    /// From and to.
    pub y: [f64; 2],
    /// Height of the picture, in page units.
    pub height: u32,
    /// Height without the margins, in page units.
    inner: f64,
}

impl Sheet {
    /// Around these ranges.
    pub fn around(x: [f64; 2], y: [f64; 2]) -> Self {
        let size = (x[1] - x[0]).max(y[1] - y[0]);
        let air = 0.08 * size;
        let (x, y) = ([x[0] - air, x[1] + air], [y[0] - air, y[1] + air]);
        // Equal scales: what the margins leave.
        let [left, right, above, below] = MARGINS.map(f64::from);
        let (inner_width, margin_up) = (f64::from(WIDTH) - left - right, above + below);
        let scale = inner_width / (x[1] - x[0]);
        let inner = (scale * (y[1] - y[0])).clamp(120.0, 720.0);
        let (x, y) = widened(x, y, inner_width / inner);
        Self { x, y, height: (inner + margin_up).round() as u32, inner }
    }

    /// Draws grid, numbers and names of the axes, each with its unit.
    ///
    /// # Errors
    /// Whatever the drawing library reports.
    pub fn axes<'b>(
        &self,
        chart: &mut ChartContext<'b, Canvas<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>,
        [across, up]: [&str; 2],
    ) -> Result<(), Failure<'b>> {
        styled(
            chart
                .configure_mesh()
                .x_desc(across)
                .y_desc(up)
                .x_labels(11)
                .y_labels(((self.inner / 60.0) as usize).max(3))
                .x_label_formatter(&|value| short(value))
                .y_label_formatter(&|value| short(value)),
        )
        .draw()?;
        Ok(())
    }
}

/// The strokes of a plan [mm], thinned evenly where they have too many points.
pub(super) fn thinned(artwork: &Artwork) -> Vec<Vec<(f64, f64)>> {
    let count: usize = artwork.strokes.iter().map(|stroke| stroke.points.len()).sum();
    let every = count.div_ceil(PLAN_POINTS).max(1);
    let thinned = |points: &[[f64; 3]]| {
        let last = points.len().saturating_sub(1);
        (points.iter().enumerate())
            .filter(|(index, _)| index % every == 0 || *index == last)
            .map(|(_, [x, y, _])| (x * MILLIMETRES, y * MILLIMETRES))
            .collect()
    };
    artwork.strokes.iter().map(|stroke| thinned(&stroke.points)).collect()
}

/// Draws one line; a line that stands still becomes a dot.
pub(super) fn curve<'b>(
    chart: &mut ChartContext<'b, Canvas<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>,
    style: ShapeStyle,
    line: Vec<(f64, f64)>,
) -> Result<(), Failure<'b>> {
    let far = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).abs().max((a.1 - b.1).abs());
    if let Some(&first) = line.first()
        && line.iter().all(|point| far(*point, first) < DOT)
    {
        let size = style.stroke_width.max(2 * FINE);
        chart.draw_series([Circle::new(first, size, style.filled())])?;
        return Ok(());
    }
    chart.draw_series(LineSeries::new(line, style))?;
    Ok(())
}

/// The stretches of a track with light of one kind, each up to the point at which it ends.
fn paths(track: &Track, kind: impl Fn(Light) -> bool) -> Vec<Vec<TrackPoint>> {
    let mut paths: Vec<Vec<TrackPoint>> = Vec::new();
    let mut open = false;
    for point in track.points() {
        let goes_on = kind(point.light);
        match paths.last_mut() {
            Some(path) if open => path.push(*point),
            _ if goes_on => paths.push(vec![*point]),
            _ => {}
        }
        open = goes_on;
    }
    paths
}

/// A path [mm], moved by its deviation times `extra`.
fn millimetres(path: &[TrackPoint], extra: f64) -> Vec<(f64, f64)> {
    path.iter()
        .map(|TrackPoint { tool: [x, y, _], deviation: [along_x, along_y, _], .. }| {
            (
                (x + extra * f64::from(*along_x)) * MILLIMETRES,
                (y + extra * f64::from(*along_y)) * MILLIMETRES,
            )
        })
        .collect()
}

/// The ranges grown about their middles to the ratio of width to height.
fn widened(x: [f64; 2], y: [f64; 2], ratio: f64) -> ([f64; 2], [f64; 2]) {
    let (width, height) = (x[1] - x[0], y[1] - y[0]);
    let grown = |range: [f64; 2], by: f64| [range[0] - 0.5 * by, range[1] + 0.5 * by];
    if width < height * ratio {
        (grown(x, height * ratio - width), y)
    } else {
        (x, grown(y, width / ratio - height))
    }
}
