use super::*;

/// Two directions across each other, with `part` of the acceleration.
fn diagonal(part: f64) -> [DirectionLimit; 2] {
    [1.0, -1.0].map(|sign| DirectionLimit {
        direction: Vector3::new(1.0, sign, 0.0).normalize(),
        speed: 0.8 * LIMITS.speed,
        acceleration: part * LIMITS.acceleration,
        jerk: 0.7 * LIMITS.jerk,
    })
}

/// The largest shares of the limits along `directions` in use, between the ends.
fn used(flight: &Flight, directions: &[DirectionLimit]) -> f64 {
    let mut most = 0.0_f64;
    for index in 1..400 {
        let motion = flight.at(flight.duration() * f64::from(index) / 400.0);
        for side in directions {
            let along = |vector: &Vector3<f64>| side.direction.dot(vector).abs();
            most = most
                .max(along(&motion.velocity) / side.speed)
                .max(along(&motion.acceleration) / side.acceleration)
                .max(along(&motion.jerk) / side.jerk);
        }
    }
    most
}

#[test]
fn turns_and_runs_keep_the_limits_of_directions() {
    let mut random = SplitMix64::new(11);
    let directions = diagonal(0.4);
    for case in 0..200 {
        let ends = [0, 1].map(|_| {
            let position = direction(&mut random, true) * logarithmic(&mut random, 1e-4, 0.1);
            moving(position, direction(&mut random, true) * random.between(0.05, 0.5))
        });
        let [from, to] = &ends;
        let turn = Flight::within(from, to, &LIMITS, &directions).unwrap();
        check(&turn, from, to, &LIMITS, &format!("turn {case}"));
        let run = Flight::run_in(to, &LIMITS, &directions).unwrap();
        for flight in [&turn, &run] {
            let used = used(flight, &directions);
            assert!(used <= 1.0 + 1e-9, "{case}: {used}");
        }
        let free = Flight::within(from, to, &LIMITS, &[]).unwrap();
        assert!(turn.duration() >= free.duration() * 0.99, "{case}");
    }
}

#[test]
fn a_straight_run_in_takes_all_that_a_direction_leaves() {
    let to = moving(Vector3::zeros(), Vector3::x() * 0.5);
    let directions = diagonal(0.4);
    let run = Flight::run_in(&to, &LIMITS, &directions).unwrap();
    let used = used(&run, &directions);
    assert!((used - 1.0).abs() < 1e-6, "{used}");
}
