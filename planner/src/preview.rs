//! What a job draws: its marks, and the ways in the dark between them, in their places on the machine, before any
//! of it is timed.

mod simplified;

use machine::Machine;
use messages::artwork::Artwork;
use messages::plan::Bounds;
use nalgebra::Vector3;

use crate::error::PlanError;
use crate::geometry::contour::{Contour, GAP};
use crate::geometry::operation::{Operation, OperationKind};
use crate::job::Job;
use crate::planning::run::{path_limits, unplanned};
use simplified::{FINEST, Simplified};

/// What a job draws, by no more points than were asked for.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Preview {
    /// What is marked, in order.
    pub marks: Vec<PreviewLine>,
    /// The ways in the dark, straight between their ends, in order.
    pub travels: Vec<PreviewLine>,
    /// The box around all that is marked; `None` where nothing is.
    pub bounds: Option<Bounds>,
    /// How far a line may be from what it stands for [m].
    pub tolerance: f64,
}

/// A line at one power.
#[derive(Debug, Clone, PartialEq)]
pub struct PreviewLine {
    /// Its points, machine frame [m]; a dot has one.
    pub points: Vec<[f64; 3]>,
    /// Power of the laser [fraction of full scale], 0 in the dark.
    pub power: f64,
    /// Whether it begins where the line before it ends, lit like that.
    pub goes_on: bool,
}

/// What `job` draws on `machine`, by no more than `most` points of marks and as many of travels.
///
/// # Errors
/// A job that cannot be read on, or a place beyond an edge of its surface.
pub fn preview(machine: &Machine, job: &Job, most: usize) -> Result<Preview, PlanError> {
    let mut queue = unplanned(machine, job, &path_limits(machine, job))?;
    let mut pen = Pen::new(job.drawing.start, most);
    let mut number = 0;
    while let Some(operation) = queue.get(number)? {
        pen.add(operation);
        number += 1;
        queue.release(number);
    }
    Ok(pen.finish())
}

/// Why there is no box around a job.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum NoOutline {
    /// It marks nothing.
    Empty,
    /// A path of it turns the tool, so that it lies in no plane.
    Turned {
        /// Line of the job file, 0 for none.
        line: u64,
    },
    /// It cannot be read on.
    Refused(PlanError),
}

/// The box around all that `job` marks, flat where it is put on a surface; `None` where it marks nothing.
///
/// # Errors
/// Where there can be none.
pub(crate) fn flat_bounds(machine: &Machine, job: &Job) -> Result<Option<Bounds>, NoOutline> {
    let flat = Job { surface: None, ..job.clone() };
    let mut queue =
        unplanned(machine, &flat, &path_limits(machine, job)).map_err(NoOutline::Refused)?;
    let mut bounds = None;
    let mut number = 0;
    while let Some(operation) = queue.get(number).map_err(NoOutline::Refused)? {
        match &operation.kind {
            OperationKind::Path(contour) if contour.is_turned() => {
                return Err(NoOutline::Turned { line: operation.line });
            }
            OperationKind::Path(contour) => {
                let lit = contour.stretches().filter(|(demand, _)| demand.power > 0.0);
                let points = lit
                    .flat_map(|(demand, to)| contour.points(demand.from, to, Artwork::CHORD_ERROR));
                points.for_each(|point| Bounds::widen(&mut bounds, &point));
            }
            OperationKind::Dot(dot) => Bounds::widen(&mut bounds, &dot.at.into()),
            _ => {}
        }
        number += 1;
        queue.release(number);
    }
    Ok(bounds)
}

/// Draws operations one after the other.
struct Pen {
    place: Vector3<f64>,
    marks: Simplified,
    travels: Simplified,
    bounds: Option<Bounds>,
    /// Whether the last line was lit, and the next may go on from it.
    is_lit: bool,
}

impl Pen {
    fn new(place: Vector3<f64>, most: usize) -> Self {
        let (marks, travels) = (Simplified::new(most), Simplified::new(most));
        Self { place, marks, travels, bounds: None, is_lit: false }
    }

    fn add(&mut self, operation: &Operation) {
        match &operation.kind {
            OperationKind::Path(contour) => self.path(contour),
            OperationKind::Rapid(to) => self.go(*to),
            OperationKind::Dot(dot) => {
                self.go(dot.at);
                self.is_lit = false;
                let power = dot.exposures.iter().map(|(_, power)| *power).fold(0.0, f64::max);
                Bounds::widen(&mut self.bounds, &dot.at.into());
                self.mark(vec![dot.at.into()], power);
                self.is_lit = false;
            }
            OperationKind::Rest(_)
            | OperationKind::Output { .. }
            | OperationKind::Frequency(_)
            | OperationKind::Pause => self.is_lit = false,
        }
    }

