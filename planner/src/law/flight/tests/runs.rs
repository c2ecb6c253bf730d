use super::*;

/// How long the pair of ramp and swing takes [s].
fn paired(to: &State, limits: &FlightLimits) -> f64 {
    run::paired(to, limits).duration()
}

#[test]
fn a_straight_run_in_is_the_ramp() {
    // Golden trajectory.json, V 0.25: T 0.045 s, L 5.625 mm.
    let to = moving(Vector3::new(0.01, 0.02, 0.0), Vector3::y() * 0.25);
    let run = Flight::run_in(&to, &LIMITS, &[]).unwrap();
    assert!((run.duration() - 0.045).abs() < 1e-12);
    let off = run.at(0.0).position - Vector3::new(0.01, 0.02 - 0.005_625, 0.0);
    assert!(off.norm() < 1e-12, "{off}");
}

#[test]
fn random_run_ins_and_run_outs_are_no_longer_than_ramp_and_swing() {
    let mut random = SplitMix64::new(4);
    let (mut sum, mut best) = (0.0, 1.0_f64);
    for index in 0..1000 {
        let speed = logarithmic(&mut random, 1e-3, 1.0);
        let part = if index % 10 == 0 { 1.0 } else { logarithmic(&mut random, 1e-4, 1.0) };
        let to = State {
            acceleration: Vector3::x() * LIMITS.acceleration * part,
            ..moving(Vector3::new(0.1, 0.0, 0.2), Vector3::z() * speed)
        };
        let case = format!("{index}: {to:?}");
        let run = Flight::run_in(&to, &LIMITS, &[]).unwrap();
        let start = State::rest(run.at(0.0).position);
        check(&run, &start, &to, &LIMITS, &case);
        let ratio = run.duration() / paired(&to, &LIMITS);
        assert!(ratio <= 1.0 + 1e-12, "{ratio} {case}");
        (sum, best) = (sum + ratio, best.min(ratio));
        let out = Flight::run_out(&to, &LIMITS, &[]).unwrap();
        check(&out, &to, &State::rest(out.at(f64::MAX).position), &LIMITS, &case);
        assert!(out.duration() <= paired(&to, &LIMITS) * (1.0 + 1e-12), "{case}");
    }
    println!("run-ins over ramp and swing: mean {:.3}, least {best:.3}", sum / 1000.0);
}

#[test]
fn a_run_into_rest_takes_no_time() {
    let rest = State::rest(Vector3::x());
    assert_eq!(Flight::run_in(&rest, &LIMITS, &[]).unwrap().duration(), 0.0);
    assert_eq!(Flight::run_out(&rest, &LIMITS, &[]).unwrap().at(1.0).position, Vector3::x());
}
