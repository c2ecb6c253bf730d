use super::*;
use crate::curve::samples::{circle, polygon};
use crate::random::Random;

fn line(from: (f64, f64), to: (f64, f64)) -> Stroke {
    let (start, end) = (Point::from(from), Point::from(to));
    Stroke {
        outline: vec![start, end],
        ends: Ends::Open { start, end, may_reverse: true },
        group: 0,
    }
}

fn arranged(strokes: &[Stroke]) -> Arrangement {
    let arrangement = arrange(strokes, Point::ORIGIN).expect("valid strokes");
    let mut visited: Vec<usize> = arrangement.visits.iter().map(|visit| visit.stroke).collect();
    visited.sort_unstable();
    assert!(visited.into_iter().eq(0..strokes.len()), "each stroke once");
    arrangement
}

fn sequence(arrangement: &Arrangement) -> Vec<usize> {
    arrangement.visits.iter().map(|visit| visit.stroke).collect()
}

/// A sheet of small parts, each a loop with a hole and a line in it, in random order.
fn sheet(parts: usize, random: &mut Random) -> Vec<Stroke> {
    let side = (parts as f64).sqrt().ceil() as usize;
    let mut strokes = Vec::new();
    for part in 0..parts {
        let (x, y) = ((part % side) as f64 * 0.01, (part / side) as f64 * 0.01);
        let centre = Point::new(x + random.unit() * 0.002, y + random.unit() * 0.002);
        strokes.push(Stroke::of_contour(&circle(centre, 0.0035), 0));
        strokes.push(Stroke::of_contour(&circle(centre, 0.0015), 0));
        strokes.push(line((centre.x - 0.001, centre.y), (centre.x + 0.001, centre.y)));
        let corner = Point::new(centre.x - 0.003, centre.y);
        let corners = [(0.0, 0.0), (0.001, 0.0), (0.0005, 0.001)];
        strokes.push(Stroke::of_contour(
            &polygon(&corners.map(|(x, y)| (x + corner.x, y + corner.y))),
            0,
        ));
    }
    for index in (1..strokes.len()).rev() {
        strokes.swap(index, random.below(index + 1));
    }
    strokes
}

#[test]
fn lines_in_a_row_are_marked_to_and_fro() {
    let rows = |row: usize| line((0.0, row as f64), (10.0, row as f64));
    let strokes: Vec<Stroke> = [3, 0, 2, 1].map(rows).into();
    let arrangement = arranged(&strokes);
    assert_eq!(sequence(&arrangement), [1, 3, 2, 0]);
    let entries: Vec<Entry> = arrangement.visits.iter().map(|visit| visit.entry).collect();
    use Entry::{Backwards, Forwards};
    assert_eq!(entries, [Forwards, Backwards, Forwards, Backwards]);
    assert!((arrangement.travel_after - 3.0).abs() < 1e-12);
    // To the fourth row, then back each time: √(10² + 3²), √(10² + 2²), √(10² + 1²).
    let before = 3.0 + 109_f64.sqrt() + 104_f64.sqrt() + 101_f64.sqrt();
    assert!((arrangement.travel_before - before).abs() < 1e-12);
}

#[test]
fn a_line_that_may_not_be_reversed_is_not() {
    let mut strokes = vec![line((5.0, 0.0), (1.0, 0.0)), line((6.0, 0.0), (9.0, 0.0))];
    if let Ends::Open { may_reverse, .. } = &mut strokes[0].ends {
        *may_reverse = false;
    }
    let visits = arranged(&strokes).visits;
    assert!(visits.contains(&Visit { stroke: 0, entry: Entry::Forwards }), "{visits:?}");
}

#[test]
fn a_loop_begins_at_the_corner_on_the_way() {
    let strokes = [
        Stroke::of_contour(&polygon(&[(3.0, 1.0), (3.0, 2.0), (1.0, 2.0), (1.0, 1.0)]), 0),
        line((0.0, 0.0), (0.5, 0.5)),
    ];
    let arrangement = arranged(&strokes);
    assert_eq!(arrangement.visits[1], Visit { stroke: 0, entry: Entry::At(3) });
    assert!((arrangement.travel_after - 0.5_f64.sqrt()).abs() < 1e-12);
}

