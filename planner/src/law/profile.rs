//! Jerk-limited profiles along a line: rest to a speed, a speed to rest, and rest to rest.
//!
//! Every profile is made of one [`Ramp`], from rest to a speed in three phases (jerk, constant
//! acceleration, jerk back), and its mirror image in time. Seven phases in all; source 003 text of
//! fig. 2-1 counts six, and its eq. 2.2 to 2.5 hold only with absolute instants, so the forms here
//! are derived again, and the tests integrate the phases once more ([`integrate`]) and compare.

use messages::math;

/// Where a motion along a line is at one instant.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Along {
    /// [m].
    pub position: f64,
    /// [m/s].
    pub velocity: f64,
    /// [m/s²].
    pub acceleration: f64,
    /// [m/s³].
    pub jerk: f64,
}

/// From rest to a speed in the shortest time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Ramp {
    /// Jerk of the first phase, and minus that of the last [m/s³].
    pub jerk: f64,
    /// Duration of the first and of the last phase [s].
    pub rise: f64,
    /// Duration of the phase of constant acceleration [s].
    pub hold: f64,
}

impl Ramp {
    /// From rest to `speed` within `acceleration` and `jerk`; all positive, or `speed` 0.
    pub fn to_speed(speed: f64, acceleration: f64, jerk: f64) -> Self {
        let rise = acceleration / jerk;
        if speed >= acceleration * rise {
            Self { jerk, rise, hold: speed / acceleration - rise }
        } else {
            Self { jerk, rise: (speed / jerk).sqrt(), hold: 0.0 }
        }
    }

    /// Half of a move of `length` from rest to rest without cruise.
    fn to_middle(length: f64, acceleration: f64, jerk: f64) -> Self {
        // Without reaching the acceleration: length = speed·2·rise with speed = jerk·rise².
        let rise = math::cbrt(length / (2.0 * jerk));
        if jerk * rise <= acceleration {
            return Self { jerk, rise, hold: 0.0 };
        }
        // Reaching it: length = speed·(speed/acceleration + rise), and speed = acceleration·(rise +
        // hold), a quadratic in hold.
        let rise = acceleration / jerk;
        let hold = (rise * rise / 4.0 + length / acceleration).sqrt() - 1.5 * rise;
        Self { jerk, rise, hold: hold.max(0.0) }
    }

    /// [s].
    pub fn duration(&self) -> f64 {
        2.0 * self.rise + self.hold
    }

    /// The speed that it ends at [m/s].
    pub fn speed(&self) -> f64 {
        self.jerk * self.rise * (self.rise + self.hold)
    }

    /// The largest acceleration [m/s²].
    pub fn acceleration(&self) -> f64 {
        self.jerk * self.rise
    }

    /// The way it takes [m]: half of what the final speed would, by symmetry.
    pub fn length(&self) -> f64 {
        self.speed() * self.duration() / 2.0
    }

    /// The motion at `time` since the start [s]; rest before, the final speed after.
    pub fn at(&self, time: f64) -> Along {
        let Self { jerk, rise, hold } = *self;
        if time <= 0.0 {
            let jerk = if time < 0.0 { 0.0 } else { jerk };
            return Along { jerk, ..Along::default() };
        }
        if time < rise {
            let acceleration = jerk * time;
            let velocity = acceleration * time / 2.0;
            return Along { position: velocity * time / 3.0, velocity, acceleration, jerk };
        }
        let top = jerk * rise;
        if time < rise + hold {
            let since = time - rise;
            let velocity = top * rise / 2.0;
            return Along {
                position: velocity * rise / 3.0 + (velocity + top * since / 2.0) * since,
                velocity: velocity + top * since,
                acceleration: top,
                jerk: 0.0,
            };
        }
        let left = self.duration() - time;
        if left <= 0.0 {
            let speed = self.speed();
            return Along {
                position: self.length() - speed * left,
                velocity: speed,
                ..Along::default()
            };
        }
        let acceleration = jerk * left;
        let lacking = acceleration * left / 2.0;
        let speed = self.speed();
        Along {
            position: self.length() - speed * left + lacking * left / 3.0,
            velocity: speed - lacking,
            acceleration,
            jerk: -jerk,
        }
    }
}

