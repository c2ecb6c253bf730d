//! What the path and the joints bear where the stream is, while its rate changes.
//!
//! At rate `r` a velocity `v`, acceleration `a` and jerk `j` of the plan become `r·v`, `r²·a + ṙ·v` and
//! `r³·j + 3·r·ṙ·a + r̈·v`: vectors of the tool, whose lengths are limited, and numbers of each joint. At
//! an instant `r` and `ṙ` are given, and `r̈` is to choose: each limit allows an interval of it.
//!
//! The derivatives are differences of the setpoints' positions, as anybody would measure them: velocity and
//! acceleration at a setpoint, the jerk in the middle between two. Measured over the cycles, the bend is the
//! mean of those before and after a cycle, in its middle. Where the plan's jerk jumps, that is not the mean
//! of what either end bears. So the limits are kept at the beginning of the coming cycle, and in the middle
//! of the one before, there with the jerk on either side.

use crate::lookahead::Lookahead;
use crate::stream_time::{ONE, StreamTime};
use machine::{Axis, Machine};
use messages::time::{Period, SETPOINT_TIME};
use messages::{MAX_AXES, Setpoint};

/// What a change of the rate leaves of each limit: between setpoints, where a jump of the plan's jerk lies
/// between two, no more is known of the motion.
const MARGIN: f64 = 0.015;

/// What a change of the rate may use beyond what an even rate does, where that is more than the margin
/// leaves: a plan that uses all of a limit against the change, for as long as it lasts, would else never
/// let it begin.
const TOLERANCE: f64 = 0.004;

/// Velocity, acceleration and jerk of one coordinate, as planned.
type Derivatives = [f64; 3];

/// The tool and the joints: velocity and acceleration at a setpoint, jerk in the middle to the next.
#[derive(Debug, Clone, Copy, Default)]
pub struct Motion {
    tool: [Derivatives; 3],
    joints: [Derivatives; MAX_AXES],
}

impl Motion {
    /// In the middle one of these five.
    pub fn amid(setpoints: [&Setpoint; 5]) -> Self {
        Self {
            tool: core::array::from_fn(|index| derivatives(setpoints.map(|at| at.tool[index]))),
            joints: core::array::from_fn(|index| {
                derivatives(setpoints.map(|at| at.position[index]))
            }),
        }
    }
}

/// From five places, a setpoint apart.
fn derivatives([a, b, c, d, e]: [f64; 5]) -> Derivatives {
    let per = 1.0 / SETPOINT_TIME;
    [
        (8.0 * (d - b) - (e - a)) / 12.0 * per,
        ((d - c) - (c - b)) * per * per,
        ((e - b) - 3.0 * (d - c)) * per * per * per,
    ]
}

/// How the rate goes at the beginning of a cycle.
#[derive(Debug, Clone, Copy, Default)]
pub struct Going {
    /// The rate.
    pub rate: f64,
    /// Its change over the cycle before [1/s].
    pub change: f64,
    /// The change of that from the cycle before it [1/s²].
    pub bend: f64,
}

/// The largest acceleration and jerk.
#[derive(Debug, Clone, Copy, Default)]
struct Largest {
    acceleration: f64,
    jerk: f64,
}

/// The limits of a machine that a change of the rate must keep.
#[derive(Debug, Clone)]
pub struct MotionLimits {
    path: Largest,
    /// Of the joints that have any, with their numbers.
    joints: Vec<(usize, Largest)>,
}

impl MotionLimits {
    /// Of this machine.
    pub fn new(machine: &Machine) -> Self {
        let most = 1.0 - MARGIN;
        let joint = |axis: &Axis| Largest {
            acceleration: axis.acceleration_limit().plan * most,
            jerk: axis.jerk_limit().plan * most,
        };
        let limited = |(_, largest): &(usize, Largest)| {
            largest.acceleration.is_finite() || largest.jerk.is_finite()
        };
        let path = &machine.path;
        Self {
            path: Largest { acceleration: path.acceleration * most, jerk: path.jerk * most },
            joints: machine.axes.iter().map(joint).enumerate().filter(limited).collect(),
        }
    }
}

