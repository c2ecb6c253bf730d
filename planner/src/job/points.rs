//! A list of points, each marked by standing on it for a while.

use nalgebra::Vector3;

use crate::drawing::{Action, Drawing, Step};

/// Dots at `points` [m], each lit for `dwell` [s] at `power`, reached from `home` in their order.
/// `line` is the line of the job `name` that lists them.
pub fn draw(
    name: &str,
    points: &[Vector3<f64>],
    dwell: f64,
    power: f64,
    home: Vector3<f64>,
    line: u64,
) -> Drawing {
    let mut steps = Vec::with_capacity(2 * points.len());
    for point in points {
        steps.push(Step { action: Action::Rapid { to: *point }, line });
        steps.push(Step { action: Action::Dwell { time: dwell, lit: Some(power) }, line });
    }
    Drawing { name: name.to_owned(), start: home, steps, notes: Vec::new() }
}
