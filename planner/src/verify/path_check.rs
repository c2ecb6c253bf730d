//! How far the tool strays from every stroke of a plan (source 002, last page): as the controller runs it, and
//! as it would with the joints interpolated between knots, so many that the tool stays within tolerance.
//!
//! The strokes are taken as planned: on the surface, turned as their places ask.

use machine::kinematics::{Joints, KinematicsError};
use machine::path_check::{Aim, Curve, Deviation, Interpolation};
use machine::surface::Surface;
use machine::{Mechanism, MechanismVisitor};
use messages::Setpoint;
use messages::time::SETPOINT_TIME;
use nalgebra::Vector3;

use crate::geometry::attitude::AttitudeLaw;
use crate::geometry::path::Path;
use crate::law::time_law::TimeLaw;
use crate::plan::{Plan, sampler};
use crate::sampling::sampler::Sampler;
use crate::trajectory::{Errand, Motion, Piece};
use crate::verify::interpolation::between;

/// The most knots of a stroke.
const MOST_KNOTS: usize = 4096;

/// Into how many parts a cycle is divided to look at the executed motion. A cubic that fits both ends in
/// place and speed strays most in the middle, unless the jerk steps between them.
const PARTS: u32 = 8;

/// The ways of interpolating that are compared, in the order of [`StrokeCheck::interpolated`].
pub const INTERPOLATIONS: [Interpolation; 3] =
    [Interpolation::Linear, Interpolation::NaturalCubic, Interpolation::NotAKnot];

/// What became of one stroke.
#[derive(Debug, Clone, PartialEq)]
pub struct StrokeCheck {
    /// Its number, from 1.
    pub stroke: u64,
    /// Line of the job file, 0 for none.
    pub line: u64,
    /// How far the tool strays between the setpoints of each millisecond, joined as the controller joins
    /// them.
    pub executed: Deviation,
    /// By way of interpolating; `None` where 4096 knots are not enough.
    pub interpolated: [Option<Subdivided>; 3],
}

/// A stroke of which segments were halved until the tool strayed by no more than was allowed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Subdivided {
    /// Knots, both ends included.
    pub knots: usize,
    /// What is left.
    pub deviation: Deviation,
}

impl Plan {
    /// Checks all strokes, on `surface` where they lie on one; the tool may stray by `tolerance` [m] from
    /// where it should be at the same parameter of the path.
    ///
    /// # Errors
    /// Where a chain does not close, or the path leaves its surface.
    pub fn path_check(
        &self,
        surface: Option<&Surface>,
        tolerance: f64,
    ) -> Result<Vec<StrokeCheck>, KinematicsError> {
        self.visit(Checking { plan: self, surface, tolerance })
    }
}

struct Checking<'a> {
    plan: &'a Plan,
    surface: Option<&'a Surface>,
    tolerance: f64,
}

impl MechanismVisitor for Checking<'_> {
    type Output = Result<Vec<StrokeCheck>, KinematicsError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let trajectory = &self.plan.trajectory;
        let mut checks = Vec::new();
        let Some(mut sampler) = sampler(self.plan, mechanism.clone(), 1) else { return Ok(checks) };
        let mut open: Option<Stroke<'_, N, M>> = None;
        let mut before: Option<Setpoint> = None;
        while let Some(now) = sampler.next() {
            let Some(from) = before.replace(now) else { continue };
            for part in 1..PARTS {
                let share = f64::from(part) / f64::from(PARTS);
                let time = (from.sequence as f64 + share) * SETPOINT_TIME;
                let Some(piece) = trajectory.piece_at(time) else { continue };
                let Motion::Path { path, law, errand: Errand::Marks } = &piece.motion else {
                    continue;
                };
                if !open.as_mut().is_some_and(|stroke| stroke.goes_on(piece, path, law)) {
                    checks.extend(open.take().map(|stroke| self.close(stroke)).transpose()?);
                }
                let stroke = open.get_or_insert_with(|| Stroke {
                    number: piece.stroke,
                    line: piece.line,
                    range: [law.places().start, law.places().end],
                    executed: Deviation::default(),
                    curve: Followed {
                        mechanism: &mechanism,
                        attitude: &trajectory.attitude,
                        surface: self.surface,
                        path,
                        near: Vec::new(),
                    },
                });
                let place = law.at(time - piece.start).position;
                stroke.curve.remember(place, stroke.range, &sampler);
                let q = between(&from, &now, share);
                let strays = stroke.curve.strays(place, &q, stroke.range, true)?;
                stroke.executed = stroke.executed.worst(strays);
            }
        }
        checks.extend(open.map(|stroke| self.close(stroke)).transpose()?);
        Ok(checks)
    }
}