/// From rest to rest over a length in the shortest time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Move {
    /// The first half up to the largest speed; the second is its mirror image.
    pub ramp: Ramp,
    /// Duration at the largest speed [s].
    pub cruise: f64,
    /// [m].
    pub length: f64,
}

impl Move {
    /// Over `length` (0 or more) within `speed` (may be infinite), `acceleration` and `jerk`.
    pub fn new(length: f64, speed: f64, acceleration: f64, jerk: f64) -> Self {
        if length <= 0.0 {
            return Self::default();
        }
        let middle = Ramp::to_middle(length, acceleration, jerk);
        if middle.speed() <= speed {
            return Self { ramp: middle, cruise: 0.0, length };
        }
        let ramp = Ramp::to_speed(speed, acceleration, jerk);
        Self { ramp, cruise: (length - 2.0 * ramp.length()).max(0.0) / speed, length }
    }

    /// [s].
    pub fn duration(&self) -> f64 {
        2.0 * self.ramp.duration() + self.cruise
    }

    /// The motion at `time` since the start [s]; rest before and after.
    pub fn at(&self, time: f64) -> Along {
        let whole = self.duration();
        if time <= whole / 2.0 {
            return self.ramp.at(time);
        }
        let left = whole - time;
        let mirrored = self.ramp.at(left);
        Along {
            position: self.length - mirrored.position,
            velocity: mirrored.velocity,
            acceleration: -mirrored.acceleration,
            // Right at the end of the mirrored ramp's phases this is the jerk of the phase that
            // ends; a sample there is as right as one of the phase that starts.
            jerk: if left > 0.0 { mirrored.jerk } else { 0.0 },
        }
    }

    /// Durations [s] and jerks [m/s³] of the seven phases.
    pub fn phases(&self) -> [(f64, f64); 7] {
        let Ramp { jerk, rise, hold } = self.ramp;
        [
            (rise, jerk),
            (hold, 0.0),
            (rise, -jerk),
            (self.cruise, 0.0),
            (rise, -jerk),
            (hold, 0.0),
            (rise, jerk),
        ]
    }
}