/// The stream ahead and the limits along it.
#[derive(Debug, Clone, Copy)]
pub struct Course<'a> {
    /// The stream.
    pub lookahead: &'a Lookahead,
    /// The limits.
    pub limits: &'a MotionLimits,
    /// The period of the cycles in which the rate changes.
    pub period: Period,
}

/// A line in the coming bend of the rate: `constant + slope·bend`.
#[derive(Debug, Clone, Copy, Default)]
struct Line {
    constant: f64,
    slope: f64,
    /// What it would be at an even rate.
    even: f64,
}

impl Line {
    fn at(self, bend: f64) -> f64 {
        self.constant + self.slope * bend
    }
}

/// A derivative of the rate over the coming bend: `constant + slope·bend`.
#[derive(Clone, Copy, Default)]
struct Growth {
    constant: f64,
    slope: f64,
}

/// The stream at an instant, and the rate there with its derivatives over the coming bend.
#[derive(Clone, Copy)]
struct Instant<'a> {
    /// The setpoints around it, and how far it is on from the first.
    around: [&'a Motion; 2],
    fraction: f64,
    /// Those with the jerks around it, and how far it is on from the first of them.
    jerks: [&'a Motion; 2],
    jerk_fraction: f64,
    rate: f64,
    change: Growth,
    bend: Growth,
}

impl Instant<'_> {
    /// Velocity, acceleration and jerk of a coordinate.
    fn of(&self, coordinate: impl Fn(&Motion) -> &Derivatives) -> Derivatives {
        let between = |[from, to]: [&Motion; 2], order: usize, fraction: f64| {
            let (from, to) = (coordinate(from)[order], coordinate(to)[order]);
            from + (to - from) * fraction
        };
        [
            between(self.around, 0, self.fraction),
            between(self.around, 1, self.fraction),
            between(self.jerks, 2, self.jerk_fraction),
        ]
    }

    fn acceleration(&self, [velocity, acceleration, _]: Derivatives) -> Line {
        let even = self.rate * self.rate * acceleration;
        Line {
            constant: even + self.change.constant * velocity,
            slope: self.change.slope * velocity,
            even,
        }
    }

    fn jerk(&self, [velocity, acceleration, jerk]: Derivatives) -> Line {
        let even = self.rate * self.rate * self.rate * jerk;
        let twist = 3.0 * self.rate * acceleration;
        Line {
            constant: even + twist * self.change.constant + self.bend.constant * velocity,
            slope: twist * self.change.slope + self.bend.slope * velocity,
            even,
        }
    }

    fn tool(&self, line: fn(&Self, Derivatives) -> Line) -> [Line; 3] {
        [0, 1, 2].map(|index| line(self, self.of(|motion| &motion.tool[index])))
    }

    fn joint(&self, line: fn(&Self, Derivatives) -> Line, index: usize) -> Line {
        line(self, self.of(|motion| &motion.joints[index]))
    }
}

impl<'a> Course<'a> {
    /// Whether all limits bear `bend` [1/s²] in the cycle from `time` on.
    pub fn allows(&self, time: StreamTime, going: Going, bend: f64) -> bool {
        let instants = self.instants(time, going);
        let here = &instants[0];
        let bears = |lines: [Line; 3], limit: f64| {
            sum(&lines, |line| line.at(bend) * line.at(bend)) <= square_allowed(&lines, limit)
        };
        let bears_joint =
            |line: Line, limit: f64| line.at(bend).abs() <= allowed(line.even.abs(), limit);
        let MotionLimits { path, joints } = self.limits;
        bears(here.tool(Instant::acceleration), path.acceleration)
            && instants.iter().all(|instant| bears(instant.tool(Instant::jerk), path.jerk))
            && joints.iter().all(|(index, largest)| {
                bears_joint(here.joint(Instant::acceleration, *index), largest.acceleration)
                    && instants.iter().all(|instant| {
                        bears_joint(instant.joint(Instant::jerk, *index), largest.jerk)
                    })
            })
    }

