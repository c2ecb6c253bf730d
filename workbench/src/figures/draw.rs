//! Pictures of the plane: curves at equal scales, and maps of the area in colours.

use monitor::report::PictureError;
use monitor::report::chart::{
    Canvas, Curve, FINE, Failure, INK, MARGINS, WIDTH, draw, frame, legend, short, span, text_style,
};
use monitor::report::path::{PLACE, Sheet};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Metres to millimetres, the unit of pictures.
pub(super) const MILLIMETRES: f64 = 1e3;

/// Radians a second to turns a minute.
pub(super) const RPM: f64 = 30.0 / core::f64::consts::PI;

/// The most points of a line; more are thinned.
const MOST_POINTS: usize = 1200;

type Plane<'b> = ChartContext<'b, Canvas<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Curves at equal scales; `axes` are the names of the axes, in one unit.
pub(super) fn plane(
    title: &str,
    axes: [&str; 2],
    curves: &[Curve],
) -> Result<String, PictureError> {
    let points = || curves.iter().flat_map(|curve| curve.lines.iter().flatten());
    let along = |values: Option<(f64, f64)>| values.map_or([0.0, 1.0], |(low, high)| [low, high]);
    let x = along(span(points().map(|point| point.0)));
    let y = along(span(points().map(|point| point.1)));
    let sheet = Sheet::around(x, y);
    draw(title, sheet.height, |area| {
        let mut chart =
            frame(area).build_cartesian_2d(sheet.x[0]..sheet.x[1], sheet.y[0]..sheet.y[1])?;
        sheet.axes(&mut chart, axes)?;
        for curve in curves {
            for line in &curve.lines {
                if let [dot] = line.as_slice() {
                    let style = curve.colour.filled();
                    chart.draw_series([Circle::new(*dot, 3 * FINE, style)])?;
                } else {
                    let style = curve.colour.stroke_width(FINE + 1);
                    chart.draw_series(LineSeries::new(line.iter().copied(), style))?;
                }
            }
        }
        let entries: Vec<_> = (curves.iter())
            .map(|curve| (curve.name.as_str(), curve.colour.stroke_width(2 * FINE)))
            .collect();
        legend(area, &entries)
    })
}

/// A quantity over the area.
#[derive(Debug, Clone)]
pub(super) struct Map<'a> {
    /// Name, for errors.
    pub(super) title: &'a str,
    /// The area from and to, along x and y [m].
    pub(super) area: [[f64; 2]; 2],
    /// Places along x, and along y.
    pub(super) size: [usize; 2],
    /// Row by row from the lowest y, along x; `None` where there is none.
    pub(super) values: &'a [Option<f64>],
    /// Short name and unit of the quantity.
    pub(super) quantity: &'a str,
    /// Further lines over the map, in millimetres.
    pub(super) curves: &'a [Curve],
}

/// How far a place of a map reaches over the next one, of its own width.
const OVERLAP: f64 = 0.04;

/// Steps of the scale beside a map.
const SCALE_STEPS: usize = 60;

impl Map<'_> {
    /// The picture, with its scale beside it.
    pub(super) fn picture(&self) -> Result<String, PictureError> {
        let sheet = Sheet::around(
            self.area[0].map(|at| at * MILLIMETRES),
            self.area[1].map(|at| at * MILLIMETRES),
        );
        let range = span(self.values.iter().flatten().copied()).unwrap_or((0.0, 0.0));
        draw(self.title, sheet.height, |area| {
            let mut chart =
                frame(area).build_cartesian_2d(sheet.x[0]..sheet.x[1], sheet.y[0]..sheet.y[1])?;
            self.fill(&mut chart, range)?;
            sheet.axes(&mut chart, PLACE)?;
            for curve in self.curves {
                for line in &curve.lines {
                    let style = curve.colour.stroke_width(FINE + 1);
                    chart.draw_series(LineSeries::new(line.iter().copied(), style))?;
                }
            }
            scale(area, range, self.quantity)
        })
    }

    /// Each place a little wider than the grid, so that no seam shows; cut off at the area's edge.
    fn fill<'b>(&self, chart: &mut Plane<'b>, range: (f64, f64)) -> Result<(), Failure<'b>> {
        let edge = |axis: usize, index: usize| {
            let [from, to] = self.area[axis];
            let share = (index as f64 - 0.5) / (self.size[axis].max(2) - 1) as f64;
            (from + (to - from) * share.clamp(0.0, 1.0)) * MILLIMETRES
        };
        let seamless = |axis: usize, index: usize| {
            let [next, edge] = [edge(axis, index), self.area[axis][1] * MILLIMETRES];
            (next + OVERLAP * (next - self.area[axis][0] * MILLIMETRES) / index as f64).min(edge)
        };
        for (index, value) in self.values.iter().enumerate() {
            let Some(value) = value else { continue };
            let (column, row) = (index % self.size[0], index / self.size[0]);
            let from = (edge(0, column), edge(1, row));
            let to = (seamless(0, column + 1), seamless(1, row + 1));
            let style = shade(share(*value, range)).filled();
            chart.draw_series([Rectangle::new([from, to], style)])?;
        }
        Ok(())
    }
}

