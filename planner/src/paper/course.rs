//! A length from rest to rest, by either profile.

use crate::law::profile::{Along, Move};

/// Where a motion along a line is at which time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Course {
    /// Not moving for so long [s].
    Rest(f64),
    /// A trapezoid of acceleration.
    Jerk(Move),
    /// A trapezoid of velocity.
    Velocity(VelocityTrapezoid),
}

/// Even acceleration from rest, even speed, even braking to rest; without the even speed where the way is
/// too short for it (source 004 eq. 4.13 to 4.18, and the erratum to 4.18).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct VelocityTrapezoid {
    /// [m].
    length: f64,
    /// The largest speed [m/s].
    speed: f64,
    /// [m/s²].
    acceleration: f64,
}

impl VelocityTrapezoid {
    /// Over `length` (0 or more) within `speed` (may be infinite) and `acceleration`.
    pub(super) fn new(length: f64, speed: f64, acceleration: f64) -> Self {
        if length <= 0.0 {
            return Self::default();
        }
        Self { length, speed: speed.min((length * acceleration).sqrt()), acceleration }
    }

    /// [s].
    fn duration(&self) -> f64 {
        if self.speed <= 0.0 {
            return 0.0;
        }
        self.length / self.speed + self.speed / self.acceleration
    }

    /// The motion at `time` since the start [s]; rest before and after.
    fn at(&self, time: f64) -> Along {
        let Self { length, speed, acceleration } = *self;
        let left = self.duration() - time;
        if time < 0.0 || speed <= 0.0 {
            return Along::default();
        }
        if left <= 0.0 {
            return Along { position: length, ..Along::default() };
        }
        let run = speed / acceleration;
        if time < run {
            // eq. 4.13
            let velocity = acceleration * time;
            return Along { position: velocity * time / 2.0, velocity, acceleration, jerk: 0.0 };
        }
        if left > run {
            // eq. 4.14 to 4.16
            let position = speed * (time - run / 2.0);
            return Along { position, velocity: speed, ..Along::default() };
        }
        // eq. 4.17, counted from the end
        let velocity = acceleration * left;
        let position = length - velocity * left / 2.0;
        Along { position, velocity, acceleration: -acceleration, jerk: 0.0 }
    }
}

impl Course {
    /// [s].
    pub(super) fn duration(&self) -> f64 {
        match self {
            Self::Rest(time) => *time,
            Self::Jerk(course) => course.duration(),
            Self::Velocity(course) => course.duration(),
        }
    }

    /// [m].
    pub(super) fn length(&self) -> f64 {
        match self {
            Self::Rest(_) => 0.0,
            Self::Jerk(course) => course.length,
            Self::Velocity(course) => course.length,
        }
    }

    /// The largest speed [m/s].
    pub(super) fn speed(&self) -> f64 {
        match self {
            Self::Rest(_) => 0.0,
            Self::Jerk(course) => course.ramp.speed(),
            Self::Velocity(course) => course.speed,
        }
    }

    /// The motion at `time` since the start [s]; rest before and after.
    pub(super) fn at(&self, time: f64) -> Along {
        match self {
            Self::Rest(_) => Along::default(),
            Self::Jerk(course) if time >= course.duration() => {
                Along { position: course.length, ..Along::default() }
            }
            Self::Jerk(course) => course.at(time),
            Self::Velocity(course) => course.at(time),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The phases integrate to the length, long or too short for the speed, and mirror each other.
    #[test]
    fn a_velocity_trapezoid_is_its_own_integral() {
        for (length, speed, acceleration) in
            [(0.12, 0.02, 0.1), (0.001, 0.05, 0.2), (1.0, f64::INFINITY, 3.0)]
        {
            let course = VelocityTrapezoid::new(length, speed, acceleration);
            let whole = course.duration();
            let steps = 20_000;
            let mut way = 0.0;
            for step in 0..steps {
                let time = whole * (f64::from(step) + 0.5) / f64::from(steps);
                let now = course.at(time);
                assert!(now.velocity <= speed * (1.0 + 1e-12));
                assert!(now.acceleration.abs() <= acceleration);
                let mirrored = course.at(whole - time);
                assert!((now.position + mirrored.position - length).abs() < 1e-12);
                way += now.velocity * whole / f64::from(steps);
                assert!(
                    (course.at(whole * f64::from(step + 1) / f64::from(steps)).position - way)
                        .abs()
                        < 1e-7 * length
                );
            }
        }
        assert_eq!(VelocityTrapezoid::new(0.0, 1.0, 1.0).duration(), 0.0);
    }
}
