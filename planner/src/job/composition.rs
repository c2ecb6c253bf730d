//! Drawings composed to a job: shapes and images in their places, by layers, in order.

mod colours;
mod compose;
mod fill;
mod frame;
mod layers;
mod middle;
mod placement;
mod recipe;
mod rows;
mod serial;
mod source;
pub mod tables;

use std::sync::Arc as Shared;

use graphics::{Contour, Segment};
use kurbo::{Point, Rect};
use messages::plan::LayerFacts;
use nalgebra::Vector3;

pub(super) use compose::{Composed, Part, Parts, compose};
pub(super) use middle::moved;
pub(super) use recipe::Defaults;
use rows::Rows;
pub(super) use source::is_font_file;

use crate::drawing::{Action, Curve, Power, Step};

/// The output bit of the air assist.
const AIR_ASSIST: u32 = 0;

/// What a composed job marks, in order; made into steps as they are asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Composition {
    sections: Shared<[Section]>,
    /// Pulse repetition rate of the laser before the first of them [pulses/s], 0 as its source is set.
    frequency: f64,
    /// How often all of it is marked, at least 1.
    repeat: u32,
    /// Whether it shows where the drawings lie instead of marking them.
    pub(crate) is_frame: bool,
}

/// What is marked in one way, in order.
#[derive(Debug, Clone, PartialEq)]
struct Section {
    /// The name of its layer; `None` for what is on none.
    layer: Option<String>,
    recipe: Recipe,
    marks: Vec<Mark>,
}

/// How the marks of a section are made.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Recipe {
    /// Speed [m/s]; `None` leaves it to the job.
    speed: Option<f64>,
    power: Power,
    /// At least 1.
    passes: u32,
    /// How far the tool is above the drawing [m], and how much lower in each further pass.
    focus: f64,
    focus_step: f64,
    /// Whether the air assist is on.
    air: bool,
    /// Pulse repetition rate of the laser [pulses/s], 0 as its source is set.
    frequency: f64,
}

/// One thing to mark.
#[derive(Debug, Clone, PartialEq)]
struct Mark {
    shape: MarkShape,
    /// Height of the drawing, machine frame [m].
    height: f64,
    /// Line that asks for it, 0 for none.
    line: u64,
}

#[derive(Debug, Clone, PartialEq)]
enum MarkShape {
    /// A curve, machine frame [m].
    Contour(Contour),
    /// The rows of an image.
    Rows(Rows),
    /// A polygon that the tool goes around in the dark, its first corner last again, machine frame [m].
    Frame(Vec<Point>),
}

impl Composition {
    /// Its steps from the first on, made as they are asked for.
    pub fn steps(&self) -> impl Iterator<Item = Step> + '_ {
        (0..self.repeat).flat_map(move |round| {
            let before = if round == 0 { None } else { self.sections.last() };
            let befores = core::iter::once(before).chain(self.sections.iter().map(Some));
            self.sections.iter().zip(befores).flat_map(move |(section, before)| {
                let before = before.map_or(self.frequency, |before| before.recipe.frequency);
                section.tuned(before).into_iter().chain(section.steps())
            })
        })
    }

    /// Whether the speed of some layer is for the planner to choose.
    pub(crate) fn leaves_speeds_open(&self) -> bool {
        self.sections.iter().any(|section| section.recipe.speed.is_none())
    }

    /// What its layers are, in the order of marking.
    pub(crate) fn layers(&self) -> Vec<LayerFacts> {
        let layer = |section: &Section| {
            let Recipe { speed, power, passes, frequency, air, .. } = section.recipe;
            LayerFacts {
                name: section.layer.clone(),
                marks: section.marks.len() as u64,
                length: section.marks.iter().map(|mark| mark.shape.length()).sum(),
                speed,
                power: power.level,
                passes: passes.into(),
                frequency: Some(frequency).filter(|frequency| *frequency > 0.0),
                air,
            }
        };
        self.sections.iter().map(layer).collect()
    }

    /// The smallest upright rectangle around all of it, machine frame [m]; `None` where there is nothing.
    pub(crate) fn bounds(&self) -> Option<Rect> {
        let marks = self.sections.iter().flat_map(|section| &section.marks);
        marks.map(|mark| mark.shape.bounds()).reduce(|one, other| one.union(other))
    }

    /// Lowest and highest place of the tool, machine frame [m].
    pub(crate) fn heights(&self) -> Option<[f64; 2]> {
        let heights = self.sections.iter().flat_map(|section| {
            let Recipe { focus, focus_step, passes, .. } = section.recipe;
            let last = focus - focus_step * f64::from(passes - 1);
            section.marks.iter().flat_map(move |mark| [mark.height + focus, mark.height + last])
        });
        heights
            .map(|height| [height; 2])
            .reduce(|[low, high], [next, _]| [low.min(next), high.max(next)])
    }

    /// How long it takes at its speeds, as if the tool started, stopped and turned in no time [s], with
    /// the speed of a mark that asks for one or none [m/s] and of free moves.
    pub(crate) fn time(&self, marking: &dyn Fn(Option<f64>) -> f64, rapid: f64) -> f64 {
        let section = |section: &Section| {
            let speed = marking(section.recipe.speed);
            let mut place: Option<Point> = None;
            let mut time = 0.0;
            for mark in &section.marks {
                let [from, to] = mark.shape.ends();
                let way = place.map_or(0.0, |place| (from - place).hypot());
                time += mark.shape.length() / speed + way / rapid;
                place = Some(to);
            }
            time * f64::from(section.recipe.passes)
        };
        f64::from(self.repeat) * self.sections.iter().map(section).sum::<f64>()
    }
}