    fn path(&mut self, contour: &Contour) {
        if !contour.goes_on_from_before() {
            self.is_lit = false;
        }
        self.go(contour.start().point);
        let mut stretches = contour.stretches().peekable();
        while let Some((demand, mut to)) = stretches.next() {
            // Another speed is no other line.
            while let Some((_, end)) = stretches.next_if(|(next, _)| next.power == demand.power) {
                to = end;
            }
            if demand.power > 0.0 {
                let mut points = contour.points(demand.from, to, FINEST);
                // The box is that of the job, however coarse its lines become.
                points.iter().for_each(|point| Bounds::widen(&mut self.bounds, point));
                if self.marks.tolerance() > FINEST {
                    points = contour.points(demand.from, to, self.marks.tolerance());
                }
                self.mark(points, demand.power);
            } else {
                self.travel(contour.points(demand.from, to, self.travels.tolerance()));
            }
        }
        self.place = contour.end().point;
    }

    fn go(&mut self, to: Vector3<f64>) {
        let from = core::mem::replace(&mut self.place, to);
        if (to - from).norm() > GAP {
            self.travel(vec![from.into(), to.into()]);
        }
    }

    fn mark(&mut self, points: Vec<[f64; 3]>, power: f64) {
        let goes_on = core::mem::replace(&mut self.is_lit, true);
        self.marks.push(PreviewLine { points, power, goes_on });
    }

    fn travel(&mut self, points: Vec<[f64; 3]>) {
        self.is_lit = false;
        self.travels.push(PreviewLine { points, power: 0.0, goes_on: false });
    }

    fn finish(self) -> Preview {
        let Self { marks, travels, bounds, .. } = self;
        let tolerance = marks.tolerance();
        Preview { marks: marks.take(), travels: travels.take(), bounds, tolerance }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn of(program: &str, settings: &[&str], most: usize) -> Preview {
        let machine = Machine::builtin();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("program.nc");
        std::fs::write(&path, format!("G21 G90\n{program}")).unwrap();
        let settings: Vec<machine::Override> =
            settings.iter().map(|setting| setting.parse().unwrap()).collect();
        preview(&machine, &Job::read(&path, &settings, &machine).unwrap(), most).unwrap()
    }

    /// In whole micrometres from home.
    fn micrometres(line: &PreviewLine) -> Vec<[i64; 2]> {
        let home = Machine::builtin().home;
        let at =
            |point: &[f64; 3]| [0, 1].map(|row| ((point[row] - home[row]) * 1e6).round() as i64);
        line.points.iter().map(at).collect()
    }

    #[test]
    fn marks_have_their_powers_and_what_lies_between_is_travelled() {
        let found = of("M4 F3000\nG0 X1 Y2\nG1 X3 S500\nX4 S1000\nG0 X10\nG4 P10\n", &[], 100);
        let marks: Vec<_> =
            found.marks.iter().map(|line| (micrometres(line), line.power, line.goes_on)).collect();
        let right = [
            (vec![[1000, 2000], [3000, 2000]], 0.5, false),
            (vec![[3000, 2000], [4000, 2000]], 1.0, true),
        ];
        assert_eq!(marks, right);
        let travels: Vec<_> = found.travels.iter().map(micrometres).collect();
        assert_eq!(travels, [[[0, 0], [1000, 2000]], [[4000, 2000], [10000, 2000]]]);
        let bounds = found.bounds.unwrap();
        let home = Machine::builtin().home;
        for (corner, right) in [(bounds.lower, [1e-3, 2e-3]), (bounds.upper, [4e-3, 2e-3])] {
            let off = [0, 1].map(|row: usize| (corner[row] - home[row] - right[row]).abs());
            assert!(off.iter().all(|off| *off < 1e-9), "{corner:?}");
        }
    }

    #[test]
    fn a_long_job_is_drawn_by_the_points_asked_for_and_loses_none_of_its_extent() {
        let mut program = "M3 S500 F3000\n".to_owned();
        for row in 0..500 {
            let y = f64::from(row) * 0.02;
            program += &format!("G0 X0 Y{y}\nG2 X5 Y{y} I2.5 J0\n");
        }
        let all = of(&program, &[], usize::MAX);
        let few = of(&program, &[], 300);
        assert!(all.marks.iter().map(|line| line.points.len()).sum::<usize>() > 3000);
        let count: usize = few.marks.iter().map(|line| line.points.len()).sum();
        assert!((50..=300).contains(&count), "{count}");
        assert!(few.tolerance > all.tolerance);
        let (all, few) = (all.bounds.unwrap(), few.bounds.unwrap());
        let sides = [(all.lower, few.lower), (all.upper, few.upper)];
        for (one, other) in sides {
            assert!((0..3).all(|row| (one[row] - other[row]).abs() < 2e-5), "{one:?} {other:?}");
        }
    }

    #[test]
    fn a_job_that_marks_nothing_has_no_bounds() {
        let found = of("G0 X1\n", &[], 100);
        assert_eq!((found.bounds, found.marks.len(), found.travels.len()), (None, 0, 1));
    }
}
