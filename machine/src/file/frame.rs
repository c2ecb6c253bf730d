//! The table of the frame that jobs speak in, over the axes of a mechanism whose joints follow from the
//! area.

use std::sync::Arc;

use super::tables::MachineTable;
use crate::document::{Diagnostics, Number, Point, Positive, Quantity, Span, Spanned};
use crate::frame::mesh::MeshError;
use crate::frame::{Alignment, Frame, Mesh};
use crate::limits::WorkArea;
use crate::quantity as unit;
use crate::table;

type Signed<K> = Quantity<K>;

/// The mechanisms whose tables are built with a frame.
pub(super) const FRAMED: [&str; 3] = ["cartesian", "corexy", "galvo"];

table! {
    /// How the machine frame, in which area, home and jobs are given, lies over the axes as they are;
    /// without it they are one. Of a cartesian, a corexy and a galvo.
    pub struct MachineFrameTable {
        /// The axes that run against the frame: of `x`, `y` and `z`.
        pub mirrored: Option<Vec<Spanned<Direction>>>,
        /// Whether the first axis moves the tool in y, and the second in x.
        pub swapped: Spanned<bool> = false,
        /// Where the tool is with all axes at zero, [x, y] or [x, y, z].
        pub origin: Option<Point>,
        /// By how much the axis along x is turned against x of the frame, counter-clockwise.
        pub rotation: Signed<unit::Angle> = "0 mrad",
        /// By how much the axis along y leans beyond a right angle from the one along x.
        pub skew: Signed<unit::Angle> = "0 mrad",
        /// What the first axis really moves per what its transmission says.
        pub scale_x: Number<Positive> = 1.0,
        /// The same of the second axis.
        pub scale_y: Number<Positive> = 1.0,
        /// The same of the z axis.
        pub scale_z: Number<Positive> = 1.0,
        /// What was measured beyond all this.
        pub mesh: Option<MeshTable>,
    }
}

table! {
    /// Where the tool really was, less where it should have been, over a grid of even distances that
    /// covers the area. A smooth surface goes through all values.
    pub struct MeshTable {
        /// First and last column of the grid.
        pub x: [Signed<unit::Length>; 2],
        /// First and last row of the grid.
        pub y: [Signed<unit::Length>; 2],
        /// Deviations in x: a list for each row, the first one at the first y, with a value for each
        /// column. 0 when left out.
        pub dx: Option<Vec<Vec<Signed<unit::Length>>>>,
        /// Deviations in y.
        pub dy: Option<Vec<Vec<Signed<unit::Length>>>>,
    }
}

/// An axis by its direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Along x.
    X = 0,
    /// Along y.
    Y = 1,
    /// Along z.
    Z = 2,
}

crate::keyword! {
    Direction, "a direction",
    "x" => Self::X,
    "y" => Self::Y,
    "z" => Self::Z,
}

/// The frame of a machine that `lifts` its tool or not; `None` where the file has none.
pub(super) fn build(
    machine: &MachineTable,
    lifts: bool,
    area: &WorkArea,
    diagnostics: &mut Diagnostics,
) -> Option<Arc<Frame>> {
    let table = machine.frame.as_ref()?;
    let mirrored = table.mirrored.as_deref().unwrap_or_default();
    let runs_against =
        |direction: Direction| mirrored.iter().any(|mirrored| mirrored.value == direction);
    let alignment = Alignment {
        mirrored: [Direction::X, Direction::Y, Direction::Z].map(runs_against),
        swapped: table.swapped.value,
        origin: table.origin.map_or([0.0; 3], |point| point.value),
        rotation: table.rotation.value,
        skew: table.skew.value,
        scale: [table.scale_x.value, table.scale_y.value, table.scale_z.value],
    };
    if !lifts {
        let up = mirrored.iter().find(|mirrored| mirrored.value == Direction::Z);
        let scaled = Some(table.scale_z.span).filter(|span| *span != table.span);
        let raised = table.origin.filter(|point| point.value[2] != 0.0).map(|point| point.span);
        for span in [up.map(|up| up.span), scaled, raised].into_iter().flatten() {
            diagnostics.contradict(
                span,
                "this has no effect: the mechanism has no z axis".to_owned(),
                "leave z out, or add the z axis",
            );
        }
    }
    let measured = table.mesh.as_ref();
    let mesh = measured.and_then(|mesh| surface(mesh, area, diagnostics));
    let frame = Frame::new(&alignment, mesh);
    if frame.is_none() {
        diagnostics.contradict(
            table.skew.span,
            "both axes move the tool the same way".to_owned(),
            "a skew is some milliradians",
        );
    }
    frame.map(Arc::new)
}