/// Integrates constant-jerk `phases` from rest, and gives the motion at the end of each.
pub fn integrate(phases: &[(f64, f64)]) -> Vec<Along> {
    let mut state = Along::default();
    let mut ends = Vec::with_capacity(phases.len());
    for &(duration, jerk) in phases {
        let Along { position, velocity, acceleration, .. } = state;
        let half = acceleration + jerk * duration / 2.0;
        let third = acceleration / 2.0 + jerk * duration / 6.0;
        state = Along {
            position: position + (velocity + third * duration) * duration,
            velocity: velocity + half * duration,
            acceleration: acceleration + jerk * duration,
            jerk,
        };
        ends.push(state);
    }
    ends
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::random::logarithmic;
    use messages::random::SplitMix64;
    use serde_json::Value;

    fn close(found: f64, expected: f64, tolerance: f64, what: &str) {
        assert!(
            (found - expected).abs() <= tolerance,
            "{what}: {found} instead of {expected}, off by {:e}",
            found - expected
        );
    }

    /// Integrates the phases again, and holds every phase to its limits.
    fn check(planned: &Move, speed: f64, acceleration: f64, jerk: f64, case: &str) {
        let ends = integrate(&planned.phases());
        let last = ends[6];
        let scale = planned.length.max(1e-6);
        close(last.position, planned.length, 1e-12 * scale + 1e-15, case);
        close(last.velocity, 0.0, 1e-12 * planned.ramp.speed().max(1e-3), case);
        close(last.acceleration, 0.0, 1e-9 * acceleration, case);
        for (end, (duration, phase_jerk)) in ends.iter().zip(planned.phases()) {
            assert!(duration >= 0.0, "{case}: a phase of {duration} s");
            assert!(phase_jerk.abs() <= jerk * (1.0 + 1e-12), "{case}: jerk {phase_jerk}");
            assert!(end.velocity <= speed * (1.0 + 1e-9), "{case}: speed {}", end.velocity);
            assert!(
                end.acceleration.abs() <= acceleration * (1.0 + 1e-9),
                "{case}: acceleration {}",
                end.acceleration
            );
        }
        let mut time = 0.0;
        for (end, (duration, _)) in ends.iter().zip(planned.phases()) {
            time += duration;
            let found = planned.at(time);
            // The instant of a change of jerk is known to rounding only.
            let rounding = 4.0 * f64::EPSILON * time;
            let off = 1e-12 * scale + rounding * speed;
            close(found.position, end.position, off, case);
            let off = 1e-10 * planned.ramp.speed() + rounding * acceleration;
            close(found.velocity, end.velocity, off, case);
            let off = 1e-8 * acceleration + rounding * jerk;
            close(found.acceleration, end.acceleration, off, case);
        }
    }

    #[test]
    fn golden_moves_are_met() {
        let text =
            include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/golden/trajectory.json"));
        let golden: Value = serde_json::from_str(text).unwrap();
        let cases = golden["cases"].as_array().unwrap();
        assert_eq!(cases.len(), 10);
        for case in cases {
            let number = |key: &str| case[key].as_f64().unwrap();
            let (speed, acceleration, jerk) = (number("V"), number("A"), number("J"));
            let name = format!("{} V {speed} A {acceleration} J {jerk}", case["case"]);
            let planned = Move::new(number("L"), speed, acceleration, jerk);
            close(planned.duration(), number("T"), 1e-9, &name);
            close(planned.ramp.speed(), number("v_peak"), 1e-9, &name);
            close(planned.ramp.acceleration(), number("a_peak"), 1e-9, &name);
            for (index, (duration, phase_jerk)) in planned.phases().into_iter().enumerate() {
                close(duration, case["phases"][index].as_f64().unwrap(), 1e-9, &name);
                close(phase_jerk, case["jerks"][index].as_f64().unwrap(), 1e-9, &name);
            }
            for (index, time) in case["t"].as_array().unwrap().iter().enumerate() {
                let found = planned.at(time.as_f64().unwrap());
                close(found.position, case["s"][index].as_f64().unwrap(), 1e-9, &name);
                close(found.velocity, case["v"][index].as_f64().unwrap(), 1e-9, &name);
                close(found.acceleration, case["a"][index].as_f64().unwrap(), 1e-9, &name);
            }
            let ramp = Ramp::to_speed(speed, acceleration, jerk);
            let run_in = &case["run_in"];
            close(ramp.rise, run_in["t1"].as_f64().unwrap(), 1e-9, &name);
            close(ramp.hold, run_in["t2"].as_f64().unwrap(), 1e-9, &name);
            close(ramp.duration(), run_in["T"].as_f64().unwrap(), 1e-9, &name);
            close(ramp.length(), run_in["L"].as_f64().unwrap(), 1e-9, &name);
            close(ramp.acceleration(), run_in["a_peak"].as_f64().unwrap(), 1e-9, &name);
            check(&planned, speed, acceleration, jerk, &name);
        }
    }

    #[test]
    fn random_moves_integrate_back_and_keep_their_limits() {
        let mut random = SplitMix64::new(1);
        for _ in 0..20_000 {
            let length = logarithmic(&mut random, 1e-9, 10.0);
            let speed = logarithmic(&mut random, 1e-4, 10.0);
            let acceleration = logarithmic(&mut random, 1e-2, 1e3);
            let jerk = logarithmic(&mut random, 1.0, 1e6);
            let case = format!("L {length:e} V {speed:e} A {acceleration:e} J {jerk:e}");
            let planned = Move::new(length, speed, acceleration, jerk);
            check(&planned, speed, acceleration, jerk, &case);
            // Time-optimal: at least one of the three limits is met.
            let ramp = planned.ramp;
            assert!(ramp.jerk == jerk || ramp.acceleration() >= acceleration * 0.999, "{case}");
        }
    }

    #[test]
    fn a_move_without_length_takes_no_time() {
        let planned = Move::new(0.0, 0.25, 10.0, 500.0);
        assert_eq!(planned.duration(), 0.0);
        assert_eq!(planned.at(0.0), Along::default());
    }

    #[test]
    fn a_speed_without_bound_is_never_reached() {
        let planned = Move::new(0.1, f64::INFINITY, 10.0, 5000.0);
        assert_eq!(planned.cruise, 0.0);
        check(&planned, 1e3, 10.0, 5000.0, "no speed limit");
    }
}
