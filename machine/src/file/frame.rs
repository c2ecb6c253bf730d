//! The table of the frame that jobs speak in, over the axes of a mechanism whose joints follow from the
//! area.

use std::sync::Arc;

use super::mesh::{self, MeshTable};
use super::tables::MachineTable;
use crate::document::{Diagnostics, Number, Point, Positive, Quantity, Spanned};
use crate::frame::{Alignment, Frame};
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
    let mesh = measured.and_then(|table| mesh::surface(table, area, diagnostics));
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
