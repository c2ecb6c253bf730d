//! Limits along single directions, as a joint has them that goes straight with the tool.

use nalgebra::Vector3;

use super::FlightLimits;
use super::frame::Frame;

/// What lies this far across a direction, as a part of it, is not held by it.
const ACROSS: f64 = 1e-6;

/// What the tool may do along one direction, forwards and backwards; any of it may be infinite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionLimit {
    /// Of length 1.
    pub direction: Vector3<f64>,
    /// [m/s].
    pub speed: f64,
    /// [m/s²].
    pub acceleration: f64,
    /// [m/s³].
    pub jerk: f64,
}

/// The same in the frame of a flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Side<const D: usize> {
    /// Of length 1.
    pub direction: [f64; D],
    /// Of speed, acceleration and jerk.
    pub limits: [f64; 3],
}

impl DirectionLimit {
    /// The same as seen in `frame`; `None` where the flight goes across it.
    pub(super) fn down<const D: usize>(&self, frame: &Frame) -> Option<Side<D>> {
        let parts: [f64; D] = frame.down(&self.direction);
        let length = parts.iter().map(|part| part * part).sum::<f64>().sqrt();
        (length > ACROSS).then(|| Side {
            direction: parts.map(|part| part / length),
            limits: [self.speed, self.acceleration, self.jerk].map(|limit| limit / length),
        })
    }
}

impl FlightLimits {
    /// What is left of these limits along `way`, which need not be of length 1.
    pub(crate) fn along(&self, way: &Vector3<f64>, directions: &[DirectionLimit]) -> Self {
        let Some(way) = way.try_normalize(0.0) else { return *self };
        directions.iter().fold(*self, |limits, side| {
            let part = side.direction.dot(&way).abs();
            let least =
                |limit: f64, side: f64| if part > ACROSS { limit.min(side / part) } else { limit };
            Self {
                speed: least(limits.speed, side.speed),
                acceleration: least(limits.acceleration, side.acceleration),
                jerk: least(limits.jerk, side.jerk),
            }
        })
    }
}
