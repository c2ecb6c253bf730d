//! Motions of single joints that no stream asks for: homing, jogging, probing; and of the tool along x, y or z, where
//! joints go straight with it.
//!
//! Each of these movers follows a `Course`: from rest to rest by a quintic, or from however it moves to another speed by
//! a cubic of the velocity. Both have their limits in closed form, end exactly, and need no memory. Limits are
//! those of the axis and, where the joint slides, of the path; an axis without any takes `RISE` to its
//! largest speed.

mod course;

use crate::planned::Planned;
use machine::{Directions, Machine};
use messages::{ActuatorArray, MAX_ACTUATORS, MAX_AXES};

use course::Course;
pub use course::{Motion, Pace};

/// What can be moved: the joints, and the tool along x, y and z, from [`MAX_AXES`] on.
pub const MOVERS: usize = MAX_AXES + 3;

/// What each mover may go to, `None` where nobody knows [m or rad].
pub type Bounds = [Option<[f64; 2]>; MOVERS];

/// A place that a motion would lead beyond.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beyond {
    /// Which joint, or direction of the tool, would be there.
    pub mover: usize,
    /// Where it would be [m or rad].
    pub end: f64,
    /// Where it may be [m or rad].
    pub limit: f64,
}

/// What a motor takes beside its weight.
#[derive(Debug, Clone, Copy)]
struct Driven {
    axis: usize,
    ratio: f64,
    share: f64,
    inertia: f64,
    viscous: f64,
}

/// The joints' motions.
#[derive(Debug, Clone)]
pub struct Travel {
    /// `None` of what cannot be moved.
    paces: [Option<Pace>; MOVERS],
    directions: Directions,
    driven: Vec<Driven>,
    courses: [Course; MOVERS],
    /// Where it began.
    base: Planned,
    is_moving: bool,
    period: f64,
}

impl Travel {
    /// Of this machine, at rest, in cycles of `period` [s].
    pub fn new(machine: &Machine, period: f64) -> Self {
        let driven = machine.actuators.iter().take(MAX_ACTUATORS).map(|actuator| Driven {
            axis: actuator.axis,
            ratio: actuator.ratio,
            share: actuator.share,
            inertia: actuator.gains.inertia,
            viscous: actuator.friction.viscous,
        });
        let directions = Directions::of(machine);
        let paces = core::array::from_fn(|mover| match mover.checked_sub(MAX_AXES) {
            None => machine.axes.get(mover).map(|axis| Pace::new(machine, axis)),
            Some(direction) => directions.lever(direction).map(|it| Pace::along(machine, it)),
        });
        Self {
            paces,
            directions,
            driven: driven.collect(),
            courses: [Course::default(); MOVERS],
            base: Planned::default(),
            is_moving: false,
            period,
        }
    }

    /// How fast a mover may go; `None` where there is no such one.
    pub fn pace(&self, mover: usize) -> Option<&Pace> {
        self.paces.get(mover)?.as_ref()
    }

    /// The ways of tool and joints that belong together.
    pub fn directions(&self) -> &Directions {
        &self.directions
    }

    /// Way of a joint, or of the tool in a direction, for each way of `mover`.
    pub fn share(&self, of: usize, mover: usize) -> f64 {
        match (of.checked_sub(MAX_AXES), mover.checked_sub(MAX_AXES)) {
            (None, Some(direction)) => {
                self.directions.lever(direction).map_or(0.0, |lever| lever[of])
            }
            (Some(direction), None) => self.directions.tool(direction)[mover],
            _ if of == mover => 1.0,
            _ => 0.0,
        }
    }

    /// Whether no joint moves.
    pub fn is_at_rest(&self) -> bool {
        !self.is_moving
    }

    /// Whether the joint of `axis` does not move.
    pub fn rests(&self, axis: usize) -> bool {
        !self.is_moving || self.courses.get(axis).is_none_or(Course::rests)
    }

    /// How far the joint of `axis` has gone since the travel began, and how it moves.
    pub fn motion(&self, axis: usize) -> Motion {
        self.courses.get(axis).map_or(Motion::default(), |it| it.at(it.elapsed, self.period))
    }

