//! Whether a job stays where the machine can go, told before it is planned.
//!
//! What is found here is no refusal: a job that is not surely within reach is planned as a whole before
//! any of it is sent, and that tells what is wrong, and where.

use machine::kinematics::Joints;
use machine::{Axis, Machine, Mechanism, MechanismVisitor, PathLimits, Pose, WorkArea, ZMeaning};
use messages::math;
use nalgebra::Vector3;

use super::{Job, MarkingSpeed};
use crate::drawing::{Action, Corners, Curve, Step};
use crate::geometry::attitude::AttitudeLaw;
use crate::geometry::bezier;
use crate::joint_space::configuration::branches;

/// How far apart points of a path are looked at [m].
const STEP: f64 = 1e-3;

/// What the digits of a program may hide [m].
const DIGITS: f64 = 1e-5;

/// Jobs on joints that turn are planned before they begin if they are estimated to last no longer than
/// this [s]: that is quickly done, and tells more than single points can.
const SHORT: f64 = 60.0;

/// Jobs that are estimated to last longer may be too long to be planned [s].
const LONG: f64 = 86_400.0;

impl Job {
    /// Whether everything in it lies within the area and within the joints' travel, and no light is too
    /// short for the source: then a run sends its first setpoints while the rest is still being planned, else all of
    /// it is planned before.
    pub fn is_surely_within_reach(&self, machine: &Machine) -> bool {
        let is_plain = self.surface.is_none() && self.attitude == AttitudeLaw::Level;
        let laser = &machine.laser;
        let may_be_too_short = laser.off_delay > laser.on_delay;
        is_plain
            && !may_be_too_short
            && self.time(machine) < LONG
            && machine.mechanism.visit(Within { job: self, machine })
    }
}

impl Job {
    /// How long it is estimated to take [s].
    fn time(&self, machine: &Machine) -> f64 {
        let rapid = self.rapid.unwrap_or(machine.path.rapid);
        let limits = PathLimits { rapid, ..machine.path };
        let fixed = match self.marking.speed {
            Some(MarkingSpeed::Constant(speed)) => Some(speed),
            Some(MarkingSpeed::Optimum) | None => None,
        };
        let speed = |asked: Option<f64>| fixed.or(asked).unwrap_or(limits.speed).min(limits.speed);
        self.estimate(&limits, &speed)
    }
}

struct Within<'a> {
    job: &'a Job,
    machine: &'a Machine,
}

impl MechanismVisitor for Within<'_> {
    type Output = bool;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> bool {
        let Self { job, machine } = self;
        let mut reach = Reach::new(mechanism, machine);
        let tolerance = job.marking.tolerance.unwrap_or(machine.path.tolerance);
        reach.allow(tolerance);
        let mut extent = Extent::at(job.drawing.start);
        if let (true, Some(survey)) = (reach.is_linear, &job.survey) {
            // The first reading of a program has found its extent.
            let facts = &survey.facts;
            reach.allow(survey.tolerance);
            for mut corner in [facts.lower, facts.upper] {
                if machine.gcode.z == ZMeaning::Ignored {
                    corner[2] = extent.place.z;
                }
                extent.add(corner.into());
            }
            return extent.corners().all(|corner| reach.holds_point(&corner));
        }
        if let (true, Some(composition)) = (reach.is_linear, &job.composition) {
            if let Some((bounds, [low, high])) = composition.bounds().zip(composition.heights()) {
                extent.add(Vector3::new(bounds.x0, bounds.y0, low));
                extent.add(Vector3::new(bounds.x1, bounds.y1, high));
            }
            return extent.corners().all(|corner| reach.holds_point(&corner));
        }
        if !reach.is_linear && job.time(machine) <= SHORT {
            return false;
        }
        let Ok(steps) = job.steps() else { return false };
        for step in steps {
            let Ok(step) = step else { return false };
            if !reach.holds(&step, &mut extent) {
                return false;
            }
        }
        // Where the joints go straight with the tool, they are farthest out at the corners.
        !reach.is_linear || extent.corners().all(|corner| reach.holds_point(&corner))
    }
}

/// The box around what is drawn.
struct Extent {
    lower: Vector3<f64>,
    upper: Vector3<f64>,
    place: Vector3<f64>,
}

impl Extent {
    fn at(place: Vector3<f64>) -> Self {
        Self { lower: place, upper: place, place }
    }

    fn add(&mut self, point: Vector3<f64>) {
        self.lower = self.lower.inf(&point);
        self.upper = self.upper.sup(&point);
    }

    fn corners(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        (0..8_usize).map(|corner| {
            Vector3::from_fn(
                |row, _| {
                    if corner >> row & 1 == 0 { self.lower[row] } else { self.upper[row] }
                },
            )
        })
    }
}

/// What the joints of a machine can reach.
pub(super) struct Reach<'a, const N: usize, M: Mechanism<N>> {
    branches: Vec<M::Branch>,
    mechanism: M,
    area: &'a WorkArea,
    axes: &'a [Axis],
    is_linear: bool,
    /// How far a smoothed path may go beyond the drawn one [m].
    margin: f64,
    /// What is forgiven at a soft limit [m or rad].
    rounding: f64,
    home: Joints<N>,
    /// The joints at the last point.
    near: Joints<N>,
}

