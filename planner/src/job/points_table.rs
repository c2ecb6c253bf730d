//! The job file's table of points.

use machine::document::{Point, Positive, Quantity};
use machine::quantity::Duration;
use machine::table;
use nalgebra::Vector3;

use super::file::Reading;
use super::{Job, JobError, points};

table! {
    /// A list of points, each marked by a dwell.
    pub struct PointsTable {
        /// Points [x, y] or [x, y, z] as seen from the machine's home.
        pub points: Vec<Point>,
        /// How long the laser stays on each.
        pub dwell: Quantity<Duration, Positive> = "10 ms",
    }
}

/// The job that marks points.
pub(super) fn read(table: &PointsTable, mut reading: Reading<'_>) -> Result<Job, JobError> {
    if table.points.is_empty() {
        let help = "write points such as [[\"10 mm\", \"5 mm\"]]";
        reading.diagnostics.contradict(table.span, "there is no point to mark".to_owned(), help);
    }
    let home = Vector3::from(reading.machine.home);
    let places: Vec<Vector3<f64>> =
        table.points.iter().map(|point| home + Vector3::from(point.value)).collect();
    let line = reading.line(table.span);
    let name = reading.stem("points");
    let drawing =
        points::draw(&name, &places, table.dwell.value, reading.beside.marking.level(), home, line);
    let job = reading.job_of(drawing);
    reading.finish(job)
}