    /// How all movers together move a joint, or the tool in a direction, since the travel began.
    fn moved(&self, of: usize) -> Motion {
        let movers = (0..MOVERS).filter(|mover| self.share(of, *mover) != 0.0);
        movers.fold(Motion::default(), |sum, mover| {
            let (share, motion) = (self.share(of, mover), self.motion(mover));
            Motion {
                position: sum.position + share * motion.position,
                velocity: sum.velocity + share * motion.velocity,
                acceleration: sum.acceleration + share * motion.acceleration,
            }
        })
    }

    /// Where a joint is, or the tool in a direction [m or rad].
    pub fn place(&self, mover: usize, standing: &Planned) -> f64 {
        let base = if self.is_moving { &self.base } else { standing };
        let from = match mover.checked_sub(MAX_AXES) {
            Some(direction) => base.tool.get(direction).copied().unwrap_or_default(),
            None => {
                let own = self.driven.iter().zip(&base.angle).filter(|(it, _)| it.axis == mover);
                own.map(|(it, angle)| it.share * (angle * it.ratio)).sum()
            }
        };
        if self.is_moving { from + self.moved(mover).position } else { from }
    }

    /// The first place beyond `bounds` to which another `way` of `mover` would lead, with whatever else comes to rest
    /// meanwhile.
    pub fn beyond(
        &self,
        mover: usize,
        way: f64,
        bounds: &Bounds,
        standing: &Planned,
    ) -> Option<Beyond> {
        (0..MOVERS).find_map(|of| {
            let own = self.share(of, mover) * way;
            let [lower, upper] = bounds[of].filter(|_| own != 0.0)?;
            let others = (0..MOVERS).filter(|other| *other != mover);
            let others: f64 = others.map(|it| self.share(of, it) * self.way_to_rest(it)).sum();
            let end = self.place(of, standing) + others + own;
            match own > 0.0 {
                true if end > upper => Some(Beyond { mover: of, end, limit: upper }),
                false if end < lower => Some(Beyond { mover: of, end, limit: lower }),
                _ => None,
            }
        })
    }

    /// How far a mover goes yet if it is stopped in the next cycle, or comes to rest already.
    fn way_to_rest(&self, mover: usize) -> f64 {
        let (Some(pace), false) = (self.pace(mover), self.rests(mover)) else { return 0.0 };
        let course = &self.courses[mover];
        let from = self.motion(mover).position;
        if course.speed == 0.0 {
            return course.end(self.period) - from;
        }
        let next = course.at(course.elapsed + 1, self.period);
        Course::to_speed(next, 0.0, pace, self.period).end(self.period) - from
    }

    /// Forgets all motion: the axes rest where somebody else says.
    pub fn reset(&mut self) {
        (self.courses, self.is_moving) = ([Course::default(); MOVERS], false);
    }

    fn begin(&mut self, standing: &Planned) {
        if !self.is_moving {
            self.reset();
            self.base = Planned { speed: ActuatorArray::default(), ..*standing };
            self.is_moving = true;
        }
    }

    /// From rest over `distance` [m or rad], no faster than `speed`; the axes stand at `standing` where none moves.
    pub fn go(&mut self, axis: usize, distance: f64, speed: f64, standing: &Planned) {
        self.begin(standing);
        let from = self.motion(axis).position;
        let (Some(Some(pace)), Some(course)) = (self.paces.get(axis), self.courses.get_mut(axis))
        else {
            return;
        };
        let pace = Pace { velocity: pace.velocity.min(speed.abs()), ..*pace };
        *course = Course::over(from, distance, &pace, self.period);
    }

    /// To an even `speed` with its sign, and on at it; the axes stand at `standing` where none moves.
    pub fn run(&mut self, axis: usize, speed: f64, standing: &Planned) {
        self.begin(standing);
        let from = self.motion(axis);
        let (Some(Some(pace)), Some(course)) = (self.paces.get(axis), self.courses.get_mut(axis))
        else {
            return;
        };
        let speed = speed.clamp(-pace.velocity, pace.velocity);
        if course.speed != speed {
            *course = Course::to_speed(from, speed, pace, self.period);
        }
    }

