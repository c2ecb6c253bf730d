//! Drawings that users bring: files of drawing programs, text, codes and images, read into curves and
//! pixels, and what is done with them before they are a job: placing, filling, offsetting, ordering.
//!
//! Nothing here knows a machine or a motion. Lengths are metres, y points up and x to the right, angles are
//! radians, counterclockwise. Curves stay curves: nothing is made of chords that was not drawn so.

#[cfg(feature = "codes")]
pub mod code;
mod curve;
pub mod dither;
#[cfg(feature = "dxf")]
pub mod dxf;
mod error;
mod extent;
pub mod hatch;
pub mod hpgl;
#[cfg(feature = "image")]
pub mod image;
#[cfg(feature = "lightburn")]
pub mod lightburn;
pub mod offset;
pub mod order;
pub mod points;
#[cfg(test)]
mod random;
pub mod read;
pub mod shape;
pub mod single_line;
#[cfg(feature = "svg")]
pub mod svg;
pub mod text;

pub use error::ReadError;
pub use shape::{
    Arc, Colour, Contour, FileMode, FileNote, FileRecipe, Fill, FillRule, Graphic, Raster, Segment,
    Shape,
};
