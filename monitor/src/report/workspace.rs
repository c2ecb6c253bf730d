//! The picture of a workspace: what of its area a machine reaches, and what a job marks there.

use super::PictureError;
use super::chart::{CURVES, Canvas, FINE, Failure, INK, draw, frame, legend};
use super::path::{MILLIMETRES, PLACE, Sheet, curve, thinned};
use messages::artwork::Artwork;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

/// What a place is to a machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ground {
    /// The tool comes there.
    Reached,
    /// Singular, or too near to a singularity or a collision.
    Singular,
    /// Out of reach, or beyond the limits of an axis.
    Outside,
}

/// A workspace seen from above.
#[derive(Debug, Clone, Copy)]
pub struct Workspace<'a> {
    /// The area from and to, along x and y [m].
    pub area: [[f64; 2]; 2],
    /// Places along x; at least 2.
    pub columns: usize,
    /// Row by row from the lowest y, along x, the edges of the area included.
    pub ground: &'a [Ground],
    /// Where the tool rests [m].
    pub home: [f64; 2],
    /// What is marked.
    pub artwork: Option<&'a Artwork>,
}

type Plane<'b> = ChartContext<'b, Canvas<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

impl Workspace<'_> {
    /// The picture, equal scales, as an SVG that stands alone.
    ///
    /// # Errors
    /// [`PictureError`] when the numbers cannot be drawn.
    pub fn picture(&self) -> Result<String, PictureError> {
        let sheet = Sheet::around(self.area[0], self.area[1]);
        let reached = CURVES[2].mix(0.35).filled();
        let singular = CURVES[4].mix(0.55).filled();
        let outline = INK.stroke_width(FINE);
        let home = CURVES[1].stroke_width(4 * FINE);
        let strokes = CURVES[0].stroke_width(FINE + 1);
        draw("workspace", sheet.height, |area| {
            let [x, y] = [sheet.x, sheet.y].map(|[from, to]| from * MILLIMETRES..to * MILLIMETRES);
            let mut chart = frame(area).build_cartesian_2d(x, y)?;
            self.fill(&mut chart, Ground::Reached, reached)?;
            self.fill(&mut chart, Ground::Singular, singular)?;
            sheet.axes(&mut chart, PLACE)?;
            curve(&mut chart, outline, self.outline())?;
            for line in self.artwork.map(thinned).unwrap_or_default() {
                curve(&mut chart, strokes, line)?;
            }
            let at = (self.home[0] * MILLIMETRES, self.home[1] * MILLIMETRES);
            chart.draw_series([Circle::new(at, 4 * FINE, home.filled())])?;
            let band = |style: ShapeStyle| ShapeStyle { stroke_width: 10 * FINE, ..style };
            let marked = if self.artwork.is_some() { "job" } else { "" };
            legend(
                area,
                &[
                    ("reached", band(reached)),
                    ("singular", band(singular)),
                    ("area", outline),
                    ("home", home),
                    (marked, strokes),
                ],
            )
        })
    }

    /// The area's edge [mm].
    fn outline(&self) -> Vec<(f64, f64)> {
        let [[left, right], [below, above]] =
            self.area.map(|range| range.map(|at| at * MILLIMETRES));
        vec![(left, below), (right, below), (right, above), (left, above), (left, below)]
    }

    /// Paints what is of one kind, runs of a row at once, each place as wide as the grid, cut off
    /// at the area's edge.
    fn fill<'b>(
        &self,
        chart: &mut Plane<'b>,
        kind: Ground,
        style: ShapeStyle,
    ) -> Result<(), Failure<'b>> {
        let rows = self.ground.len() / self.columns.max(1);
        let edge = |axis: usize, index: usize, count: usize| {
            let [from, to] = self.area[axis];
            let share = (index as f64 - 0.5) / (count.max(2) - 1) as f64;
            (from + (to - from) * share.clamp(0.0, 1.0)) * MILLIMETRES
        };
        for (row, line) in self.ground.chunks(self.columns.max(1)).enumerate() {
            let mut column = 0;
            for run in line.chunk_by(|one, other| one == other) {
                let end = column + run.len();
                if run.first() == Some(&kind) {
                    let from = (edge(0, column, self.columns), edge(1, row, rows));
                    let to = (edge(0, end, self.columns), edge(1, row + 1, rows));
                    chart.draw_series([Rectangle::new([from, to], style)])?;
                }
                column = end;
            }
        }
        Ok(())
    }
}
