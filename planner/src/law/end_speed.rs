//! How fast a path can be a little way from an end of its stretch.

use messages::math::cbrt;

/// The state at an end of a stretch, seen into the stretch, and the third derivative from there.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct EndSpeed {
    /// u̇ at the end [m/s]; 0 at rest.
    pub(super) speed: f64,
    /// ü at the end, positive where the speed grows into the stretch [m/s²].
    pub(super) acceleration: f64,
    /// The largest third derivative of u [m/s³].
    pub(super) jerk: f64,
}

impl EndSpeed {
    /// An upper estimate of the speed at `distance` [m] from the end [m/s].
    pub(super) fn at(&self, distance: f64) -> f64 {
        let distance = distance.max(0.0);
        if self.speed == 0.0 {
            return cbrt(4.5 * self.jerk * distance * distance);
        }
        let gain = self.acceleration.max(0.0);
        let place = |time: f64| time * (self.speed + time * (gain / 2.0 + time * self.jerk / 6.0));
        let speed = |time: f64| self.speed + time * (gain + time * self.jerk / 2.0);
        // The place is convex in time: from above, Newton's steps come down without overshoot.
        let mut time = (distance / self.speed).min(cbrt(6.0 * distance / self.jerk));
        for _ in 0..30 {
            let step = (place(time) - distance) / speed(time);
            time -= step;
            if step.abs() <= 1e-6 * time {
                break;
            }
        }
        speed(time.max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::EndSpeed;

    #[test]
    fn the_speed_from_rest_and_from_motion_is_that_of_constant_jerk() {
        let rest = EndSpeed { speed: 0.0, acceleration: 0.0, jerk: 6.0 };
        assert!((rest.at(1.0) - 3.0).abs() < 1e-9);
        let moving = EndSpeed { speed: 1.0, acceleration: 2.0, jerk: 6.0 };
        assert!((moving.at(3.0) - 6.0).abs() < 1e-4);
        assert_eq!(moving.at(0.0), 1.0);
    }
}
