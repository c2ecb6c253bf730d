//! The edges of areas of square cells.

use kurbo::Point;

use crate::{Contour, Segment};

/// Directions counterclockwise from right.
const STEPS: [(isize, isize); 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];

/// Edges between marked cells and others, with the marked ones on the left: outer contours counterclockwise,
/// holes clockwise. Cells that touch at a corner alone do not belong together.
pub(super) fn merged(
    columns: usize,
    rows: usize,
    cell: f64,
    is_marked: impl Fn(usize, usize) -> bool,
) -> Vec<Contour> {
    let is_marked = |column: isize, row: isize| {
        let within = (0..columns as isize).contains(&column) && (0..rows as isize).contains(&row);
        within && is_marked(column as usize, row as usize)
    };
    // Whether an edge leads from a corner in a direction: the cell on its left is marked, that on its right not.
    let leads = |(x, y): (isize, isize), direction: usize| {
        let (left, right) = match direction {
            0 => ((x, y), (x, y - 1)),
            1 => ((x - 1, y), (x, y)),
            2 => ((x - 1, y - 1), (x - 1, y)),
            _ => ((x, y - 1), (x - 1, y - 1)),
        };
        is_marked(left.0, left.1) && !is_marked(right.0, right.1)
    };
    let point = |(x, y): (isize, isize)| Point::new(x as f64 * cell, y as f64 * cell);
    // Of every corner whether the edge to the right of it has been followed: each contour has such edges.
    let mut followed = vec![false; (columns + 1) * (rows + 1)];
    let index = |(x, y): (isize, isize)| y as usize * (columns + 1) + x as usize;
    let mut contours = Vec::new();
    for row in 0..=rows as isize {
        for column in 0..columns as isize {
            let start = (column, row);
            if followed[index(start)] || !leads(start, 0) {
                continue;
            }
            let mut corners = Vec::new();
            let (mut at, mut direction) = (start, 0);
            loop {
                if direction == 0 {
                    followed[index(at)] = true;
                }
                at = (at.0 + STEPS[direction].0, at.1 + STEPS[direction].1);
                // To the left first: where two marked cells meet at a corner it stays at the same one.
                let turns = [direction + 1, direction, direction + 3].map(|turn| turn % 4);
                let next = turns.into_iter().find(|turn| leads(at, *turn)).unwrap_or(direction);
                if next != direction {
                    corners.push(point(at));
                }
                direction = next;
                if at == start && direction == 0 {
                    break;
                }
            }
            let first = corners.last().copied().unwrap_or_else(|| point(start));
            let segments = corners.into_iter().map(Segment::Line).collect();
            contours.push(Contour { start: first, segments, is_closed: true });
        }
    }
    contours
}
