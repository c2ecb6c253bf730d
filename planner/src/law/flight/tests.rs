#![allow(clippy::unwrap_used)]
use super::*;
use crate::random::logarithmic;
use messages::math;
use messages::random::SplitMix64;

mod directions;
mod jobs;
mod runs;
mod turns;

const LIMITS: FlightLimits = FlightLimits { speed: 1.0, acceleration: 10.0, jerk: 500.0 };

/// Without other limits than the tool's.
fn flight(from: &State, to: &State, limits: &FlightLimits) -> Flight {
    Flight::new(from, to, limits, &mut |_| true).unwrap()
}

/// Moving straight on from `position`.
fn moving(position: Vector3<f64>, velocity: Vector3<f64>) -> State {
    State { velocity, ..State::rest(position) }
}

/// Holds a flight to its ends, its limits, and itself.
fn check(flight: &Flight, from: &State, to: &State, limits: &FlightLimits, case: &str) {
    for (end, time) in [(from, 0.0), (to, flight.duration())] {
        let size = end.position.norm().max(1.0);
        let found = flight.at(time);
        assert!((found.position - end.position).norm() < 1e-12 * size, "{case}");
        assert!((found.velocity - end.velocity).norm() < 1e-12, "{case}");
        assert!((found.acceleration - end.acceleration).norm() < 1e-9, "{case}");
    }
    check_limits(flight, limits, case);
    check_joints(flight, case);
}

/// Holds a flight to its limits on a fine grid, and to its box.
fn check_limits(flight: &Flight, limits: &FlightLimits, case: &str) {
    let [lower, upper] = flight.bounds();
    for index in 0..=400 {
        let motion = flight.at(flight.duration() * f64::from(index) / 400.0);
        let share = [
            motion.velocity.norm() / limits.speed,
            motion.acceleration.norm() / limits.acceleration,
            motion.jerk.norm() / limits.jerk,
        ];
        assert!(share.iter().all(|share| *share <= 1.0 + 1e-9), "{case}: {share:?}");
        for axis in 0..3 {
            let position = motion.position[axis];
            assert!(lower[axis] <= position + 1e-13 && position <= upper[axis] + 1e-13, "{case}");
        }
    }
}

/// Holds a flight to be continuous where its jerk changes.
fn check_joints(flight: &Flight, case: &str) {
    let breaks: Vec<f64> = flight.breaks().collect();
    assert_eq!(*breaks.last().unwrap(), flight.duration());
    for (index, pair) in breaks.windows(2).enumerate() {
        let end = flight.phases[index].motion.after(pair[1] - pair[0]);
        let next = flight.at(pair[1]);
        let size = next.position.norm().max(1.0);
        assert!((end.position - next.position).norm() < 1e-12 * size, "{case} at {index}");
        assert!((end.velocity - next.velocity).norm() < 1e-12, "{case} at {index}");
        assert!((end.acceleration - next.acceleration).norm() < 1e-9, "{case} at {index}");
    }
}

fn direction(random: &mut SplitMix64, flat: bool) -> Vector3<f64> {
    let angle = random.between(0.0, math::TURN);
    let height = if flat { 0.0 } else { random.between(-1.0, 1.0) };
    let (sine, cosine) = math::sin_cos(angle);
    Vector3::new(cosine, sine, height).normalize()
}

/// A state within `limits`, at times at rest, straight or at its very limit.
fn state(random: &mut SplitMix64, flat: bool, limits: &FlightLimits) -> State {
    let position = direction(random, flat) * logarithmic(random, 1e-6, 0.1);
    let kind = random.bits() % 8;
    let part =
        if kind == 0 || random.bits().is_multiple_of(8) { 1.0 } else { random.between(0.01, 1.0) };
    let velocity = direction(random, flat) * limits.speed * part;
    if kind == 1 {
        return State::rest(position);
    }
    if kind.is_multiple_of(2) {
        return moving(position, velocity);
    }
    let across = direction(random, flat);
    let across = (across - velocity * (across.dot(&velocity) / velocity.norm_squared()))
        .try_normalize(0.0)
        .unwrap_or_else(Vector3::zeros);
    let part = if kind == 3 { 1.0 } else { random.fraction() };
    // On a line the jerk is at least a²/v.
    let top = limits.acceleration.min(0.7 * (limits.jerk * velocity.norm()).sqrt());
    State { velocity, acceleration: across * top * part, ..State::rest(position) }
}

#[test]
fn random_flights_meet_their_ends_and_keep_their_limits() {
    let mut random = SplitMix64::new(1);
    for index in 0..6000_u32 {
        let limits = FlightLimits {
            speed: logarithmic(&mut random, 0.05, 2.0),
            acceleration: logarithmic(&mut random, 1.0, 100.0),
            jerk: logarithmic(&mut random, 50.0, 1e6),
        };
        let flat = !index.is_multiple_of(3);
        let from = state(&mut random, flat, &limits);
        let to = state(&mut random, flat, &limits);
        let case = format!("{index}: {from:?} {to:?} {limits:?}");
        let Some(flight) = Flight::new(&from, &to, &limits, &mut |_| true) else {
            panic!("none: {case}");
        };
        check(&flight, &from, &to, &limits, &case);
    }
}

