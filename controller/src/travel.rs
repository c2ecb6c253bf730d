//! Motions of single joints that no stream asks for: homing, jogging, probing; and of the tool along x, y or z, where
//! joints go straight with it.
//!
//! Each of these movers follows a `Course`: from rest to rest by a quintic, or from however it moves to another speed by
//! a cubic of the velocity. Both have their limits in closed form, end exactly, and need no memory. Limits are
//! those of the axis and, where the joint slides, of the path; an axis without any takes `RISE` to its
//! largest speed.

use crate::feedforward::Planned;
use machine::{Axis, Directions, JointUnit, Machine};
use messages::{ActuatorArray, MAX_ACTUATORS, MAX_AXES};

/// What can be moved: the joints, and the tool along x, y and z, from [`MAX_AXES`] on.
pub const MOVERS: usize = MAX_AXES + 3;

/// The least time in which a joint comes to its largest speed [s], and to its largest acceleration.
const RISE: f64 = 0.1;
const ONSET: f64 = 0.05;

/// What of its largest speed a joint is asked for: told to go slower in the midst of speeding up, it goes on getting
/// faster for a moment, by up to a ninth.
const SPEED_SHARE: f64 = 0.85;

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
    fn along(machine: &Machine, lever: &messages::AxisArray) -> Self {
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
struct Course {
    /// Of the powers of the time [joint units, s].
    coefficients: [f64; 6],
    /// How long the polynomial lasts, and how much of it has gone by [cycles].
    cycles: u32,
    elapsed: u32,
    /// The speed afterwards [joint units/s].
    speed: f64,
}

impl Course {
    /// From rest at `from` to rest `distance` further.
    fn over(from: f64, distance: f64, pace: &Pace, period: f64) -> Self {
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
    fn to_speed(from: Motion, speed: f64, pace: &Pace, period: f64) -> Self {
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

    fn at(&self, elapsed: u32, period: f64) -> Motion {
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
    fn end(&self, period: f64) -> f64 {
        self.at(self.cycles, period).position
    }

    /// Whether it leads from rest to rest.
    fn is_sent(&self) -> bool {
        self.coefficients[5] != 0.0
    }

    fn rests(&self) -> bool {
        self.elapsed >= self.cycles && self.speed == 0.0
    }
}

/// Whole cycles of `time`, at least one.
fn whole(time: f64, period: f64) -> u32 {
    (time / period - 1e-9).ceil().clamp(1.0, 1e9) as u32
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

    /// The motors' places are told otherwise by `shift` [rad] from now on.
    pub fn shift(&mut self, shift: &ActuatorArray) {
        self.base.angle.iter_mut().zip(shift).for_each(|(angle, shift)| *angle += shift);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::random::SplitMix64;

    const PERIOD: f64 = 1e-3;

    /// Differences of the planned places keep the limits, and the ways end where they shall.
    #[test]
    fn random_requests_never_break_a_limit() {
        let machine = Machine::builtin();
        let pace = Pace::new(&machine, &machine.axes[0]);
        let ratio = machine.actuators[0].ratio;
        for seed in 1..200 {
            let mut random = SplitMix64::new(seed);
            let mut travel = Travel::new(&machine, PERIOD);
            let mut standing = Planned::default();
            let mut joints = [0.0; 4];
            for _ in 0..4000 {
                if random.fraction() < 0.01 {
                    match (random.fraction() * 3.0) as u32 {
                        0 => travel.run(
                            0,
                            (random.fraction() - 0.5) * 4.0 * pace.velocity,
                            &standing,
                        ),
                        1 => travel.stop(0),
                        _ if travel.rests(0) => {
                            travel.go(0, random.fraction() - 0.5, 1.0, &standing)
                        }
                        _ => {}
                    }
                }
                standing = travel.advance(|_| {}).unwrap_or(standing);
                joints.rotate_left(1);
                joints[3] = standing.angle[0] * ratio;
                let [a, b, c, d] = joints;
                let velocity = (d - c) / PERIOD;
                let acceleration = (d - 2.0 * c + b) / (PERIOD * PERIOD);
                let jerk = (d - 3.0 * c + 3.0 * b - a) / (PERIOD * PERIOD * PERIOD);
                let most = pace.velocity / SPEED_SHARE;
                assert!(velocity.abs() <= most, "seed {seed}: {velocity}");
                assert!(
                    acceleration.abs() <= 1.01 * pace.acceleration,
                    "seed {seed}: {acceleration}"
                );
                assert!(jerk.abs() <= 1.05 * pace.jerk, "seed {seed}: {jerk}");
            }
        }
    }

    #[test]
    fn a_joint_that_is_kept_within_stops_before_the_end_and_close_to_it() {
        let machine = Machine::builtin();
        let mut bounds = [None; MOVERS];
        bounds[0] = Some([-0.1, 0.1]);
        for speed in [0.01, 0.1, 0.2] {
            let mut travel = Travel::new(&machine, PERIOD);
            let mut standing = Planned::default();
            travel.run(0, speed, &standing);
            for _ in 0..20_000 {
                travel.keep_within(0, &bounds, &standing);
                standing = travel.advance(|_| {}).unwrap_or(standing);
                assert!(travel.place(0, &standing) <= 0.1);
            }
            assert!(travel.is_at_rest());
            assert!(travel.place(0, &standing) > 0.1 - 1.1e-3 * speed.max(0.1), "{speed}");
        }
    }

    #[test]
    fn the_tool_of_a_corexy_goes_straight_and_no_joint_leads_it_out_of_the_area() {
        let machine = Machine::builtin();
        let [x, y] = [MAX_AXES, MAX_AXES + 1];
        let mut travel = Travel::new(&machine, PERIOD);
        let mut standing = Planned::default();
        travel.go(y, 0.02, 0.1, &standing);
        while let Some(mut planned) = travel.advance(|_| {}) {
            let joint = |index: usize| planned.angle[index] * machine.actuators[index].ratio;
            assert!((joint(0) + joint(1)).abs() < 1e-12, "x stays");
            planned.tool[1] = (joint(0) - joint(1)) / 2.0;
            standing = planned;
        }
        assert!((travel.place(y, &standing) - 0.02).abs() < 1e-12);
        assert!((travel.place(0, &standing) - 0.02).abs() < 1e-12);
        // Belt a takes the tool along x and y at once: x ends it.
        let mut bounds = [None; MOVERS];
        bounds[x] = Some([-0.01, 0.03]);
        let far = travel.beyond(0, 0.1, &bounds, &standing).unwrap();
        assert_eq!((far.mover, far.limit), (x, 0.03));
        assert!((far.end - 0.05).abs() < 1e-12);
        travel.run(0, 0.1, &standing);
        let mut told = None;
        for _ in 0..5000 {
            told = told.or(travel.keep_within(0, &bounds, &standing));
            assert!(travel.place(x, &standing) <= 0.03);
            let Some(mut planned) = travel.advance(|_| {}) else { break };
            planned.tool[0] = 0.5 * (planned.angle[0] * machine.actuators[0].ratio - 0.02);
            standing = planned;
        }
        assert_eq!(told.map(|it| it.mover), Some(x));
        assert!(travel.is_at_rest());
    }

    #[test]
    fn a_way_ends_exactly_where_it_shall_and_a_shift_moves_nothing() {
        let machine = Machine::builtin();
        let mut travel = Travel::new(&machine, PERIOD);
        let mut standing = Planned::default();
        travel.go(1, -0.05, 0.1, &standing);
        while let Some(planned) = travel.advance(|_| {}) {
            standing = planned;
        }
        assert!((travel.place(1, &standing) + 0.05).abs() < 1e-12);
        assert_eq!(standing.speed, [0.0; MAX_ACTUATORS]);
        travel.go(1, 0.05, 0.1, &standing);
        travel.advance(|_| {});
        let before = travel.place(1, &standing);
        let mut shift = [0.0; MAX_ACTUATORS];
        shift[1] = 3.0;
        travel.shift(&shift);
        let moved = travel.place(1, &standing) - before;
        assert!((moved - 3.0 * machine.actuators[1].ratio).abs() < 1e-12);
    }
}
