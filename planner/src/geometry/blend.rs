//! The smoothing of a joint: where two curves of a stroke meet with a small kink or a jump of
//! curvature, the path leaves them over a short way so that its acceleration is continuous.
//!
//! The smoothed path is `p(x) = curve(x) + e(x)` over `−reach ≤ x ≤ reach`, with x the arc length
//! from the join. The offset `e` is a cubic spline whose third derivative is bang-bang: with the
//! largest third derivative given, no other offset is shorter. It has two parts.
//!
//! ```text
//! kink δ₁ = t_B − t_A            e″ = δ₁·(reach − |x|)/reach²            deviation |δ₁|·reach/6
//!                                flatter in the middle where the jerk leaves room for it
//! curvature jump δ₂ = p″_B − p″_A
//!   e″ = ±δ₂·(F(|x|) − ½),  F = k·|x| up to ρ·reach, then k·(2ρ·reach − |x|)
//!   with ρ³ = ½ and k = ½/((2ρ − 1)·reach): e, e′ and e″ vanish at ±reach
//!                                                      deviation 0.01446·|δ₂|·reach²
//! ```
//!
//! The speed along the smoothed path differs from the one along the curves by a share of at most
//! `0.011·|δ₂|²·reach²`, and is left at that: with a tolerance of 5 µm this is below 0.1 % where the
//! curvature jumps by 200/m (the S of 10 mm at full reach), and 0.7 % at 2000/m.

use machine::PathLimits;
use nalgebra::Vector3;

use crate::geometry::jet::Jet;
use crate::geometry::track::{Bend, Track};

/// ρ, the cube root of ½: from `∫x·(F − ½) = 0`, so that the path meets both curves again.
const TURN: f64 = 0.793_700_525_984_099_8;

/// k·reach.
const SLOPE: f64 = 0.5 / (2.0 * TURN - 1.0);

/// Largest |e| of the curvature part over |δ₂|·reach²; it lies at x = 0.296·reach.
const DEVIATION: f64 = 0.014_464;

/// A join is lengthened beyond need only while the speed along it is even to a part in 10⁴:
/// √(10⁻⁴/0.011).
const EVEN: f64 = 0.095;

/// Largest F above ½: how far the curvature overshoots.
const OVERSHOOT: f64 = SLOPE * TURN - 0.5;

/// A curvature off by this little jumps the acceleration at 1 m/s by 1 µm/s² [1/m].
const CURVATURE: f64 = 1e-6;

/// The least share of the reach in which e″ rises.
const LEAST_RISE: f64 = 0.1;

/// Where one curve of a stroke goes over into the next.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Blend {
    /// Jump of the unit tangent [1].
    pub(crate) kink: Vector3<f64>,
    /// Jump of the curvature vector [1/m].
    pub(crate) bend: Vector3<f64>,
    /// Share of the reach in which the kink's e″ rises; less than all where jerk leaves room for it.
    rise: f64,
    /// The longest reach that tolerance and the neighbouring joins leave [m].
    pub(crate) room: f64,
    /// The curves' own curvature [1/m], and the parts of their third derivative along and across
    /// the path [1/m²], the larger of both sides.
    curvature: f64,
    along: f64,
    across: f64,
}

/// A segment of a smoothed join: a stretch of one curve and the cubic offset from it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BlendSegment {
    pub(crate) track: Track,
    /// Where it starts on the track [m].
    pub(crate) from: f64,
    /// Offset and its derivatives at the start.
    offset: [Vector3<f64>; 4],
}

