//! Holds our deadlines to the clock of a bus.

use messages::Nanoseconds;
use messages::time::Period;

/// The part of a distance that one cycle takes back.
const PROPORTIONAL: f64 = 1.0 / 64.0;

/// The part of it that is learned as drift: a quarter of the square of the other, for no overshoot.
const INTEGRAL: f64 = PROPORTIONAL * PROPORTIONAL / 4.0;

/// The largest part of a period by which a cycle is made longer or shorter.
const MOST: f64 = 0.01;

/// What moves our deadlines after another clock: proportional and integral, so that a drift that stays leaves
/// no distance.
#[derive(Debug, Clone, Copy)]
pub struct Discipline {
    /// The most that one cycle is changed by [ns].
    most: f64,
    /// What is known of the drift [ns a cycle].
    drift: f64,
    /// What rounding to nanoseconds has left [ns].
    rest: f64,
}

impl Discipline {
    /// For cycles of this `period`, with clocks that run alike.
    pub fn new(period: Period) -> Self {
        Self { most: MOST * period.time().0 as f64, drift: 0.0, rest: 0.0 }
    }

    /// By how much the next deadline is to be moved, beside a period after the one before, where the other
    /// clock is `ahead` of its place at our deadline.
    pub fn follow(&mut self, ahead: Nanoseconds) -> Nanoseconds {
        let ahead = ahead.0 as f64;
        self.drift = (self.drift + INTEGRAL * ahead).clamp(-self.most, self.most);
        self.change(self.drift + PROPORTIONAL * ahead)
    }

    /// The same where nobody knows: by what is known of the drift.
    pub fn coast(&mut self) -> Nanoseconds {
        self.change(self.drift)
    }

    fn change(&mut self, change: f64) -> Nanoseconds {
        let change = change.clamp(-self.most, self.most);
        let moved = (self.rest - change).round();
        self.rest -= change + moved;
        Nanoseconds(moved as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::random::SplitMix64;

    /// The distance of a clock that is `ppm` fast and starts `ahead` [ns], read within `noise` [ns], over so
    /// many cycles; the largest of the last half.
    fn distance(ppm: f64, ahead: f64, noise: f64, cycles: usize) -> f64 {
        let period = Period::OF_SETPOINTS;
        let (mut discipline, mut random) = (Discipline::new(period), SplitMix64::new(7));
        let (mut apart, mut largest) = (ahead, 0.0_f64);
        for cycle in 0..cycles {
            let read = apart + noise * (2.0 * random.fraction() - 1.0);
            let moved = discipline.follow(Nanoseconds(read.round() as i64));
            apart += ppm * 1e-6 * (period.time().0 + moved.0) as f64 + moved.0 as f64;
            if cycle > cycles / 2 {
                largest = largest.max(apart.abs());
            }
        }
        largest
    }

    #[test]
    fn a_drift_leaves_no_distance() {
        for ppm in [-200.0, -20.0, 0.0, 20.0, 200.0] {
            let left = distance(ppm, 0.0, 0.0, 4000);
            assert!(left <= 2.0, "{ppm} ppm: {left} ns");
        }
    }

    #[test]
    fn a_distance_is_taken_back_and_noise_is_not_followed() {
        let left = distance(20.0, 400_000.0, 0.0, 8000);
        assert!(left <= 2.0, "{left} ns");
        let left = distance(20.0, 0.0, 50_000.0, 8000);
        assert!(left < 10_000.0, "{left} ns of 50 us");
    }

    #[test]
    fn no_cycle_is_changed_by_more_than_a_hundredth() {
        let mut discipline = Discipline::new(Period::OF_SETPOINTS);
        for _ in 0..1000 {
            let moved = discipline.follow(Nanoseconds(i64::MAX / 2));
            assert!(moved.0.abs() <= 10_001, "{moved:?}");
        }
    }
}
