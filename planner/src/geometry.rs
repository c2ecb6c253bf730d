//! Where the tool goes, without time: curves, their joints, and the drawn lines as a measure.

pub(crate) mod arc_length;
pub mod attitude;
pub(crate) mod bezier;
pub(crate) mod blend;
pub(crate) mod contour;
pub(crate) mod cubic;
pub(crate) mod fit;
pub mod jet;
pub(crate) mod operation;
pub(crate) mod operations;
pub(crate) mod path;
pub(crate) mod polyline;
pub mod posed_path;
pub(crate) mod projected;
pub(crate) mod spline;
pub(crate) mod track;
pub mod turning;
