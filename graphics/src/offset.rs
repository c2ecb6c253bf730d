//! Kerf: closed contours moved by half the width of the cut, so that the part has its drawn size.
//!
//! Outer contours move outwards and holes inwards, by how many closed contours lie around each. Corners
//! that a contour moves away from are rounded by arcs. Circular arcs stay arcs; other curves are replaced by
//! arcs within 1e-6 m before they move.

mod arcs;

use cavalier_contours::polyline::{PlineOffsetOptions, PlineSource};

use crate::curve::signed_area;
use crate::order::depths;
use crate::{Contour, FileNote};

/// Contours that allow for a kerf.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Compensated {
    /// The contours in the order of those that they come from.
    pub contours: Vec<Contour>,
    /// Index of the contour that each comes from; one may become several.
    pub sources: Vec<usize>,
    /// What vanished and what could not be moved.
    pub notes: Vec<FileNote>,
}

/// Why contours are not moved.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum OffsetError {
    /// The kerf is of no use.
    #[error("a kerf of {0} m is outside of the range from -0.1 m to 0.1 m")]
    Kerf(f64),
    /// A coordinate is of no use.
    #[error(
        "contour {0} (from 0) has a coordinate that is not a finite number within {FARTHEST} m"
    )]
    Coordinate(usize),
}

/// The widest kerf [m].
const WIDEST: f64 = 0.1;
/// Farther from the origin than this [m] the arithmetic of offsets is too coarse.
const FARTHEST: f64 = 1e4;
/// Farthest that chords leave a contour of which only the sense is wanted [m].
const COARSE: f64 = 1e-5;

/// Moves each closed contour by half a kerf [m]: outer ones outwards and holes inwards, the other way
/// round where the kerf is negative. Open contours stay, and so, with a note, do those that cross
/// themselves.
///
/// # Errors
///
/// Where the kerf is not within 0.1 m or a coordinate is not finite.
pub fn compensate(contours: &[Contour], kerf: f64) -> Result<Compensated, OffsetError> {
    if !(kerf.is_finite() && kerf.abs() <= WIDEST) {
        return Err(OffsetError::Kerf(kerf));
    }
    let outlines: Vec<_> = contours.iter().map(|contour| contour.flattened(COARSE)).collect();
    for (index, (contour, outline)) in contours.iter().zip(&outlines).enumerate() {
        let is_near = outline.iter().all(|point| point.to_vec2().hypot() <= FARTHEST);
        if !contour.is_finite() || !is_near {
            return Err(OffsetError::Coordinate(index));
        }
    }
    let depths = depths(contours);
    let mut result = Compensated::default();
    for (index, (contour, outline)) in contours.iter().zip(&outlines).enumerate() {
        if !contour.is_closed || contour.segments.is_empty() || kerf == 0.0 {
            result.contours.push(contour.clone());
            result.sources.push(index);
            continue;
        }
        let is_outer = depths[index].is_multiple_of(2);
        let is_left_inside = signed_area(outline) > 0.0;
        // Millimetres to the left.
        let left = kerf / 2.0 * 1e3 * if is_outer == is_left_inside { -1.0 } else { 1.0 };
        let place = || {
            let rect = contour.bounds();
            let (centre, size) = (rect.center(), rect.size());
            format!(
                "contour {index} (from 0), {:.4} mm x {:.4} mm around x {:.4} mm, y {:.4} mm",
                size.width * 1e3,
                size.height * 1e3,
                centre.x * 1e3,
                centre.y * 1e3
            )
        };
        match offset(contour, left) {
            Err(Crossing) => {
                let text = format!("{} crosses itself and is left as drawn: no kerf", place());
                result.notes.push(FileNote { line: 0, text });
                result.contours.push(contour.clone());
                result.sources.push(index);
            }
            Ok(moved) if moved.is_empty() => {
                let text = format!("{} vanishes under a kerf of {:.4} mm", place(), kerf * 1e3);
                result.notes.push(FileNote { line: 0, text });
            }
            Ok(moved) => {
                result.sources.extend(moved.iter().map(|_| index));
                result.contours.extend(moved);
            }
        }
    }
    Ok(result)
}

/// The contour crosses or touches itself.
struct Crossing;

/// A closed contour moved to its left [mm].
fn offset(contour: &Contour, left: f64) -> Result<Vec<Contour>, Crossing> {
    let line = arcs::polyline(contour);
    if line.vertex_count() < 2 {
        return Ok(Vec::new());
    }
    if line.scan_for_self_intersect() {
        return Err(Crossing);
    }
    let options = PlineOffsetOptions { offset_dist_eps: 1e-5, ..PlineOffsetOptions::new() };
    let moved = line.parallel_offset_opt(left, &options);
    Ok(moved.iter().filter_map(arcs::contour).collect())
}

#[cfg(test)]
mod tests;
