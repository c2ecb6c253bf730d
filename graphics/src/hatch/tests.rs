use kurbo::{CubicBez, ParamCurveNearest};
use messages::math;

use super::*;
use crate::curve::samples::{circle, polygon};
use crate::random::Random;

const LEVEL: Hatch = Hatch { angle: 0.0, spacing: 1.0, is_cross: false, travel: Travel::OneWay };

fn filled(contours: &[Contour], rule: FillRule, how: Hatch) -> Vec<Contour> {
    hatch(&[Area { contours, rule, is_dark: true }], &how).expect("valid areas")
}

/// Lines as (x from, x to, y).
fn level(lines: &[Contour]) -> Vec<(f64, f64, f64)> {
    lines.iter().map(|line| (line.start.x, line.end().x, line.start.y)).collect()
}

fn square(low: f64, high: f64) -> Contour {
    polygon(&[(low, low), (high, low), (high, high), (low, high)])
}

/// The outline of a blob of four cubics around a point.
fn blob(centre: Point, radius: f64) -> Contour {
    let at = |x: f64, y: f64| Point::new(centre.x + x * radius, centre.y + y * radius);
    Contour {
        start: at(1.0, 0.1),
        segments: vec![
            Segment::Cubic(at(1.3, 0.9), at(0.3, 1.4), at(-0.1, 0.8)),
            Segment::Cubic(at(-0.4, 0.3), at(-1.2, 1.1), at(-1.0, -0.2)),
            Segment::Cubic(at(-0.8, -1.3), at(0.2, -0.4), at(0.4, -0.9)),
            Segment::Cubic(at(0.6, -1.2), at(0.8, -0.6), at(1.0, 0.1)),
        ],
        is_closed: true,
    }
}

#[test]
fn a_square_has_a_line_in_the_middle_of_each_spacing() {
    let lines = filled(&[square(0.0, 3.0)], FillRule::NonZero, LEVEL);
    assert_eq!(level(&lines), [(0.0, 3.0, 0.5), (0.0, 3.0, 1.5), (0.0, 3.0, 2.5)]);
}

#[test]
fn every_second_line_goes_back() {
    let how = Hatch { travel: Travel::BothWays, ..LEVEL };
    let lines = filled(&[square(-2.0, 1.0)], FillRule::NonZero, how);
    assert_eq!(level(&lines), [(-2.0, 1.0, -1.5), (1.0, -2.0, -0.5), (-2.0, 1.0, 0.5)]);
}

#[test]
fn holes_stay_empty_by_the_rule() {
    let contours = [square(0.0, 3.0), square(1.0, 2.0)];
    let even_odd = filled(&contours, FillRule::EvenOdd, LEVEL);
    let expected = [(0.0, 3.0, 0.5), (0.0, 1.0, 1.5), (2.0, 3.0, 1.5), (0.0, 3.0, 2.5)];
    assert_eq!(level(&even_odd), expected);
    assert_eq!(filled(&contours, FillRule::NonZero, LEVEL).len(), 3);
    let contours = [contours[0].clone(), contours[1].reversed()];
    assert_eq!(level(&filled(&contours, FillRule::NonZero, LEVEL)), expected);
}

#[test]
fn an_outline_that_crosses_itself_is_filled_by_the_rule() {
    // A pentagram: its middle is wound twice.
    let corner = |number: usize| {
        let (sine, cosine) = math::sin_cos(math::TURN * (0.25 + 0.4 * number as f64));
        (cosine, sine)
    };
    let star = [polygon(&[0, 1, 2, 3, 4].map(corner))];
    let how = Hatch { spacing: 0.02, ..LEVEL };
    let at_centre = |rule| {
        level(&filled(&star, rule, how))
            .iter()
            .any(|(from, to, y)| (y - 0.01).abs() < 1e-9 && *from < 0.0 && *to > 0.0)
    };
    assert!(at_centre(FillRule::NonZero));
    assert!(!at_centre(FillRule::EvenOdd));
}

#[test]
fn areas_that_overlap_are_filled_once_whatever_way_they_are_drawn() {
    let (one, other) = ([square(0.0, 2.0)], [square(1.0, 3.0).reversed()]);
    let area = |contours| Area { contours, rule: FillRule::NonZero, is_dark: true };
    let lines = hatch(&[area(&one), area(&other)], &LEVEL).expect("valid areas");
    assert_eq!(level(&lines), [(0.0, 2.0, 0.5), (0.0, 3.0, 1.5), (1.0, 3.0, 2.5)]);
}

