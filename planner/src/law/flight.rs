//! The flight: a motion of the tool in the dark from one state to another without stopping.
//!
//! Where the laser marks at one speed only, the tool must leave a marked line with the line's
//! velocity and come onto the next with that line's, and with its lateral acceleration V²κ where
//! the line is curved. Between them it flies, in nearly the least time: hatch turns, loops at
//! corners, and the ways from and to rest.

mod along;
mod band;
mod cone;
mod direction;
mod frame;
mod grid;
mod model;
mod programme;
mod run;
mod search;
mod speed;

use machine::kinematics::{Attitude, ToolMotion};
use nalgebra::{Matrix3, Vector3};

pub(crate) use direction::DirectionLimit;

use crate::law::profile::Move;

/// Flights longer than this are not looked for [s].
const LONGEST: f64 = 60.0;

/// The way that a flight's ends may be off by rounding [m].
const ROUNDING: f64 = 1e-13;

/// Where the tool is, and how it moves, at one end of a flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// [m].
    pub position: Vector3<f64>,
    /// [m/s].
    pub velocity: Vector3<f64>,
    /// [m/s²].
    pub acceleration: Vector3<f64>,
    /// How it is turned in all of the flight, where the path says it.
    pub rotation: Matrix3<f64>,
}

/// What the tool may do, as the norms of vectors; all positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlightLimits {
    /// May be infinite [m/s].
    pub speed: f64,
    /// [m/s²].
    pub acceleration: f64,
    /// [m/s³].
    pub jerk: f64,
}

/// The tool's motion at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion3 {
    /// [m].
    pub position: Vector3<f64>,
    /// [m/s].
    pub velocity: Vector3<f64>,
    /// [m/s²].
    pub acceleration: Vector3<f64>,
    /// [m/s³].
    pub jerk: Vector3<f64>,
}

/// A stretch of constant jerk.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Phase {
    /// Since the flight's start [s].
    start: f64,
    motion: Motion3,
}

/// A motion between two states in phases of constant jerk.
#[derive(Debug, Clone, PartialEq)]
pub struct Flight {
    phases: Vec<Phase>,
    duration: f64,
    end: State,
}

impl State {
    /// At rest at `position` [m].
    pub fn rest(position: Vector3<f64>) -> Self {
        let (velocity, acceleration) = (Vector3::zeros(), Vector3::zeros());
        Self { position, velocity, acceleration, rotation: Matrix3::identity() }
    }

    fn is_finite(&self) -> bool {
        let parts = [self.position, self.velocity, self.acceleration];
        parts.iter().all(|vector| vector.iter().all(|part| part.is_finite()))
    }

    /// Whether it keeps `limits`, to rounding.
    fn keeps(&self, limits: &FlightLimits) -> bool {
        self.velocity.norm() <= limits.speed * (1.0 + 1e-9)
            && self.acceleration.norm() <= limits.acceleration * (1.0 + 1e-9)
    }
}

impl Motion3 {
    /// `time` [s] later at the same jerk.
    fn after(&self, time: f64) -> Self {
        let Self { position, velocity, acceleration, jerk } = *self;
        Self {
            position: position
                + (velocity + (acceleration / 2.0 + jerk * (time / 6.0)) * time) * time,
            velocity: velocity + (acceleration + jerk * (time / 2.0)) * time,
            acceleration: acceleration + jerk * time,
            jerk,
        }
    }
}

impl Flight {
    /// The shortest found between `from` and `to`.
    ///
    /// `fits` judges a flight that keeps `limits` by whatever else there is: axes, motors, area.
    /// While it says no, the flight is sought again within lower limits. `None` where the states
    /// are not finite or beyond `limits`, where no motion from one to the other keeps those, as at a
    /// lateral acceleration a with a²/v beyond the jerk, or where nothing of up to 60 s fits.
    pub fn new(
        from: &State,
        to: &State,
        limits: &FlightLimits,
        fits: &mut dyn FnMut(&Self) -> bool,
    ) -> Option<Self> {
        if !(from.is_finite() && to.is_finite() && from.keeps(limits) && to.keeps(limits)) {
            return None;
        }
        search::fitting(from, to, limits, fits)
    }

    /// The shortest found between `from` and `to` within `limits` and those of `directions`; `None`
    /// as for [`Self::new`].
    pub fn within(
        from: &State,
        to: &State,
        limits: &FlightLimits,
        directions: &[DirectionLimit],
    ) -> Option<Self> {
        if !(from.is_finite() && to.is_finite() && from.keeps(limits) && to.keeps(limits)) {
            return None;
        }
        search::shortest(from, to, limits, directions)
    }

    /// From rest into `to` in the shortest time found, wherever that starts; `to` keeps `limits`. `None`
    /// where no motion was found.
    pub fn run_in(
        to: &State,
        limits: &FlightLimits,
        directions: &[DirectionLimit],
    ) -> Option<Self> {
        run::into(to, limits, directions)
    }

    /// From rest into `to`, whose acceleration is across its velocity, by a ramp and a swing: a little
    /// slower than [`Self::run_in`] on a curve, and found at once.
    pub(crate) fn ramp_in(to: &State, limits: &FlightLimits) -> Self {
        run::paired(to, limits)
    }

    /// From `from` to rest in the shortest time found, wherever that ends; `from` keeps `limits`. `None`
    /// where no motion was found.
    pub fn run_out(
        from: &State,
        limits: &FlightLimits,
        directions: &[DirectionLimit],
    ) -> Option<Self> {
        let back = State { velocity: -from.velocity, ..*from };
        run::into(&back, limits, directions).map(|flight| flight.reversed())
    }

