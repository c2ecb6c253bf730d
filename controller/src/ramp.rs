//! How the rate of the stream changes: limited in its first and second derivative, by numbers of its
//! own and by what the path and the joints bear where the stream is.
//!
//! Each cycle chooses the change of the rate anew: towards the rate that is wanted, as fast as the
//! [`Course`] allows. Fast now may be too fast a few setpoints on, where the plan itself uses up the
//! limits. So a change is taken only if there is a way back from it: from there to an even rate, within
//! the limits in every cycle. At an even rate of 1 or less the plan's own limits hold, so there is always
//! a next step, and none has to break a limit. Where all of a limit is used against the change, the
//! rate leaves slowly: by what is allowed beyond it, and by the room that each step makes.
//!
//! Rates are whole counts, so that a target is reached exactly, and the sum of all changes is exact.
//!
//! Unhindered, a hold from rate 1 takes 0.13 s. Overrides change the rate five times as gently.

use crate::motion_limits::{Bends, Course, Going};
use crate::stream_time::{FRACTION_BITS, SETPOINT_STEPS, StreamTime};
use messages::Nanoseconds;
use messages::time::{Period, SETPOINT_TIME};

/// Bits after the binary point of a rate. The mean of two has one more: the [`FRACTION_BITS`] of
/// stream time.
const RATE_BITS: u32 = FRACTION_BITS - 1;

/// Changes that are tried between the largest and the one that is known to be safe.
const TRIALS: u32 = 3;

/// The largest bend on a way back, against that of a stop.
const WAY_BACK_BEND: i64 = 2;

/// Time in which a way back to an even rate must end.
const WAY_BACK: Nanoseconds = Nanoseconds(48_000_000);

/// The largest change of the rate [1/s], and of that in a second [1/(2·s²)]: to and from rest, and between
/// rates while marking.
const STOP: [i64; 2] = [10, 625];
const GENTLE: [i64; 2] = [2, 125];

/// Nanoseconds in a second.
const NANOSECONDS: i128 = 1_000_000_000;

/// A rate in counts of 2⁻²⁹; 1 is as planned, negative is backwards.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Rate(pub i64);

impl Rate {
    /// At rest.
    pub const ZERO: Self = Self(0);
    /// As planned.
    pub const ONE: Self = Self(1 << RATE_BITS);

    /// The rate nearest to `rate`, which must be finite.
    pub fn nearest(rate: f64) -> Self {
        Self((rate * Self::ONE.0 as f64).round() as i64)
    }

    /// As a number.
    pub fn value(self) -> f64 {
        self.0 as f64 / Self::ONE.0 as f64
    }
}

/// How rates change in cycles of one period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pace {
    period: Period,
    /// To and from rest: ṙ ≤ 10/s, r̈ ≤ 312.5/s².
    pub stop: Slew,
    /// Between rates while marking: ṙ ≤ 2/s, r̈ ≤ 62.5/s².
    pub gentle: Slew,
    /// Cycles in which a way back to an even rate must end.
    way_back: u64,
}

impl Pace {
    /// In cycles of this period.
    pub fn new(period: Period) -> Self {
        Self {
            period,
            stop: Slew::new(STOP, period),
            gentle: Slew::new(GENTLE, period),
            way_back: period.cycles_for(WAY_BACK),
        }
    }

    /// The period of the cycles.
    pub fn period(&self) -> Period {
        self.period
    }

    /// The largest bend on a way back, in counts.
    fn largest_bend(&self) -> i64 {
        WAY_BACK_BEND * self.stop.bend
    }

    /// A change of the change, per second²; in counts.
    fn bend_of(&self, counts: i64) -> f64 {
        let cycle_time = self.period.seconds();
        Rate(counts).value() / (cycle_time * cycle_time)
    }
}

/// How fast the rate may change at most, in counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slew {
    /// Per cycle.
    change: i64,
    /// Change of that, per cycle.
    bend: i64,
}

impl Slew {
    fn new([change, bend]: [i64; 2], period: Period) -> Self {
        let [one, cycle] = [Rate::ONE.0, period.time().0].map(i128::from);
        let counts = |counts: i128| i64::try_from(counts).unwrap_or(i64::MAX).max(1);
        Self {
            change: counts(one * cycle * i128::from(change) / NANOSECONDS),
            bend: counts(one * cycle * cycle * i128::from(bend) / (2 * NANOSECONDS * NANOSECONDS)),
        }
    }

    /// The largest change, up to `self.change`, from which the rate still lands exactly within `gap`.
    fn landing(self, gap: i64) -> i64 {
        // With m = change, n = m div bend, the changes to come are m − bend, m − 2·bend, …: with m
        // itself m·(n + 1) − bend·n·(n + 1)/2 in all, and bend·n·(n + 1)/2 for m = n·bend.
        if gap >= self.change * (self.change / self.bend + 2) {
            return self.change;
        }
        let sum = |n: i64| self.bend * (n * (n + 1) / 2);
        let mut n = ((0.25 + 2.0 * gap as f64 / self.bend as f64).sqrt() - 0.5) as i64;
        while sum(n) > gap {
            n -= 1;
        }
        ((gap + sum(n)) / (n + 1)).min(self.change)
    }
}