    /// The bends [1/s²] that all limits bear in the cycle from `time` on, or what comes nearest.
    pub fn bends(&self, time: StreamTime, going: Going) -> Bends {
        let instants = self.instants(time, going);
        let here = &instants[0];
        let MotionLimits { path, joints } = self.limits;
        let mut bends = Bends::ALL;
        bends.keep_vector(here.tool(Instant::acceleration), path.acceleration);
        for instant in &instants {
            bends.keep_vector(instant.tool(Instant::jerk), path.jerk);
        }
        for (index, largest) in joints {
            bends.keep(here.joint(Instant::acceleration, *index), largest.acceleration);
            for instant in &instants {
                bends.keep(instant.joint(Instant::jerk, *index), largest.jerk);
            }
        }
        bends
    }

    /// `time`, and the middle of the cycle before it with the jerk on either side.
    fn instants(&self, time: StreamTime, going: Going) -> [Instant<'a>; 3] {
        let Going { rate, change, bend } = going;
        let cycle_time = self.period.seconds();
        let half_before = rate - change * cycle_time / 2.0;
        let half_a_cycle = StreamTime::in_cycles(1, self.period).0 / 2;
        let middle = time - StreamTime((half_before * half_a_cycle as f64) as i64);
        // The change at an instant is the mean of those before and after, and in the middle of a cycle
        // that of its ends; so is the bend.
        let quarter = cycle_time / 4.0;
        let here = Instant {
            change: Growth { constant: change, slope: 2.0 * quarter },
            bend: Growth { constant: 0.0, slope: 1.0 },
            ..self.instant(time, rate)
        };
        let before = Instant {
            change: Growth { constant: change - quarter * bend, slope: quarter },
            bend: Growth { constant: 0.5 * bend, slope: 0.5 },
            ..self.instant(middle, half_before)
        };
        let [early, late] = [0.0, 1.0].map(|jerk_fraction| Instant { jerk_fraction, ..before });
        [here, early, late]
    }

    fn instant(&self, time: StreamTime, rate: f64) -> Instant<'a> {
        let around = |time: StreamTime| {
            [time.sequence(), time.sequence() + 1].map(|sequence| self.lookahead.motion(sequence))
        };
        let half_before = time - StreamTime(ONE / 2);
        Instant {
            around: around(time),
            fraction: time.fraction(),
            jerks: around(half_before),
            jerk_fraction: half_before.fraction(),
            rate,
            change: Growth::default(),
            bend: Growth::default(),
        }
    }
}

/// What is allowed of a number that is `even` at an even rate.
fn allowed(even: f64, limit: f64) -> f64 {
    limit.max(even * (1.0 + TOLERANCE))
}

/// The square of what is allowed of a vector's length.
fn square_allowed(lines: &[Line; 3], limit: f64) -> f64 {
    let even = sum(lines, |line| line.even * line.even);
    (limit * limit).max(even * ((1.0 + TOLERANCE) * (1.0 + TOLERANCE)))
}

fn sum(lines: &[Line; 3], part: impl Fn(&Line) -> f64) -> f64 {
    part(&lines[0]) + part(&lines[1]) + part(&lines[2])
}

/// An interval of bends [1/s²].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bends {
    /// The least of them.
    pub least: f64,
    /// The greatest.
    pub most: f64,
    /// Whether they are within all limits; else there is no such bend, and this is what breaks them least.
    pub is_allowed: bool,
}

impl Bends {
    const ALL: Self = Self { least: f64::NEG_INFINITY, most: f64::INFINITY, is_allowed: true };

