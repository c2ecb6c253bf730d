//! One cell of a time law: its motion in closed form.

use messages::math::cbrt;

pub(super) use crate::law::profile::Along;

/// What is constant in a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Motion {
    /// ü′, the derivative of the acceleration by the place [1/s²].
    Slope(f64),
    /// The third derivative of u by time [m/s³].
    Jerk(f64),
}

/// A cell of a time law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cell {
    /// When it begins, after the start of the law [s].
    pub(super) time: f64,
    /// How long it takes [s].
    pub(super) duration: f64,
    /// Where it begins [m].
    pub(super) place: f64,
    /// How far it goes [m], 0 or more.
    pub(super) length: f64,
    /// u̇ at its start [m/s].
    pub(super) speed: f64,
    /// ü at its start [m/s²].
    pub(super) acceleration: f64,
    pub(super) motion: Motion,
    /// Which limit is nearest in it.
    pub(super) limit: u16,
}

/// The most terms of a motion's series.
const MOST_TERMS: usize = 60;

impl Cell {
    /// The motion at `time` after the start of the cell [s], the position from its start.
    #[inline]
    pub(super) fn at(&self, time: f64) -> Along {
        match self.motion {
            Motion::Slope(slope) => series(self.speed, self.acceleration, slope, time),
            Motion::Jerk(jerk) => Along {
                position: time
                    * (self.speed + time * (self.acceleration / 2.0 + time * jerk / 6.0)),
                velocity: self.speed + time * (self.acceleration + time * jerk / 2.0),
                acceleration: self.acceleration + time * jerk,
                jerk,
            },
        }
    }

    /// When, after the start of the cell, the place `distance` [m] from it is reached [s]; the cell
    /// takes at most `longest` [s].
    pub(super) fn time_at(&self, distance: f64, longest: f64) -> f64 {
        if distance <= 0.0 {
            return 0.0;
        }
        let (mut low, mut high) = (0.0, longest);
        let mut time = self.guess(distance).clamp(low, high);
        for _ in 0..200 {
            let along = self.at(time);
            let off = along.position - distance;
            if off == 0.0 {
                break;
            }
            if off > 0.0 {
                high = time;
            } else {
                low = time;
            }
            let step = off / along.velocity;
            let next = time - step;
            let inside = next >= low && next <= high;
            let next = if inside { next } else { (low + high) / 2.0 };
            if (next - time).abs() <= 1e-15 * time || high - low <= 1e-16 * high {
                return next;
            }
            time = next;
        }
        time
    }

    /// A first guess of the time to `distance` [m].
    fn guess(&self, distance: f64) -> f64 {
        match self.motion {
            Motion::Jerk(jerk) if self.speed == 0.0 && self.acceleration == 0.0 && jerk > 0.0 => {
                cbrt(6.0 * distance / jerk)
            }
            Motion::Jerk(jerk) => {
                let rest = self.length - distance;
                let end = self.at(self.duration);
                // A launch seen backwards ends at rest.
                if self.duration > 0.0 && end.velocity.abs() < 1e-9 * self.speed && jerk > 0.0 {
                    self.duration - cbrt(6.0 * rest.max(0.0) / jerk)
                } else if self.duration > 0.0 && self.length > 0.0 {
                    self.duration * distance / self.length
                } else {
                    distance / self.speed.max(1e-12)
                }
            }
            Motion::Slope(slope) => {
                let square = self.speed * self.speed
                    + distance * (2.0 * self.acceleration + slope * distance);
                2.0 * distance / (self.speed + square.max(0.0).sqrt()).max(1e-300)
            }
        }
    }
}

/// The motion after `time` [s] from `speed` and `acceleration` where ü = acceleration + slope·u.
fn series(speed: f64, acceleration: f64, slope: f64, time: f64) -> Along {
    let square = slope * time * time;
    // The odd terms begin with v·t, the even ones with a·t²/2; each two orders on from the last.
    let (mut odd, mut even) = (speed * time, acceleration * time * time / 2.0);
    let (mut position, mut velocity) = (odd + even, speed + acceleration * time);
    let mut order = 1.0;
    for _ in 0..MOST_TERMS {
        let next_odd = odd * square / ((order + 1.0) * (order + 2.0));
        let next_even = even * square / ((order + 2.0) * (order + 3.0));
        // The derivative of a term is its order's worth of it by the time.
        velocity += (next_odd * (order + 2.0) + next_even * (order + 3.0)) / time.max(1e-300);
        position += next_odd + next_even;
        (odd, even) = (next_odd, next_even);
        order += 2.0;
        if odd.abs() + even.abs() <= 1e-17 * position.abs() {
            break;
        }
    }
    Along {
        position,
        velocity,
        acceleration: acceleration + slope * position,
        jerk: velocity * slope,
    }
}

#[cfg(test)]
mod tests {
    use super::{Cell, Motion};
    use messages::math::{cos, exp, sin};

    fn cell(speed: f64, acceleration: f64, slope: f64) -> Cell {
        Cell {
            time: 0.0,
            duration: 0.0,
            place: 0.0,
            length: 0.0,
            speed,
            acceleration,
            motion: Motion::Slope(slope),
            limit: 0,
        }
    }

    #[test]
    fn the_series_is_the_swing_and_the_growth_it_stands_for() {
        let swing = cell(2.0, 0.0, -9.0).at(0.4);
        assert!((swing.position - 2.0 / 3.0 * sin(1.2)).abs() < 1e-15);
        assert!((swing.velocity - 2.0 * cos(1.2)).abs() < 1e-14);
        let growth = cell(2.0, 6.0, 9.0).at(0.4);
        assert!((growth.position - 2.0 / 3.0 * (exp(1.2) - 1.0)).abs() < 1e-14);
        assert!((growth.velocity - 2.0 * exp(1.2)).abs() < 1e-13);
        assert!((growth.jerk - 18.0 * exp(1.2)).abs() < 1e-12);
    }

    #[test]
    fn the_time_to_a_place_is_where_the_motion_is_there() {
        for slope in [-40.0, 0.0, 300.0] {
            let cell = cell(0.1, 1.0, slope);
            let time = cell.time_at(0.01, 1.0);
            assert!((cell.at(time).position - 0.01).abs() < 1e-16, "{slope}");
        }
    }
}
