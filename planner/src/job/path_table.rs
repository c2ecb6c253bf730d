//! The job file's table of a path in space.

use core::f64::consts::TAU;

use machine::document::{Diagnostics, Point, Positive, Quantity};
use machine::quantity::{Angle, Length};
use machine::table;
use nalgebra::Vector3;

use crate::drawing::{Action, Curve, Drawing, Power, Step};
use crate::geometry::attitude::turned;

table! {
    /// A path in space, marked in one go: exactly one of `points` and `circle`.
    pub struct PathTable {
        /// Where its origin lies as seen from the machine's home.
        pub at: Option<Point>,
        /// Corners [x, y] or [x, y, z] as seen from its origin, joined by straight lines.
        pub points: Option<Vec<Point>>,
        /// A circle around its origin.
        pub circle: Option<CircleTable>,
    }
}

table! {
    /// A circle, gone round once counter-clockwise from its own x.
    pub struct CircleTable {
        /// Its radius.
        pub radius: Quantity<Length, Positive>,
        /// How its plane is turned about x, before `pitch`.
        pub roll: Quantity<Angle> = "0 deg",
        /// How its plane is turned about y.
        pub pitch: Quantity<Angle> = "0 deg",
    }
}

/// The drawing of a path at `power`, reached from `home` [m], as asked for in `line` of the job
/// `name`; what is wrong with the table goes to `diagnostics`.
pub(super) fn draw(
    table: &PathTable,
    name: &str,
    power: f64,
    home: Vector3<f64>,
    line: u64,
    diagnostics: &mut Diagnostics,
) -> Drawing {
    let at = table.at.as_ref().map_or(Vector3::zeros(), |at| Vector3::from(at.value));
    let origin = home + at;
    let curves = match (&table.points, &table.circle) {
        (Some(points), None) => {
            if points.len() < 2 {
                let help = "write points such as [[\"0 mm\", \"0 mm\"], [\"10 mm\", \"5 mm\"]]";
                let text = "a path has two points at least".to_owned();
                diagnostics.contradict(table.span, text, help);
            }
            let corner = |point: &Point| origin + Vector3::from(point.value);
            let lines = points.windows(2);
            lines.map(|pair| Curve::Line { from: corner(&pair[0]), to: corner(&pair[1]) }).collect()
        }
        (None, Some(circle)) => {
            let plane = turned(circle.roll.value, circle.pitch.value, 0.0);
            vec![Curve::Arc {
                centre: origin,
                major: plane.column(0) * circle.radius.value,
                minor: plane.column(1) * circle.radius.value,
                start: 0.0,
                sweep: TAU,
                rise: Vector3::zeros(),
            }]
        }
        _ => {
            let help = "write one of `points` and a table [path.circle]";
            diagnostics.contradict(table.span, "which path is not clear".to_owned(), help);
            Vec::new()
        }
    };
    let power = Power { level: power, follows_speed: false };
    let mark = |curve| Step { action: Action::Mark { curve, speed: None, power }, line };
    let steps = curves.into_iter().map(mark).collect();
    Drawing { name: name.to_owned(), start: home, steps, notes: Vec::new() }
}
