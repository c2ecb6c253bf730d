//! Reads drawings of every format, within bounds that no file exceeds by mistake.

pub(crate) mod arcs;
pub(crate) mod bounds;
#[cfg(feature = "dxf")]
pub(crate) mod join;
#[cfg(test)]
pub(crate) mod mutations;
pub(crate) mod notes;
pub(crate) mod pen;
pub(crate) mod text;
#[cfg(any(feature = "svg", feature = "lightburn"))]
pub(crate) mod xml;

pub(crate) use bounds::bounds;
pub(crate) use text::text;

/// Bytes of a file, and of what a compressed one holds: 64 MiB. A drawing of this size has some two million
/// curves.
pub const MOST_BYTES: usize = 64 << 20;

/// Curves and lines of a drawing, with each symbol or block counted wherever it is drawn: they take some
/// 160 MB.
pub const MOST_SEGMENTS: usize = 2_000_000;

/// Elements of a drawing, with each symbol or block counted wherever it is drawn.
pub const MOST_ELEMENTS: usize = 300_000;

/// How deep elements may be in each other, through symbols and blocks. Deeper ones would need more stack than
/// a thread has.
pub const MOST_DEPTH: usize = 100;

pub(crate) fn too_large() -> crate::ReadError {
    crate::ReadError::new(
        format!("the file holds more than {} MiB", MOST_BYTES >> 20),
        "divide the drawing, or simplify its paths",
    )
}
