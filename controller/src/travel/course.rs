//! The way of one mover: a polynomial of the time from rest to rest, or to another speed.
//!
//! Both have their limits in closed form, end exactly, and need no memory.

use machine::{Axis, JointUnit, Machine};

/// The least time in which a joint comes to its largest speed [s], and to its largest acceleration.
const RISE: f64 = 0.1;
const ONSET: f64 = 0.05;

/// What of its largest speed a joint is asked for: told to go slower in the midst of speeding up, it goes on getting
/// faster for a moment, by up to a ninth.
pub(super) const SPEED_SHARE: f64 = 0.85;

/// How far a joint has gone from where the travel began, and how it moves [joint units].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Motion {
    /// Way [m or rad].
    pub position: f64,
    /// Velocity.
    pub velocity: f64,
    /// Acceleration.
    pub acceleration: f64,
}

/// How fast a joint may go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// Largest speed that may be asked for, below the limit [joint units/s].
    pub velocity: f64,
    /// Largest acceleration.
    pub acceleration: f64,
    /// Largest jerk.
    pub jerk: f64,
}

impl Pace {
    /// Of `axis` on `machine`.
    pub fn new(machine: &Machine, axis: &Axis) -> Self {
        let path = match axis.unit {
            JointUnit::Length => [machine.path.rapid, machine.path.acceleration, machine.path.jerk],
            JointUnit::Angle => [f64::INFINITY; 3],
        };
        let velocity = SPEED_SHARE * axis.limits.velocity.min(path[0]);
        let acceleration = axis.limits.acceleration.min(path[1]).min(velocity / RISE);
        let jerk = axis.limits.jerk.min(path[2]).min(acceleration / ONSET);
        Self { velocity, acceleration, jerk }
    }

    /// Of the tool in a direction in which each joint goes by its `lever`.
    pub(super) fn along(machine: &Machine, lever: &messages::AxisArray) -> Self {
        let path = &machine.path;
        let whole = Self {
            velocity: SPEED_SHARE * path.rapid,
            acceleration: path.acceleration,
            jerk: path.jerk,
        };
        let joints = machine.axes.iter().zip(lever).filter(|(_, lever)| **lever != 0.0);
        let pace = joints.fold(whole, |least, (axis, lever)| {
            let own = Self::new(machine, axis);
            Self {
                velocity: least.velocity.min(own.velocity / lever.abs()),
                acceleration: least.acceleration.min(own.acceleration / lever.abs()),
                jerk: least.jerk.min(own.jerk / lever.abs()),
            }
        });
        let acceleration = pace.acceleration.min(pace.velocity / RISE);
        Self { acceleration, jerk: pace.jerk.min(acceleration / ONSET), ..pace }
    }

    /// Time in which a joint with acceleration `from` comes to a velocity that is `change` away, at rest in its
    /// acceleration [s]: the jerk of the cubic is `6·Δv/T² + 4·a/T` at most, its acceleration no more than the larger
    /// of `a` and the limit.
    fn time(&self, change: f64, from: f64) -> f64 {
        let start = 4.0 * from.abs();
        let by_jerk =
            (start + (start * start + 24.0 * self.jerk * change.abs()).sqrt()) / (2.0 * self.jerk);
        by_jerk.max(3.0 * change.abs() / self.acceleration)
    }
}

/// The way of one joint: a polynomial of the time, and an even speed after it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Course {
    /// Of the powers of the time [joint units, s].
    coefficients: [f64; 6],
    /// How long the polynomial lasts, and how much of it has gone by [cycles].
    cycles: u32,
    pub(super) elapsed: u32,
    /// The speed afterwards [joint units/s].
    pub(super) speed: f64,
}

impl Course {
    /// From rest at `from` to rest `distance` further.
    pub(super) fn over(from: f64, distance: f64, pace: &Pace, period: f64) -> Self {
        // Velocity, acceleration and jerk of the quintic from 0 to 1 within a time of 1.
        let size = distance.abs();
        let time = (1.875 * size / pace.velocity)
            .max((5.7736 * size / pace.acceleration).sqrt())
            .max(messages::math::cbrt(60.0 * size / pace.jerk));
        let cycles = whole(time, period);
        let time = f64::from(cycles) * period;
        let cube = distance / (time * time * time);
        let coefficients =
            [from, 0.0, 0.0, 10.0 * cube, -15.0 * cube / time, 6.0 * cube / (time * time)];
        Self { coefficients, cycles, elapsed: 0, speed: 0.0 }
    }

    /// From `from` to an even `speed`.
    pub(super) fn to_speed(from: Motion, speed: f64, pace: &Pace, period: f64) -> Self {
        let change = speed - from.velocity;
        let cycles = whole(pace.time(change, from.acceleration), period);
        let time = f64::from(cycles) * period;
        let start = from.acceleration;
        // Velocity v + a·t + p·t² + q·t³, at `speed` without acceleration after `time`.
        let square = (3.0 * change / time - 2.0 * start) / time;
        let cube = (start - 2.0 * change / time) / (time * time);
        let coefficients =
            [from.position, from.velocity, start / 2.0, square / 3.0, cube / 4.0, 0.0];
        Self { coefficients, cycles, elapsed: 0, speed }
    }

    pub(super) fn at(&self, elapsed: u32, period: f64) -> Motion {
        let [a, b, c, d, e, f] = self.coefficients;
        let t = f64::from(elapsed.min(self.cycles)) * period;
        let position = a + t * (b + t * (c + t * (d + t * (e + t * f))));
        if elapsed >= self.cycles {
            let after = f64::from(elapsed - self.cycles) * period;
            let position = position + self.speed * after;
            return Motion { position, velocity: self.speed, acceleration: 0.0 };
        }
        Motion {
            position,
            velocity: b + t * (2.0 * c + t * (3.0 * d + t * (4.0 * e + t * 5.0 * f))),
            acceleration: 2.0 * c + t * (6.0 * d + t * (12.0 * e + t * 20.0 * f)),
        }
    }

    /// Where it ends, of one that ends at rest.
    pub(super) fn end(&self, period: f64) -> f64 {
        self.at(self.cycles, period).position
    }

    /// Whether it leads from rest to rest.
    pub(super) fn is_sent(&self) -> bool {
        self.coefficients[5] != 0.0
    }

    pub(super) fn rests(&self) -> bool {
        self.elapsed >= self.cycles && self.speed == 0.0
    }
}

/// Whole cycles of `time`, at least one.
fn whole(time: f64, period: f64) -> u32 {
    (time / period - 1e-9).ceil().clamp(1.0, 1e9) as u32
}