impl MarkShape {
    fn bounds(&self) -> Rect {
        match self {
            Self::Contour(contour) => contour.bounds(),
            Self::Rows(rows) => rows.bounds(),
            Self::Frame(corners) => {
                let first = corners.first().copied().unwrap_or_default();
                let start = Rect::from_points(first, first);
                corners.iter().fold(start, |rect, corner| rect.union_pt(*corner))
            }
        }
    }

    /// Where it begins and ends [m].
    fn ends(&self) -> [Point; 2] {
        match self {
            Self::Contour(contour) => [contour.start, contour.end()],
            Self::Rows(rows) => rows.ends(),
            Self::Frame(corners) => {
                [corners.first(), corners.last()].map(|corner| corner.copied().unwrap_or_default())
            }
        }
    }

    /// How long the way along it is, about [m].
    fn length(&self) -> f64 {
        /// How far chords may be from a curve whose length is reckoned [m].
        const CHORD: f64 = 1e-5;
        let along = |points: &[Point]| -> f64 {
            points.windows(2).map(|pair| (pair[1] - pair[0]).hypot()).sum()
        };
        match self {
            Self::Contour(contour) => along(&contour.flattened(CHORD)),
            Self::Rows(rows) => rows.length(),
            Self::Frame(corners) => along(corners),
        }
    }
}

impl Section {
    /// The step that sets its frequency, where that is not the one `before` [pulses/s].
    fn tuned(&self, before: f64) -> Option<Step> {
        let value = self.recipe.frequency;
        (value != before).then_some(Step { action: Action::Frequency { value }, line: 0 })
    }

    fn steps(&self) -> impl Iterator<Item = Step> + '_ {
        let switch = |on| {
            let step = Step { action: Action::Output { bit: AIR_ASSIST, on }, line: 0 };
            self.recipe.air.then_some(step)
        };
        let passes = (0..self.recipe.passes)
            .flat_map(move |pass| self.marks.iter().flat_map(move |mark| self.mark(mark, pass)));
        switch(true).into_iter().chain(passes).chain(switch(false))
    }

    /// The steps of one mark in a pass, from 0.
    fn mark<'a>(&'a self, mark: &'a Mark, pass: u32) -> Box<dyn Iterator<Item = Step> + 'a> {
        let recipe = &self.recipe;
        let pen = Pen {
            height: mark.height + recipe.focus - recipe.focus_step * f64::from(pass),
            line: mark.line,
            recipe,
        };
        match &mark.shape {
            MarkShape::Contour(contour) => Box::new(pen.contour(contour)),
            MarkShape::Rows(rows) => Box::new(rows.steps(pen)),
            MarkShape::Frame(corners) => Box::new(pen.frame(corners)),
        }
    }
}

/// Makes steps of flat shapes.
#[derive(Debug, Clone, Copy)]
struct Pen<'a> {
    /// Of the tool [m].
    height: f64,
    line: u64,
    recipe: &'a Recipe,
}

impl<'a> Pen<'a> {
    fn place(&self, point: Point) -> Vector3<f64> {
        Vector3::new(point.x, point.y, self.height)
    }

    fn step(&self, action: Action) -> Step {
        Step { action, line: self.line }
    }

    fn go(&self, to: Point) -> Step {
        self.step(Action::Rapid { to: self.place(to) })
    }

    fn contour(self, contour: &'a Contour) -> impl Iterator<Item = Step> + 'a {
        let pieces = contour.pieces().map(move |(from, segment)| self.segment(from, segment));
        core::iter::once(self.go(contour.start)).chain(pieces)
    }

    fn segment(&self, from: Point, segment: &Segment) -> Step {
        let Recipe { speed, power, .. } = *self.recipe;
        let curve = match *segment {
            Segment::Line(to) => Curve::Line { from: self.place(from), to: self.place(to) },
            Segment::Cubic(first, second, end) => {
                let points = [from, first, second, end].map(|point| self.place(point));
                return self.step(Action::Trace { points, speed, power });
            }
            Segment::Arc(arc) => Curve::Arc {
                centre: self.place(arc.centre),
                major: Vector3::new(arc.major.x, arc.major.y, 0.0),
                minor: Vector3::new(arc.minor.x, arc.minor.y, 0.0),
                start: arc.start,
                sweep: arc.sweep,
                rise: Vector3::zeros(),
            },
        };
        self.step(Action::Mark { curve, speed, power })
    }

    /// Around a polygon in the dark.
    fn frame(self, corners: &'a [Point]) -> impl Iterator<Item = Step> + 'a {
        let ways = corners.iter().zip(corners.iter().skip(1));
        let ways = ways.map(move |(from, to)| match self.recipe.speed {
            Some(speed) => {
                let curve = Curve::Line { from: self.place(*from), to: self.place(*to) };
                self.step(Action::Feed { curve, speed })
            }
            None => self.go(*to),
        });
        corners.first().map(|first| self.go(*first)).into_iter().chain(ways)
    }
}
