//! How far the tool strays from a curve on a surface while the joints are interpolated between
//! knots, and knots enough that it does not (source 002, last page).

mod interpolation;

use messages::math;
use nalgebra::Vector3;

use crate::kinematics::{Joints, KinematicsError, Pose};

pub use interpolation::{Interpolated, Interpolation};

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
pub struct Deviation {
    /// From the point of the curve with the same parameter [m].
    pub matched: f64,
    /// From the nearest point of the curve [m].
    pub geometric: f64,
    /// From the surface, in or out [m].
    pub surface: f64,
    /// Of the tool's axis, from the surface's normal at the point with the same parameter [rad].
    pub axis: f64,
}

impl Deviation {
    /// The larger one of each.
    #[must_use]
    pub fn worst(self, other: Self) -> Self {
        Self {
            matched: self.matched.max(other.matched),
            geometric: self.geometric.max(other.geometric),
            surface: self.surface.max(other.surface),
            axis: self.axis.max(other.axis),
        }
    }

    /// Whether nothing is larger than in `tolerance`.
    pub fn within(&self, tolerance: &Self) -> bool {
        self.matched <= tolerance.matched
            && self.geometric <= tolerance.geometric
            && self.surface <= tolerance.surface
            && self.axis <= tolerance.axis
    }
}

/// Where a tool is, and which way it points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aim {
    /// [m].
    pub position: Vector3<f64>,
    /// Unit vector of the tool's z axis, against the beam.
    pub axis: Vector3<f64>,
}

impl Aim {
    /// That of a pose.
    pub fn of(pose: &Pose) -> Self {
        Self { position: pose.position, axis: pose.rotation.column(2).into_owned() }
    }

    /// The angle between its axis and that of `other` [rad].
    pub fn angle(&self, other: &Self) -> f64 {
        math::atan2(self.axis.cross(&other.axis).norm(), self.axis.dot(&other.axis))
    }
}

/// A curve that a machine with `N` axes follows, by a parameter of its own.
pub trait Curve<const N: usize> {
    /// Where the tool has to be at `parameter`.
    ///
    /// # Errors
    /// Where the curve is nowhere, such as off its surface.
    fn wanted(&self, parameter: f64) -> Result<Aim, KinematicsError>;

    /// The exact joints at `parameter`, continuous with `previous`.
    ///
    /// # Errors
    /// As for [`Self::wanted`], or out of the machine's reach.
    fn joints(&self, parameter: f64, previous: &Joints<N>) -> Result<Joints<N>, KinematicsError>;

    /// Where the tool is with the joints at `q`, near `parameter`.
    ///
    /// # Errors
    /// Where a chain does not close.
    fn reached(&self, parameter: f64, q: &Joints<N>) -> Result<Aim, KinematicsError>;

    /// How far `point` is from the surface that the curve lies on [m]; 0 without one.
    ///
    /// # Errors
    /// Where the surface has no height.
    fn height(&self, point: &Vector3<f64>) -> Result<f64, KinematicsError>;

    /// Exact knots at growing `parameters`, the first continuous with `previous`.
    ///
    /// # Errors
    /// As for [`Self::joints`].
    fn knots(
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

    /// How far the tool strays with the joints at `q`, which belong to `parameter`; from the nearest point
    /// of the curve in `range` only where `is_near` is asked for, else 0.
    ///
    /// # Errors
    /// Where a chain does not close, or the curve leaves its surface.
    fn strays(
        &self,
        parameter: f64,
        q: &Joints<N>,
        range: [f64; 2],
        is_near: bool,
    ) -> Result<Deviation, KinematicsError> {
        let (reached, wanted) = (self.reached(parameter, q)?, self.wanted(parameter)?);
        let point = reached.position;
        Ok(Deviation {
            matched: (point - wanted.position).norm(),
            geometric: if is_near { self.nearest(&point, parameter, range)? } else { 0.0 },
            surface: self.height(&point)?.abs(),
            axis: reached.angle(&wanted),
        })
    }

    /// The largest deviations inside of `segment` of the interpolated joints.
    ///
    /// # Errors
    /// Where a chain does not close, or the curve leaves its surface.
    fn deviation(
        &self,
        path: &Interpolated<N>,
        segment: usize,
    ) -> Result<Deviation, KinematicsError> {
        let mut largest = Deviation::default();
        let knots = path.knots();
        let range = [knots[0].0, knots[knots.len() - 1].0];
        for sample in 1..SAMPLES {
            let (parameter, q) = path.at(segment, sample as f64 / SAMPLES as f64);
            let is_near = sample % NEAREST_EACH == 0;
            largest = largest.worst(self.strays(parameter, &q, range, is_near)?);
        }
        Ok(largest)
    }

    /// The largest deviations of all the segments.
    ///
    /// # Errors
    /// As for [`Self::deviation`].
    fn largest_deviation(&self, path: &Interpolated<N>) -> Result<Deviation, KinematicsError> {
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
        let mut least = (self.wanted(parameter)?.position - point).norm();
        for _ in 0..NEAREST_STEPS {
            let (low, high) = ((parameter - step).max(first), (parameter + step).min(last));
            let rate = (self.wanted(high)?.position - self.wanted(low)?.position) / (high - low);
            let away = point - self.wanted(parameter)?.position;
            if rate.norm_squared() == 0.0 {
                break;
            }
            parameter = (parameter + away.dot(&rate) / rate.norm_squared()).clamp(first, last);
            least = least.min((self.wanted(parameter)?.position - point).norm());
        }
        Ok(least)
    }

    /// Halves segments, beginning with the one from `first` to `last`, until every one deviates by
    /// no more than `tolerance`; the first knot is continuous with `previous`.
    ///
    /// # Errors
    /// As for [`Self::deviation`]; `too_many_knots` where `most` knots are not enough.
    fn subdivided(
        &self,
        [first, last]: [f64; 2],
        interpolation: Interpolation,
        tolerance: &Deviation,
        most: usize,
        previous: &Joints<N>,
    ) -> Result<(Interpolated<N>, Deviation), KinematicsError> {
        let mut parameters = vec![first, last];
        loop {
            let knots = self.knots(parameters.iter().copied(), previous)?;
            let path = Interpolated::new(knots, interpolation);
            let mut finer = vec![first];
            let mut largest = Deviation::default();
            for segment in 0..path.segments() {
                // A segment on which a chain does not close is too long.
                let deviation = self.deviation(&path, segment).ok();
                largest = largest.worst(deviation.unwrap_or_default());
                // A curve with one bend each way crosses the middle of its chord unseen, but not
                // all of the samples.
                if !deviation.is_some_and(|deviation| deviation.within(tolerance)) {
                    finer.push((parameters[segment] + parameters[segment + 1]) / 2.0);
                }
                finer.push(parameters[segment + 1]);
            }
            if finer.len() == parameters.len() {
                return Ok((path, largest));
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
