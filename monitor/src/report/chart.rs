//! Charts over time, and distributions, as SVG.
//!
//! Colours are fixed in the picture so that it stands alone; the page's style sheet replaces ink,
//! grid and paper by those of a dark screen where the reader prefers one.

use super::PictureError;
use plotters::chart::MeshStyle;
use plotters::coord::Shift;
use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Text and axes.
pub const INK: RGBColor = RGBColor(0x3d, 0x44, 0x51);
/// Grid lines.
pub const GRID: RGBColor = RGBColor(0xd9, 0xdd, 0xe3);
/// Background.
pub const PAPER: RGBColor = RGBColor(0xff, 0xff, 0xff);
/// Curves, told apart by every kind of colour vision, legible on light and dark.
pub const CURVES: [RGBColor; 8] = [
    RGBColor(0x2f, 0x7e, 0xd8),
    RGBColor(0xe6, 0x79, 0x2b),
    RGBColor(0x1f, 0xa1, 0x7a),
    RGBColor(0xb0, 0x5c, 0xc6),
    RGBColor(0xd6, 0x45, 0x55),
    RGBColor(0x2a, 0xa8, 0xb8),
    RGBColor(0xa8, 0x8b, 0x1c),
    RGBColor(0x7d, 0x86, 0x94),
];

/// Picture elements per unit of the page: plotters rounds to whole ones.
pub const FINE: u32 = 3;
/// Width of every picture, in page units.
pub const WIDTH: u32 = 960;
/// Size of text, in page units.
const TEXT: u32 = 13;
/// Radius of a dot, in page units.
const DOT: u32 = 3;

/// The colour of curve `index`.
pub fn colour(index: usize) -> RGBColor {
    CURVES.get(index % CURVES.len()).copied().unwrap_or(INK)
}

/// Text of the usual size.
pub fn text_style() -> TextStyle<'static> {
    ("sans-serif", (TEXT * FINE) as i32).into_font().color(&INK)
}

/// `mesh` with the look that axes, labels and grid have in every picture.
pub fn styled<'s, 'a, 'b, X, Y, B>(
    mesh: &'s mut MeshStyle<'a, 'b, X, Y, B>,
) -> &'s mut MeshStyle<'a, 'b, X, Y, B>
where
    X: Ranged,
    Y: Ranged,
    B: DrawingBackend,
{
    mesh.label_style(text_style())
        .axis_desc_style(text_style())
        .axis_style(INK.stroke_width(FINE))
        .bold_line_style(GRID.stroke_width(FINE))
        .light_line_style(TRANSPARENT)
}

/// Text centred above what it names.
pub fn centred() -> TextStyle<'static> {
    text_style().pos(Pos::new(HPos::Center, VPos::Bottom))
}

/// One named curve, as lines without gaps.
#[derive(Debug, Clone)]
pub struct Curve {
    /// For the legend; none when empty.
    pub name: String,
    /// Its colour.
    pub colour: RGBColor,
    /// `(x, y)` in the units of the axes; a line of one point is a dot.
    pub lines: Vec<Vec<(f64, f64)>>,
}

/// A chart: what its axes mean, and its curves.
#[derive(Debug, Clone)]
pub struct Chart<'a> {
    /// Name, for errors.
    pub title: &'a str,
    /// Name and unit of the horizontal axis.
    pub across: &'a str,
    /// Name and unit of the vertical axis.
    pub up: &'a str,
    /// Height in page units.
    pub height: u32,
    /// Range of the vertical axis that is always shown.
    pub at_least: Option<(f64, f64)>,
    /// The curves.
    pub curves: Vec<Curve>,
}

