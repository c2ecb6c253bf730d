//! How far the tool strays from a curve on a surface while the joints are interpolated between
//! knots, and knots enough that it does not (source 002, last page).

mod interpolation;

use nalgebra::Vector3;

use machine::kinematics::{Joints, KinematicsError, Mechanism, Pose};
use machine::surface::{Surface, facing};

pub(crate) use interpolation::{Interpolated, Interpolation};

/// Samples inside of each segment are at multiples of this share of it.
const SAMPLES: usize = 32;

/// Each how many samples the nearest point of the curve is looked for.
const NEAREST_EACH: usize = 8;

/// Steps to the nearest point; each is exact for a straight curve, and squares the error of others.
const NEAREST_STEPS: usize = 6;

/// Share of the whole curve over which its direction is measured.
const DIFFERENCE: f64 = 1e-6;

/// Largest distances from a curve and its surface.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Deviation {
    /// From the point of the curve with the same parameter [m].
    pub(crate) matched: f64,
    /// From the nearest point of the curve [m].
    pub(crate) geometric: f64,
    /// From the surface, in or out [m].
    pub(crate) surface: f64,
    /// Of the tool's axis, from the surface's normal at the point with the same parameter [rad].
    pub(crate) axis: f64,
}

impl Deviation {
    fn worst(self, other: Self) -> Self {
        Self {
            matched: self.matched.max(other.matched),
            geometric: self.geometric.max(other.geometric),
            surface: self.surface.max(other.surface),
            axis: self.axis.max(other.axis),
        }
    }

    /// Whether nothing is larger than in `tolerance`.
    fn within(&self, tolerance: &Self) -> bool {
        self.matched <= tolerance.matched
            && self.geometric <= tolerance.geometric
            && self.surface <= tolerance.surface
            && self.axis <= tolerance.axis
    }
}

/// A curve of a drawing, put onto a surface and followed by a machine with the beam across the
/// surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SurfaceCurve<'a, const N: usize, M: Mechanism<N>, F> {
    /// The machine.
    pub(crate) mechanism: &'a M,
    /// The branch it takes.
    pub(crate) branch: M::Branch,
    /// What it marks on.
    pub(crate) surface: &'a Surface,
    /// The point of the drawing [m] at a parameter.
    pub(crate) drawing: F,
}