    /// Those that keep a number within `limit` on either side.
    fn keep(&mut self, line: Line, limit: f64) {
        let limit = allowed(line.even.abs(), limit);
        let slope = line.slope.abs();
        let constant = if line.slope < 0.0 { -line.constant } else { line.constant };
        if slope == 0.0 {
            self.is_allowed &= constant.abs() <= limit;
        } else {
            self.intersect((-limit - constant) / slope, (limit - constant) / slope);
        }
    }

    /// Those that keep a vector's length within `limit`.
    fn keep_vector(&mut self, lines: [Line; 3], limit: f64) {
        let slopes = sum(&lines, |line| line.slope * line.slope);
        let mixed = sum(&lines, |line| line.constant * line.slope);
        let constants = sum(&lines, |line| line.constant * line.constant);
        let over = constants - square_allowed(&lines, limit);
        if slopes == 0.0 {
            self.is_allowed &= over <= 0.0;
            return;
        }
        let square = mixed * mixed - slopes * over;
        self.is_allowed &= square >= 0.0;
        let root = square.max(0.0).sqrt();
        self.intersect((-mixed - root) / slopes, (-mixed + root) / slopes);
    }

    fn intersect(&mut self, least: f64, most: f64) {
        let (least, most) = (self.least.max(least), self.most.min(most));
        if least <= most {
            (self.least, self.most) = (least, most);
        } else {
            let between = (least + most) / 2.0;
            *self = Self { least: between, most: between, is_allowed: false };
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// A stream of constant jerk along both joints of the built-in machine.
    fn cubic(jerk: f64) -> Lookahead {
        let mut ring = Lookahead::new();
        for sequence in 0..200 {
            let time = (sequence as f64 - 60.0) * SETPOINT_TIME;
            let place = jerk * time * time * time / 6.0;
            let mut setpoint = Setpoint { stream: 1, sequence, ..Setpoint::default() };
            (setpoint.tool[0], setpoint.position[0], setpoint.position[1]) = (place, place, place);
            ring.accept(&setpoint).unwrap();
        }
        ring
    }

    #[test]
    fn the_derivatives_of_a_cubic_are_exact() {
        let ring = cubic(400.0);
        let time = 0.04;
        let [velocity, acceleration, jerk] = ring.motion(100).tool[0];
        assert!((velocity - 200.0 * time * time).abs() < 1e-9, "{velocity}");
        assert!((acceleration - 400.0 * time).abs() < 1e-6, "{acceleration}");
        assert!((jerk - 400.0).abs() < 1e-3, "{jerk}");
    }

    #[test]
    fn a_bend_uses_what_the_plan_leaves_of_the_jerk() {
        let (ring, limits) = (cubic(400.0), MotionLimits::new(&Machine::builtin()));
        let course = Course { lookahead: &ring, limits: &limits, period: Period::OF_SETPOINTS };
        let going = Going { rate: 1.0, ..Going::default() };
        let bends = course.bends(StreamTime::of(80), going);
        assert!(bends.is_allowed);
        // 0.08 m/s and 8 m/s², of which half a cycle of the bend comes to the change.
        let slope = 0.08 + 1.5 * 8.0 * SETPOINT_TIME;
        assert!((bends.most - (492.5 - 400.0) / slope).abs() < 1.0, "{bends:?}");
        assert!(course.allows(StreamTime::of(80), going, bends.most - 1.0));
        assert!(!course.allows(StreamTime::of(80), going, bends.most + 1.0));
        assert!(!course.allows(StreamTime::of(80), going, bends.least - 1.0));
    }

    #[test]
    fn an_even_rate_is_always_allowed_where_the_plan_is() {
        let (ring, limits) = (cubic(500.0), MotionLimits::new(&Machine::builtin()));
        let course = Course { lookahead: &ring, limits: &limits, period: Period::OF_SETPOINTS };
        for rate in [1.0, 0.99, 0.5, 0.1, 0.0] {
            let going = Going { rate, ..Going::default() };
            assert!(course.allows(StreamTime::of(75), going, 0.0), "{rate}");
        }
    }
}
