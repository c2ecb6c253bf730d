//! How the rate of the stream changes: limited in its first and second derivative.
//!
//! A slew-limited rate runs through a moving average of [`LENGTH`] cycles. The average bounds the
//! second derivative, never overshoots, and lands exactly after [`LENGTH`] cycles. Rates are whole
//! counts, so the average, the way to rest and the way up to a rate are exact integers.
//!
//! With the numbers below a hold from rate 1 takes 0.1 s + 0.032 s. At 0.25 m/s it adds at most
//! 2.5 m/s² along the path. Where the plan brakes at its limit of 10 m/s² already, the sum peaks
//! 5 % above it, because the share of the plan falls with the square of the rate. To the jerk it
//! adds `3·a·r·ṙ + v·r̈`, at most 300 and 78 m/s³ of the planner's 500. A machine with faster rapids
//! gets more of both, in proportion to their speed.
//!
//! Overrides change the rate five times as gently: 0.5 m/s² and 60 + 16 m/s³. Above the planned rate
//! there is room for that inside the limits; see [`rate_limit`](crate::rate_limit).

use crate::stream_time::{FRACTION_BITS, StreamTime};
use messages::time::CYCLE_TIME;

/// Cycles of the moving average; a power of two.
pub const LENGTH: usize = 32;

/// The fastest a stream is ever played.
pub const LARGEST_RATE: f64 = 2.0;

/// Bits after the binary point of a rate. The sum of [`LENGTH`] rates has five more, and the
/// mean of two such sums one more: the [`FRACTION_BITS`] of stream time.
const RATE_BITS: u32 = FRACTION_BITS - LENGTH.trailing_zeros() - 1;

/// A rate in counts of 2⁻²⁴; 1 is as planned, negative is backwards.
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

    /// The largest rate not above `rate`, which must be finite.
    pub fn below(rate: f64) -> Self {
        Self((rate * Self::ONE.0 as f64).floor() as i64)
    }

    /// As a number.
    pub fn value(self) -> f64 {
        self.0 as f64 / Self::ONE.0 as f64
    }
}

/// How fast the rate may change, per cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slew(i64);

impl Slew {
    /// To and from rest: ṙ ≤ 10/s, r̈ ≤ 312/s².
    pub const STOP: Self = Self(Rate::ONE.0 / 100);
    /// Between rates while marking: ṙ ≤ 2/s, r̈ ≤ 62.5/s².
    pub const OVERRIDE: Self = Self(Rate::ONE.0 / 500);
}

/// Largest |ṙ| of [`Slew::OVERRIDE`] [1/s].
pub const OVERRIDE_CHANGE: f64 = 2.0;

/// Time of the moving average [s]: |r̈| is at most |ṙ| over it.
pub const AVERAGING: f64 = LENGTH as f64 * CYCLE_TIME;

/// The largest rate from which [`Slew::OVERRIDE`] comes down to `limit` within `distance` setpoints:
/// `d(r²)/ds = 2·ṙ`, after the distance on which the average still lags at the largest rate.
pub fn rate_before(limit: f64, distance: f64) -> f64 {
    let way = (distance - 2.0 * LARGEST_RATE * LENGTH as f64).max(0.0) * CYCLE_TIME;
    (limit * limit + 2.0 * OVERRIDE_CHANGE * way).sqrt()
}

/// The rate in the making.
#[derive(Debug, Clone)]
pub struct Ramp {
    recent: [i64; LENGTH],
    next: usize,
    /// Sum of `recent`.
    sum: i64,
    /// What `recent` still adds to the sums of the coming cycles.
    pending: i64,
}

impl Ramp {
    /// At rest.
    pub fn new() -> Self {
        Self { recent: [0; LENGTH], next: 0, sum: 0, pending: 0 }
    }

    /// The rate now.
    pub fn rate(&self) -> f64 {
        self.sum as f64 / (LENGTH as i64 * Rate::ONE.0) as f64
    }

    /// Whether the rate is zero and stays so.
    pub fn is_still(&self) -> bool {
        self.sum == 0 && self.pending == 0
    }

    /// Takes `rate` at once; only where the stream itself is at rest.
    pub fn jump(&mut self, rate: Rate) {
        let length = LENGTH as i64;
        self.recent = [rate.0; LENGTH];
        self.sum = rate.0 * length;
        self.pending = rate.0 * (length * (length - 1) / 2);
    }

    /// The next value of the slew-limited rate on its way to `target`.
    pub fn toward(&self, target: Rate, slew: Slew) -> Rate {
        let newest = self.newest();
        Rate(newest + (target.0 - newest).clamp(-slew.0, slew.0))
    }

    /// Goes on for one cycle with `rate` from [`Self::toward`]: how far the stream moves.
    pub fn advance(&mut self, rate: Rate) -> StreamTime {
        let before = self.sum;
        (self.sum, self.pending) = self.after(rate);
        self.recent[self.next % LENGTH] = rate.0;
        self.next = (self.next + 1) % LENGTH;
        StreamTime(before + self.sum)
    }

