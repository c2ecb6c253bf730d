//! What of a machine moves, and what ground it covers.

use nalgebra::Vector3;

use super::Place;

/// The moving parts of a mechanism at one joint position.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Bodies {
    /// Mass of all that moves [kg]; of tables and pivots that only turn, only what lies on them.
    pub moving_mass: f64,
    /// Motors, pivots, joints and tool, in the machine's own frame [m].
    pub points: Vec<Vector3<f64>>,
}

/// The box in x and y around all points of the bodies at `places`, from and to [m]; `None` without any.
///
/// It is that of joints and pivots: a machine file does not say how wide carriages and motors are.
pub fn footprint<'a>(places: impl IntoIterator<Item = &'a Place>) -> Option<[[f64; 2]; 2]> {
    let points = places.into_iter().flat_map(|place| &place.bodies.points);
    points.fold(None, |around, point| {
        let [x, y] = around.unwrap_or([[point.x; 2], [point.y; 2]]);
        let grown = |[from, to]: [f64; 2], at: f64| [from.min(at), to.max(at)];
        Some([grown(x, point.x), grown(y, point.y)])
    })
}
