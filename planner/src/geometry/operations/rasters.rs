//! The rows of a raster: short steps between two of them are left out.

use nalgebra::Vector3;

use super::Operations;
use crate::drawing::Note;
use crate::geometry::contour::{Contour, GAP};
use crate::geometry::operation::{Operation, OperationKind};
use crate::light::Policy;

/// A step between two rows of a raster is shorter than this [m], and than this share of the rows.
const ROW_STEP: f64 = 1e-3;

const ROW_SHARE: f64 = 0.05;

/// What a raster's rows and steps are known by.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    from: Vector3<f64>,
    to: Vector3<f64>,
    /// Directions at the start and at the end.
    begins: Vector3<f64>,
    ends: Vector3<f64>,
    length: f64,
    is_constant: bool,
    is_lit: bool,
}

/// A lit step between two lines that may be rows of a raster.
#[derive(Debug, Clone, Copy)]
pub(super) struct RowStep {
    way: Vector3<f64>,
    to: Vector3<f64>,
    is_left_out: bool,
}

impl Extent {
    pub(super) fn of(contour: &Contour) -> Self {
        let (start, end) = (contour.start(), contour.end());
        Self {
            from: start.point,
            to: end.point,
            begins: start.first.normalize(),
            ends: end.first.normalize(),
            length: contour.length(),
            is_constant: contour.policy == Policy::Constant,
            is_lit: contour.is_lit(),
        }
    }
}

impl Operations<'_> {
    /// Leaves out a short step between two rows of a raster: dark it only leads to the next row; lit at one
    /// speed it could only be marked by two loops, and it lies within the rows' own width. Two lines that go
    /// to and fro once, such as those of a slot, are no raster: it takes a second step like the first.
    pub(super) fn leave_row_step(&mut self, next: &Extent) {
        let [Some(row), Some(step)] = self.before else { return };
        if !is_row_step(&row, &step, next) {
            return;
        }
        if !step.is_lit {
            self.leave_path(0);
            return;
        }
        let way = step.to - step.from;
        let before = self.row_step.replace(RowStep { way, to: step.to, is_left_out: false });
        let Some(before) = before.filter(|before| before.is_followed_by(&row, &way)) else {
            return;
        };
        let line = self.leave_path(0);
        if !before.is_left_out {
            // The row between the two is the last path now.
            self.leave_path(1);
        }
        self.row_step = Some(RowStep { way, to: step.to, is_left_out: true });
        let text =
            "the steps between the rows of this raster are moved with the laser off: at constant \
                    speed they cannot be marked"
                .to_owned();
        if !self.notes.iter().any(|note| note.text == text) {
            self.notes.push(Note { line: line.unwrap_or(0), text });
        }
    }

    /// Leaves out a path with so many behind it; gives its line.
    fn leave_path(&mut self, behind: usize) -> Option<u64> {
        let is_path = |operation: &Operation| matches!(operation.kind, OperationKind::Path(_));
        let mut paths = (0..self.done.len()).rev().filter(|&index| is_path(&self.done[index]));
        let index = paths.nth(behind)?;
        let line = self.done.remove(index)?.line;
        if behind == 0 {
            self.leave_approach();
        }
        Some(line)
    }
}

impl RowStep {
    /// Whether a step of this `way` at the end of `row` is another one like it.
    fn is_followed_by(&self, row: &Extent, way: &Vector3<f64>) -> bool {
        /// How much the distances of rows differ by, as a share.
        const UNEVEN: f64 = 0.25;
        (row.from - self.to).norm() <= GAP && (way - self.way).norm() <= UNEVEN * self.way.norm()
    }
}

/// Whether `step` only leads from one row of a raster to the next.
fn is_row_step(row: &Extent, step: &Extent, next: &Extent) -> bool {
    let is_row = |part: &Extent| part.is_constant && part.is_lit;
    let most = ROW_STEP.min(ROW_SHARE * row.length.min(next.length));
    let meets = |one: Vector3<f64>, other: Vector3<f64>| (one - other).norm() <= GAP;
    is_row(row)
        && is_row(next)
        && (step.is_constant || !step.is_lit)
        && step.length <= most
        && row.ends.dot(&next.begins) < -0.99
        && row.ends.dot(&step.ends).abs() < 0.5
        && meets(row.to, step.from)
        && meets(step.to, next.from)
}