/// Where `value` lies in `range`, 0 to 1; in the middle where all are alike.
fn share(value: f64, (low, high): (f64, f64)) -> f64 {
    if is_even((low, high)) { 0.5 } else { ((value - low) / (high - low)).clamp(0.0, 1.0) }
}

/// Whether a range is no wider than rounding.
fn is_even((low, high): (f64, f64)) -> bool {
    high - low <= 1e-9 * high.abs().max(low.abs())
}

/// The colour of a share of the scale: dark blue to yellow, told apart by every kind of colour vision and
/// in print.
fn shade(share: f64) -> RGBColor {
    const ANCHORS: [[f64; 3]; 5] = [
        [68.0, 1.0, 84.0],
        [59.0, 82.0, 139.0],
        [33.0, 145.0, 140.0],
        [94.0, 201.0, 98.0],
        [253.0, 231.0, 37.0],
    ];
    let at = share.clamp(0.0, 1.0) * (ANCHORS.len() - 1) as f64;
    let below = (at as usize).min(ANCHORS.len() - 2);
    let part = at - below as f64;
    let channel = |index: usize| {
        (ANCHORS[below][index] * (1.0 - part) + ANCHORS[below + 1][index] * part).round() as u8
    };
    RGBColor(channel(0), channel(1), channel(2))
}

/// The scale of a map in its right margin.
fn scale<'b>(
    area: &DrawingArea<Canvas<'b>, Shift>,
    range: (f64, f64),
    quantity: &str,
) -> Result<(), Failure<'b>> {
    let fine = FINE as i32;
    let left = (WIDTH - MARGINS[1] + 14) as i32 * fine;
    let (top, height) = (46 * fine, 200 * fine);
    let label = |text: String, at: (i32, i32)| {
        Text::new(text, at, text_style().pos(Pos::new(HPos::Left, VPos::Center)))
    };
    for (line, part) in quantity.splitn(2, " [").enumerate() {
        let part = if line == 0 { part.to_owned() } else { format!("[{part}") };
        area.draw(&label(part, (left, (10 + 16 * line as i32) * fine)))?;
    }
    let count = if is_even(range) { 1 } else { SCALE_STEPS };
    for step in 0..count {
        let along = |index: usize| top + height - (height * index as i32) / count as i32;
        let part = if count == 1 { 0.5 } else { step as f64 / (count - 1) as f64 };
        // Each up to the top, the next ones over it: no seam shows.
        let corners = [(left, top), (left + 16 * fine, along(step))];
        area.draw(&Rectangle::new(corners, shade(part).filled()))?;
    }
    let ticks: &[f64] = if is_even(range) { &[0.5] } else { &[0.0, 0.25, 0.5, 0.75, 1.0] };
    for part in ticks {
        let value = range.0 + part * (range.1 - range.0);
        let y = top + (f64::from(height) * (1.0 - part)) as i32;
        area.draw(&PathElement::new([(left, y), (left + 20 * fine, y)], INK.stroke_width(FINE)))?;
        area.draw(&label(short(&value), (left + 24 * fine, y)))?;
    }
    Ok(())
}

/// `line` with so few points as a picture can show: of every run of points the lowest and the highest.
pub(super) fn thinned(line: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    if line.len() <= MOST_POINTS {
        return line;
    }
    let run = (2 * line.len()).div_ceil(MOST_POINTS);
    let mut thin = Vec::with_capacity(MOST_POINTS + 2);
    for part in line.chunks(run) {
        let by_height = |one: &&(f64, f64), other: &&(f64, f64)| one.1.total_cmp(&other.1);
        let ends = [part.iter().min_by(by_height), part.iter().max_by(by_height)];
        let mut ends: Vec<(f64, f64)> = ends.into_iter().flatten().copied().collect();
        ends.sort_by(|one, other| one.0.total_cmp(&other.0));
        ends.dedup();
        thin.extend(ends);
    }
    thin.extend(line.last());
    thin
}

/// An ellipse about `centre` with semi-axes along `angle` [rad] and across.
pub(super) fn ellipse(centre: (f64, f64), [major, minor]: [f64; 2], angle: f64) -> Vec<(f64, f64)> {
    const POINTS: u32 = 72;
    let (sine, cosine) = messages::math::sin_cos(angle);
    (0..=POINTS)
        .map(|index| {
            let turn = core::f64::consts::TAU * f64::from(index) / f64::from(POINTS);
            let (across, along) = messages::math::sin_cos(turn);
            let (u, v) = (major * along, minor * across);
            (centre.0 + u * cosine - v * sine, centre.1 + u * sine + v * cosine)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::thinned;

    #[test]
    fn a_thinned_line_keeps_its_peaks() {
        let line: Vec<(f64, f64)> = (0..50_000)
            .map(|index| (f64::from(index), if index == 31_234 { 7.0 } else { 1.0 }))
            .collect();
        let thin = thinned(line);
        assert!(thin.len() <= 1300, "{}", thin.len());
        assert!(thin.contains(&(31_234.0, 7.0)) && thin.last() == Some(&(49_999.0, 1.0)));
        assert!(thin.windows(2).all(|pair| pair[0].0 <= pair[1].0));
    }
}
