//! Arcs against their definition, and what becomes of rounded ones.

use core::f64::consts::{PI, TAU};

use messages::math;
use messages::random::SplitMix64;

use super::super::arc::{Arc, Form, axes, rounding};
use super::super::codes::{MILLIMETRE, Plane};
use super::*;
use crate::random::logarithmic;

const PLANES: [Plane; 3] = [Plane::Xy, Plane::Zx, Plane::Yz];

#[test]
fn random_arcs_keep_their_ends_and_radius() {
    let mut random = SplitMix64::new(2);
    for case in 0..20_000 {
        let plane = PLANES[(random.bits() % 3) as usize];
        let [u, v, w] = axes(plane);
        let radius = logarithmic(&mut random, 1e-5, 1.0);
        let counterclockwise = random.bits().is_multiple_of(2);
        let first = random.between(-PI, PI);
        let sweep = random.between(1e-3, TAU - 1e-3);
        let last = if counterclockwise { first + sweep } else { first - sweep };
        let centre = Vector3::from_fn(|_, _| random.between(-0.2, 0.2));
        let on = |angle: f64, height: f64| {
            let mut point = centre;
            point[u] += radius * math::cos(angle);
            point[v] += radius * math::sin(angle);
            point[w] = height;
            point
        };
        let start = on(first, random.between(-0.1, 0.1));
        let end = on(last, random.between(-0.1, 0.1));
        let by_radius = random.bits().is_multiple_of(2);
        let form = if by_radius {
            Form::Radius(if sweep < PI { radius } else { -radius })
        } else {
            Form::Centre(centre)
        };
        let input = format!("case {case}: {plane:?} {start:?} {end:?} {form:?}");
        let turns = if by_radius { 1.0 } else { 1.0 + (random.bits() % 3) as f64 };
        let arc = Arc::new(plane, counterclockwise, start, end, form, turns, rounding(MILLIMETRE))
            .unwrap();
        // Coordinates are rounded at 5e-17 m; a centre from R amplifies that near a half turn by
        // the root of it, which moves the arc but not its ends.
        let signed = if counterclockwise { sweep } else { -sweep };
        let expected = signed + signed.signum() * TAU * (turns - 1.0);
        assert!((arc.sweep - expected).abs() < 1e-6, "{input}: {} {expected}", arc.sweep);
        assert!((arc.point(0.0) - start).norm() < 1e-14, "{input}");
        assert!((arc.point(arc.sweep) - end).norm() < 2e-12, "{input}");
        let length = math::hypot(radius * expected, end[w] - start[w]);
        assert!((arc.length() - length).abs() < 1e-6 * radius, "{input}");
    }
}

#[test]
fn rounded_arcs_meet_their_ends_and_stay_near_their_circle() {
    let mut random = SplitMix64::new(3);
    let rounded = |value: f64| (value / 1e-5).round() * 1e-5;
    for case in 0..20_000 {
        let radius = logarithmic(&mut random, 2e-4, 0.1);
        let centre = Vector3::zeros();
        let first = random.between(-PI, PI);
        let sweep = random.between(2e-3, TAU);
        let on = |angle: f64| {
            let (sine, cosine) = math::sin_cos(angle);
            Vector3::new(rounded(radius * cosine), rounded(radius * sine), 0.0)
        };
        let (start, end) = (on(first), on(first + sweep));
        if (end - start).norm() < 3e-5 {
            continue;
        }
        let input = format!("case {case}: {start:?} {end:?} {sweep}");
        let arc =
            Arc::new(Plane::Xy, true, start, end, Form::Centre(centre), 1.0, rounding(MILLIMETRE))
                .unwrap();
        assert!((arc.point(0.0) - start).norm() < 1e-15, "{input}");
        assert!((arc.point(arc.sweep) - end).norm() < 1e-12, "{input}");
        // Each end is off the circle by up to 7.1 µm, half the diagonal of the grid.
        for part in 0..=16 {
            let point = arc.point(arc.sweep * f64::from(part) / 16.0);
            let off = (point.norm() - radius).abs();
            assert!(off < 2.0 * 7.1e-6, "{input}: {off:e} at {part}/16");
        }
    }
}

#[test]
fn an_almost_straight_arc_becomes_a_line() {
    let program = flat("M3 S1 F60 G2 X0.001 R1000");
    assert_eq!(program.drawing.steps.len(), 1);
    let Action::Mark { curve, .. } = program.drawing.steps[0].action else { panic!() };
    assert!(matches!(curve, Curve::Line { .. }), "{curve:?}");
}

#[test]
fn an_arc_upright_to_an_ignored_z_goes_to_and_fro() {
    // 300 degrees over XZ around X5 with radius 5: from X10 to X0 and back to X7.5 in 6 s.
    let program = flat("G0 X10\nM3 S1 G93 G18 G3 X7.5 Z4.3301270189 I-5 F10");
    check_sound(&program, "to and fro");
    let marks: Vec<_> = program.drawing.steps[1..]
        .iter()
        .map(|step| match step.action {
            Action::Mark { curve, speed, .. } => (curve.to(), speed.unwrap()),
            _ => panic!("{step:?}"),
        })
        .collect();
    assert_eq!(marks.len(), 2);
    // The file gives Z to 1e-10 mm, which the centre absorbs.
    assert!((marks[0].0 - Vector3::new(0.0, 0.0, 0.0)).norm() < 1e-12, "{marks:?}");
    assert!((marks[1].0 - Vector3::new(0.0075, 0.0, 0.0)).norm() < 1e-12, "{marks:?}");
    assert!(marks.iter().all(|mark| (mark.1 - 0.0175 / 6.0).abs() < 1e-12), "{marks:?}");
    let length = 5.0 * 0.005 * PI / 3.0;
    assert!((program.facts.feed_length - length).abs() < 1e-12, "{:?}", program.facts);
}