/// The most by which the rate changes [1/s].
pub const LARGEST_CHANGE: f64 = STOP[0] as f64;

/// The most by which that changes from one setpoint to the next [1/s].
pub const LARGEST_TURN: f64 = (WAY_BACK_BEND * STOP[1]) as f64 / 2.0 * SETPOINT_TIME;

/// A rate on its way.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Ramp {
    rate: i64,
    /// What the rate changed by in the cycle before.
    change: i64,
    /// What that changed by from the cycle before it.
    bend: i64,
}

impl Ramp {
    /// At rest.
    pub fn new() -> Self {
        Self::default()
    }

    /// The rate now.
    pub fn rate(self) -> Rate {
        Rate(self.rate)
    }

    /// Whether the rate is `rate` and stays so.
    pub fn is_even_at(self, rate: Rate) -> bool {
        self.rate == rate.0 && self.change == 0
    }

    /// Whether the rate is zero and stays so.
    pub fn is_still(self) -> bool {
        self.is_even_at(Rate::ZERO)
    }

    /// At `rate`; only where the stream itself is at rest may it come to this at once.
    pub fn even(rate: Rate) -> Self {
        Self { rate: rate.0, ..Self::default() }
    }

    /// One cycle later, with this change.
    fn changed(self, change: i64) -> Self {
        Self { rate: self.rate + change, change, bend: change - self.change }
    }

    /// How far the stream moves in the cycle in which the rate comes from `before` to this: exactly in a
    /// cycle of a setpoint and at the planned rate, else to a count.
    pub fn advance(self, before: Self, pace: &Pace) -> StreamTime {
        StreamTime((before.rate + self.rate) * pace.period.steps() / SETPOINT_STEPS)
    }

    /// One cycle later on the way to `target`, from `time` on, as fast as `slew` and the limits of
    /// `course` let it.
    #[must_use]
    pub fn toward(
        self,
        target: Rate,
        slew: Slew,
        pace: &Pace,
        course: &Course<'_>,
        time: StreamTime,
    ) -> Self {
        let gap = target.0 - self.rate;
        if gap == 0 && self.change == 0 {
            return Self::even(target);
        }
        let bends = course.bends(time, self.going(pace));
        let mut safe = self.bent(-self.change, &bends, pace);
        let mut wished = self.bent(self.unhindered(target, slew).bend, &bends, pace);
        let is_safe = |ramp: Self| {
            ramp.is_safe([target.0, gap], pace, course, time + ramp.advance(self, pace))
        };
        if bends.is_allowed && is_safe(wished) {
            return wished;
        }
        for _ in 0..TRIALS {
            let between = self.changed((safe.change + wished.change) / 2);
            if is_safe(between) {
                safe = between;
            } else {
                wished = between;
            }
        }
        safe
    }

    /// One cycle later with this bend, or the nearest that is among `bends`.
    fn bent(self, bend: i64, bends: &Bends, pace: &Pace) -> Self {
        let largest = pace.largest_bend() as f64;
        let counts = |bend: f64| (bend / pace.bend_of(1)).clamp(-largest, largest);
        let (least, most) = (counts(bends.least).ceil() as i64, counts(bends.most).floor() as i64);
        self.changed(self.change + bend.min(most).max(least))
    }

    /// One cycle later on the way to `target`, as fast as `slew` lets it.
    #[must_use]
    pub fn unhindered(self, target: Rate, slew: Slew) -> Self {
        let gap = target.0 - self.rate;
        let direction = if gap == 0 { -self.change.signum() } else { gap.signum() };
        let speed = direction * self.change;
        let most = slew.landing(gap.abs()).min(speed + slew.bend);
        self.changed(direction * most.max(speed - slew.bend))
    }

    /// How far the stream moves until an unhindered stop has come to rest.
    pub fn stopping_distance(mut self, pace: &Pace) -> StreamTime {
        let mut way = StreamTime::default();
        while !self.is_still() {
            let before = self;
            self = self.unhindered(Rate::ZERO, pace.stop);
            way = way + self.advance(before, pace);
        }
        way
    }

    /// How far the stream moves from rest until the rate is `rate`, unhindered.
    pub fn starting_distance(rate: Rate, pace: &Pace) -> StreamTime {
        let (mut ramp, mut way) = (Self::new(), StreamTime::default());
        while ramp.rate != rate.0 {
            let before = ramp;
            ramp = ramp.unhindered(rate, pace.stop);
            way = way + ramp.advance(before, pace);
        }
        way
    }