#[test]
fn looser_limits_never_make_a_flight_longer() {
    let mut random = SplitMix64::new(2);
    for index in 0..3000_u32 {
        let from = state(&mut random, !index.is_multiple_of(3), &LIMITS);
        let to = state(&mut random, !index.is_multiple_of(3), &LIMITS);
        let factor = [(); 3].map(|()| random.between(1.0, 2.0));
        let loose = FlightLimits {
            speed: LIMITS.speed * factor[0],
            acceleration: LIMITS.acceleration * factor[1],
            jerk: LIMITS.jerk * factor[2],
        };
        let (tight, loose) = (flight(&from, &to, &LIMITS), flight(&from, &to, &loose));
        let ratio = loose.duration() / tight.duration();
        assert!(ratio <= 1.01, "{index}: {ratio} {from:?} {to:?} {factor:?}");
    }
}

#[test]
fn a_state_is_reached_from_itself_in_no_time() {
    for velocity in [0.0, 0.5] {
        let state = moving(Vector3::new(0.1, 0.2, 0.3), Vector3::x() * velocity);
        let flight = flight(&state, &state, &LIMITS);
        assert_eq!(flight.duration(), 0.0);
        check(&flight, &state, &state, &LIMITS, "itself");
    }
}

#[test]
fn the_same_velocity_on_its_way_is_kept() {
    let velocity = Vector3::new(0.3, 0.4, 0.0);
    let from = moving(Vector3::zeros(), velocity);
    let to = moving(velocity * 0.02, velocity);
    let flight = flight(&from, &to, &LIMITS);
    assert!((flight.duration() - 0.02).abs() < 1e-12);
    check(&flight, &from, &to, &LIMITS, "straight on");
}

#[test]
fn from_rest_to_rest_it_is_the_shortest_move() {
    let from = State::rest(Vector3::zeros());
    for length in [1e-9, 1e-3, 0.1, 1.0] {
        let to = State::rest(Vector3::new(0.6, 0.0, 0.8) * length);
        let flight = flight(&from, &to, &LIMITS);
        let shortest = Move::new(length, 1.0, 10.0, 500.0).duration();
        assert!((flight.duration() - shortest).abs() < 1e-12);
        check(&flight, &from, &to, &LIMITS, "rest to rest");
    }
}

#[test]
fn tiny_and_huge_numbers_end_in_a_flight_or_in_none() {
    let sizes = [0.0, 1e-300, 1e-18, 1e-9, 1e-3, 1.0, 1e6, 1e150, f64::INFINITY, f64::NAN];
    for way in sizes {
        for speed in sizes {
            for change in sizes {
                let from = moving(Vector3::zeros(), Vector3::x() * speed);
                let to = State {
                    acceleration: Vector3::y() * change,
                    ..moving(Vector3::new(way, way, 0.0), Vector3::y() * speed)
                };
                let found = Flight::new(&from, &to, &LIMITS, &mut |_| true);
                if let Some(found) = found {
                    assert!(found.duration().is_finite());
                    check(&found, &from, &to, &LIMITS, &format!("{way:e} {speed:e} {change:e}"));
                }
                let loose = FlightLimits { speed: f64::INFINITY, acceleration: 1e9, jerk: 1e18 };
                let found = Flight::new(&from, &to, &loose, &mut |_| true);
                assert!(found.is_none_or(|found| found.duration().is_finite()));
            }
        }
    }
}

#[test]
fn states_beyond_the_limits_have_no_flight() {
    let (rest, fast) =
        (State::rest(Vector3::zeros()), moving(Vector3::zeros(), Vector3::x() * 1.1));
    assert!(Flight::new(&rest, &fast, &LIMITS, &mut |_| true).is_none());
    let bent = State { acceleration: Vector3::x() * 11.0, ..rest };
    assert!(Flight::new(&bent, &rest, &LIMITS, &mut |_| true).is_none());
}

#[test]
fn what_asks_for_slower_is_obeyed() {
    let mut random = SplitMix64::new(3);
    for index in 0..200 {
        let from = state(&mut random, true, &LIMITS);
        let to = state(&mut random, true, &LIMITS);
        let top =
            random.between(3.0, 9.0).max(from.acceleration.norm()).max(to.acceleration.norm());
        let case = format!("{index} {from:?} {to:?}");
        let mut slow = |flight: &Flight| {
            flight.breaks().all(|time| flight.at(time).acceleration.norm() <= top * (1.0 + 1e-9))
        };
        let Some(found) = Flight::new(&from, &to, &LIMITS, &mut slow) else {
            panic!("none: {case}");
        };
        assert!(slow(&found), "{case}");
        check(&found, &from, &to, &LIMITS, &case);
        let direct = flight(&from, &to, &FlightLimits { acceleration: top, ..LIMITS });
        let ratio = found.duration() / direct.duration();
        assert!(ratio < 1.05, "{ratio} {case}");
    }
}

#[test]
fn what_never_fits_is_none() {
    let from = moving(Vector3::zeros(), Vector3::x() * 0.5);
    let to = moving(Vector3::y() * 1e-3, Vector3::x() * -0.5);
    let mut calls = 0;
    let found = Flight::new(&from, &to, &LIMITS, &mut |_| {
        calls += 1;
        false
    });
    assert!(found.is_none() && calls < 100, "{calls}");
}
