//! Step pulses: how many, and when inside a cycle.
//!
//! A stepper's driver is told a position by pulses, `N = ⌊K·θ + ½⌋` for the commanded angle θ from
//! home with `K` pulses per radian. The count is absolute: it follows from the angle at hand alone,
//! so that nothing adds up over a job. A pulse falls where `K·θ` passes a half-integer, to the
//! nanosecond, along the cubic that joins the angles and speeds at both ends of the cycle.

use machine::pulses::{crossings, nearest};
use messages::Nanoseconds;
use messages::time::NANOSECONDS_PER_SECOND;

/// A commanded angle through one cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Time of the cycle [s].
    pub time: f64,
    /// Angle at its start [rad].
    pub from: f64,
    /// Speed at its start [rad/s].
    pub from_speed: f64,
    /// Angle at its end [rad].
    pub to: f64,
    /// Speed at its end [rad/s].
    pub to_speed: f64,
}

/// Which way a pulse steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Towards larger angles.
    Up,
    /// Towards smaller ones.
    Down,
}

/// One pulse.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pulse {
    /// When, from the start of the cycle.
    pub offset: Nanoseconds,
    /// Which way.
    pub direction: Direction,
}

/// Pulses sent by the time the commanded angle from home is `angle` [rad].
pub fn count(per_radian: f64, angle: f64) -> i64 {
    nearest(per_radian * angle)
}

impl Segment {
    /// At rest at `angle` [rad], for a cycle of `time` [s].
    pub fn rest(angle: f64, time: f64) -> Self {
        Self { time, from: angle, from_speed: 0.0, to: angle, to_speed: 0.0 }
    }

    /// What comes after this one at an even speed.
    pub fn coast(&self) -> Self {
        let speed = self.to_speed;
        self.then(self.to + speed * self.time, speed)
    }

    /// What comes after this one, to `angle` [rad] and `speed` [rad/s] at its end.
    pub fn then(&self, angle: f64, speed: f64) -> Self {
        Self {
            time: self.time,
            from: self.to,
            from_speed: self.to_speed,
            to: angle,
            to_speed: speed,
        }
    }

    /// What comes after this one, slowing down by `deceleration` [rad/s²] or to rest.
    pub fn brake(&self, deceleration: f64) -> Self {
        let speed = self.to_speed;
        if speed == 0.0 {
            return self.then(self.to, 0.0);
        }
        let left = speed.abs() - deceleration * self.time;
        if left > 0.0 {
            let end = left * speed.signum();
            return self.then(self.to + 0.5 * (speed + end) * self.time, end);
        }
        self.then(self.to + 0.5 * speed * speed.abs() / deceleration, 0.0)
    }

    /// Angle [rad] and speed [rad/s] at the share `at` of the cycle; exactly its ends at 0 and 1.
    pub fn at(&self, at: f64) -> (f64, f64) {
        let (slope, square, cube) = self.coefficients();
        let speed = (slope + at * (2.0 * square + at * 3.0 * cube)) / self.time;
        let angle = match at {
            1.0 => self.to,
            _ => self.from + at * (slope + at * (square + at * cube)),
        };
        (angle, speed)
    }

    /// The count of pulses in the mean over the shares `from` to `to` of the cycle, where the speed
    /// changes little in between: each pulse counts from its instant on.
    pub fn mean_count(&self, per_radian: f64, from: f64, to: f64) -> f64 {
        let first = per_radian * self.at(from).0;
        let last = per_radian * self.at(to).0;
        let count = nearest(first);
        // From this count on, so that nothing cancels far from home.
        let (first, last) = (first - count as f64, last - count as f64);
        let passed = nearest(last) as f64;
        if passed == 0.0 {
            return count as f64;
        }
        // The integral of the count along a line: passed·u − passed²/2, which is 0 at `first`.
        count as f64 + passed * (last - passed / 2.0) / (last - first)
    }

