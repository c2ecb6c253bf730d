use kurbo::{Point, Vec2};
use messages::math;

use super::*;
use crate::curve::samples::{circle, polygon};
use crate::random::Random;
use crate::{Arc, Segment};

const MM: f64 = 1e-3;

fn square(low: f64, high: f64) -> Contour {
    polygon(&[(low, low), (high, low), (high, high), (low, high)])
}

fn moved(contours: &[Contour], kerf: f64) -> Compensated {
    compensate(contours, kerf).expect("valid contours")
}

/// Enclosed area without its sign [m²].
fn area(contour: &Contour) -> f64 {
    signed_area(&contour.flattened(1e-9)).abs()
}

fn distance(outline: &[Point], point: Point) -> f64 {
    let next = outline.iter().cycle().skip(1);
    let edges = outline.iter().zip(next).map(|(from, to)| {
        let (edge, off) = (*to - *from, point - *from);
        let length = edge.hypot2();
        let t = if length > 0.0 { (edge.dot(off) / length).clamp(0.0, 1.0) } else { 0.0 };
        (off - edge * t).hypot()
    });
    edges.fold(f64::INFINITY, f64::min)
}

/// That every point of the moved contours is half the kerf away from where it comes from.
fn assert_away(contours: &[Contour], result: &Compensated, kerf: f64) {
    for (contour, source) in result.contours.iter().zip(&result.sources) {
        let outline = contours[*source].flattened(1e-7);
        for (start, segment) in contour.pieces() {
            for t in [0.0, 0.25, 0.5, 0.8] {
                let away = distance(&outline, segment.point(start, t));
                assert!((away - kerf.abs() / 2.0).abs() < 1.5e-6, "{away} for {kerf}");
            }
        }
    }
}

#[test]
fn a_part_grows_and_its_hole_shrinks() {
    let contours = [square(0.0, 20.0 * MM), circle(Point::new(10.0 * MM, 10.0 * MM), 5.0 * MM)];
    for contours in [contours.clone(), contours.map(|contour| contour.reversed())] {
        let result = moved(&contours, 0.2 * MM);
        assert_eq!(result.sources, [0, 1]);
        assert_eq!(result.notes, []);
        assert_away(&contours, &result, 0.2 * MM);
        // 20 mm and 0.1 mm on each side, with rounded corners.
        let corners = (4.0 - math::TURN / 2.0) * 0.1 * 0.1;
        let expected = (20.2 * 20.2 - corners) * MM * MM;
        assert!((area(&result.contours[0]) / expected - 1.0).abs() < 1e-9);
        let hole = &result.contours[1];
        assert!(hole.segments.iter().all(|one| matches!(one, Segment::Arc(_))));
        for (start, segment) in hole.pieces() {
            let middle = segment.point(start, 0.5) - Point::new(10.0 * MM, 10.0 * MM);
            assert!((middle.hypot() - 4.9 * MM).abs() < 1e-10);
        }
        for (contour, source) in result.contours.iter().zip(&contours) {
            let sense = |one: &Contour| signed_area(&one.flattened(1e-6)).signum();
            assert_eq!(sense(contour), sense(source));
        }
    }
}

#[test]
fn a_negative_kerf_moves_the_other_way() {
    let contours = [square(0.0, 10.0 * MM)];
    let result = moved(&contours, -MM);
    assert!((area(&result.contours[0]) - 81.0 * MM * MM).abs() < 1e-12);
}

#[test]
fn an_island_in_a_hole_is_an_outer_contour() {
    let contours = [square(0.0, 0.03), square(0.005, 0.025), square(0.01, 0.02)];
    let areas: Vec<f64> = moved(&contours, 0.1 * MM).contours.iter().map(area).collect();
    let before: Vec<f64> = contours.iter().map(area).collect();
    assert!(areas[0] > before[0] && areas[1] < before[1] && areas[2] > before[2]);
}

#[test]
fn what_vanishes_is_named() {
    let contours = [square(0.0, 10.0 * MM), circle(Point::new(5.0 * MM, 4.0 * MM), 0.05 * MM)];
    let result = moved(&contours, 0.2 * MM);
    assert_eq!(result.sources, [0]);
    let text = "contour 1 (from 0), 0.1000 mm x 0.1000 mm around x 5.0000 mm, y 4.0000 mm vanishes \
                under a kerf of 0.2000 mm";
    assert_eq!(result.notes, [FileNote { line: 0, text: text.into() }]);
}

#[test]
fn a_waist_that_is_too_narrow_divides_a_hole() {
    let (a, b, c) = (10.0 * MM, 4.9 * MM, 5.1 * MM);
    let dumbbell = polygon(&[
        (0.0, 0.0),
        (a, 0.0),
        (a, b),
        (2.0 * a, b),
        (2.0 * a, 0.0),
        (3.0 * a, 0.0),
        (3.0 * a, a),
        (2.0 * a, a),
        (2.0 * a, c),
        (a, c),
        (a, a),
        (0.0, a),
    ]);
    let contours = [square(-a, 4.0 * a), dumbbell];
    let result = moved(&contours, 0.5 * MM);
    assert_eq!(result.sources, [0, 1, 1]);
    assert_away(&contours, &result, 0.5 * MM);
}

