//! The programs of `jobs/`, whose lengths and ends also `rs274` of LinuxCNC 2.9 gives.

use core::f64::consts::PI;

use super::*;
use crate::drawing::{Corners, Drawing, Power};

const SQUARE: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../jobs/square_arcs.ngc"));
const PREAMBLE: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../jobs/preamble.ngc"));
const HELIX: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../jobs/helix.ngc"));

pub(super) const ALL: [&str; 3] = [SQUARE, PREAMBLE, HELIX];

/// Rounding of sums of lengths around 0.1 m.
const ROUND_OFF: f64 = 1e-15;

fn check(program: &Program, blocks: u64, feed: f64, rapid: f64, mark: f64) {
    let facts = program.facts;
    assert_eq!(facts.blocks, blocks);
    assert!((facts.feed_length - feed).abs() < ROUND_OFF, "{facts:?}");
    assert!((facts.rapid_length - rapid).abs() < ROUND_OFF, "{facts:?}");
    assert!((facts.mark_length - mark).abs() < ROUND_OFF, "{facts:?}");
    check_sound(program, "sample");
}

fn notes(drawing: &Drawing) -> Vec<(u64, &str)> {
    drawing.notes.iter().map(|note| (note.line, note.text.as_str())).collect()
}

#[test]
fn square_with_arcs() {
    let program = read("jobs/square_arcs.ngc", SQUARE, &Machine::builtin()).unwrap();
    let marked = 0.120 + 3.0 * PI * 0.015;
    check(&program, 14, marked, 0.030 * 2.0_f64.sqrt(), marked);
    assert_eq!(program.drawing.name, "square_arcs");
    assert!(program.drawing.notes.is_empty());
    // The origin of the built-in machine is the middle of its area.
    assert!(program.facts.end.iter().all(|end| end.abs() < ROUND_OFF));
    let lower = [0.085, 0.085, 0.0];
    let upper = [0.115, 0.115, 0.0];
    for axis in 0..3 {
        assert!((program.facts.lower[axis] - lower[axis]).abs() < ROUND_OFF);
        assert!((program.facts.upper[axis] - upper[axis]).abs() < ROUND_OFF);
    }
    let marks = program.drawing.steps.iter().filter_map(|step| match step.action {
        Action::Mark { speed, power, .. } => Some((speed, power)),
        _ => None,
    });
    let expected = (Some(6000.0 * 1e-3 / 60.0), Power { level: 0.8, follows_speed: false });
    assert_eq!(marks.collect::<Vec<_>>(), [expected; 7]);
}

#[test]
fn preamble_and_forms_of_arcs() {
    let program = flat(PREAMBLE);
    let feed = 4.0 * PI * 0.010 + 0.0127 - 0.010 + 0.0127 + 0.010;
    check(&program, 19, feed, 0.020, feed - 0.0127);
    assert!(program.facts.end.iter().all(|end| end.abs() < ROUND_OFF));
    assert_eq!(
        notes(&program.drawing),
        [
            (4, "T has no effect: a marking head has no tools"),
            (8, "lines that begin with / are left out (block delete)"),
            (22, "the program ends here: one line with words after it, not read"),
        ]
    );
    let steps = &program.drawing.steps;
    assert_eq!(steps[0].action, Action::Corners(Corners::Blend(Some(0.05e-3))));
    assert_eq!(steps[2].action, Action::Output { bit: 0, on: true });
    let Action::Mark { curve: Curve::Arc { sweep, .. }, power, .. } = steps[3].action else {
        panic!("{:?}", steps[3]);
    };
    assert_eq!(sweep, 2.0 * PI);
    assert_eq!(power, Power { level: 0.25, follows_speed: true });
    // Inches beside G20: F100 is 100 in/min; S0 goes on in the dark at the same feed.
    let inches = 100.0 * 0.0254 / 60.0;
    assert!(
        matches!(steps[7].action, Action::Feed { speed, .. } if (speed - inches).abs() < 1e-15)
    );
    assert_eq!(steps[8].action, Action::Dwell { time: 0.25, lit: None });
    // G93: 10 mm in 1/120 min are 20 mm/s.
    assert!(matches!(
        steps[9].action,
        Action::Mark { speed: Some(speed), .. } if (speed - 0.020).abs() < 1e-15
    ));
    assert_eq!(steps[10].action, Action::Dwell { time: 0.1, lit: Some(1.0) });
    assert_eq!(steps[11].action, Action::Output { bit: 0, on: false });
    assert_eq!(steps.len(), 13);
}

fn helix_length() -> f64 {
    let turn = |angle: f64, rise: f64| messages::math::hypot(angle * 0.005, rise);
    turn(2.0 * PI, 0.002) + turn(4.0 * PI, 0.002) + 2.0 * turn(PI, 0.0) + turn(PI, 0.010)
}

#[test]
fn arcs_in_space_with_a_focus_axis() {
    let program = read("helix.ngc", HELIX, &machine(ZMeaning::Focus)).unwrap();
    let rapid = 0.005 + messages::math::hypot(0.005, 0.020);
    check(&program, 11, helix_length(), rapid, helix_length());
    assert!(program.drawing.notes.is_empty());
    // Clockwise as seen from the far end of the plane's normal: in the ZX plane from X-5 to X5 below
    // the centre, in the YZ plane from Y-5 to Y5 above it.
    let heights = [2e-3, 0.0, 0.0, 0.0, 0.0];
    let middles = [1e-3, 1e-3, -5e-3, -5e-3, 5e-3];
    for (index, step) in program.drawing.steps[1..6].iter().enumerate() {
        let Action::Mark { curve, .. } = step.action else { panic!("{step:?}") };
        assert!((curve.to().z - heights[index]).abs() < 1e-15, "{curve:?}");
        assert!((curve.point(0.5).z - middles[index]).abs() < 1e-15, "{curve:?}");
    }
}

#[test]
fn arcs_seen_along_an_ignored_z() {
    let program = flat(HELIX);
    let rapid = 0.005 + messages::math::hypot(0.005, 0.020);
    check(&program, 11, helix_length(), rapid, helix_length());
    assert_eq!(
        notes(&program.drawing),
        [
            (5, "moves along Z are left out: this machine ignores Z"),
            (7, "an arc in an upright plane is marked as seen along Z, to and fro"),
        ]
    );
    for step in &program.drawing.steps {
        if let Action::Mark { curve, .. } = step.action {
            assert!((0..=8).all(|part| curve.point(f64::from(part) / 8.0).z == 0.0), "{curve:?}");
        }
    }
    // Half a turn that moves along Y is half a wave: in its middle it is half way along both.
    let Action::Mark { curve: wave @ Curve::Arc { .. }, .. } = program.drawing.steps[4].action
    else {
        panic!("{:?}", program.drawing.steps[4]);
    };
    assert!((wave.point(0.5) - Vector3::new(0.010, 0.005, 0.0)).norm() < 1e-15);
}
