//! The dark ends of paths, whose ways in and out take the place of them.

use machine::PathLimits;
use nalgebra::Vector3;

use super::Operations;
use crate::geometry::contour::{Contour, GAP};
use crate::geometry::operation::{Operation, OperationKind};
use crate::light::Policy;

impl Operations<'_> {
    /// Leaves out the way to the dark end of a path that is at one speed, whose run-out takes the place
    /// of it, where the tool goes on to `to` at the same height.
    pub(super) fn leave_dark_end(&mut self, to: &Vector3<f64>) {
        if !core::mem::take(&mut self.leaves_dark_end) {
            return;
        }
        if let Some(Operation { kind: OperationKind::Rapid(end), .. }) = self.done.back()
            && end.z == to.z
        {
            self.done.pop_back();
        }
    }

    /// Leaves a free move that only leads to a path to the approach of that.
    pub(super) fn leave_approach(&mut self) {
        if matches!(self.done.back(), Some(Operation { kind: OperationKind::Rapid(_), .. })) {
            self.done.pop_back();
        }
    }
}

/// A path of one speed without what is dark at its ends, which its run-in and run-out take the place
/// of, and where it ended. A path that `goes_on` does not end there.
pub(super) fn without_dark_ends(
    mut contour: Contour,
    goes_on: bool,
    limits: &PathLimits,
) -> (Contour, Option<Vector3<f64>>) {
    let is_whole = !goes_on && !contour.goes_on_from_before();
    if contour.policy == Policy::Proportional || !contour.is_lit() {
        let policy =
            if contour.is_lit() || !is_whole { contour.policy } else { Policy::Proportional };
        contour.policy = policy;
        return (contour, None);
    }
    let lit: Vec<(f64, f64)> = contour
        .stretches()
        .filter(|(demand, _)| demand.power > 0.0)
        .map(|(demand, to)| (demand.from, to))
        .collect();
    let (Some((from, _)), Some((_, to))) = (lit.first(), lit.last()) else {
        return (contour, None);
    };
    let from = if contour.goes_on_from_before() { 0.0 } else { *from };
    let to = if goes_on { contour.length() } else { *to };
    if from <= GAP && contour.length() - to <= GAP {
        return (contour, None);
    }
    let end = contour.end().point;
    let left = (contour.length() - to > GAP).then_some(end);
    match contour.part(from, to, limits) {
        Some(part) => (part, left),
        None => (contour, None),
    }
}