impl Blend {
    /// Between a curve that ends with `before` and one that starts with `after`, with at most
    /// `room` to either side and at most `tolerance` from the curves.
    pub(crate) fn new(
        before: &Jet,
        after: &Jet,
        room: f64,
        tolerance: f64,
        limits: &PathLimits,
    ) -> Self {
        let kink = after.first - before.first;
        let bend = after.second - before.second;
        let split = |jet: &Jet| {
            let along = jet.third.dot(&jet.first);
            (along.abs(), (jet.third - jet.first * along).norm())
        };
        let ((along_before, across_before), (along_after, across_after)) =
            (split(before), split(after));
        let mut join = Self {
            kink,
            bend,
            rise: 1.0,
            room,
            curvature: before.second.norm().max(after.second.norm()),
            along: along_before.max(along_after),
            across: across_before.max(across_after),
        };
        join.rise = join.rise(room, tolerance, limits);
        join.room = room.min(join.reach_at(tolerance));
        join
    }

    /// Whether the curves go over into each other as they are, to rounding.
    pub(crate) fn is_smooth(&self) -> bool {
        /// A tangent off by this little turns a velocity of 1 m/s by 1 nm/s.
        const TANGENT: f64 = 1e-9;
        self.kink.norm() <= TANGENT && self.bend.norm() <= CURVATURE
    }

    /// The reach whose deviation from the curves is `deviation` [m].
    fn reach_at(&self, deviation: f64) -> f64 {
        let square = DEVIATION * self.bend.norm();
        let half = self.kink.norm() * lift(self.rise) / 2.0;
        // square·x² + 2·half·x = deviation, in the form without cancellation.
        deviation / (half + (half * half + square * deviation).sqrt())
    }

    /// The share of the reach in which e″ rises to its largest value as slowly as the jerk asks for, at
    /// the speed that the acceleration then allows.
    fn rise(&self, room: f64, tolerance: f64, limits: &PathLimits) -> f64 {
        let kink = self.kink.norm();
        if self.bend.norm() > CURVATURE || kink <= 0.0 {
            return 1.0;
        }
        let reach = room.min(tolerance / (kink * lift(LEAST_RISE)));
        let speed = (limits.acceleration * reach * (2.0 - LEAST_RISE) / kink).sqrt();
        let rise = limits.acceleration / limits.jerk * speed / reach;
        rise.clamp(LEAST_RISE, 1.0)
    }

    /// The sharpest bend of the smoothed join, from above.
    pub(crate) fn sharpest(&self, reach: f64) -> Bend {
        let (kink, bend) = (self.kink.norm(), self.bend.norm());
        let height = kink / (reach * (2.0 - self.rise));
        let curvature = self.curvature + height + OVERSHOOT * bend;
        let across = self.across + height / (reach * self.rise) + SLOPE * bend / reach;
        let along = self.along.max(curvature * curvature);
        Bend { curvature, third: (along * along + across * across).sqrt() }
    }

    /// The longest reach that costs nothing: within `deviation` [m], and even in speed.
    pub(crate) fn gentle(&self, deviation: f64) -> f64 {
        self.reach_at(deviation).min(EVEN / self.bend.norm())
    }

    /// The shortest reach that keeps `speed` within `acceleration` and `jerk`; `room` when there is
    /// none.
    pub(crate) fn shortest(&self, speed: f64, acceleration: f64, jerk: f64) -> f64 {
        let fits = |reach: f64| self.sharpest(reach).speed(acceleration, jerk) >= speed;
        let (mut short, mut long) = (self.room * 1e-6, self.room);
        if fits(short) || !fits(long) {
            return if fits(short) { short } else { long };
        }
        // Geometric bisection of six orders of magnitude to a part in a thousand.
        for _ in 0..24 {
            let middle = (short * long).sqrt();
            if fits(middle) {
                long = middle;
            } else {
                short = middle;
            }
        }
        long
    }