    /// The largest |speed| inside it [rad/s].
    pub fn fastest(&self) -> f64 {
        let (_, square, cube) = self.coefficients();
        let turn = -square / (3.0 * cube);
        let inside = if turn > 0.0 && turn < 1.0 { self.at(turn).1.abs() } else { 0.0 };
        let ends = [self.from_speed, self.to_speed, self.from, self.to];
        // `max` would drop what is not a number.
        if ends.iter().any(|end| end.is_nan()) {
            return f64::NAN;
        }
        self.from_speed.abs().max(self.to_speed.abs()).max(inside)
    }

    /// Gives `each` the pulses of the cycle in order, at `per_radian` pulses per radian.
    ///
    /// They take the count from that of [`Segment::from`] to that of [`Segment::to`].
    pub fn pulses(&self, per_radian: f64, mut each: impl FnMut(Pulse)) {
        let rate = per_radian * self.time;
        let nanoseconds = (self.time * NANOSECONDS_PER_SECOND).round();
        let (from, to) = (per_radian * self.from, per_radian * self.to);
        let mut reached = nearest(from);
        for crossing in crossings(from, to, rate * self.from_speed, rate * self.to_speed) {
            let direction = if crossing.count > reached { Direction::Up } else { Direction::Down };
            let offset = (crossing.share * nanoseconds).round() as i64;
            each(Pulse { offset: Nanoseconds(offset), direction });
            reached = crossing.count;
        }
    }