    /// Whether there is a way from here, at `time`, to an even rate that is not beyond `target`, which
    /// was `gap` away, in counts: as fast as the limits let it, and within them all the way.
    fn is_safe(
        self,
        [target, gap]: [i64; 2],
        pace: &Pace,
        course: &Course<'_>,
        mut time: StreamTime,
    ) -> bool {
        let mut ramp = self;
        let most = pace.largest_bend();
        for _ in 0..pace.way_back {
            let left = target - ramp.rate;
            let beyond = left.signum() * gap.signum() < 0 || ramp.rate.abs() > Rate::ONE.0;
            if beyond || ramp.change.abs() > pace.stop.change {
                return false;
            }
            let before = ramp;
            let bend = (-ramp.change).clamp(-most, most);
            if course.allows(time, ramp.going(pace), pace.bend_of(bend)) {
                if ramp.change == 0 {
                    return true;
                }
                ramp = ramp.changed(ramp.change + bend);
            } else {
                let bends = course.bends(time, ramp.going(pace));
                let largest = pace.bend_of(most);
                if !bends.is_allowed || bends.least > largest || bends.most < -largest {
                    return false;
                }
                ramp = ramp.bent(-ramp.change, &bends, pace);
            }
            time = time + ramp.advance(before, pace);
        }
        false
    }

    fn going(self, pace: &Pace) -> Going {
        let change = Rate(self.change).value() / pace.period.seconds();
        Going { rate: self.rate().value(), change, bend: pace.bend_of(self.bend) }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// The periods that are tried, the shortest, that of the setpoints and the longest among them.
    fn paces() -> [Pace; 4] {
        let half = Period::new(Nanoseconds(500_000)).unwrap();
        [Period::SHORTEST, half, Period::OF_SETPOINTS, Period::LONGEST].map(Pace::new)
    }

    /// Unhindered to `target`: the rates, and how far the stream moves.
    fn run(mut ramp: Ramp, target: Rate, slew: Slew, pace: &Pace) -> (Vec<Ramp>, StreamTime) {
        let (mut ramps, mut way) = (vec![ramp], StreamTime::default());
        while !ramp.is_even_at(target) {
            let before = ramp;
            ramp = ramp.unhindered(target, slew);
            way = way + ramp.advance(before, pace);
            ramps.push(ramp);
            assert!(ramps.len() < 40_000, "never at {target:?}");
        }
        (ramps, way)
    }

    #[test]
    fn lands_exactly_and_keeps_both_limits() {
        let ways = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (0.3, 0.302), (0.777, 0.1)];
        for (pace, (from, to)) in paces().iter().flat_map(|pace| ways.map(|way| (pace, way))) {
            for slew in [pace.stop, pace.gentle] {
                let [from, to] = [from, to].map(Rate::nearest);
                let (ramps, _) = run(Ramp::even(from), to, slew, pace);
                let inside = from.min(to)..=from.max(to);
                for ramp in &ramps {
                    assert!(inside.contains(&ramp.rate()), "{ramp:?} from {from:?} to {to:?}");
                    assert!(ramp.change.abs() <= slew.change && ramp.bend.abs() <= slew.bend);
                }
            }
        }
    }

    #[test]
    fn foresees_the_way_to_rest_and_up_to_a_rate_exactly() {
        for pace in &paces() {
            let (ramps, way) = run(Ramp::new(), Rate::ONE, pace.stop, pace);
            // The last cycle is at the rate already.
            let cycle = StreamTime::in_cycles(1, pace.period());
            assert_eq!(Ramp::starting_distance(Rate::ONE, pace) + cycle, way);
            for ramp in ramps {
                let (_, way) = run(ramp, Rate::ZERO, pace.stop, pace);
                assert_eq!(ramp.stopping_distance(pace), way, "{ramp:?}");
            }
        }
    }

    #[test]
    fn a_ramp_that_the_limits_bent_finds_its_way_to_rest_too() {
        let rates = [-1.0, -0.3, 0.0, 1e-6, 0.2, 1.0];
        for (pace, rate) in paces().iter().flat_map(|pace| rates.map(|rate| (pace, rate))) {
            for change in [-1.0, -0.37, 0.0, 0.5, 1.0] {
                for bend in [-2.0, -1.0, 0.0, 0.4, 2.0] {
                    let change = (pace.stop.change as f64 * change) as i64;
                    let bend = (pace.stop.bend as f64 * bend) as i64;
                    let ramp = Ramp { rate: Rate::nearest(rate).0, change, bend };
                    let (ramps, way) = run(ramp, Rate::ZERO, pace.stop, pace);
                    assert_eq!(ramp.stopping_distance(pace), way, "{ramp:?}");
                    let took = pace.period().of(ramps.len() as u64);
                    assert!(took < Nanoseconds(320_000_000), "{took:?} from {ramp:?}");
                }
            }
        }
    }

    #[test]
    fn an_unhindered_hold_takes_what_the_header_says() {
        for pace in &paces() {
            let (ramps, _) = run(Ramp::even(Rate::ONE), Rate::ZERO, pace.stop, pace);
            let took = pace.period().of(ramps.len() as u64).seconds();
            let most = 0.1325 + 2.0 * pace.period().seconds();
            assert!((0.131..=most).contains(&took), "{took} s, {:?}", pace.period());
        }
    }
}