    /// Whether the joint of `axis` is on its way to rest, be it where it was sent.
    pub fn comes_to_rest(&self, axis: usize) -> bool {
        let course = self.courses.get(axis);
        self.is_moving && course.is_some_and(|course| course.speed == 0.0 && !course.rests())
    }

    /// Brings the joint of `axis` to rest.
    pub fn stop(&mut self, axis: usize) {
        if self.rests(axis) {
            return;
        }
        let from = self.motion(axis);
        let (Some(Some(pace)), Some(course)) = (self.paces.get(axis), self.courses.get_mut(axis))
        else {
            return;
        };
        let rest = Course::to_speed(from, 0.0, pace, self.period);
        let way = |course: &Course| (course.end(self.period) - from.position).abs();
        // What comes to rest anyway is not told anew: that would take longer.
        if course.speed != 0.0 || course.is_sent() && way(&rest) < way(course) {
            *course = rest;
        }
    }

    /// Brings all joints to rest.
    pub fn stop_all(&mut self) {
        (0..self.paces.len()).for_each(|axis| self.stop(axis));
    }

    /// Stops a mover where another cycle would lead beyond `bounds`, and says beyond which; the axes stand at
    /// `standing` where none moves.
    pub fn keep_within(
        &mut self,
        mover: usize,
        bounds: &Bounds,
        standing: &Planned,
    ) -> Option<Beyond> {
        if self.rests(mover) || self.comes_to_rest(mover) {
            return None;
        }
        let beyond = self.beyond(mover, self.way_to_rest(mover), bounds, standing)?;
        self.stop(mover);
        Some(beyond)
    }

    /// What a mover that is told to go on at `speed` for a cycle, and then to rest, would lead beyond.
    pub fn lacks_room(
        &self,
        mover: usize,
        speed: f64,
        bounds: &Bounds,
        standing: &Planned,
    ) -> Option<Beyond> {
        let pace = self.pace(mover)?;
        let speed = speed.clamp(-pace.velocity, pace.velocity);
        let from = self.motion(mover);
        let next = Course::to_speed(from, speed, pace, self.period).at(1, self.period);
        let rest = Course::to_speed(next, 0.0, pace, self.period);
        self.beyond(mover, rest.end(self.period) - from.position, bounds, standing)
    }

    /// Goes on by one cycle, to where `weight` [N·m] has to be borne; where that is, `None` where nothing moves.
    pub fn advance(&mut self, weight: impl FnOnce(&mut Planned)) -> Option<Planned> {
        if !self.is_moving {
            return None;
        }
        self.courses
            .iter_mut()
            .for_each(|course| course.elapsed = course.elapsed.saturating_add(1));
        let motions: [Motion; MAX_AXES] = core::array::from_fn(|axis| self.moved(axis));
        let mut planned = self.base;
        for (index, driven) in self.driven.iter().enumerate() {
            let Some(motion) = motions.get(driven.axis) else { continue };
            planned.angle[index] += motion.position / driven.ratio;
            planned.speed[index] = motion.velocity / driven.ratio;
        }
        weight(&mut planned);
        for (index, driven) in self.driven.iter().enumerate() {
            let Some(motion) = motions.get(driven.axis) else { continue };
            planned.torque[index] += driven.viscous * planned.speed[index]
                + driven.inertia * (motion.acceleration / driven.ratio);
        }
        self.is_moving = self.courses.iter().any(|course| !course.rests());
        Some(planned)
    }

    /// The motor with this index is at `angle` [rad], where somebody else has brought it.
    pub fn put(&mut self, index: usize, angle: f64) {
        let Some(driven) = self.driven.get(index) else { return };
        self.base.angle[index] = angle - self.moved(driven.axis).position / driven.ratio;
    }

    /// The motors' places are told otherwise by `shift` [rad] from now on.
    pub fn shift(&mut self, shift: &ActuatorArray) {
        self.base.angle.iter_mut().zip(shift).for_each(|(angle, shift)| *angle += shift);
    }
}

#[cfg(test)]
mod tests;
