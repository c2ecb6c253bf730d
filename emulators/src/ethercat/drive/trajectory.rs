//! Where the drive shall be between two targets of the bus, and on its way to rest.

use messages::Nanoseconds;

/// Cycles for which a drive goes on as before without a new target.
const COASTED: f64 = 4.0;

/// The way from one position target to the next, in a straight line [rad].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    start: Nanoseconds,
    period: f64,
    from: f64,
    to: f64,
}

impl Segment {
    /// A stay at `position` [rad] from `at` on.
    pub fn rest(at: Nanoseconds, position: f64) -> Self {
        Self { start: at, period: 1e-3, from: position, to: position }
    }

    /// The way on to `target` [rad], from `at` for `period` [s].
    pub fn then(&self, at: Nanoseconds, target: f64, period: f64) -> Self {
        let [from, _] = self.at(at);
        Self { start: at, period: period.max(1e-6), from, to: target }
    }

    /// Position [rad] and speed [rad/s] at `now`.
    pub fn at(&self, now: Nanoseconds) -> [f64; 2] {
        let part = (now - self.start).seconds() / self.period;
        let speed = (self.to - self.from) / self.period;
        let speed_now = if part < COASTED { speed } else { 0.0 };
        let part = part.clamp(0.0, COASTED);
        [self.from + (self.to - self.from) * part, speed_now]
    }
}

/// The way to rest at an even deceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ramp {
    position: f64,
    speed: f64,
    deceleration: f64,
    /// For how long it has stood [s].
    standing: f64,
}

impl Ramp {
    /// From `position` [rad] at `speed` [rad/s] with `deceleration` [rad/s²].
    pub fn new(position: f64, speed: f64, deceleration: f64) -> Self {
        Self { position, speed, deceleration, standing: 0.0 }
    }

    /// Position [rad] and speed [rad/s] after `step` [s].
    pub fn step(&mut self, step: f64) -> [f64; 2] {
        let change = (self.deceleration * step).min(self.speed.abs()) * self.speed.signum();
        self.position += (self.speed - 0.5 * change) * step;
        self.speed -= change;
        if self.speed == 0.0 {
            self.standing += step;
        }
        [self.position, self.speed]
    }

    /// For how long it has stood [s].
    pub fn standing(&self) -> f64 {
        self.standing
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_goes_on_for_a_while_without_a_new_target() {
        let ms = |time: i64| Nanoseconds(time * 1_000_000);
        let segment = Segment::rest(ms(0), 1.0).then(ms(10), 1.5, 1e-3);
        assert_eq!(segment.at(Nanoseconds(10_500_000)), [1.25, 500.0]);
        assert_eq!(segment.at(ms(13)), [2.5, 500.0]);
        assert_eq!(segment.at(ms(20)), [3.0, 0.0]);
    }

    #[test]
    fn a_ramp_ends_where_the_deceleration_has_it() {
        let mut ramp = Ramp::new(0.0, 10.0, 100.0);
        let last = (0..200).map(|_| ramp.step(1e-3)).last().unwrap_or_default();
        assert!((last[0] - 0.5).abs() < 1e-9 && last[1] == 0.0, "{last:?}");
        assert!((ramp.standing() - 0.1).abs() < 2e-3);
    }
}
