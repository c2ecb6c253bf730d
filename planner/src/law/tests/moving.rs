//! Stretches with ends in motion.

use super::path::Path;
use crate::law::{End, Infeasible, Settings, TimeLaw, plan};

const TOOL: [f64; 3] = [0.3, 10.0, 500.0];

fn moving(speed: f64, acceleration: f64) -> End {
    End::Moving { speed, acceleration }
}

fn law_of(path: &mut Path, ends: [End; 2]) -> Result<TimeLaw, Infeasible> {
    let length = path.length;
    plan(path, 0.0, length, ends, &Settings::default())
}

#[test]
fn a_plateau_at_both_ends_is_met_and_the_dip_between_is_within_limits() {
    let mut path = Path::wave(2e-3, 20e-3, 0.04, [0.5, 10.0, 500.0]);
    let law = law_of(&mut path, [moving(0.1, 0.0); 2]).unwrap();
    for time in [0.0, law.duration()] {
        let along = law.at(time);
        assert!((along.velocity - 0.1).abs() < 1e-9, "{along:?}");
        assert!(along.acceleration.abs() < 1e-6, "{along:?}");
    }
    let most = path.most(&law, 2e-4);
    assert!(most.iter().all(|used| *used < 1.01), "{most:?}");
}

#[test]
fn a_plateau_within_every_limit_is_kept() {
    let mut path = Path::circle(0.02, 1.0, TOOL);
    let law = law_of(&mut path, [moving(0.3, 0.0); 2]).unwrap();
    let even = path.length / 0.3;
    assert!((law.duration() / even - 1.0).abs() < 2e-3, "{} {even}", law.duration());
}

#[test]
fn an_end_with_acceleration_is_met() {
    let mut path = Path::line(0.05, TOOL);
    let law = law_of(&mut path, [moving(0.05, 5.0), moving(0.1, -8.0)]).unwrap();
    let (start, end) = (law.at(0.0), law.at(law.duration()));
    assert!((start.velocity - 0.05).abs() < 1e-9 && (start.acceleration - 5.0).abs() < 1e-6);
    assert!((end.velocity - 0.1).abs() < 1e-6 && (end.acceleration + 8.0).abs() < 1e-3);
    let most = path.most(&law, 1e-4);
    assert!(most.iter().all(|used| *used < 1.01), "{most:?}");
}

#[test]
fn the_state_of_a_law_on_its_way_can_be_gone_on_from() {
    let mut whole = Path::wave(2e-3, 10e-3, 0.06, [0.5, 10.0, 500.0]);
    let law = law_of(&mut whole, [End::Rest; 2]).unwrap();
    for place in [0.004, 0.0123, 0.03, 0.0431, 0.055] {
        let begin = law.up_to(place);
        let (from, state) = (begin.places().end, law.at(begin.duration()));
        let start = moving(state.velocity, state.acceleration);
        let settings = Settings::default();
        let rest = plan(&mut whole, from, 0.06, [start, End::Rest], &settings)
            .unwrap_or_else(|error| panic!("{place}: {error:?}"));
        let all = begin.duration() + rest.duration();
        assert!(all < 1.02 * law.duration(), "{place}: {all} {}", law.duration());
        let mut joined = begin.clone();
        joined.append(&rest);
        let most = whole.most(&joined, 1e-4);
        assert!(most.iter().all(|used| *used < 1.01), "{place}: {most:?}");
    }
}

#[test]
fn an_end_out_of_reach_is_told() {
    let mut short = Path::line(1e-3, TOOL);
    let error = law_of(&mut short, [End::Rest, moving(0.3, 0.0)]).unwrap_err();
    assert!(error.at_end, "{error:?}");
    let error = law_of(&mut short, [moving(0.3, 0.0), End::Rest]).unwrap_err();
    assert!(!error.at_end, "{error:?}");
    // Within the acceleration, but not within the jerk.
    let mut middling = Path::line(3e-3, TOOL);
    let error = law_of(&mut middling, [moving(0.2, 0.0), End::Rest]).unwrap_err();
    assert!(!error.at_end, "{error:?}");
    let mut long = Path::line(0.05, TOOL);
    assert!(law_of(&mut long, [moving(0.4, 0.0), End::Rest]).is_err());
    assert!(law_of(&mut long, [moving(0.3, 0.0), End::Rest]).is_ok());
}