    /// Slope, square and cube of the angle in the share of the cycle.
    fn coefficients(&self) -> (f64, f64, f64) {
        let rise = self.to - self.from;
        let (slope, last) = (self.from_speed * self.time, self.to_speed * self.time);
        (slope, 3.0 * rise - 2.0 * slope - last, slope + last - 2.0 * rise)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::time::SETPOINT_TIME as CYCLE_TIME;

    const PER_RADIAN: f64 = 3200.0 / core::f64::consts::TAU;

    fn all(segment: &Segment) -> Vec<Pulse> {
        let mut pulses = Vec::new();
        segment.pulses(PER_RADIAN, |pulse| pulses.push(pulse));
        pulses
    }

    fn sum(pulses: &[Pulse]) -> i64 {
        pulses.iter().map(|pulse| if pulse.direction == Direction::Up { 1 } else { -1 }).sum()
    }

    #[test]
    fn an_even_speed_gives_even_pulses_at_the_half_integers() {
        // 10 pulses in a cycle, from 0: they fall at 0.05, 0.15, … of it.
        let speed = 10.0 / PER_RADIAN / CYCLE_TIME;
        let segment = Segment {
            time: CYCLE_TIME,
            from: 0.0,
            from_speed: speed,
            to: 10.0 / PER_RADIAN,
            to_speed: speed,
        };
        let offsets: Vec<i64> = all(&segment).iter().map(|pulse| pulse.offset.0).collect();
        let expected: Vec<i64> = (0..10).map(|index| 50_000 + 100_000 * index).collect();
        assert_eq!(offsets, expected);
        assert_eq!(count(PER_RADIAN, segment.to), 10);
    }

    #[test]
    fn pulses_of_an_acceleration_fall_where_the_parabola_says() {
        // From rest to 32 pulses a cycle: θ = 16·s² pulses, so pulse n at √((n − ½)/16).
        let unit = 1.0 / PER_RADIAN;
        let segment = Segment {
            time: CYCLE_TIME,
            from: 0.0,
            from_speed: 0.0,
            to: 16.0 * unit,
            to_speed: 32.0 * unit / CYCLE_TIME,
        };
        let pulses = all(&segment);
        assert_eq!(pulses.len(), 16);
        for (index, pulse) in pulses.iter().enumerate() {
            let exact = ((index as f64 + 0.5) / 16.0).sqrt() * 1e6;
            assert!((pulse.offset.0 as f64 - exact).abs() <= 0.51, "{pulse:?} {exact}");
        }
        assert!((segment.fastest() * PER_RADIAN * CYCLE_TIME - 32.0).abs() < 1e-9);
    }

    #[test]
    fn a_reversal_steps_up_and_down_again() {
        // 3.2 pulses up and back: θ = 12.8·s·(1 − s).
        let unit = 1.0 / PER_RADIAN;
        let speed = 12.8 * unit / CYCLE_TIME;
        let segment =
            Segment { time: CYCLE_TIME, from: 0.0, from_speed: speed, to: 0.0, to_speed: -speed };
        let pulses = all(&segment);
        let directions: Vec<_> = pulses.iter().map(|pulse| pulse.direction).collect();
        assert_eq!(directions, [[Direction::Up; 3], [Direction::Down; 3]].concat());
        for (up, down) in pulses[..3].iter().zip(pulses[3..].iter().rev()) {
            assert!((up.offset.0 + down.offset.0 - 1_000_000).abs() <= 1, "{up:?} {down:?}");
        }
    }

    #[test]
    fn the_mean_count_is_that_of_the_pulses_at_their_instants() {
        let unit = 1.0 / PER_RADIAN;
        let speed = |pulses: f64| pulses * unit / CYCLE_TIME;
        // Far from home, at rates from one pulse in some cycles to many in a twentieth of one.
        for (rise, from_speed, to_speed) in
            [(0.7, 0.7, 0.7), (-3.4, -3.0, -3.8), (150.3, 150.3, 150.3), (9.0, 5.0, 12.0)]
        {
            let from = 1e6 + 0.3;
            let segment = Segment {
                time: CYCLE_TIME,
                from: from * unit,
                from_speed: speed(from_speed),
                to: (from + rise) * unit,
                to_speed: speed(to_speed),
            };
            let pulses = all(&segment);
            let start = count(PER_RADIAN, segment.from) as f64;
            for index in 0..20 {
                let (low, high) = (f64::from(index) / 20.0, f64::from(index + 1) / 20.0);
                let mut mean = start;
                for pulse in &pulses {
                    let step = if pulse.direction == Direction::Up { 1.0 } else { -1.0 };
                    let at = pulse.offset.0 as f64 * 1e-6;
                    mean += step * ((high - at) / (high - low)).clamp(0.0, 1.0);
                }
                let found = segment.mean_count(PER_RADIAN, low, high);
                assert!((found - mean).abs() < 2e-2, "{rise} {index}: {found} {mean}");
            }
        }
        assert_eq!(Segment::rest(0.0, CYCLE_TIME).mean_count(PER_RADIAN, 0.0, 0.05), 0.0);
        assert!(Segment::rest(f64::NAN, CYCLE_TIME).mean_count(PER_RADIAN, 0.0, 0.05).abs() < 1.0);
    }

    #[test]
    fn the_count_is_absolute_over_200_segments() {
        let mut sent = 0;
        let mut segment = Segment::rest(0.0, CYCLE_TIME);
        let mut last = 0;
        for index in 1..=200_i64 {
            let phase = 0.063 * index as f64;
            let (sine, cosine) = messages::math::sin_cos(phase);
            // An odd amplitude, and a drift, so that no angle falls on a pulse.
            let angle = 0.037 * sine + 1.3e-3 * index as f64;
            segment = segment.then(angle, (0.037 * 0.063 * cosine + 1.3e-3) / CYCLE_TIME);
            let pulses = all(&segment);
            sent += sum(&pulses);
            assert_eq!(sent, count(PER_RADIAN, angle), "segment {index}");
            assert!(pulses.is_sorted_by_key(|pulse| pulse.offset.0));
            assert!(pulses.iter().all(|pulse| (0..=1_000_000).contains(&pulse.offset.0)));
            last = pulses.len().max(last);
        }
        assert_eq!(sent, (PER_RADIAN * segment.to).round() as i64);
        assert!(last > 1);
    }

    #[test]
    fn braking_ends_where_the_deceleration_says() {
        let mut segment =
            Segment { time: CYCLE_TIME, from: 0.0, from_speed: 9.3, to: 0.0093, to_speed: 9.3 };
        let exact = segment.to + 9.3 * 9.3 / (2.0 * 700.0);
        for _ in 0..20 {
            segment = segment.brake(700.0);
        }
        assert_eq!(segment.to_speed, 0.0);
        assert!((segment.to - exact).abs() < 1e-12, "{} {exact}", segment.to);
    }
}
