//! The job file's tables of drawings, layers and order.

use machine::document::{
    Either, Fraction, NonNegative, Number, Point, Positive, Quantity, Spanned,
};
use machine::quantity::{Angle, Length, PulseRate, Speed};
use machine::table;

use crate::light::Policy;

table! {
    /// A drawing: exactly one of `file`, `text` and `code`.
    pub struct DrawingTable {
        /// A file of a drawing program or an image, relative to this one: SVG, DXF, LightBurn, HPGL, PNG,
        /// JPEG, BMP, GIF, WebP, TIFF.
        pub file: Option<Spanned<String>>,
        /// Text in a font.
        pub text: Option<TextTable>,
        /// A code that machines read.
        pub code: Option<CodeTable>,
        /// The layer that all of it is on, of those under `layers`; left out, colours and the file's own
        /// layers say it.
        pub layer: Option<Spanned<String>>,
        /// Where the anchor comes to lie, as seen from the machine's home; left out, at home or, where there is
        /// no room for it there, in the middle of the area.
        pub at: Option<Point>,
        /// The point of the drawing that comes to lie at `at`: of the rectangle around what is drawn, or
        /// `page`, the lower left corner of the file's page, from which its coordinates are counted.
        pub anchor: Spanned<Anchor> = "center",
        /// Turned about the anchor, counterclockwise.
        pub rotation: Quantity<Angle> = "0 deg",
        /// How much larger than drawn.
        pub scale: Option<Number<Positive>>,
        /// How wide what is drawn shall be, before it is turned; instead of `scale`.
        pub width: Option<Quantity<Length, Positive>>,
        /// How high; alone it keeps the proportions, with `width` it does not.
        pub height: Option<Quantity<Length, Positive>>,
        /// Mirrored before it is turned: `x` exchanges left and right, `y` top and bottom.
        pub mirror: Spanned<Mirror> = "none",
        /// Several of it in rows and columns.
        pub array: Option<ArrayTable>,
        /// Several of it around a circle.
        pub ring: Option<RingTable>,
        /// Numbers and columns of a file that stand for {n} and {column} in texts and codes, another one
        /// for each place of the array.
        pub serial: Option<SerialTable>,
    }
}

table! {
    /// Text in a font.
    pub struct TextTable {
        /// What to write; \n begins another line.
        pub content: Spanned<String>,
        /// A font file (TTF, OTF, TTC), relative to this file; the name of a font of this computer, such as
        /// "DejaVu Sans"; or one that is built in: `single_line`, whose letters are strokes, and
        /// `outline`, Ubuntu Light, whose letters are filled.
        pub font: Either<BuiltInFont, Spanned<String>> = "single_line",
        /// Height of a capital letter.
        pub height: Quantity<Length, Positive> = "5 mm",
        /// Where lines meet: `left`, `center`, `right`.
        pub align: Spanned<Align> = "left",
        /// Added between letters.
        pub spacing: Quantity<Length> = "0 mm",
        /// From a line to the next, in sizes of the font, 0.1 to 10.
        pub line_spacing: Number<Positive> = 1.2,
        /// On a circle of this radius around a centre below; negative, above.
        pub radius: Option<Quantity<Length>>,
    }
}

table! {
    /// A code that machines read: exactly one of `qr` and `data_matrix`.
    pub struct CodeTable {
        /// What the QR code says.
        pub qr: Option<Spanned<String>>,
        /// What the Data Matrix code says.
        pub data_matrix: Option<Spanned<String>>,
        /// Whether a Data Matrix code is rectangular instead of square.
        pub rectangular: Spanned<bool> = false,
        /// How much of a QR code may be lost: `low` 7 %, `medium` 15 %, `quartile` 25 %, `high` 30 %.
        pub correction: Spanned<Correction> = "medium",
        /// Width of one module.
        pub module: Quantity<Length, Positive> = "0.5 mm",
        /// Modules become dots of this share of their width, instead of areas that join.
        pub dot: Option<Fraction<Positive>>,
        /// Width of the quiet zone in modules; 4 for QR and 1 for Data Matrix when left out. It counts where
        /// light and dark are exchanged.
        pub quiet: Option<Number<NonNegative>>,
        /// Whether light and dark are exchanged, for materials that the laser makes light; the quiet zone
        /// is then marked too.
        pub inverted: Spanned<bool> = false,
    }
}

table! {
    /// Rows and columns.
    pub struct ArrayTable {
        /// Along x.
        pub columns: Number<Positive> = 1.0,
        /// Along y.
        pub rows: Number<Positive> = 1.0,
        /// From a column to the next, and from a row to the next.
        pub spacing: [Quantity<Length>; 2],
    }
}

