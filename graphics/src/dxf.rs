//! DXF drawings, text or binary, of releases 12 to 2018: lines, arcs, polylines,
//! splines, blocks, hatches and texts, seen from above.
//!
//! Pieces of the same layer and colour that touch end to end are joined into contours. Places are as the file has
//! them: its origin is kept.

mod areas;
mod codes;
mod colours;
mod draw;
mod file;
mod frame;
mod hatch;
mod record;
mod spline;
#[cfg(test)]
mod tests;
mod text;

use std::collections::HashMap;
use std::sync::Arc as Shared;

use crate::ReadError;
use crate::read::join::join;
use crate::read::notes::Notes;
use crate::shape::{Colour, Contour, Graphic, Shape};
use file::File;

/// A contour of one object, before it is joined to others.
#[derive(Debug)]
struct Piece {
    contour: Contour,
    layer: Shared<str>,
    colour: Colour,
    line: u64,
}

/// A shape that is filled or written, with as many pieces before it.
#[derive(Debug)]
struct Area {
    before: usize,
    shape: Shape,
}

/// Index and line of each piece of a layer and a colour.
type Groups = HashMap<(Shared<str>, Colour), Vec<(usize, u64)>>;

/// Reads a DXF file.
///
/// # Errors
///
/// Where it is no DXF file, with the line, or exceeds a bound of [`crate::read`].
pub fn read(bytes: &[u8]) -> Result<Graphic, ReadError> {
    let mut notes = Notes::default();
    let (pieces, areas) = drawn(bytes, &mut notes)?;
    Ok(Graphic { shapes: shapes(pieces, areas), notes: notes.finish(), ..Graphic::default() })
}

/// The lines of a file, and what is filled or written in it.
fn drawn(bytes: &[u8], notes: &mut Notes) -> Result<(Vec<Piece>, Vec<Area>), ReadError> {
    let text;
    let pairs = if bytes.starts_with(codes::SENTINEL) {
        codes::of_binary(bytes)?
    } else {
        text = crate::read::text(bytes).unwrap_or_else(|_| latin(bytes));
        codes::of_text(&text)?
    };
    let file = File::new(&pairs, notes)?;
    draw::pieces(&file, notes)
}

/// Bytes as characters: names in another code page are wrong, and all else is right.
fn latin(bytes: &[u8]) -> String {
    bytes.iter().map(|&byte| char::from(byte)).collect()
}

/// Joins the pieces of each layer and colour; shapes are in the order of their first pieces, areas between them.
fn shapes(pieces: Vec<Piece>, areas: Vec<Area>) -> Vec<Shape> {
    let mut groups = Groups::new();
    let mut contours = Vec::with_capacity(pieces.len());
    for (index, piece) in pieces.into_iter().enumerate() {
        groups.entry((piece.layer, piece.colour)).or_default().push((index, piece.line));
        contours.push(Some(piece.contour));
    }
    let mut shapes: Vec<(usize, Shape)> =
        areas.into_iter().map(|area| (area.before, area.shape)).collect();
    for ((layer, colour), members) in groups {
        let own = members.iter().filter_map(|&(index, _)| contours[index].take()).collect();
        for (first, contour) in join(own) {
            let (index, line) = members[first];
            let shape = Shape {
                contours: vec![contour],
                stroke: Some(colour),
                layer: Some(Shared::clone(&layer)),
                line,
                ..Shape::default()
            };
            shapes.push((index, shape));
        }
    }
    shapes.sort_by_key(|&(index, _)| index);
    shapes.into_iter().map(|(_, shape)| shape).collect()
}