impl Chart<'_> {
    /// The chart with linear axes.
    ///
    /// # Errors
    /// [`PictureError`] when the numbers cannot be drawn.
    pub fn draw(&self) -> Result<String, PictureError> {
        draw(self.title, self.height, |area| self.paint(area))
    }

    /// Paints the chart with linear axes into `area`.
    fn paint<'b>(&self, area: &DrawingArea<Canvas<'b>, Shift>) -> Result<(), Failure<'b>> {
        let (x, y) = self.ranges();
        let mut chart = frame(area).build_cartesian_2d(x.0..x.1, y.0..y.1)?;
        self.fill(area, &mut chart, &short, &short)
    }

    /// The chart of a distribution: across the nines of the share (1 is 90 %, 2 is 99 %), upwards
    /// a logarithmic axis.
    ///
    /// # Errors
    /// [`PictureError`] when the numbers cannot be drawn.
    pub fn draw_distribution(&self) -> Result<String, PictureError> {
        let points = || self.curves.iter().flat_map(|curve| curve.lines.iter().flatten());
        let nines = span(points().map(|point| point.0)).map_or(1.0, |range| range.1.max(1.0));
        let seen = span(points().map(|point| point.1).filter(|value| *value > 0.0));
        let (low, high) = seen.unwrap_or((1.0, 10.0));
        let share = |nines: &f64| {
            let part = 100.0 * (1.0 - messages::math::pow(10.0, -nines));
            let digits = (nines.round() as usize).saturating_sub(1).saturating_sub(1);
            format!("{part:.digits$} %")
        };
        draw(self.title, self.height, |area| {
            let mut chart =
                frame(area).build_cartesian_2d(0.0..nines, (0.6 * low..1.6 * high).log_scale())?;
            self.fill(area, &mut chart, &share, &short)
        })
    }

    fn ranges(&self) -> ((f64, f64), (f64, f64)) {
        let points = || self.curves.iter().flat_map(|curve| curve.lines.iter().flatten());
        let x = span(points().map(|point| point.0)).unwrap_or((0.0, 1.0));
        let seen = span(points().map(|point| point.1));
        let y = span(seen.into_iter().chain(self.at_least).flat_map(|(low, high)| [low, high]));
        let (low, high) = y.unwrap_or((0.0, 1.0));
        // Air above and below, except at a bound that is meant.
        let air = 0.06 * (high - low).max(1e-9);
        let meant = |bound: f64, pick: fn((f64, f64)) -> f64| {
            self.at_least.map(pick).is_some_and(|fixed| fixed == bound)
        };
        let low = if meant(low, |range| range.0) { low } else { low - air };
        let high = if meant(high, |range| range.1) { high } else { high + air };
        ((x.0, x.1.max(x.0 + 1e-6)), (low, high.max(low + 1e-9)))
    }

    fn fill<'b, Y>(
        &self,
        area: &DrawingArea<Canvas<'b>, Shift>,
        chart: &mut ChartContext<
            'b,
            Canvas<'b>,
            Cartesian2d<plotters::coord::types::RangedCoordf64, Y>,
        >,
        label_x: &dyn Fn(&f64) -> String,
        label_y: &dyn Fn(&f64) -> String,
    ) -> Result<(), Failure<'b>>
    where
        Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        styled(
            chart
                .configure_mesh()
                .x_desc(self.across)
                .y_desc(self.up)
                .x_labels(11)
                .y_labels(self.height as usize / 32)
                .x_label_formatter(&label_x)
                .y_label_formatter(&label_y),
        )
        .draw()?;
        for curve in &self.curves {
            let style = curve.colour.stroke_width(FINE + 1);
            for line in &curve.lines {
                if let [dot] = line.as_slice() {
                    chart.draw_series([Circle::new(*dot, DOT * FINE, curve.colour.filled())])?;
                } else {
                    chart.draw_series(LineSeries::new(line.iter().copied(), style))?;
                }
            }
        }
        let entries: Vec<_> = (self.curves.iter())
            .map(|curve| (curve.name.as_str(), curve.colour.stroke_width(2 * FINE)))
            .collect();
        legend(area, &entries)
    }
}

/// One picture of charts one below the other, each with axes of its own.
///
/// # Errors
/// [`PictureError`] when the numbers cannot be drawn.
pub fn stack(title: &str, charts: &[Chart<'_>]) -> Result<String, PictureError> {
    let height = charts.iter().map(|chart| chart.height).sum();
    draw(title, height, |area| {
        let mut rest = area.clone();
        for chart in charts {
            let (upper, below) = rest.split_vertically(chart.height * FINE);
            chart.paint(&upper)?;
            rest = below;
        }
        Ok(())
    })
}

/// Where pictures are drawn.
pub type Canvas<'a> = SVGBackend<'a>;
/// What can go wrong there.
pub type Failure<'a> = DrawingAreaErrorKind<<Canvas<'a> as DrawingBackend>::ErrorType>;

/// Width of the margins of a chart, in page units: left, right, above, below.
pub const MARGINS: [u32; 4] = [72, 118, 10, 52];
/// Height of a line of the legend, in page units.
const LEGEND_LINE: u32 = 20;

/// A chart's margins, the same for all; the legend is in the right one.
pub fn frame<'a, 'b>(area: &'a DrawingArea<Canvas<'b>, Shift>) -> ChartBuilder<'a, 'b, Canvas<'b>> {
    let [left, right, above, below] = MARGINS.map(|margin| margin * FINE);
    let mut builder = ChartBuilder::on(area);
    builder.margin_top(above).margin_right(right);
    builder.margin_left(8 * FINE).margin_bottom(8 * FINE);
    builder.x_label_area_size(below - 8 * FINE).y_label_area_size(left - 8 * FINE);
    builder
}