table! {
    /// Places around a circle.
    pub struct RingTable {
        /// How many.
        pub count: Number<Positive>,
        /// Of the circle around `at`.
        pub radius: Quantity<Length, NonNegative>,
        /// From the first to the last; a whole turn by default, evenly spaced.
        pub angle: Option<Quantity<Angle>>,
        /// Where the first one is, counterclockwise from x.
        pub from: Quantity<Angle> = "90 deg",
        /// Whether each is turned with its place.
        pub turn: Spanned<bool> = true,
    }
}

table! {
    /// What stands for {n} and {column}.
    pub struct SerialTable {
        /// The first number.
        pub start: Number<NonNegative> = 1.0,
        /// From a number to the next.
        pub step: Number<Positive> = 1.0,
        /// Digits of a number, filled up with zeros.
        pub digits: Number<Positive> = 1.0,
        /// A CSV file whose first line names its columns, relative to this file.
        pub csv: Option<Spanned<String>>,
        /// The first row of it that is marked, from 1.
        pub row: Number<Positive> = 1.0,
    }
}

table! {
    /// How the shapes of a layer are marked.
    pub struct LayerTable {
        /// Colours of lines and fills that are on it, such as "#ff0000" or "red".
        pub colors: Option<Vec<Spanned<String>>>,
        /// Layers of the file that are on it; left out, the one with its own name.
        pub names: Option<Vec<Spanned<String>>>,
        /// `as_drawn`: lines as lines, filled shapes with hatch lines; `line`, `fill`, `fill_and_line`;
        /// `skip` leaves it out.
        pub mode: Spanned<Mode> = "as_drawn",
        /// Speed while the laser is on.
        pub speed: Option<Quantity<Speed, Positive>>,
        /// Power of the laser.
        pub power: Option<Fraction<Positive>>,
        /// Pulse repetition rate of the laser, within `laser.frequency` of the machine.
        pub frequency: Option<Quantity<PulseRate, Positive>>,
        /// How the light goes with the speed along lines.
        pub policy: Option<Spanned<Policy>>,
        /// How often it is marked.
        pub passes: Option<Number<Positive>>,
        /// How far above the drawing the tool is; needs a z axis.
        pub focus: Option<Quantity<Length>>,
        /// How much lower the tool is in each further pass.
        pub focus_step: Option<Quantity<Length>>,
        /// Whether the air assist is on.
        pub air: Option<Spanned<bool>>,
        /// Width of the cut: outlines are moved outward by half of it, holes inward.
        pub kerf: Option<Quantity<Length, NonNegative>>,
        /// How shapes are filled.
        pub hatch: Option<HatchTable>,
        /// How images are marked.
        pub image: Option<ImageTable>,
    }
}

table! {
    /// How shapes are filled.
    pub struct HatchTable {
        /// `lines`, or `contours` parallel to the outline.
        pub style: Spanned<HatchStyle> = "lines",
        /// From a line to the next.
        pub spacing: Quantity<Length, Positive> = "0.1 mm",
        /// Of the lines, counterclockwise from x.
        pub angle: Quantity<Angle> = "0 deg",
        /// Whether it is filled again by lines across.
        pub cross: Spanned<bool> = false,
        /// How far the fill stays within the outline.
        pub inset: Quantity<Length, NonNegative> = "0 mm",
        /// Whether every second line runs back.
        pub bidirectional: Spanned<bool> = true,
    }
}

table! {
    /// How images are marked, row by row.
    pub struct ImageTable {
        /// `grey` by power, or black and white by `threshold`, `ordered`, `floyd_steinberg`,
        /// `jarvis`, `stucki`.
        pub mode: Spanned<ImageMode> = "floyd_steinberg",
        /// From a row to the next.
        pub interval: Quantity<Length, Positive> = "0.1 mm",
        /// Width of a dot in a row; as `interval` when left out.
        pub pitch: Option<Quantity<Length, Positive>>,
        /// Brightness is raised to the power of one over this.
        pub gamma: Number<Positive> = 1.0,
        /// Added to the brightness, -1 to 1.
        pub brightness: Number = 0.0,
        /// Stretches the brightness around its middle: -1 all grey, 1 black and white alone.
        pub contrast: Number = 0.0,
        /// Whether light places are marked instead of dark ones.
        pub inverted: Spanned<bool> = false,
        /// Darker is black, for `threshold`; white is 1.
        pub threshold: Fraction<Positive> = 0.5,
        /// Whether every second row runs back.
        pub bidirectional: Spanned<bool> = true,
    }
}