impl<'a, const N: usize, M: Mechanism<N>> Reach<'a, N, M> {
    pub(super) fn new(mechanism: M, machine: &'a Machine) -> Self {
        let home = Joints::<N>::from_fn(|axis, _| machine.home_joints[axis]);
        Self {
            branches: branches(&mechanism, &home),
            is_linear: mechanism.is_linear(),
            mechanism,
            area: &machine.area,
            axes: &machine.axes,
            margin: DIGITS,
            rounding: 0.0,
            home,
            near: home,
        }
    }

    /// Leaves no room, and forgives `rounding` at the edges of the area and at soft limits [m or rad].
    pub(super) fn rounding(self, rounding: f64) -> Self {
        Self { margin: -rounding, rounding, ..self }
    }

    /// Leaves room for a path that may be `tolerance` from the drawn line [m].
    fn allow(&mut self, tolerance: f64) {
        self.margin = self.margin.max(2.0 * tolerance + DIGITS);
    }

    fn holds(&mut self, step: &Step, extent: &mut Extent) -> bool {
        let curve = match &step.action {
            Action::Corners(Corners::Blend(Some(tolerance))) => {
                self.allow(*tolerance);
                return true;
            }
            Action::Mark { curve, .. } | Action::Feed { curve, .. } => *curve,
            Action::Rapid { to } => Curve::Line { from: extent.place, to: *to },
            Action::Trace { points, .. } => {
                let count = (bezier::length(points) / STEP).ceil().max(1.0) as usize;
                let beyond = bezier::beyond_chords(points, count);
                extent.place = points[3];
                return bezier::samples(points, count)
                    .all(|point| self.holds_around(&point, &beyond, extent));
            }
            // Only planning tells what the tool's turns do.
            Action::Follow { .. } => return false,
            _ => return true,
        };
        extent.place = curve.to();
        if let (true, Curve::Line { from, to }) = (self.is_linear, curve) {
            extent.add(from);
            extent.add(to);
            return true;
        }
        let count = (curve.length() / STEP).ceil().max(1.0) as u64;
        // How far the curve may go beyond its points.
        let beyond = match curve {
            Curve::Line { .. } => Vector3::zeros(),
            Curve::Arc { major, minor, sweep, .. } => {
                let sagitta = 1.0 - math::cos(sweep / count as f64 / 2.0);
                major.zip_map(&minor, |major, minor| {
                    (major * major + minor * minor).sqrt() * sagitta
                })
            }
        };
        // A dense polyline's chords are looked at by their ends.
        (1..=count).all(|index| {
            let point = curve.point(index as f64 / count as f64);
            self.holds_around(&point, &beyond, extent)
        })
    }

    /// Whether it holds a point of a curve that goes `beyond` its points; takes it into the `extent`.
    fn holds_around(
        &mut self,
        point: &Vector3<f64>,
        beyond: &Vector3<f64>,
        extent: &mut Extent,
    ) -> bool {
        extent.add(point - beyond);
        extent.add(point + beyond);
        self.is_linear || self.holds_point(point)
    }

    /// Whether the tool can be at a point [m], level, and with the joints in the turns of home.
    pub(super) fn holds_from_home(&mut self, point: &Vector3<f64>) -> bool {
        self.near = self.home;
        self.holds_point(point)
    }

    fn holds_point(&mut self, point: &Vector3<f64>) -> bool {
        let inside = (0..3).all(|row| {
            let margin =
                if self.area.lower[row] < self.area.upper[row] { self.margin } else { 0.0 };
            let (lower, upper) = (self.area.lower[row] + margin, self.area.upper[row] - margin);
            (lower..=upper).contains(&point[row])
        });
        inside
            && (0..self.branches.len()).any(|branch| {
                let pose = Pose::at(*point);
                let Ok(joints) = self.mechanism.inverse(&pose, self.branches[branch], &self.near)
                else {
                    return false;
                };
                let rounding = self.rounding;
                let within = |(axis, joint): (&Axis, &f64)| {
                    let [lower, upper] = axis.limits.position;
                    (lower - rounding..=upper + rounding).contains(joint)
                };
                let holds = self.axes.iter().zip(joints.iter()).all(within);
                if holds {
                    self.near = joints;
                }
                holds
            })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    fn is_within(program: &str, settings: &[&str]) -> bool {
        let machine = Machine::builtin();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("program.nc");
        std::fs::write(&path, format!("G21 G90\n{program}")).unwrap();
        let settings: Vec<machine::Override> =
            settings.iter().map(|setting| setting.parse().unwrap()).collect();
        Job::read(&path, &settings, &machine).unwrap().is_surely_within_reach(&machine)
    }

    #[test]
    fn a_job_with_a_wide_tolerance_is_not_surely_within_reach_near_an_edge() {
        let near = "M3 S500\nG1 X99.9 F3000\nG1 Y20\n";
        assert!(is_within(near, &[]));
        assert!(!is_within(&format!("G64 P0.1\n{near}"), &[]));
        assert!(!is_within(near, &["marking.tolerance=0.1 mm"]));
        assert!(is_within(near, &["marking.tolerance=0.01 mm"]));
    }

    #[test]
    fn a_job_that_may_be_too_long_is_not_surely_within_reach() {
        assert!(!is_within("G4 P80000\nG4 P80000\n", &[]));
        assert!(is_within("G4 P1000\n", &[]));
    }
}
