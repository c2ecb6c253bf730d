//! Filling areas with parallel lines.
//!
//! Lines lie at odd multiples of half the spacing from the origin of the drawing: areas that are filled
//! one by one match, and an edge on a multiple of the spacing has no line on it. Where a line ends is solved
//! on the curve itself: ends lie on it within 1e-9 m, at any coarseness of drawing.

mod inset;
mod pieces;
mod rows;

use std::collections::BTreeMap;

use kurbo::{Affine, Point};

use crate::{Contour, FillRule, Segment};
pub use inset::{inset, rings};
use rows::{Crossing, Row, Rows};

/// How an area is filled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hatch {
    /// Direction of the lines, counterclockwise from x [rad].
    pub angle: f64,
    /// Distance of neighbouring lines, more than 0 [m].
    pub spacing: f64,
    /// Whether it is filled a second time, with lines across.
    pub is_cross: bool,
    /// How lines follow each other.
    pub travel: Travel,
}

/// How lines follow each other.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Travel {
    /// All in the hatch's direction.
    OneWay,
    /// Every second one back.
    #[default]
    BothWays,
    /// To and fro, neighbours joined along the edge of the area where one edge leads from the end of one
    /// to the start of the next.
    Connected,
}

/// What is filled: a point is inside where the last of all areas that it is inside of is dark.
#[derive(Debug, Clone, Copy)]
pub struct Area<'a> {
    /// Its edges; open ones are closed by a straight line.
    pub contours: &'a [Contour],
    /// What is inside of them.
    pub rule: FillRule,
    /// Whether it is filled; a light one covers those before it.
    pub is_dark: bool,
}

/// Why an area is not filled.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum HatchError {
    /// A coordinate is infinite or not a number.
    #[error("area {area}, contour {contour} (from 0) has a coordinate that is not a finite number")]
    NotFinite {
        /// Index of the area.
        area: usize,
        /// Index of the contour in it.
        contour: usize,
    },
    /// A contour is too far away for insets.
    #[error("area {area}, contour {contour} (from 0) is farther than {farthest} m from the origin")]
    TooFar {
        /// Index of the area.
        area: usize,
        /// Index of the contour in it.
        contour: usize,
        /// The limit [m].
        farthest: f64,
    },
    /// Spacing or angle are of no use.
    #[error("{name} is {value}; it must be {range}")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// Its value in SI units.
        value: f64,
        /// What would be right.
        range: &'static str,
    },
    /// A spacing far too small for the area.
    #[error(
        "lines {spacing} m apart would be {rows:.0} in an area {height} m across; at most {MOST_ROWS} are made"
    )]
    TooManyRows {
        /// Their distance [m].
        spacing: f64,
        /// How far the area reaches across the lines, from the origin if that is farther [m].
        height: f64,
        /// How many lines that would be.
        rows: f64,
    },
    /// More lines than memory should hold.
    #[error(
        "the fill has more than {MOST_LINES} lines; take a larger spacing or fill less at once"
    )]
    TooManyLines,
}

/// More rows of lines are not made.
pub const MOST_ROWS: usize = 2_000_000;
/// More lines are not made.
pub const MOST_LINES: usize = 20_000_000;

/// Fills areas: open contours in the order and direction of marking.
///
/// # Errors
///
/// Where a setting is out of its range, a coordinate is not finite, or the lines are too many.
pub fn hatch(areas: &[Area<'_>], how: &Hatch) -> Result<Vec<Contour>, HatchError> {
    check_setting("angle", how.angle, how.angle.is_finite(), "a finite number of radians")?;
    let is_positive = how.spacing.is_finite() && how.spacing > 0.0;
    check_setting("spacing", how.spacing, is_positive, "more than 0 m")?;
    check_areas(areas)?;
    let mut lines = Vec::new();
    fill(areas, how.angle, how, &mut lines)?;
    if how.is_cross {
        fill(areas, how.angle + messages::math::TURN / 4.0, how, &mut lines)?;
    }
    Ok(lines)
}

fn check_setting(
    name: &'static str,
    value: f64,
    is_right: bool,
    range: &'static str,
) -> Result<(), HatchError> {
    if is_right { Ok(()) } else { Err(HatchError::Setting { name, value, range }) }
}

fn check_areas(areas: &[Area<'_>]) -> Result<(), HatchError> {
    for (area, one) in areas.iter().enumerate() {
        if let Some(contour) = one.contours.iter().position(|contour| !contour.is_finite()) {
            return Err(HatchError::NotFinite { area, contour });
        }
    }
    Ok(())
}

/// Fills with lines of one direction.
fn fill(
    areas: &[Area<'_>],
    angle: f64,
    how: &Hatch,
    lines: &mut Vec<Contour>,
) -> Result<(), HatchError> {
    let (sine, cosine) = messages::math::sin_cos(angle);
    let back = Affine::new([cosine, sine, -sine, cosine, 0.0, 0.0]);
    let level = Affine::new([cosine, -sine, sine, cosine, 0.0, 0.0]);
    let mut rows = Rows::new(areas, level, how.spacing)?;
    // Ends on the row before, by piece: where they are, and of which line.
    let mut open: BTreeMap<u32, (Crossing, usize)> = BTreeMap::new();
    let mut before: Option<Row> = None;
    while let Some(row) = rows.next() {
        let is_back = how.travel != Travel::OneWay && row.number.rem_euclid(2) == 1;
        let below = before
            .filter(|before| how.travel == Travel::Connected && before.number + 1 == row.number);
        let mut ends = BTreeMap::new();
        for place in 0..rows.spans.len() {
            if lines.len() >= MOST_LINES {
                return Err(HatchError::TooManyLines);
            }
            let at = |x: f64| back * Point::new(x, row.height);
            let (from, to) = if is_back {
                let span = rows.spans[rows.spans.len() - 1 - place];
                (span.last, span.first)
            } else {
                (rows.spans[place].first, rows.spans[place].last)
            };
            let link = below.and_then(|below| {
                rows.link(from, below.height, row.height, |piece| Some(open.get(&piece)?.0))
            });
            let line = match link {
                Some((piece, link)) => {
                    let line = open.remove(&piece).map_or(0, |(_, line)| line);
                    let link = link.iter().map(|segment| segment.transformed(back));
                    lines[line].segments.extend(link);
                    lines[line].segments.push(Segment::Line(at(to.x)));
                    line
                }
                None => {
                    let segments = vec![Segment::Line(at(to.x))];
                    lines.push(Contour { start: at(from.x), segments, is_closed: false });
                    lines.len() - 1
                }
            };
            ends.insert(to.piece, (to, line));
        }
        open = ends;
        before = Some(row);
    }
    Ok(())
}

#[cfg(test)]
mod tests;
