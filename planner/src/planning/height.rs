//! How low the tool goes: never below what is written.

use machine::Mechanism;

use super::Planning;
use crate::geometry::contour::Contour;

/// How far a chord may lie from a curve whose depth is told [m].
const CHORD: f64 = 1e-6;

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// Lets the tool go as low as `contour` is written.
    pub(super) fn go_as_low_as(&mut self, contour: &Contour) {
        if !self.task.z_is_height {
            return;
        }
        let lowest = &mut self.front.lowest[1];
        contour.visit(0.0, contour.length(), CHORD, &mut |point| {
            *lowest = lowest.min(point[2]);
            true
        });
        self.hold_height();
    }

    /// Keeps flights from going lower than the paths that they join.
    pub(super) fn hold_height(&mut self) {
        if self.task.z_is_height {
            self.limits.lowest = self.front.lowest[0].min(self.front.lowest[1]);
        }
    }
}
