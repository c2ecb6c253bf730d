//! The path of a stroke: curves by arc length with smoothed joins, followed at constant speed.

use crate::blend::Quarter;
use crate::jet::Jet;
use crate::track::Track;

/// The path that the tool follows while the laser is on. It is never empty once it is planned.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StrokePath {
    spans: Vec<Span>,
    length: f64,
}

#[derive(Debug, Clone, PartialEq)]
struct Span {
    /// Where it starts along the path [m].
    start: f64,
    shape: Shape,
}

#[derive(Debug, Clone, PartialEq)]
enum Shape {
    /// A stretch of a track from this distance on.
    Track(Track, f64),
    /// A part of a smoothed join.
    Quarter(Box<Quarter>),
}

impl StrokePath {
    /// Goes on along `track` for `length`, from the distance `from`.
    pub(crate) fn push_track(&mut self, track: &Track, from: f64, length: f64) {
        if length > 0.0 {
            self.push(Shape::Track(track.clone(), from), length);
        }
    }

    pub(crate) fn push_quarter(&mut self, quarter: Quarter, length: f64) {
        self.push(Shape::Quarter(Box::new(quarter)), length);
    }

    fn push(&mut self, shape: Shape, length: f64) {
        self.spans.push(Span { start: self.length, shape });
        self.length += length;
    }

    /// [m].
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The point and its derivatives at `distance` from the start [m].
    pub fn at(&self, distance: f64) -> Jet {
        let after = self.spans.partition_point(|span| span.start <= distance);
        let span = &self.spans[after.max(1) - 1];
        span.at(distance - span.start)
    }

    /// Distances at which the path goes over from one shape into the next [m].
    pub fn seams(&self) -> impl Iterator<Item = f64> + '_ {
        self.spans.iter().skip(1).map(|span| span.start)
    }
}

impl Span {
    fn at(&self, distance: f64) -> Jet {
        match &self.shape {
            Shape::Track(track, from) => track.at(from + distance),
            Shape::Quarter(quarter) => quarter.at(distance),
        }
    }
}