    /// [s].
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// The tool's motion at `time` since the start [s]; that at the ends before and after.
    pub fn at(&self, time: f64) -> Motion3 {
        if time >= self.duration {
            let State { position, velocity, acceleration, .. } = self.end;
            let jerk = self.phases.last().map_or(Vector3::zeros(), |phase| phase.motion.jerk);
            return Motion3 { position, velocity, acceleration, jerk };
        }
        let index = self.phases.partition_point(|phase| phase.start <= time).max(1) - 1;
        let Phase { start, motion } = self.phases[index];
        motion.after((time - start).max(0.0))
    }

    /// The same, with the tool turned as it is at the end.
    pub fn tool(&self, time: f64) -> ToolMotion {
        let Motion3 { position, velocity, acceleration, jerk } = self.at(time);
        let attitude = Attitude::fixed(self.end.rotation);
        ToolMotion { position, velocity, acceleration, jerk, attitude }
    }

    /// The least box of all its positions, lower and upper corner [m].
    pub fn bounds(&self) -> [Vector3<f64>; 2] {
        let (mut lower, mut upper) = (self.end.position, self.end.position);
        let mut include = |position: &Vector3<f64>| {
            lower = lower.inf(position);
            upper = upper.sup(position);
        };
        for (index, phase) in self.phases.iter().enumerate() {
            include(&phase.motion.position);
            let end = self.phases.get(index + 1).map_or(self.duration, |next| next.start);
            for axis in 0..3 {
                for time in turns(&phase.motion, axis) {
                    if time > 0.0 && time < end - phase.start {
                        include(&phase.motion.after(time).position);
                    }
                }
            }
        }
        [lower, upper]
    }

    /// The instants at which the jerk changes, both ends included, rising [s].
    pub fn breaks(&self) -> impl Iterator<Item = f64> + '_ {
        self.phases.iter().map(|phase| phase.start).chain([self.duration])
    }

    /// From `from` over `steps` [s] with the `accelerations` at their ends [m/s²], exactly into `to`.
    fn through(
        from: &State,
        to: &State,
        steps: &[f64],
        accelerations: impl Iterator<Item = Vector3<f64>>,
    ) -> Self {
        let mut phases = Vec::with_capacity(steps.len());
        let State { position, velocity, acceleration, .. } = *from;
        let mut motion = Motion3 { position, velocity, acceleration, jerk: Vector3::zeros() };
        let mut start = 0.0;
        for (&step, next) in steps.iter().zip(accelerations) {
            motion.jerk = (next - motion.acceleration) / step;
            phases.push(Phase { start, motion });
            motion = Motion3 { acceleration: next, ..motion.after(step) };
            start += step;
        }
        Self { phases, duration: start, end: *to }
    }

    /// Nowhere, in no time.
    fn nothing(at: &State) -> Self {
        let State { position, velocity, acceleration, .. } = *at;
        let motion = Motion3 { position, velocity, acceleration, jerk: Vector3::zeros() };
        Self { phases: vec![Phase { start: 0.0, motion }], duration: 0.0, end: *at }
    }

    /// From rest to rest along a line, within `limits`, which is exactly the shortest.
    fn straight(from: &State, to: &State, limits: &FlightLimits) -> Self {
        let way = to.position - from.position;
        let length = way.norm();
        let direction = way / length;
        let planned = Move::new(length, limits.speed, limits.acceleration, limits.jerk);
        let phases = planned.phases().into_iter().filter(|&(step, _)| step > 0.0);
        let (steps, jerks): (Vec<f64>, Vec<f64>) = phases.unzip();
        let mut acceleration = 0.0;
        let accelerations = steps.iter().zip(&jerks).map(|(step, jerk)| {
            acceleration += step * jerk;
            direction * acceleration
        });
        Self::through(from, to, &steps, accelerations)
    }

    /// The same way backwards in time.
    fn reversed(&self) -> Self {
        let mut phases = Vec::with_capacity(self.phases.len());
        for (index, phase) in self.phases.iter().enumerate().rev() {
            let end = match self.phases.get(index + 1) {
                Some(next) => Phase { start: next.start, motion: next.motion },
                None => Phase { start: self.duration, motion: self.at(self.duration) },
            };
            let Motion3 { position, velocity, acceleration, .. } = end.motion;
            let motion =
                Motion3 { position, velocity: -velocity, acceleration, jerk: -phase.motion.jerk };
            phases.push(Phase { start: self.duration - end.start, motion });
        }
        let Motion3 { position, velocity, acceleration, .. } = self.at(0.0);
        let rotation = self.end.rotation;
        let end = State { position, velocity: -velocity, acceleration, rotation };
        Self { phases, duration: self.duration, end }
    }
}

/// When the velocity along `axis` is 0, counted from the start of `motion` [s].
fn turns(motion: &Motion3, axis: usize) -> [f64; 2] {
    let (velocity, acceleration) = (motion.velocity[axis], motion.acceleration[axis]);
    let jerk = motion.jerk[axis];
    let discriminant = acceleration * acceleration - 2.0 * jerk * velocity;
    if discriminant < 0.0 {
        return [f64::NAN; 2];
    }
    // v + a·t + j·t²/2 = 0 without cancellation.
    let sum = -(acceleration + discriminant.sqrt().copysign(acceleration));
    [sum / jerk, 2.0 * velocity / sum]
}

#[cfg(test)]
mod tests;