    /// How far the stream would move if it went on for one cycle with `rate` and then came to
    /// rest; signed.
    pub fn stopping_distance(&self, rate: Rate, slew: Slew) -> StreamTime {
        let (sum, pending) = self.after(rate);
        let cycles = rate.0.abs() / slew.0;
        let coming = cycles * rate.0 - rate.0.signum() * slew.0 * (cycles * (cycles + 1) / 2);
        StreamTime(self.sum + 2 * (sum + pending + LENGTH as i64 * coming))
    }

    /// How far the stream moves from rest until the rate is `rate`, which is positive.
    pub fn starting_distance(rate: Rate, slew: Slew) -> StreamTime {
        let length = LENGTH as i64;
        let cycles = (rate.0 + slew.0 - 1) / slew.0;
        let slewed = slew.0 * (cycles * (cycles - 1) / 2) + rate.0 * length;
        let sums = length * slewed - rate.0 * (length * (length - 1) / 2);
        StreamTime(2 * sums - length * rate.0)
    }

    fn newest(&self) -> i64 {
        self.recent[(self.next + LENGTH - 1) % LENGTH]
    }

    fn after(&self, rate: Rate) -> (i64, i64) {
        let kept = self.sum - self.recent[self.next % LENGTH];
        (kept + rate.0, self.pending - kept + (LENGTH as i64 - 1) * rate.0)
    }
}

impl Default for Ramp {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(ramp: &mut Ramp, target: Rate, slew: Slew, cycles: usize) -> StreamTime {
        (0..cycles).fold(StreamTime::default(), |way, _| {
            let rate = ramp.toward(target, slew);
            way + ramp.advance(rate)
        })
    }

    #[test]
    fn lands_exactly_and_keeps_both_limits() {
        let mut ramp = Ramp::new();
        let (mut rates, mut changes) = (vec![0.0], Vec::new());
        for cycle in 0..600 {
            let target = if cycle < 250 { Rate::nearest(1.7) } else { Rate::nearest(0.3) };
            let rate = ramp.toward(target, Slew::STOP);
            ramp.advance(rate);
            changes.push(ramp.rate() - rates[rates.len() - 1]);
            rates.push(ramp.rate());
        }
        // 10/s is 0.01 a cycle; 312.5/s² is 0.01/32 a cycle².
        assert!(changes.iter().all(|change| change.abs() <= 0.01 + 1e-12));
        assert!(changes.windows(2).all(|pair| (pair[1] - pair[0]).abs() <= 0.01 / 32.0 + 1e-9));
        assert_eq!(ramp.rate(), Rate::nearest(0.3).value());
        assert!(rates.iter().all(|rate| *rate <= Rate::nearest(1.7).value()));
    }

    #[test]
    fn foresees_the_way_to_rest_exactly() {
        for (start, cycles) in [(1.0, 0), (2.0, 17), (0.1, 3), (-1.0, 40)] {
            let mut ramp = Ramp::new();
            ramp.jump(Rate::nearest(start));
            run(&mut ramp, Rate::nearest(start * 0.7), Slew::OVERRIDE, cycles);
            let rate = ramp.toward(Rate::ZERO, Slew::STOP);
            let foreseen = ramp.stopping_distance(rate, Slew::STOP);
            let way = run(&mut ramp, Rate::ZERO, Slew::STOP, 400);
            assert!(ramp.is_still());
            assert_eq!(foreseen, way, "from {start} after {cycles}");
        }
    }

    #[test]
    fn foresees_the_way_up_exactly() {
        for target in [1.0, 2.0, 0.1, 0.777] {
            let target = Rate::nearest(target);
            let mut ramp = Ramp::new();
            let mut way = StreamTime::default();
            while ramp.rate() < target.value() {
                way = way + run(&mut ramp, target, Slew::STOP, 1);
            }
            assert_eq!(Ramp::starting_distance(target, Slew::STOP), way, "{target:?}");
        }
    }

    #[test]
    fn slowing_down_as_late_as_allowed_keeps_the_limit() {
        for (start, limit) in [(2.0, 1.0), (2.0, 1.9), (1.3, 1.0), (1.05, 1.04)] {
            let mut ramp = Ramp::new();
            ramp.jump(Rate::nearest(start));
            let (mut left, mut cycles) = (1200.0, 0);
            while left > 0.0 {
                let allowed = Rate::nearest(rate_before(limit, left).min(start));
                left -= run(&mut ramp, allowed, Slew::OVERRIDE, 1).setpoints();
                cycles += 1;
            }
            assert!(ramp.rate() <= limit + 1e-7, "{} instead of {limit} from {start}", ramp.rate());
            // Slowing down at once, from 1200 setpoints before, would take longer.
            assert!(f64::from(cycles) < 1200.0 / limit);
        }
    }

    #[test]
    fn a_hold_takes_what_the_header_says() {
        let mut ramp = Ramp::new();
        ramp.jump(Rate::ONE);
        let mut cycles = 0;
        while !ramp.is_still() {
            run(&mut ramp, Rate::ZERO, Slew::STOP, 1);
            cycles += 1;
        }
        // 101 cycles of slew, because a hundredth is rounded down, and 31 more of averaging.
        assert_eq!(cycles, 132);
    }
}
