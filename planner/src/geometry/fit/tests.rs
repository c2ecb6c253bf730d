//! Tests of the fit as a whole.

use messages::math::{cos, sin};

use super::*;
use crate::geometry::jet::Jet;

const TURN: f64 = 2.0 * std::f64::consts::PI;

/// A circle of 20 mm in chords of this length [m], so many turns.
fn circle(chord: f64, turns: f64) -> Vec<Vector3<f64>> {
    let count = (turns * TURN * 0.02 / chord).round();
    (0..=count as usize)
        .map(|i| turns * TURN * i as f64 / count)
        .map(|angle| Vector3::new(cos(angle), sin(angle), 0.0) * 0.02)
        .collect()
}

fn rounded(vertex: Vector3<f64>, step: f64) -> Vector3<f64> {
    vertex.map(|value| (value / step).round() * step)
}

/// A polyline through these corners [mm].
fn corners(points: &[(f64, f64)]) -> Vec<Vector3<f64>> {
    points.iter().map(|&(x, y)| Vector3::new(x, y, 0.0) * 1e-3).collect()
}

/// The polyline with its lines cut into chords of this length [m].
fn chopped(polyline: &[Vector3<f64>], chord: f64) -> Vec<Vector3<f64>> {
    let mut result = vec![polyline[0]];
    for ends in polyline.windows(2) {
        let count = ((ends[1] - ends[0]).norm() / chord).round().max(1.0);
        result.extend(
            (1..=count as usize).map(|i| ends[0] + (ends[1] - ends[0]) * (i as f64 / count)),
        );
    }
    result
}

fn only_curve(vertices: &[Vector3<f64>], tolerance: f64) -> Spline {
    match fit(vertices, tolerance).as_slice() {
        [(Part::Curve(curve), _)] => curve.clone(),
        parts => panic!("{} parts", parts.len()),
    }
}

fn jets(curve: &Spline) -> impl Iterator<Item = Jet> + '_ {
    let count = 8 * curve.knots().len();
    (0..=count).map(move |i| curve.at(curve.length() * i as f64 / count as f64))
}

fn lines(parts: &[(Part, RangeInclusive<usize>)]) -> usize {
    parts.iter().filter(|(part, _)| matches!(part, Part::Line { .. })).count()
}

/// Parts follow one another, cover every vertex, and all numbers are finite.
fn assert_sound(vertices: &[Vector3<f64>], tolerance: f64) {
    let parts = fit(vertices, tolerance);
    let mut next = None;
    for (part, range) in &parts {
        let (from, to) = match part {
            Part::Line { from, to } => (*from, *to),
            Part::Curve(curve) => {
                for jet in jets(curve) {
                    let all = [jet.point, jet.first, jet.second, jet.third];
                    assert!(all.iter().all(|vector| vector.iter().all(|x| x.is_finite())));
                }
                (curve.at(0.0).point, curve.at(curve.length()).point)
            }
        };
        if let Some((point, number)) = next {
            assert_eq!((from, *range.start()), (point, number));
        }
        next = Some((to, *range.end()));
    }
}

#[test]
fn a_circle_is_found_whatever_its_chords() {
    for (chord, allowed) in [(3e-5, 1e-6), (1e-4, 1e-6), (1e-3, 5e-6)] {
        let curve = only_curve(&circle(chord, 4.0), 1e-5);
        // Coarse chords hold the curve inside the circle, but not at its ends.
        let inside = (0..5000).map(|i| 3e-3 + (curve.length() - 6e-3) * f64::from(i) / 5000.0);
        for jet in inside.map(|u| curve.at(u)) {
            assert!((jet.point.norm() - 0.02).abs() < allowed, "{chord}");
            assert!((jet.first.norm() - 1.0).abs() < 3e-3);
            assert!((jet.second.norm() - 50.0).abs() < 0.5, "{}", jet.second.norm());
            assert!(jet.third.norm() < 3250.0);
        }
    }
}

#[test]
fn a_long_curve_has_two_continuous_derivatives() {
    let curve = only_curve(&circle(1e-4, 4.0), 1e-5);
    for &knot in &curve.knots()[1..] {
        let (before, after) = (curve.at(knot - 1e-12), curve.at(knot));
        assert!((before.point - after.point).norm() < 1e-11);
        assert!((before.first - after.first).norm() < 1e-9);
        assert!((before.second - after.second).norm() < 1e-6);
    }
}

#[test]
fn a_straight_line_in_rounded_chords_is_a_line() {
    let ends = corners(&[(20.0, 20.0), (80.0, 57.0)]);
    for step in [1e-5, 1e-6, 1e-7] {
        let vertices: Vec<_> =
            chopped(&ends, 1e-4).into_iter().map(|vertex| rounded(vertex, step)).collect();
        let parts = fit(&vertices, 1e-5);
        assert_eq!((parts.len(), lines(&parts)), (1, 1), "{step}");
    }
}

#[test]
fn noise_within_the_tolerance_makes_no_corner() {
    // Noise of a third of the chord still makes the shortest chords wiggle here and there.
    for (chord, allowed) in [(3e-5, f64::INFINITY), (1e-4, 1.5), (3e-4, 1.5)] {
        let vertices: Vec<_> = circle(chord, 2.0).into_iter().map(|v| rounded(v, 1e-5)).collect();
        let curve = only_curve(&vertices, 1e-5);
        let inside = (0..5000).map(|i| 3e-3 + (curve.length() - 6e-3) * f64::from(i) / 5000.0);
        for jet in inside.map(|u| curve.at(u)) {
            assert!((jet.second.norm() - 50.0).abs() < allowed, "{chord} {}", jet.second.norm());
        }
    }
}