    /// The segments of the smoothed join with their lengths.
    pub(crate) fn segments(
        &self,
        before: &Track,
        after: &Track,
        reach: f64,
    ) -> Vec<(BlendSegment, f64)> {
        let end = before.length();
        let turn = TURN * reach;
        let segment = |track: &Track, from: f64, at: f64, length: f64| {
            (
                BlendSegment { track: track.clone(), from, offset: self.offset(reach, at, length) },
                length,
            )
        };
        // Without a jump of curvature its part of the offset is nothing, and the halves are one cubic.
        if self.bend.norm() <= CURVATURE {
            let flat = (1.0 - self.rise) * reach;
            let rise = reach - flat;
            let all = [
                segment(before, end - reach, -reach, rise),
                segment(before, end - flat, -flat, flat),
                segment(after, 0.0, 0.0, flat),
                segment(after, flat, flat, rise),
            ];
            return all.into_iter().filter(|(_, length)| *length > 0.0).collect();
        }
        vec![
            segment(before, end - reach, -reach, reach - turn),
            segment(before, end - turn, -turn, turn),
            segment(after, 0.0, 0.0, turn),
            segment(after, turn, turn, reach - turn),
        ]
    }

    /// The offset and its derivatives just after `x`, in the segment of `length` that starts there.
    fn offset(&self, reach: f64, x: f64, length: f64) -> [Vector3<f64>; 4] {
        let middle = x + length / 2.0;
        // By the distance y to the nearer end; the kink part is even in x, the other odd.
        let side = if middle < 0.0 { -1.0 } else { 1.0 };
        let y = reach - side * x;
        let slope = SLOPE / reach;
        let turn = TURN * reach;
        let even = self.even(reach, y, side, reach - side * middle);
        let odd = if middle.abs() > turn {
            [side * y * y * y / 6.0, -y * y / 2.0, side * y, -1.0].map(|v| v * slope)
        } else {
            let x = side * x;
            let rest = reach - turn;
            let tilt = turn / 2.0 - slope * (turn * turn + rest * rest) / 2.0;
            [
                side * (slope * x * x * x / 6.0 - x * x / 4.0 + tilt * x),
                slope * x * x / 2.0 - x / 2.0 + tilt,
                side * (slope * x - 0.5),
                slope,
            ]
        };
        std::array::from_fn(|order| self.kink * even[order] + self.bend * odd[order])
    }
}

impl Blend {
    /// The part of the offset that takes a kink of 1, and its derivatives, at the distance `y` from the
    /// nearer end, in the segment whose middle is at the distance `middle` from it.
    fn even(&self, reach: f64, y: f64, side: f64, middle: f64) -> [f64; 4] {
        let height = 1.0 / (reach * (2.0 - self.rise));
        let rise = self.rise * reach;
        if middle <= rise {
            let slope = height / rise;
            return [y * y * y / 6.0, -side * y * y / 2.0, y, -side].map(|v| v * slope);
        }
        let beyond = y - rise;
        [
            rise * rise / 6.0 + rise / 2.0 * beyond + beyond * beyond / 2.0,
            -side * (rise / 2.0 + beyond),
            1.0,
            0.0,
        ]
        .map(|v| v * height)
    }
}

/// |e| in the middle of a kink of 1 over its reach, when e″ rises in the share `rise` of it.
fn lift(rise: f64) -> f64 {
    let flat = 1.0 - rise;
    let risen = (1.0 - flat * flat) / 2.0 - (1.0 - flat * flat * flat) / 3.0;
    (flat * flat / 2.0 + risen / rise) / (2.0 - rise)
}

impl BlendSegment {
    /// How sharply it bends at most, over its `length`.
    pub(crate) fn bend(&self, length: f64) -> Bend {
        /// Points on a segment, which is a cubic away from a smooth curve.
        const POINTS: usize = 8;
        (0..=POINTS)
            .map(|point| Bend::of(&self.at(length * point as f64 / POINTS as f64)))
            .fold(Bend::default(), Bend::or)
    }

    /// The point and its derivatives at `distance` from the start of the segment [m].
    pub(crate) fn at(&self, distance: f64) -> Jet {
        let jet = self.track.at(self.from + distance);
        let [value, first, second, third] = &self.offset;
        let x = distance;
        Jet {
            point: jet.point + value + (first + (second / 2.0 + third * (x / 6.0)) * x) * x,
            first: jet.first + first + (second + third * (x / 2.0)) * x,
            second: jet.second + second + third * x,
            third: jet.third + third,
        }
    }
}