/// Writes the names of curves with a piece of each beside the chart, from above.
///
/// # Errors
/// Whatever the drawing library reports.
pub fn legend<'b>(
    area: &DrawingArea<Canvas<'b>, Shift>,
    entries: &[(&str, ShapeStyle)],
) -> Result<(), Failure<'b>> {
    let left = ((WIDTH - MARGINS[1] + 12) * FINE) as i32;
    let piece = 16 * FINE as i32;
    let named = entries.iter().filter(|(name, _)| !name.is_empty());
    for (y, (name, style)) in (1..).map(|line| (line * LEGEND_LINE * FINE) as i32).zip(named) {
        area.draw(&PathElement::new([(left, y), (left + piece, y)], *style))?;
        let beside = text_style().pos(Pos::new(HPos::Left, VPos::Center));
        let at = (left + piece + 6 * FINE as i32, y);
        area.draw(&Text::new((*name).to_owned(), at, beside))?;
    }
    Ok(())
}

/// Makes a picture of the usual width and `height` page units.
///
/// # Errors
/// [`PictureError`] with what the drawing library reports.
pub fn draw<F>(title: &str, height: u32, paint: F) -> Result<String, PictureError>
where
    F: for<'b> FnOnce(&DrawingArea<Canvas<'b>, Shift>) -> Result<(), Failure<'b>>,
{
    let mut svg = String::new();
    {
        let area =
            SVGBackend::with_string(&mut svg, (WIDTH * FINE, height * FINE)).into_drawing_area();
        let painted = area.fill(&PAPER).and_then(|()| paint(&area)).and_then(|()| area.present());
        painted
            .map_err(|error| PictureError { title: title.to_owned(), reason: error.to_string() })?;
    }
    Ok(svg)
}

/// Lowest and highest of finite numbers; `None` when there are none.
pub fn span(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.filter(|value| value.is_finite()).fold(None, |range, value| {
        let (low, high) = range.unwrap_or((value, value));
        Some((low.min(value), high.max(value)))
    })
}

/// A number on an axis: as few digits as tell the ticks apart.
pub fn short(value: &f64) -> String {
    let digits = match value.abs() {
        size if !(1e-9..100.0).contains(&size) => 0,
        size if size >= 1.0 => 2,
        _ => 3,
    };
    let text = format!("{value:.digits$}");
    let text =
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.replace('-', "−") }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn numbers_on_axes_are_short() {
        for (value, expect) in [
            (0.0, "0"),
            (-1e-12, "0"),
            (0.25, "0.25"),
            (12.0, "12"),
            (-3.5, "−3.5"),
            (1200.0, "1200"),
        ] {
            assert_eq!(short(&value), expect);
        }
    }

    #[test]
    fn charts_in_a_stack_keep_their_heights_and_names() {
        let chart = |up: &'static str, lines: Vec<Vec<(f64, f64)>>| Chart {
            title: up,
            across: "time [s]",
            up,
            height: 200,
            at_least: None,
            curves: vec![Curve { name: up.to_owned(), colour: CURVES[0], lines }],
        };
        let line = vec![vec![(0.0, 1.0), (1.0, 2.0)]];
        let charts = [chart("speed [rpm]", line), chart("torque [mN·m]", vec![vec![(0.5, 1.0)]])];
        let svg = stack("two", &charts).unwrap();
        assert!(svg.contains(&format!("height=\"{}\"", 400 * FINE)), "{svg}");
        assert!(svg.contains("speed [rpm]") && svg.contains("torque [mN·m]"));
        // One line, and one dot.
        assert_eq!(svg.matches("<circle").count(), 1);
    }

    #[test]
    fn a_chart_without_points_is_still_a_picture() {
        let chart = Chart {
            title: "empty",
            across: "time [s]",
            up: "error [µm]",
            height: 200,
            at_least: None,
            curves: Vec::new(),
        };
        for svg in [chart.draw().unwrap(), chart.draw_distribution().unwrap()] {
            assert!(svg.starts_with("<svg") && svg.contains("error [µm]"), "{svg}");
        }
    }
}