impl Checking<'_> {
    /// Interpolates a stroke of which all has been seen.
    fn close<const N: usize, M: Mechanism<N>>(
        &self,
        stroke: Stroke<'_, N, M>,
    ) -> Result<StrokeCheck, KinematicsError> {
        let infinite = f64::INFINITY;
        let tolerance = Deviation {
            matched: self.tolerance,
            geometric: infinite,
            surface: infinite,
            axis: infinite,
        };
        let mut interpolated = [None; 3];
        for (found, interpolation) in interpolated.iter_mut().zip(INTERPOLATIONS) {
            let (range, curve) = (stroke.range, &stroke.curve);
            let near = &curve.nearest_to(range[0]).joints;
            match curve.subdivided(range, interpolation, &tolerance, MOST_KNOTS, near) {
                Ok((path, deviation)) => {
                    *found = Some(Subdivided { knots: path.knots().len(), deviation });
                }
                Err(error) if error.code == "too_many_knots" => {}
                Err(error) => return Err(error),
            }
        }
        let Stroke { number, line, executed, .. } = stroke;
        Ok(StrokeCheck { stroke: number, line, executed, interpolated })
    }
}

/// A stroke while it is gone along.
struct Stroke<'a, const N: usize, M: Mechanism<N>> {
    number: u64,
    line: u64,
    /// The parameters of its ends [m].
    range: [f64; 2],
    executed: Deviation,
    curve: Followed<'a, N, M>,
}

impl<const N: usize, M: Mechanism<N>> Stroke<'_, N, M> {
    /// Whether `piece` belongs to it: the same, or the next one along the same path.
    fn goes_on(&mut self, piece: &Piece, path: &Path, law: &TimeLaw) -> bool {
        /// Rounding of a place along a path [m].
        const ROUNDING: f64 = 1e-9;
        let places = law.places();
        let is_near =
            places.start <= self.range[1] + ROUNDING && places.end >= self.range[1] - ROUNDING;
        let is_same =
            core::ptr::eq(self.curve.path, path) && self.number == piece.stroke && is_near;
        if is_same {
            self.range[1] = self.range[1].max(places.end);
        }
        is_same
    }
}

/// A path that the joints follow, with what was found of them on the way.
struct Followed<'a, const N: usize, M: Mechanism<N>> {
    mechanism: &'a M,
    attitude: &'a AttitudeLaw,
    surface: Option<&'a Surface>,
    path: &'a Path,
    /// By growing place.
    near: Vec<Near<N, M>>,
}

/// How the joints stand somewhere on a path.
struct Near<const N: usize, M: Mechanism<N>> {
    place: f64,
    joints: Joints<N>,
    branch: M::Branch,
    chain: M::ChainState,
}

impl<const N: usize, M: Mechanism<N>> Followed<'_, N, M> {
    /// Remembers how the joints of `sampler` stand about `place`, unless that is known already.
    fn remember(&mut self, place: f64, range: [f64; 2], sampler: &Sampler<N, M>) {
        let apart = (range[1] - range[0]) / MOST_KNOTS as f64;
        if self.near.last().is_some_and(|last| place - last.place < apart) {
            return;
        }
        let (joints, branch, chain) = sampler.stands();
        self.near.push(Near { place, joints, branch, chain });
    }

    /// What is known nearest to `place`.
    fn nearest_to(&self, place: f64) -> &Near<N, M> {
        let after = self.near.partition_point(|near| near.place <= place);
        let before = &self.near[after.max(1) - 1];
        match self.near.get(after) {
            Some(next) if next.place - place < place - before.place => next,
            _ => before,
        }
    }

    fn tool(&self, place: f64) -> Result<machine::kinematics::ToolMotion, KinematicsError> {
        self.attitude.apply(&self.path.tool(place, [1.0, 0.0, 0.0]))
    }
}

impl<const N: usize, M: Mechanism<N>> Curve<N> for Followed<'_, N, M> {
    fn wanted(&self, place: f64) -> Result<Aim, KinematicsError> {
        Ok(Aim::of(&self.tool(place)?.pose()))
    }

    fn joints(&self, place: f64, _previous: &Joints<N>) -> Result<Joints<N>, KinematicsError> {
        let near = self.nearest_to(place);
        let motion = self.mechanism.joint_motion(&self.tool(place)?, near.branch, &near.joints)?;
        Ok(motion.position)
    }

    fn reached(&self, place: f64, q: &Joints<N>) -> Result<Aim, KinematicsError> {
        let near = self.nearest_to(place);
        Ok(Aim::of(&self.mechanism.locate(q, near.branch, Some(&near.chain))?))
    }

    fn height(&self, point: &Vector3<f64>) -> Result<f64, KinematicsError> {
        self.surface.map_or(Ok(0.0), |surface| surface.height(<[f64; 3]>::from(*point)))
    }
}