#[test]
fn a_light_area_covers_those_before_it_alone() {
    let (low, middle, high) = ([square(0.0, 5.0)], [square(1.0, 4.0)], [square(2.0, 3.0)]);
    let area = |contours, is_dark| Area { contours, rule: FillRule::NonZero, is_dark };
    let areas = [area(&low, true), area(&middle, false), area(&high, true)];
    let lines = hatch(&areas, &LEVEL).expect("valid areas");
    let right = [
        (0.0, 5.0, 0.5),
        (0.0, 1.0, 1.5),
        (4.0, 5.0, 1.5),
        (0.0, 1.0, 2.5),
        (2.0, 3.0, 2.5),
        (4.0, 5.0, 2.5),
        (0.0, 1.0, 3.5),
        (4.0, 5.0, 3.5),
        (0.0, 5.0, 4.5),
    ];
    assert_eq!(level(&lines), right);
    let covered = [area(&middle, false), area(&low, true)];
    assert_eq!(hatch(&covered, &LEVEL).expect("valid areas").len(), 5);
}

#[test]
fn areas_filled_one_by_one_match() {
    let how = Hatch { spacing: 0.3, angle: 0.7, ..LEVEL };
    let left = polygon(&[(0.0, 0.0), (1.0, 0.0), (1.0, 2.0), (0.0, 2.0)]);
    let right = polygon(&[(1.0, 0.0), (2.0, 0.0), (2.0, 2.0), (1.0, 2.0)]);
    let ends: Vec<Point> = filled(&[left], FillRule::NonZero, how)
        .iter()
        .map(Contour::end)
        .filter(|end| (end.x - 1.0).abs() < 1e-9)
        .collect();
    let starts: Vec<Point> = filled(&[right], FillRule::NonZero, how)
        .iter()
        .map(|line| line.start)
        .filter(|start| (start.x - 1.0).abs() < 1e-9)
        .collect();
    assert_eq!(ends.len(), 5);
    assert!(ends.iter().zip(&starts).all(|(end, start)| (*end - *start).hypot() < 1e-12));
}

#[test]
fn ends_lie_on_the_curve() {
    let mut random = Random::new(8);
    for _ in 0..40 {
        let centre = Point::new(random.unit() * 0.2, random.unit() * 0.2);
        let radius = 0.001 + 0.05 * random.unit();
        let how = Hatch { angle: random.unit() * 7.0, spacing: radius / 37.0, ..LEVEL };
        let round = filled(&[circle(centre, radius)], FillRule::EvenOdd, how);
        assert!((73..=74).contains(&round.len()));
        for line in &round {
            for end in [line.start, line.end()] {
                assert!(((end - centre).hypot() - radius).abs() < 1e-9);
            }
        }
        let blob = blob(centre, radius);
        for line in filled(std::slice::from_ref(&blob), FillRule::EvenOdd, how) {
            for end in [line.start, line.end()] {
                let away = blob.pieces().map(|(start, segment)| {
                    let Segment::Cubic(first, second, last) = *segment else { return f64::NAN };
                    CubicBez::new(start, first, second, last).nearest(end, 1e-12).distance_sq
                });
                let away = away.fold(f64::INFINITY, f64::min).sqrt();
                assert!(away < 1e-9, "{away}");
            }
        }
    }
}

#[test]
fn the_lines_cover_the_area() {
    let how = Hatch { spacing: 1e-5, is_cross: true, ..LEVEL };
    for contour in [circle(Point::new(0.5, 0.5), 0.01), blob(Point::new(0.1, 0.2), 0.01)] {
        let lines = filled(std::slice::from_ref(&contour), FillRule::NonZero, how);
        let length: f64 = lines.iter().map(|line| (line.end() - line.start).hypot()).sum();
        let area = crate::curve::signed_area(&contour.flattened(1e-9));
        let covered = length * how.spacing / 2.0;
        assert!((covered / area - 1.0).abs() < 1e-4, "{covered} of {area}");
    }
}

