//! Rows from below to above, and the parts of each that lie inside.

use std::collections::BTreeSet;

use kurbo::Affine;

use super::pieces::{Piece, cut};
use super::{Area, HatchError, MOST_ROWS};
use crate::{FillRule, Segment};

/// Gaps and lines shorter than this are rounding [m].
const LEAST: f64 = 1e-9;

/// A crossing of a row with a piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    /// Where [m].
    pub(super) x: f64,
    pub(super) piece: u32,
    /// Fraction of the piece's segment.
    at: f64,
}

/// A part of a row that lies inside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    pub(super) first: Crossing,
    pub(super) last: Crossing,
}

/// A horizontal line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    /// It lies at (number + ½) · spacing.
    pub(super) number: i64,
    /// Its height [m].
    pub(super) height: f64,
}

/// A sweep over areas, row by row.
pub(super) struct Rows {
    pieces: Vec<Piece>,
    rules: Vec<FillRule>,
    are_dark: Vec<bool>,
    spacing: f64,
    /// Pieces by the first row that they may cross, the rows that they may cross, ahead of the sweep.
    waiting: Vec<(i64, i64, u32)>,
    next_waiting: usize,
    /// Pieces that the sweep is in, with the last row that they may cross.
    active: Vec<(i64, u32)>,
    next_row: i64,
    crossings: Vec<Crossing>,
    windings: Vec<i32>,
    /// The parts of the row that was given last, from left to right.
    pub(super) spans: Vec<Span>,
}

impl Rows {
    /// Over areas in coordinates in which the rows are level.
    pub(super) fn new(areas: &[Area<'_>], level: Affine, spacing: f64) -> Result<Self, HatchError> {
        let mut pieces = Vec::new();
        for (index, area) in areas.iter().enumerate() {
            for contour in area.contours {
                cut(&contour.transformed(level), index as u32, &mut pieces);
            }
        }
        let heights = || pieces.iter().flat_map(|piece| [piece.first(), piece.last()]);
        let start = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = heights().fold(start, |(low, high), y| (low.min(y), high.max(y)));
        // Far from the origin rows are told apart only while their numbers are exact.
        let farthest = low.abs().max(high.abs());
        let is_far = farthest / spacing > 1e12;
        let height = if is_far { farthest } else { high - low };
        let rows = height / spacing;
        if !pieces.is_empty() && (rows.is_nan() || rows > MOST_ROWS as f64) {
            return Err(HatchError::TooManyRows { spacing, height, rows });
        }
        let number = |y: f64| (y / spacing - 0.5).floor() as i64;
        let mut waiting: Vec<(i64, i64, u32)> = Vec::with_capacity(pieces.len());
        for (index, piece) in pieces.iter().enumerate() {
            let (low, high) = (piece.first().min(piece.last()), piece.first().max(piece.last()));
            if low < high {
                waiting.push((number(low), number(high) + 1, index as u32));
            }
        }
        waiting.sort_unstable();
        Ok(Self {
            pieces,
            rules: areas.iter().map(|area| area.rule).collect(),
            are_dark: areas.iter().map(|area| area.is_dark).collect(),
            spacing,
            waiting,
            next_waiting: 0,
            active: Vec::new(),
            next_row: i64::MIN,
            crossings: Vec::new(),
            windings: vec![0; areas.len()],
            spans: Vec::new(),
        })
    }

    /// The next row with a part inside; its parts are in `spans`.
    pub(super) fn next(&mut self) -> Option<Row> {
        loop {
            if self.active.is_empty() {
                self.next_row = self.next_row.max(self.waiting.get(self.next_waiting)?.0);
            }
            let number = self.next_row;
            self.next_row += 1;
            while let Some((first, last, piece)) = self.waiting.get(self.next_waiting)
                && *first <= number
            {
                self.active.push((*last, *piece));
                self.next_waiting += 1;
            }
            let height = (number as f64 + 0.5) * self.spacing;
            self.cross(height);
            self.active.retain(|(last, _)| *last > number);
            self.find_spans();
            if !self.spans.is_empty() {
                return Some(Row { number, height });
            }
        }
    }

    /// Where the active pieces cross a height, from left to right.
    fn cross(&mut self, height: f64) {
        self.crossings.clear();
        for (_, index) in &self.active {
            let piece = &self.pieces[*index as usize];
            if piece.crosses(height) {
                let at = piece.solve(height);
                self.crossings.push(Crossing { x: piece.point(at).x, piece: *index, at });
            }
        }
        self.crossings.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.piece.cmp(&b.piece)));
    }

    fn find_spans(&mut self) {
        self.spans.clear();
        // The areas that the sweep along the row is in.
        let mut inside = BTreeSet::new();
        let mut first = None;
        for crossing in &self.crossings {
            let piece = &self.pieces[crossing.piece as usize];
            let (winding, rule) =
                (&mut self.windings[piece.area as usize], self.rules[piece.area as usize]);
            let is_in = |winding: i32| match rule {
                FillRule::NonZero => winding != 0,
                FillRule::EvenOdd => winding % 2 != 0,
            };
            *winding += if piece.first() < piece.last() { 1 } else { -1 };
            if is_in(*winding) {
                inside.insert(piece.area);
            } else {
                inside.remove(&piece.area);
            }
            let is_dark = inside.last().is_some_and(|area| self.are_dark[*area as usize]);
            match first {
                None if is_dark => first = Some(*crossing),
                Some(begin) if !is_dark => {
                    first = None;
                    let span = Span { first: begin, last: *crossing };
                    match self.spans.last_mut() {
                        Some(before) if begin.x - before.last.x < LEAST => before.last = *crossing,
                        _ => self.spans.push(span),
                    }
                }
                _ => {}
            }
        }
        self.spans.retain(|span| span.last.x - span.first.x >= LEAST);
    }

    /// The edge that leads to a crossing from an open end on the row below without leaving the strip
    /// between the rows: which piece that end is on, and the edge from it.
    pub(super) fn link(
        &self,
        to: Crossing,
        low: f64,
        high: f64,
        open_end: impl Fn(u32) -> Option<Crossing>,
    ) -> Option<(u32, Vec<Segment>)> {
        let (mut index, mut at) = (to.piece, to.at);
        let piece = &self.pieces[index as usize];
        let (begin, end) = piece.contour;
        // Downwards is along the contour where its piece falls.
        let forwards = piece.first() > piece.last();
        let mut downwards = Vec::new();
        for _ in begin..end {
            let piece = &self.pieces[index as usize];
            if let Some(from) = open_end(index) {
                downwards.push(piece.part(from.at, at));
                downwards.reverse();
                return Some((index, downwards));
            }
            let y = if forwards { piece.last() } else { piece.first() };
            if !(low..=high).contains(&y) {
                return None;
            }
            downwards.push(piece.part(piece.fraction(forwards), at));
            index = match (forwards, index) {
                (true, index) if index + 1 == end => begin,
                (true, index) => index + 1,
                (false, index) if index == begin => end - 1,
                (false, index) => index - 1,
            };
            at = self.pieces[index as usize].fraction(!forwards);
        }
        None
    }
}