#[test]
fn small_cases_are_as_good_as_the_best_of_all_orders() {
    let mut random = Random::new(3);
    let (mut sum, mut best_sum) = (0.0, 0.0);
    for _ in 0..200 {
        let mut point = || (random.unit(), random.unit());
        let strokes: Vec<Stroke> = (0..5).map(|_| line(point(), point())).collect();
        let after = arranged(&strokes).travel_after;
        let best = best(&strokes, &mut vec![false; 5], Point::ORIGIN);
        assert!(after >= best - 1e-12);
        sum += after;
        best_sum += best;
    }
    assert!(sum < 1.02 * best_sum, "{sum} where {best_sum} is possible");
}

/// The shortest way through the strokes that are not taken yet, by trying all.
fn best(strokes: &[Stroke], taken: &mut Vec<bool>, from: Point) -> f64 {
    let mut shortest = f64::INFINITY;
    for index in 0..strokes.len() {
        if taken[index] {
            continue;
        }
        taken[index] = true;
        for entry in [Entry::Forwards, Entry::Backwards] {
            let (start, end) = strokes[index].ends_of(entry);
            shortest = shortest.min(distance(from, start) + best(strokes, taken, end));
        }
        taken[index] = false;
    }
    if shortest.is_finite() { shortest } else { 0.0 }
}

#[test]
fn what_lies_inside_comes_first() {
    let mut random = Random::new(4);
    for parts in [1, 2, 7, 60] {
        let strokes = sheet(parts, &mut random);
        let members: Vec<&Stroke> = strokes.iter().collect();
        let containers = containment::containers(&members);
        assert_eq!(containers.iter().flatten().count(), 3 * parts);
        let mut places = vec![0; strokes.len()];
        for (place, stroke) in sequence(&arranged(&strokes)).into_iter().enumerate() {
            places[stroke] = place;
        }
        for (inner, around) in containers.iter().enumerate() {
            for outer in around {
                assert!(places[inner] < places[*outer as usize], "{inner} in {outer}");
            }
        }
    }
}

#[test]
fn groups_keep_their_sequence() {
    let mut random = Random::new(5);
    let mut strokes = sheet(20, &mut random);
    for stroke in &mut strokes {
        stroke.group = 7 - random.below(3);
    }
    let groups: Vec<usize> =
        sequence(&arranged(&strokes)).iter().map(|index| strokes[*index].group).collect();
    assert!(groups.is_sorted(), "{groups:?}");
}

#[test]
fn a_shuffled_sheet_of_twenty_thousand_strokes_loses_nearly_all_its_travel() {
    let strokes = sheet(5_000, &mut Random::new(6));
    let arrangement = arranged(&strokes);
    let left = arrangement.travel_after / arrangement.travel_before;
    // Of 7.3 km in the order of the file there remain 74 m: less than 4 mm for each stroke.
    assert!(left < 0.0105, "{left} of {} m", arrangement.travel_before);
    assert_eq!(arrangement, arranged(&strokes));
}

#[test]
fn loops_in_loops_in_loops_are_ordered_from_the_inside() {
    let strokes: Vec<Stroke> = (0..300)
        .map(|index| Stroke::of_contour(&circle(Point::ORIGIN, 1.0 + (index * 7 % 300) as f64), 0))
        .collect();
    let sizes: Vec<usize> =
        sequence(&arranged(&strokes)).into_iter().map(|index| index * 7 % 300).collect();
    assert!(sizes.is_sorted(), "{sizes:?}");
}

#[test]
fn nothing_and_points_are_arranged() {
    assert_eq!(arranged(&[]).visits, []);
    let point = Point::new(1.0, 1.0);
    let dot = Stroke { outline: vec![point], ends: Ends::Closed(vec![point]), group: 0 };
    assert_eq!(arranged(&vec![dot; 30]).travel_after, 2_f64.sqrt());
}

#[test]
fn a_stroke_that_cannot_be_placed_is_named() {
    let good = line((0.0, 0.0), (1.0, 0.0));
    let check = |bad: Stroke, expected: &str| {
        let error = arrange(&[good.clone(), bad], Point::ORIGIN).expect_err("refused");
        assert_eq!(error.to_string(), expected);
    };
    check(
        line((0.0, f64::NAN), (1.0, 0.0)),
        "stroke 1 (from 0) has a coordinate that is not a finite number",
    );
    check(
        Stroke { outline: vec![Point::ORIGIN], ends: Ends::Closed(Vec::new()), group: 0 },
        "stroke 1 (from 0) has no point: an outline and a loop's starts need at least one",
    );
}