#[test]
fn true_corners_are_kept_exactly() {
    let square = [(0.0, 0.0), (40.0, 0.0), (40.0, 40.0), (0.0, 40.0), (0.0, 0.0)];
    let zigzag: Vec<_> = (0..20).map(|i| (i as f64, f64::from(i % 2) * 2.0)).collect();
    for outline in [corners(&square), corners(&zigzag)] {
        for chord in [1.0, 1e-4] {
            let parts = fit(&chopped(&outline, chord), 1e-5);
            assert_eq!((parts.len(), lines(&parts)), (outline.len() - 1, outline.len() - 1));
            for ((part, _), corner) in parts.iter().zip(&outline[1..]) {
                assert!(matches!(part, Part::Line { to, .. } if (to - corner).norm() < 1e-12));
            }
        }
    }
}

#[test]
fn the_cusps_of_a_heart_are_corners_and_nothing_else_is() {
    // Two half circles over a straight tip.
    let mut vertices = chopped(&corners(&[(0.0, -20.0), (-10.0, 0.0)]), 1e-4);
    for centre in [-5e-3, 5e-3] {
        let arc = (1..=150).map(|i| TURN / 2.0 * (1.0 - i as f64 / 150.0));
        vertices.extend(arc.map(|a| Vector3::new(centre + cos(a) * 5e-3, sin(a) * 5e-3, 0.0)));
    }
    vertices.extend(chopped(&corners(&[(10.0, 0.0), (0.0, -20.0)]), 1e-4).into_iter().skip(1));
    let parts = fit(&vertices, 1e-5);
    assert_eq!(parts.len(), 4, "{:?}", parts.iter().map(|part| &part.1).collect::<Vec<_>>());
    assert_eq!(lines(&parts), 2);
}

#[test]
fn a_true_way_back_is_a_corner() {
    let parts = fit(&corners(&[(0.0, 0.0), (10.0, 0.0), (0.0, 0.0)]), 1e-5);
    assert_eq!((parts.len(), lines(&parts)), (2, 2));
}

#[test]
fn a_helix_far_from_the_origin_is_smooth() {
    let helix: Vec<_> = (0..3000)
        .map(|i| i as f64 * 0.01)
        .map(|a| Vector3::new(0.5 + 0.01 * cos(a), 0.5 + 0.01 * sin(a), 1e-3 * a))
        .collect();
    let curve = only_curve(&helix, 1e-5);
    let curvature = 0.01 / (0.01 * 0.01 + 1e-6);
    for jet in jets(&curve) {
        assert!((jet.second.norm() - curvature).abs() < 0.02 * curvature);
    }
}

#[test]
fn every_vertex_is_near_its_place_on_the_curve() {
    let vertices: Vec<_> = circle(1e-4, 1.0).into_iter().map(|v| rounded(v, 1e-5)).collect();
    let curve = only_curve(&vertices, 2e-5);
    let mut before = 0.0;
    for (number, vertex) in vertices.iter().enumerate() {
        let u = curve.parameter_of(number);
        assert!(u >= before);
        before = u;
        assert!((curve.at(u).point - vertex).norm() < 1.3e-5);
    }
    assert_eq!(curve.at(before).point, vertices[vertices.len() - 1]);
}

#[test]
fn odd_polylines_are_fitted_without_panic() {
    let point = Vector3::new(0.5, 0.5, 0.0);
    for tolerance in [0.0, f64::NAN, 1e-6, 1e-5, 1e-4] {
        assert_sound(&[], tolerance);
        assert_sound(&[point], tolerance);
        assert_sound(&vec![point; 100], tolerance);
        assert_sound(&circle(1e-4, 1.0).iter().map(|v| v * 2.5e-3).collect::<Vec<_>>(), tolerance);
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as f64 / (1_u64 << 31) as f64 - 0.5
        };
        for scale in [1e-7, 1e-5, 1e-4, 1e-2] {
            let mut walk = vec![point];
            for i in 0..1500 {
                let step = Vector3::new(random(), random(), random()) * scale;
                walk.push(if i % 7 == 0 { walk[i] } else { walk[i] + step });
            }
            assert_sound(&walk, tolerance);
        }
        assert_sound(&[point, Vector3::repeat(f64::NAN), point * 2.0], tolerance);
    }
}

#[test]
#[ignore = "prints a time"]
fn the_time_for_a_vertex_is_printed() {
    let vertices: Vec<_> =
        circle(1e-4, 40.0).into_iter().map(|vertex| rounded(vertex, 1e-6)).collect();
    let start = std::time::Instant::now();
    let parts = fit(&vertices, 1e-5);
    let time = start.elapsed().as_secs_f64() * 1e9 / vertices.len() as f64;
    println!("{} vertices, {} parts, {time:.0} ns a vertex", vertices.len(), parts.len());
}

#[test]
fn memory_does_not_grow_with_the_polyline() {
    let mut fitter = Fitter::new(1e-5);
    let (mut most, mut parts) = (0, 0);
    for vertex in circle(1e-4, 100.0) {
        fitter.push(vertex);
        most = most.max(fitter.vertices.len());
        while fitter.part().is_some() {
            parts += 1;
        }
    }
    assert!(most < 2000 && parts > 100, "{most} {parts}");
}