#[test]
fn connected_lines_follow_the_edge() {
    let how = Hatch { spacing: 1e-4, travel: Travel::Connected, ..LEVEL };
    let (centre, radius) = (Point::new(0.05, 0.05), 0.01);
    let lines = filled(&[circle(centre, radius)], FillRule::NonZero, how);
    assert_eq!(lines.len(), 1);
    let line = &lines[0];
    assert_eq!(line.segments.iter().filter(|one| matches!(one, Segment::Line(_))).count(), 200);
    for (start, segment) in line.pieces() {
        assert!((segment.point(start, 0.0) - start).hypot() < 1e-9);
        if let Segment::Arc(_) = segment {
            let middle = segment.point(start, 0.5);
            assert!(((middle - centre).hypot() - radius).abs() < 1e-12);
        }
    }
}

#[test]
fn connected_lines_divide_where_the_area_does() {
    let how = Hatch { travel: Travel::Connected, ..LEVEL };
    let u_shape = polygon(&[
        (0.0, 0.0),
        (6.0, 0.0),
        (6.0, 9.0),
        (4.0, 9.0),
        (4.0, 3.0),
        (2.0, 3.0),
        (2.0, 9.0),
        (0.0, 9.0),
    ]);
    let lines = filled(&[u_shape], FillRule::NonZero, how);
    // The row after the foot enters one arm along the edge; the other arm begins anew.
    assert_eq!(lines.len(), 2);
    let length: f64 = lines
        .iter()
        .flat_map(Contour::pieces)
        .map(|(start, segment)| (segment.end() - start).hypot())
        .sum();
    assert!((length - (3.0 * 6.0 + 12.0 * 2.0) - (8.0 + 5.0)).abs() < 1e-12, "{length}");
}

#[test]
fn what_cannot_be_filled_is_named() {
    let check = |contours: &[Contour], how: Hatch, expected: &str| {
        let error = hatch(&[Area { contours, rule: FillRule::EvenOdd, is_dark: true }], &how);
        assert_eq!(error.expect_err("refused").to_string(), expected);
    };
    let square = [square(0.0, 1.0)];
    check(&square, Hatch { spacing: 0.0, ..LEVEL }, "spacing is 0; it must be more than 0 m");
    check(
        &square,
        Hatch { angle: f64::INFINITY, ..LEVEL },
        "angle is inf; it must be a finite number of radians",
    );
    check(
        &square,
        Hatch { spacing: 1e-7, ..LEVEL },
        "lines 0.0000001 m apart would be 10000000 in an area 1 m across; at most 2000000 are made",
    );
    let bad = [square[0].clone(), polygon(&[(0.0, 0.0), (f64::NAN, 1.0), (2.0, 2.0)])];
    check(&bad, LEVEL, "area 0, contour 1 (from 0) has a coordinate that is not a finite number");
}

#[test]
fn nothing_is_filled_with_nothing() {
    assert_eq!(filled(&[], FillRule::NonZero, LEVEL), []);
    let empty = Contour { start: Point::ORIGIN, segments: Vec::new(), is_closed: true };
    assert_eq!(filled(&[empty], FillRule::NonZero, LEVEL), []);
    let flat = polygon(&[(0.0, 0.5), (5.0, 0.5)]);
    assert_eq!(filled(&[flat], FillRule::NonZero, LEVEL), []);
}

#[test]
fn random_scribbles_are_filled_without_a_stray_line() {
    let mut random = Random::new(9);
    for _ in 0..200 {
        let mut point = || Point::new((random.unit() * 6.0).round(), (random.unit() * 6.0).round());
        let start = point();
        let mut segments: Vec<Segment> =
            (0..12).map(|_| Segment::Cubic(point(), point(), point())).collect();
        segments.push(Segment::Line(start));
        let scribble = [Contour { start, segments, is_closed: true }];
        for travel in [Travel::OneWay, Travel::BothWays, Travel::Connected] {
            for angle in [0.0, math::TURN / 4.0, 1.0] {
                let how = Hatch { angle, spacing: 0.25, travel, ..LEVEL };
                for line in filled(&scribble, FillRule::EvenOdd, how) {
                    for (start, segment) in line.pieces() {
                        assert!(start.x > -1.0 && start.x < 7.0 && segment.end().y < 7.0);
                        assert!((segment.point(start, 0.0) - start).hypot() < 1e-9);
                    }
                }
            }
        }
    }
}
