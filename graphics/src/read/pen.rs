//! Makes contours out of moves, lines and curves, within the bound on their number.

use kurbo::Point;

use super::MOST_SEGMENTS;
use crate::ReadError;
use crate::shape::{Arc, Contour, Segment};

/// Draws contours one after the other. A contour without a length is not kept.
#[derive(Debug, Default)]
pub(crate) struct Pen {
    contours: Vec<Contour>,
    start: Point,
    at: Point,
    segments: Vec<Segment>,
    /// How many contours had no length.
    pub(crate) points: u64,
    has_begun: bool,
}

impl Pen {
    /// Where the pen is.
    pub(crate) fn at(&self) -> Point {
        self.at
    }

    /// Begins another contour.
    pub(crate) fn move_to(&mut self, to: Point) {
        self.end(false);
        self.start = to;
        self.at = to;
    }

    /// Goes straight; a line without a length is not drawn.
    pub(crate) fn line_to(&mut self, to: Point) {
        self.has_begun = true;
        if to != self.at {
            self.push(Segment::Line(to), to);
        }
    }

    /// Goes along a cubic Bézier curve.
    pub(crate) fn cubic_to(&mut self, first: Point, second: Point, to: Point) {
        self.has_begun = true;
        if first != self.at || second != self.at || to != self.at {
            self.push(Segment::Cubic(first, second, to), to);
        }
    }

    /// Goes along a quadratic Bézier curve, which a cubic one equals.
    pub(crate) fn quadratic_to(&mut self, control: Point, to: Point) {
        let first = self.at + (control - self.at) * (2.0 / 3.0);
        let second = to + (control - to) * (2.0 / 3.0);
        self.cubic_to(first, second, to);
    }

    /// Goes along an arc that begins at the pen and ends at `to`, to rounding.
    pub(crate) fn arc_to(&mut self, arc: Arc, to: Point) {
        self.has_begun = true;
        self.push(Segment::Arc(arc), to);
    }

    /// Goes along all of a contour, which begins at the pen, to rounding.
    pub(crate) fn extend(&mut self, contour: &Contour) {
        self.has_begun = true;
        for segment in &contour.segments {
            self.push(*segment, segment.end());
        }
    }

    /// Goes back to where the contour began and ends it as a loop.
    pub(crate) fn close(&mut self) {
        self.has_begun = true;
        self.line_to(self.start);
        self.end(true);
        self.at = self.start;
    }

    /// Ends the contour as a loop that is where it began, to rounding.
    pub(crate) fn close_here(&mut self) {
        self.end(true);
        self.at = self.start;
    }

    /// The contours, and a new pen.
    pub(crate) fn take(&mut self) -> Vec<Contour> {
        self.end(false);
        core::mem::take(&mut self.contours)
    }

    fn push(&mut self, segment: Segment, end: Point) {
        self.segments.push(segment);
        self.at = end;
    }

    fn end(&mut self, is_closed: bool) {
        let segments = core::mem::take(&mut self.segments);
        if segments.is_empty() {
            self.points += u64::from(self.has_begun);
        } else {
            self.contours.push(Contour { start: self.start, segments, is_closed });
        }
        self.has_begun = false;
        self.start = self.at;
    }
}

/// Counts the segments of a drawing against [`MOST_SEGMENTS`].
#[derive(Debug, Default)]
pub(crate) struct Budget {
    segments: usize,
}

impl Budget {
    /// Counts the segments of contours, and one for each contour.
    ///
    /// # Errors
    ///
    /// Where there are more than the bound.
    pub(crate) fn spend(&mut self, contours: &[Contour]) -> Result<(), ReadError> {
        self.spend_count(contours.iter().map(|contour| contour.segments.len() + 1).sum())
    }

    /// Counts this many segments.
    ///
    /// # Errors
    ///
    /// Where there are more than the bound.
    pub(crate) fn spend_count(&mut self, count: usize) -> Result<(), ReadError> {
        self.segments = self.segments.saturating_add(count);
        if self.segments > MOST_SEGMENTS {
            return Err(ReadError::new(
                format!("the drawing has more than {MOST_SEGMENTS} curves and lines"),
                "divide it into several files, or simplify its paths",
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use kurbo::Point;

    use super::{Budget, MOST_SEGMENTS, Pen};
    use crate::shape::Segment;

    #[test]
    fn a_closed_contour_ends_at_its_start_and_points_are_counted() {
        let mut pen = Pen::default();
        pen.move_to(Point::new(1.0, 1.0));
        pen.line_to(Point::new(2.0, 1.0));
        pen.line_to(Point::new(2.0, 2.0));
        pen.close();
        pen.line_to(Point::new(0.0, 0.0));
        pen.move_to(Point::new(5.0, 5.0));
        pen.line_to(Point::new(5.0, 5.0));
        pen.move_to(Point::new(6.0, 6.0));
        let contours = pen.take();
        assert_eq!(contours.len(), 2);
        assert!(contours[0].is_closed);
        assert_eq!(contours[0].segments.len(), 3);
        assert_eq!(contours[0].end(), contours[0].start);
        assert!(!contours[1].is_closed);
        assert_eq!(contours[1].start, Point::new(1.0, 1.0));
        assert_eq!(contours[1].segments, [Segment::Line(Point::new(0.0, 0.0))]);
        assert_eq!(pen.points, 1);
    }

    #[test]
    fn more_segments_than_the_bound_are_refused() {
        let mut budget = Budget::default();
        assert!(budget.spend_count(MOST_SEGMENTS).is_ok());
        assert!(budget.spend_count(1).is_err());
        assert!(budget.spend_count(usize::MAX).is_err());
    }
}