impl<const N: usize, M: Mechanism<N>, F: Fn(f64) -> [f64; 2]> SurfaceCurve<'_, N, M, F> {
    /// Where the focus has to be [m], and the unit vector that the beam has to follow.
    fn wanted(&self, parameter: f64) -> Result<[Vector3<f64>; 2], KinematicsError> {
        let [x, y] = (self.drawing)(parameter);
        let spot = self.surface.spot(x, y)?;
        Ok([spot.point.into(), -Vector3::from(spot.normal)])
    }

    /// The exact joints at `parameter`, continuous with `previous`.
    ///
    /// # Errors
    /// Off the surface, or out of the machine's reach.
    pub(crate) fn joints(
        &self,
        parameter: f64,
        previous: &Joints<N>,
    ) -> Result<Joints<N>, KinematicsError> {
        let [position, beam] = self.wanted(parameter)?;
        let rotation = facing(&-beam);
        self.mechanism.inverse(&Pose { position, rotation }, self.branch, previous)
    }

    /// Exact knots at growing `parameters`, the first continuous with `previous`.
    ///
    /// # Errors
    /// As for [`Self::joints`].
    pub(crate) fn knots(
        &self,
        parameters: impl IntoIterator<Item = f64>,
        previous: &Joints<N>,
    ) -> Result<Vec<(f64, Joints<N>)>, KinematicsError> {
        let mut last = *previous;
        let knot = |parameter| {
            last = self.joints(parameter, &last)?;
            Ok((parameter, last))
        };
        parameters.into_iter().map(knot).collect()
    }

    /// The largest deviations inside of `segment` of the interpolated joints.
    ///
    /// # Errors
    /// Where a chain does not close, or the curve leaves its surface.
    pub(crate) fn deviation(
        &self,
        path: &Interpolated<N>,
        segment: usize,
    ) -> Result<Deviation, KinematicsError> {
        let mut largest = Deviation::default();
        let knots = path.knots();
        let range = [knots[0].0, knots[knots.len() - 1].0];
        for sample in 1..SAMPLES {
            let (parameter, q) = path.at(segment, sample as f64 / SAMPLES as f64);
            let pose = self.mechanism.forward(&q, self.branch)?;
            let beam = -pose.rotation.column(2).into_owned();
            let [point, direction] = self.wanted(parameter)?;
            let matched = (pose.position - point).norm();
            let geometric = if sample % NEAREST_EACH == 0 {
                self.nearest(&pose.position, parameter, range)?
            } else {
                0.0
            };
            let angle = messages::math::atan2(beam.cross(&direction).norm(), beam.dot(&direction));
            largest = largest.worst(Deviation {
                matched,
                geometric,
                surface: self.surface.height(<[f64; 3]>::from(pose.position))?.abs(),
                axis: angle,
            });
        }
        Ok(largest)
    }

    /// The largest deviations of all the segments.
    ///
    /// # Errors
    /// As for [`Self::deviation`].
    pub(crate) fn largest_deviation(
        &self,
        path: &Interpolated<N>,
    ) -> Result<Deviation, KinematicsError> {
        (0..path.segments()).try_fold(Deviation::default(), |largest, segment| {
            Ok(largest.worst(self.deviation(path, segment)?))
        })
    }

    /// Distance of `point` from the curve [m], by Gauss and Newton from the point at `parameter`.
    fn nearest(
        &self,
        point: &Vector3<f64>,
        mut parameter: f64,
        [first, last]: [f64; 2],
    ) -> Result<f64, KinematicsError> {
        let step = (last - first) * DIFFERENCE;
        let mut least = (self.wanted(parameter)?[0] - point).norm();
        for _ in 0..NEAREST_STEPS {
            let (low, high) = ((parameter - step).max(first), (parameter + step).min(last));
            let rate = (self.wanted(high)?[0] - self.wanted(low)?[0]) / (high - low);
            let away = point - self.wanted(parameter)?[0];
            if rate.norm_squared() == 0.0 {
                break;
            }
            parameter = (parameter + away.dot(&rate) / rate.norm_squared()).clamp(first, last);
            least = least.min((self.wanted(parameter)?[0] - point).norm());
        }
        Ok(least)
    }

    /// Halves segments, beginning with the one from `first` to `last`, until every one deviates by
    /// no more than `tolerance`; the first knot is continuous with `previous`.
    ///
    /// # Errors
    /// As for [`Self::deviation`]; `too_many_knots` where `most` knots are not enough.
    pub(crate) fn subdivided(
        &self,
        [first, last]: [f64; 2],
        interpolation: Interpolation,
        tolerance: &Deviation,
        most: usize,
        previous: &Joints<N>,
    ) -> Result<Interpolated<N>, KinematicsError> {
        let mut parameters = vec![first, last];
        loop {
            let knots = self.knots(parameters.iter().copied(), previous)?;
            let path = Interpolated::new(knots, interpolation);
            let mut finer = vec![first];
            let mut largest = Deviation::default();
            for segment in 0..path.segments() {
                let deviation = self.deviation(&path, segment)?;
                largest = largest.worst(deviation);
                // A curve with one bend each way crosses the middle of its chord unseen, but not
                // all of the samples.
                if !deviation.within(tolerance) {
                    finer.push((parameters[segment] + parameters[segment + 1]) / 2.0);
                }
                finer.push(parameters[segment + 1]);
            }
            if finer.len() == parameters.len() {
                return Ok(path);
            }
            if finer.len() > most {
                return Err(KinematicsError {
                    code: "too_many_knots",
                    axis: None,
                    value: largest.matched,
                    limit: tolerance.matched,
                    detail: "the path does not come within its tolerance with so many knots",
                });
            }
            parameters = finer;
        }
    }
}