#[test]
fn lines_stay_and_a_contour_that_crosses_itself_is_named() {
    let open = Contour { is_closed: false, ..square(0.0, 0.01) };
    let bow_tie = polygon(&[(0.1, 0.1), (0.2, 0.2), (0.2, 0.1), (0.1, 0.2)]);
    let contours = [open, bow_tie];
    let result = moved(&contours, 0.2 * MM);
    assert_eq!(result.contours, contours);
    assert_eq!(result.notes.len(), 1);
    assert!(result.notes[0].text.starts_with("contour 1 (from 0), 100.0000 mm x 100.0000 mm"));
    assert!(result.notes[0].text.ends_with("crosses itself and is left as drawn: no kerf"));
}

#[test]
fn curves_move_within_a_micrometre() {
    let mut random = Random::new(10);
    let mut random_rounds = 0;
    for round in 0..90 {
        // A blob: a ring of cubics with random radii and smooth joins.
        let count = 3 + random.below(6);
        let radii: Vec<f64> = (0..count).map(|_| 0.01 + 0.01 * random.unit()).collect();
        let at = |number: usize, out: f64, along: f64| {
            let (sine, cosine) = math::sin_cos(math::TURN * number as f64 / count as f64);
            let radius = radii[number % count] * out;
            Point::new(cosine * radius - sine * along, sine * radius + cosine * along)
        };
        let reach = 0.01 * 2.0 / count as f64;
        let mut segments: Vec<Segment> = (0..count)
            .map(|one| {
                let end = at(one + 1, 1.0, 0.0);
                Segment::Cubic(at(one, 1.0, reach), at(one + 1, 1.0, -reach), end)
            })
            .collect();
        let start = at(0, 1.0, 0.0);
        if round % 3 == 0 {
            let arc = Arc {
                centre: Point::ORIGIN,
                major: Vec2::new(0.02, 0.003),
                minor: Vec2::new(0.0, 0.01),
                start: 0.0,
                sweep: math::TURN,
            };
            let contour = Contour {
                start: arc.point(0.0),
                segments: vec![Segment::Arc(arc)],
                is_closed: true,
            };
            let result = moved(std::slice::from_ref(&contour), 0.3 * MM);
            assert_away(&[contour], &result, 0.3 * MM);
            continue;
        }
        if let Some(Segment::Cubic(_, _, end)) = segments.last_mut() {
            *end = start;
        }
        let contour = [Contour { start, segments, is_closed: true }];
        for kerf in [0.1 * MM, -MM] {
            let result = moved(&contour, kerf);
            assert!(result.notes.is_empty(), "{:?}", result.notes);
            assert_away(&contour, &result, kerf);
            random_rounds += result.contours.len();
        }
    }
    assert!(random_rounds >= 120, "{random_rounds}");
}

#[test]
fn random_scribbles_do_no_harm() {
    let mut random = Random::new(11);
    let mut moved_contours = 0;
    for round in 0..4_000 {
        let grid = [1.0, 8.0, 1e6][round % 3];
        let snapped = |unit: f64| (unit * grid).round() / grid * 0.01;
        let count = 3 + round % 9;
        // Every second one is a star, which does not cross itself.
        let mut point = |number: usize| {
            if round % 2 == 0 {
                return Point::new(snapped(random.unit()), snapped(random.unit()));
            }
            let (sine, cosine) = math::sin_cos(math::TURN * number as f64 / count as f64);
            Point::new(snapped(random.unit() * cosine), snapped(random.unit() * sine))
        };
        let start = point(0);
        let mut segments: Vec<Segment> = (1..count)
            .map(|number| match number * round % 5 {
                0 => Segment::Cubic(point(number), point(number), point(number)),
                _ => Segment::Line(point(number)),
            })
            .collect();
        segments.push(Segment::Line(start));
        let contours = [Contour { start, segments, is_closed: true }];
        for kerf in [1e-4, -3e-3] {
            let result = moved(&contours, kerf);
            assert_eq!(result.contours.len(), result.sources.len());
            moved_contours += usize::from(result.notes.is_empty());
        }
    }
    assert!(moved_contours > 1_200, "{moved_contours}");
}

#[test]
fn what_cannot_be_moved_is_named() {
    let check = |contour: Contour, kerf: f64, expected: &str| {
        let error = compensate(&[square(0.0, 1.0), contour], kerf).expect_err("refused");
        assert_eq!(error.to_string(), expected);
    };
    let bad = square(0.0, f64::NAN);
    check(
        bad,
        1e-4,
        "contour 1 (from 0) has a coordinate that is not a finite number within 10000 m",
    );
    check(square(0.0, 1.0), 0.2, "a kerf of 0.2 m is outside of the range from -0.1 m to 0.1 m");
}
