//! The path that the tool follows: curves with smoothed joints, by one parameter that is the arc
//! length on lines and arcs, and near it elsewhere.

use std::sync::Arc;

use machine::kinematics::{Attitude, ToolMotion};
use machine::taylor::Taylor;
use nalgebra::{Matrix3, Vector3};

use crate::drawing::Curve;
use crate::geometry::blend::BlendSegment;
use crate::geometry::jet::Jet;
use crate::geometry::track::Track;
use crate::geometry::turning::Turning;
use crate::search::partition_near;

/// The path of a contour. It is never empty once it is planned.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Path {
    spans: Vec<Span>,
    length: f64,
    turned: Turned,
}

/// How the tool is turned along a path, where the path says it.
#[derive(Debug, Clone, Default, PartialEq)]
enum Turned {
    #[default]
    Level,
    Fixed(Matrix3<f64>),
    /// From this place of the turning on [m].
    Along(Arc<Turning>, f64),
}

/// Where on a path it was looked last.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct PathCursor {
    span: usize,
    piece: usize,
    knot: usize,
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
    BlendSegment(Box<BlendSegment>),
}

impl Path {
    /// Goes on along `track` for `length`, from the distance `from`.
    pub(crate) fn push_track(&mut self, track: &Track, from: f64, length: f64) {
        if length > 0.0 {
            self.push(Shape::Track(track.clone(), from), length);
        }
    }

    pub(crate) fn push_segment(&mut self, segment: BlendSegment, length: f64) {
        self.push(Shape::BlendSegment(Box::new(segment)), length);
    }

    fn push(&mut self, shape: Shape, length: f64) {
        self.spans.push(Span { start: self.length, shape });
        self.length += length;
    }

    /// A straight line.
    pub(crate) fn line(from: Vector3<f64>, to: Vector3<f64>) -> Self {
        let mut path = Self::default();
        let track = Track::new(&Curve::Line { from, to });
        path.push_track(&track, 0.0, track.length());
        path
    }

    /// With the tool turned by `rotation` all along.
    pub(crate) fn facing(self, rotation: Matrix3<f64>) -> Self {
        Self { turned: Turned::Fixed(rotation), ..self }
    }

    /// With the tool turned as `turning` has it from the place `from` on [m].
    pub(crate) fn turning(self, turning: Arc<Turning>, from: f64) -> Self {
        Self { turned: Turned::Along(turning, from), ..self }
    }

    /// The range of the parameter [m].
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The point and its derivatives at `distance` from the start [m].
    pub fn at(&self, distance: f64) -> Jet {
        self.at_near(distance, &mut PathCursor::default())
    }

    /// As [`Self::at`], looked for from the place of `near` on.
    #[inline]
    pub(crate) fn at_near(&self, distance: f64, near: &mut PathCursor) -> Jet {
        let after = partition_near(&self.spans, &mut near.span, |span| span.start <= distance);
        let span = &self.spans[after.max(1) - 1];
        match &span.shape {
            Shape::Track(track, from) => {
                track.at_near(from + (distance - span.start), &mut near.piece)
            }
            Shape::BlendSegment(segment) => segment.at(distance - span.start),
        }
    }

    /// The same, from the shape that ends at `distance` where one does and `before` says so.
    pub(crate) fn on_side(&self, distance: f64, before: bool, near: &mut PathCursor) -> Jet {
        if !before {
            return self.at_near(distance, near);
        }
        let after = partition_near(&self.spans, &mut near.span, |span| span.start < distance);
        let span = &self.spans[after.max(1) - 1];
        match &span.shape {
            Shape::Track(track, from) => {
                track.before(from + (distance - span.start), &mut near.piece)
            }
            Shape::BlendSegment(segment) => segment.at(distance - span.start),
        }
    }

    /// The tool's motion at `distance` [m], where the parameter goes with these rates: velocity [m/s],
    /// acceleration [m/s²] and jerk [m/s³].
    pub fn tool(&self, distance: f64, rates: [f64; 3]) -> ToolMotion {
        self.tool_near(distance, rates, &mut PathCursor::default())
    }

    /// As [`Self::tool`], looked for from the place of `near` on.
    #[inline]
    pub(crate) fn tool_near(
        &self,
        distance: f64,
        rates: [f64; 3],
        near: &mut PathCursor,
    ) -> ToolMotion {
        self.turn(self.at_near(distance, near).motion(rates), distance, rates, near)
    }

    /// The same, from the shape that ends at `distance` where one does and `before` says so.
    pub(crate) fn tool_on_side(
        &self,
        distance: f64,
        before: bool,
        rates: [f64; 3],
        near: &mut PathCursor,
    ) -> ToolMotion {
        self.turn(self.on_side(distance, before, near).motion(rates), distance, rates, near)
    }

    /// The tool's motion at the last point, as its shape ends.
    pub(crate) fn end_tool(&self, rates: [f64; 3]) -> ToolMotion {
        self.tool_on_side(self.length, true, rates, &mut PathCursor::default())
    }

    #[inline]
    fn turn(
        &self,
        tool: ToolMotion,
        distance: f64,
        [velocity, acceleration, jerk]: [f64; 3],
        near: &mut PathCursor,
    ) -> ToolMotion {
        let attitude = match &self.turned {
            Turned::Level => return tool,
            Turned::Fixed(rotation) => Attitude::fixed(*rotation),
            Turned::Along(turning, from) => {
                let place = Taylor::new(from + distance, velocity, acceleration, jerk);
                turning.attitude(place, &mut near.knot)
            }
        };
        ToolMotion { attitude, ..tool }
    }

    /// Distances at which the path goes over from one shape into the next [m].
    pub fn seams(&self) -> impl Iterator<Item = f64> + '_ {
        self.spans.iter().skip(1).map(|span| span.start)
    }

    /// Appends where its third derivative may jump from `from` to `to`: seams, and the knots of splines
    /// [m], growing; then where the turning has its knots, and half way between them.
    pub(crate) fn borders(&self, from: f64, to: f64, borders: &mut Vec<f64>) {
        let first = self.spans.partition_point(|span| span.start <= from).max(1) - 1;
        for (index, span) in self.spans.iter().enumerate().skip(first) {
            if span.start > to {
                break;
            }
            if span.start > 0.0 && span.start >= from {
                borders.push(span.start);
            }
            if let Shape::Track(track, offset) = &span.shape {
                let end = self.spans.get(index + 1).map_or(self.length, |next| next.start);
                let knots = track.knots(from - span.start + offset);
                let inside = |knot: &f64| *knot > span.start && *knot < end && *knot >= from;
                let knots = knots.map(|knot| knot - offset + span.start);
                borders.extend(knots.take_while(|knot| *knot <= to).filter(inside));
            }
        }
        if let Turned::Along(turning, offset) = &self.turned {
            let knots = turning.places(from + offset).map(|place| place - offset);
            let inside = |knot: &f64| *knot > 0.0 && *knot >= from;
            borders.extend(knots.take_while(|knot| *knot <= to).filter(inside));
        }
    }

    /// Whether it is one straight line, on which nothing changes.
    pub(crate) fn is_straight(&self) -> bool {
        !matches!(self.turned, Turned::Along(..))
            && matches!(&*self.spans, [Span { shape: Shape::Track(Track::Line { .. }, _), .. }])
    }
}
