//! Whether a machine may rest where `home_axes` says: the tool in its area, and the mechanism away from
//! its singularities, of either kind, and collisions: joints may pass some of them, but none is a place
//! to wait at. The axes' own limits are compared with their home beside them.

use crate::document::{Diagnostics, Quantity};
use crate::kinematics::Mechanism;
use crate::limits::WorkArea;
use crate::quantity::Travel;

/// Rounding allowed at the edge of the area [m].
const ROUNDING: f64 = 1e-9;

/// Compares where the axes stand by `values` with `area` and the margins of `mechanism`.
pub(super) fn check<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    chain: &M::ChainState,
    values: &[Quantity<Travel>],
    area: &WorkArea,
    diagnostics: &mut Diagnostics,
) {
    let Some(span) = values.first().map(|value| value.span) else { return };
    let tool = mechanism.pose(chain).position;
    for (row, name) in ["x", "y", "z"].into_iter().enumerate() {
        let (lower, upper) = (area.lower[row], area.upper[row]);
        // False for a place that is not a number too.
        let inside = tool[row] >= lower - ROUNDING && tool[row] <= upper + ROUNDING;
        if !inside {
            diagnostics.contradict(
                span,
                format!(
                    "with `home_axes` the tool rests outside the area: {name} is {:.6} m, the area is \
                     from {lower} m to {upper} m",
                    tool[row]
                ),
                "change `home_axes` so that the tool is in the area, or widen the area",
            );
        }
    }
    for margin in mechanism.margins(chain) {
        let kept = margin.value >= margin.limit;
        if !kept {
            diagnostics.contradict(
                span,
                format!(
                    "with `home_axes` the mechanism rests too near to a singularity or a collision: \
                     `{}` is {:.6}, and must be {} or more",
                    margin.name, margin.value, margin.limit
                ),
                "change `home_axes` to a configuration farther from it",
            );
        }
    }
}