table! {
    /// In which order the lines of a layer are marked.
    pub struct OrderTable {
        /// `shortest`: little way in the dark, what lies inside of an outline before it; `file`: as they
        /// are drawn.
        pub by: Spanned<OrderWord> = "shortest",
        /// How often all of it is marked.
        pub repeat: Number<Positive> = 1.0,
    }
}

table! {
    /// Shows where the job lies instead of marking it.
    pub struct FrameTable {
        /// `rectangle` or `hull`, the shortest way around.
        pub shape: Spanned<FrameShape> = "rectangle",
        /// Power of the laser; left out, in the dark.
        pub power: Option<Fraction<Positive>>,
        /// Speed along it.
        pub speed: Quantity<Speed, Positive> = "100 mm/s",
    }
}

/// A point of a drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// Of the rectangle around what is drawn: 0, ½ and 1 of its width and height, in halves.
    Box([u8; 2]),
    /// The origin of the file's coordinates.
    Page,
}

machine::keyword! {
    Anchor, "a point of the drawing",
    "center" => Self::Box([1, 1]),
    "lower_left" => Self::Box([0, 0]),
    "lower" => Self::Box([1, 0]),
    "lower_right" => Self::Box([2, 0]),
    "left" => Self::Box([0, 1]),
    "right" => Self::Box([2, 1]),
    "upper_left" => Self::Box([0, 2]),
    "upper" => Self::Box([1, 2]),
    "upper_right" => Self::Box([2, 2]),
    "page" => Self::Page,
}

/// What is exchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mirror {
    /// Nothing.
    None,
    /// Left and right.
    X,
    /// Top and bottom.
    Y,
}

machine::keyword! {
    Mirror, "a mirror",
    "none" => Self::None,
    "x" => Self::X,
    "y" => Self::Y,
}

/// A font that is always there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BuiltInFont {
    /// Letters are strokes.
    SingleLine,
    /// Letters are filled.
    Outline,
}

machine::keyword! {
    BuiltInFont, "a font",
    "single_line" => Self::SingleLine,
    "outline" => Self::Outline,
}

/// Where the lines of a text meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    /// At their beginnings.
    Left,
    /// In their middles.
    Center,
    /// At their ends.
    Right,
}

machine::keyword! {
    Align, "an alignment",
    "left" => Self::Left,
    "center" => Self::Center,
    "right" => Self::Right,
}

/// How much of a QR code may be lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Correction {
    /// 7 %.
    Low,
    /// 15 %.
    Medium,
    /// 25 %.
    Quartile,
    /// 30 %.
    High,
}

machine::keyword! {
    Correction, "a level of correction",
    "low" => Self::Low,
    "medium" => Self::Medium,
    "quartile" => Self::Quartile,
    "high" => Self::High,
}

/// What is made of shapes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Lines of lines, hatch lines of fills.
    AsDrawn,
    /// Lines.
    Line,
    /// Hatch lines.
    Fill,
    /// Hatch lines, and the outlines after that.
    FillAndLine,
    /// Nothing.
    Skip,
}

machine::keyword! {
    Mode, "what is made of shapes",
    "as_drawn" => Self::AsDrawn,
    "line" => Self::Line,
    "fill" => Self::Fill,
    "fill_and_line" => Self::FillAndLine,
    "skip" => Self::Skip,
}

/// With what shapes are filled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HatchStyle {
    /// Straight lines.
    Lines,
    /// Lines parallel to the outline.
    Contours,
}

machine::keyword! {
    HatchStyle, "a style of filling",
    "lines" => Self::Lines,
    "contours" => Self::Contours,
}

/// How the brightness of an image is marked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageMode {
    /// By power.
    Grey,
    /// Black below a threshold.
    Threshold,
    /// By a matrix of thresholds.
    Ordered,
    /// By spreading what is left over.
    FloydSteinberg,
    /// The same, farther.
    Jarvis,
    /// The same, sharper.
    Stucki,
}

machine::keyword! {
    ImageMode, "a mode of images",
    "grey" => Self::Grey,
    "threshold" => Self::Threshold,
    "ordered" => Self::Ordered,
    "floyd_steinberg" => Self::FloydSteinberg,
    "jarvis" => Self::Jarvis,
    "stucki" => Self::Stucki,
}

/// An order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OrderWord {
    /// Inside first, with little way in the dark.
    Shortest,
    /// As drawn.
    File,
}

machine::keyword! {
    OrderWord, "an order",
    "shortest" => Self::Shortest,
    "file" => Self::File,
}

/// The form of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameShape {
    /// Upright.
    Rectangle,
    /// The convex hull.
    Hull,
}

machine::keyword! {
    FrameShape, "a frame",
    "rectangle" => Self::Rectangle,
    "hull" => Self::Hull,
}
