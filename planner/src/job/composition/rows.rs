//! The rows of an image, made into steps one by one: memory does not depend on how many dots there are.

use graphics::Raster;
use graphics::dither::{Dither, DitherError, Row};
use kurbo::{Affine, Point, Rect};

use super::Pen;
use super::recipe::Image;
use crate::drawing::{Action, Curve, Power, Step};

/// An image and how its rows are made.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rows {
    raster: Raster,
    dither: Dither,
    is_bidirectional: bool,
    /// From dots, x to the right and y up from the lower left corner, to the machine frame [m].
    dots: Affine,
    columns: usize,
    rows: usize,
}

impl Rows {
    pub(super) fn new(raster: Raster, image: &Image) -> Result<Self, DitherError> {
        let rows = image.dither.rows(&raster)?;
        let (dots, columns, rows) = (rows.placement(), rows.columns(), rows.rows());
        let &Image { dither, is_bidirectional } = image;
        Ok(Self { raster, dither, is_bidirectional, dots, columns, rows })
    }

    pub(super) fn bounds(&self) -> Rect {
        self.raster.bounds()
    }

    /// Where the first and the last row are [m].
    pub(super) fn ends(&self) -> [Point; 2] {
        let right = self.columns as f64;
        let last = if self.is_bidirectional && self.rows.is_multiple_of(2) { 0.0 } else { right };
        [
            self.dots * Point::new(0.0, self.height(0)),
            self.dots * Point::new(last, self.height(self.rows - 1)),
        ]
    }

    /// The way along all rows and from one to the next [m].
    pub(super) fn length(&self) -> f64 {
        let way = |columns: f64, rows: f64| {
            (self.dots * Point::new(columns, rows) - self.dots * Point::ORIGIN).hypot()
        };
        self.rows as f64 * (way(self.columns as f64, 0.0) + way(0.0, 1.0))
    }

    /// Of the middle of a row, from 0 at the top, in dots.
    fn height(&self, row: usize) -> f64 {
        (self.rows - row) as f64 - 0.5
    }

    pub(super) fn steps<'a>(&'a self, pen: Pen<'a>) -> Box<dyn Iterator<Item = Step> + 'a> {
        // It was made once.
        let Ok(rows) = self.dither.rows(&self.raster) else { return Box::new(core::iter::empty()) };
        let mut is_back = false;
        Box::new(rows.flat_map(move |row| {
            let steps = self.row(&row, is_back, pen);
            is_back ^= self.is_bidirectional && !row.runs.is_empty();
            steps
        }))
    }

    /// One row, from its first dot to its last.
    fn row(&self, row: &Row, is_back: bool, pen: Pen<'_>) -> Vec<Step> {
        let at = |column: usize| {
            pen.place(self.dots * Point::new(column as f64, self.height(row.number)))
        };
        let mut steps = Vec::with_capacity(2 * row.runs.len());
        let mut place: Option<usize> = None;
        let mut add = |from: usize, to: usize, level: u8| {
            match place {
                None => steps.push(pen.step(Action::Rapid { to: at(from) })),
                Some(place) if place != from => {
                    let curve = Curve::Line { from: at(place), to: at(from) };
                    steps.push(pen.step(match pen.recipe.speed {
                        Some(speed) => Action::Feed { curve, speed },
                        None => Action::Rapid { to: at(from) },
                    }));
                }
                Some(_) => {}
            }
            let level = pen.recipe.power.level * f64::from(level) / f64::from(u8::MAX);
            steps.push(pen.step(Action::Mark {
                curve: Curve::Line { from: at(from), to: at(to) },
                speed: pen.recipe.speed,
                power: Power { level, ..pen.recipe.power },
            }));
            place = Some(to);
        };
        if is_back {
            row.runs.iter().rev().for_each(|run| add(run.to, run.from, run.level));
        } else {
            row.runs.iter().for_each(|run| add(run.from, run.to, run.level));
        }
        steps
    }
}