fn surface(table: &MeshTable, area: &WorkArea, diagnostics: &mut Diagnostics) -> Option<Mesh> {
    let mut is_sound = true;
    for (row, (name, [from, to])) in [("x", table.x), ("y", table.y)].into_iter().enumerate() {
        let (lower, upper) = (area.lower[row], area.upper[row]);
        let covers = from.value < to.value && from.value <= lower && to.value >= upper;
        if !covers {
            is_sound = false;
            diagnostics.contradict(
                from.span,
                format!(
                    "the mesh reaches from {name} = {} m to {} m, and the area from {lower} m to \
                     {upper} m",
                    from.value, to.value
                ),
                "measure all of the area, and write [first, last]",
            );
        }
    }
    let size =
        |rows: &Vec<Vec<Signed<unit::Length>>>| (rows.len(), rows.first().map_or(0, Vec::len));
    let lists = [&table.dx, &table.dy].map(Option::as_ref);
    let Some(given) = lists.into_iter().flatten().next() else {
        diagnostics.contradict(
            table.span,
            "a mesh without deviations has no effect".to_owned(),
            "add `dx` or `dy`, a list of values for each row",
        );
        return None;
    };
    let (rows, columns) = size(given);
    let even = |list: &Vec<Vec<Signed<unit::Length>>>| {
        list.len() == rows && list.iter().all(|row| row.len() == columns)
    };
    let place = given.iter().flatten().next().map_or(table.span, |value| value.span);
    if !lists.into_iter().flatten().all(even) {
        diagnostics.contradict(
            place,
            "the rows of the mesh are not all of one length".to_owned(),
            "give `dx` and `dy` as many rows as each other, and every row as many values",
        );
        return None;
    }
    let value = |list: Option<&Vec<Vec<Signed<unit::Length>>>>, row: usize, column: usize| {
        list.map_or(0.0, |list| list[row][column].value)
    };
    let deviations: Vec<Vec<[f64; 2]>> = (0..rows)
        .map(|row| (0..columns).map(|column| lists.map(|list| value(list, row, column))).collect())
        .collect();
    if !is_sound {
        return None;
    }
    let ends = |range: [Signed<unit::Length>; 2]| range.map(|end| end.value);
    Mesh::new(ends(table.x), ends(table.y), &deviations)
        .map_err(|error| refuse(error, place, diagnostics))
        .ok()
}

fn refuse(error: MeshError, span: Span, diagnostics: &mut Diagnostics) {
    match error {
        MeshError::Lines(count) => diagnostics.contradict(
            span,
            format!("a mesh of {count} lines in one direction is none"),
            &format!("give {} to {} rows, and as many values in each", Mesh::FEWEST, Mesh::MOST),
        ),
        MeshError::Steep(slope) => diagnostics.contradict(
            span,
            format!(
                "the deviations of the mesh change by {:.0} µm in a millimetre, and a correction by \
                 {:.0} µm at most",
                slope * 1e3,
                Mesh::STEEPEST * 1e3
            ),
            "look for a wrong value or unit; what is turned or scaled is no mesh",
        ),
    }
}
