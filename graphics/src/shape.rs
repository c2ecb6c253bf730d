//! What a drawing consists of: shapes made of contours, and images.

use std::sync::Arc as Shared;

use kurbo::{Affine, Point, Rect, Vec2};
use messages::math;

/// What a file draws, in the order of the file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Graphic {
    /// Curves.
    pub shapes: Vec<Shape>,
    /// Images.
    pub images: Vec<Raster>,
    /// The page that the file gives [m]; `None` where it has none.
    pub page: Option<Rect>,
    /// How the file itself wants its shapes marked, where it says so (LightBurn projects).
    pub recipes: Vec<FileRecipe>,
    /// What a person should know: what was left out, and why, each said once.
    pub notes: Vec<FileNote>,
}

/// Something to know about a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileNote {
    /// Line of the file, from 1; 0 for none.
    pub line: u64,
    /// One sentence without a full stop.
    pub text: String,
}

/// One object of a drawing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shape {
    /// Its contours: holes are contours of their own.
    pub contours: Vec<Contour>,
    /// Colour of its line; `None` where it has none.
    pub stroke: Option<Colour>,
    /// How it is filled; `None` where it is not.
    pub fill: Option<Fill>,
    /// The layer that it is on, as the file names it.
    pub layer: Option<Shared<str>>,
    /// Index into [`Graphic::recipes`].
    pub recipe: Option<usize>,
    /// Line of the file that it begins in, from 1; 0 for none.
    pub line: u64,
}

/// A colour as the file gives it, without transparency.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Colour {
    /// Red, 0 to 255.
    pub red: u8,
    /// Green, 0 to 255.
    pub green: u8,
    /// Blue, 0 to 255.
    pub blue: u8,
}

/// How a shape is filled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fill {
    /// With which colour.
    pub colour: Colour,
    /// What is inside where contours cross or lie in each other.
    pub rule: FillRule,
}

/// What is inside of several contours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FillRule {
    /// Where the winding number is not 0.
    NonZero,
    /// Where the winding number is odd.
    EvenOdd,
}

/// A curve without a gap, open or closed.
#[derive(Debug, Clone, PartialEq)]
pub struct Contour {
    /// Where it begins [m].
    pub start: Point,
    /// What it goes along, each piece from where the one before ends.
    pub segments: Vec<Segment>,
    /// Whether it is meant as a loop. The last segment of one ends at the start, to rounding.
    pub is_closed: bool,
}

/// A smooth piece of a contour, from where the one before ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Segment {
    /// Straight to a point [m].
    Line(Point),
    /// A cubic Bézier curve: two control points and the end [m].
    Cubic(Point, Point, Point),
    /// An arc of a circle or an ellipse.
    Arc(Arc),
}

/// An arc of a circle or an ellipse: `p(φ) = centre + major·cos φ + minor·sin φ`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Centre [m].
    pub centre: Point,
    /// Semi-diameter at φ = 0 [m].
    pub major: Vec2,
    /// Semi-diameter at φ = π/2 [m]; of a sheared circle not perpendicular to `major`.
    pub minor: Vec2,
    /// φ at the start [rad].
    pub start: f64,
    /// Signed change of φ, not 0, at most a turn either way [rad].
    pub sweep: f64,
}

/// An image and where it lies.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster {
    /// Grey values row by row from the top, 0 black and 255 white, transparency on white.
    pub pixels: Shared<[u8]>,
    /// Pixels in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// From pixels, x to the right and y up from the lower left corner of the image, to metres.
    pub placement: Affine,
    /// The layer that it is on, as the file names it.
    pub layer: Option<Shared<str>>,
    /// Index into [`Graphic::recipes`].
    pub recipe: Option<usize>,
    /// Line of the file, from 1; 0 for none.
    pub line: u64,
}

/// How a file wants something marked; `None` is what it does not say.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FileRecipe {
    /// Its name in the file.
    pub name: String,
    /// Lines, filled, or image.
    pub mode: FileMode,
    /// Speed [m/s].
    pub speed: Option<f64>,
    /// Power, 0 to 1.
    pub power: Option<f64>,
    /// Least power, 0 to 1, of sources whose power follows the speed.
    pub least_power: Option<f64>,
    /// How often it is marked, at least 1.
    pub passes: Option<u32>,
    /// Distance of hatch lines or rows [m].
    pub interval: Option<f64>,
    /// Direction of hatch lines or rows [rad].
    pub angle: Option<f64>,
    /// Whether it is hatched a second time, across.
    pub is_cross: bool,
    /// How far outside of its line the middle of the cut shall be [m].
    pub kerf: Option<f64>,
    /// Pulse repetition rate [Hz].
    pub frequency: Option<f64>,
    /// How far the focus goes down [m].
    pub focus: Option<f64>,
    /// How much deeper the focus is in each further pass [m].
    pub focus_step: Option<f64>,
    /// Whether the air assist is on.
    pub air: Option<bool>,
    /// Whether it is left out.
    pub is_hidden: bool,
}

/// What a recipe of a file makes of a shape.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum FileMode {
    /// Its contours are marked.
    #[default]
    Line,
    /// It is filled with hatch lines.
    Fill,
    /// It is filled, and its contours are marked after that.
    FillAndLine,
    /// It is an image.
    Image,
}

impl Colour {
    /// Black.
    pub const BLACK: Self = Self { red: 0, green: 0, blue: 0 };
}

impl core::fmt::Display for Colour {
    /// As `#ff0000`.
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(formatter, "#{:02x}{:02x}{:02x}", self.red, self.green, self.blue)
    }
}

impl Segment {
    /// Where it ends [m].
    pub fn end(&self) -> Point {
        match *self {
            Self::Line(end) | Self::Cubic(_, _, end) => end,
            Self::Arc(arc) => arc.point(arc.start + arc.sweep),
        }
    }

    /// The segment in other coordinates.
    #[must_use]
    pub fn transformed(&self, by: Affine) -> Self {
        match *self {
            Self::Line(end) => Self::Line(by * end),
            Self::Cubic(first, second, end) => Self::Cubic(by * first, by * second, by * end),
            Self::Arc(arc) => Self::Arc(arc.transformed(by)),
        }
    }
}

impl Arc {
    /// The point at φ [rad], in metres.
    pub fn point(&self, angle: f64) -> Point {
        let (sine, cosine) = math::sin_cos(angle);
        self.centre + self.major * cosine + self.minor * sine
    }

    /// The arc in other coordinates.
    #[must_use]
    pub fn transformed(&self, by: Affine) -> Self {
        let turn = |vector: Vec2| by * vector.to_point() - by * Point::ORIGIN;
        Self { centre: by * self.centre, major: turn(self.major), minor: turn(self.minor), ..*self }
    }
}

impl Contour {
    /// Where it ends [m].
    pub fn end(&self) -> Point {
        self.segments.last().map_or(self.start, Segment::end)
    }

    /// The contour in other coordinates.
    #[must_use]
    pub fn transformed(&self, by: Affine) -> Self {
        Self {
            start: by * self.start,
            segments: self.segments.iter().map(|segment| segment.transformed(by)).collect(),
            is_closed: self.is_closed,
        }
    }
}
