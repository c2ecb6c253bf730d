//! A law as a function: its continuity, its inverse, its parts.

use super::path::Path;
use crate::law::{End, Settings, TimeLaw, plan};

const TOOL: [f64; 3] = [0.3, 10.0, 500.0];

fn law_of(path: &mut Path) -> TimeLaw {
    let length = path.length;
    plan(path, 0.0, length, [End::Rest; 2], &Settings::default()).unwrap()
}

/// The time of a straight line from rest to rest, fully limited.
fn seven_phases(length: f64, [v, a, j]: [f64; 3]) -> f64 {
    let time = |speed: f64| {
        if speed * j < a * a { 2.0 * (speed / j).sqrt() } else { speed / a + a / j }
    };
    let way = |speed: f64| speed * time(speed);
    if way(v) <= length {
        return 2.0 * time(v) + (length - way(v)) / v;
    }
    let (mut low, mut high) = (0.0, v);
    for _ in 0..100 {
        let middle = (low + high) / 2.0;
        if way(middle) < length { low = middle } else { high = middle }
    }
    2.0 * time(low)
}

#[test]
fn a_straight_line_takes_the_time_of_its_seven_phases() {
    for length in [1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.5] {
        let law = law_of(&mut Path::line(length, TOOL));
        let ratio = law.duration() / seven_phases(length, TOOL);
        assert!((0.9999..1.01).contains(&ratio), "{length}: {ratio}");
    }
}

#[test]
fn the_place_is_continuous_and_ends_where_the_stretch_does() {
    let mut path = Path::circle(0.02, 1.0, TOOL);
    let law = law_of(&mut path);
    assert!((law.at(law.duration()).position - path.length).abs() < 1e-12);
    assert_eq!(law.at(0.0).position, 0.0);
    let mut time = 0.0;
    for part in law.binding() {
        time += part.duration;
        let (before, after) = (law.at(time - 1e-13), law.at(time + 1e-13));
        assert!((after.position - before.position).abs() < 1e-12);
        assert!((after.velocity - before.velocity).abs() < 1e-9);
        assert!((after.acceleration - before.acceleration).abs() < 1e-6);
    }
    assert!((time - law.duration()).abs() < 1e-9);
}

#[test]
fn the_inverse_is_exact() {
    let mut path = Path::wave(2e-3, 10e-3, 0.05, TOOL);
    let law = law_of(&mut path);
    for index in 0..=1000 {
        let place = path.length * f64::from(index) / 1000.0;
        let there = law.at(law.time_at(place)).position;
        assert!((there - place).abs() < 1e-14, "{place} {there}");
    }
}

#[test]
fn plateaus_phases_and_programmes_join_to_one_law() {
    let mut law = TimeLaw::phases(0.0, 0.0, 0.0, [(500.0, 0.01, 1), (-500.0, 0.01, 1)]);
    assert!((law.places().end - 0.0005).abs() < 1e-15);
    law.append(&TimeLaw::even(0.0005, 0.01, 0.05, 7));
    assert!((law.duration() - 0.21).abs() < 1e-12);
    assert!((law.time_at(0.00525) - 0.115).abs() < 1e-12);
    assert!((law.at(0.02).velocity - 0.05).abs() < 1e-12);
    assert_eq!(law.binding().last().unwrap().limit, 7);
    let first = law.up_to(0.001);
    assert_eq!(first.places(), 0.0..law.binding().nth(1).unwrap().places.end);
    assert!(TimeLaw::default().is_empty() && TimeLaw::default().duration() == 0.0);
}

#[test]
fn what_binds_is_told() {
    let mut path = Path::circle(0.02, 1.0, TOOL);
    let law = law_of(&mut path);
    let middle = law.binding().find(|part| part.places.end > path.length / 2.0).unwrap();
    assert_eq!(middle.limit, super::path::SPEED);
    assert_eq!(law.binding().next().unwrap().limit, super::path::JERK);
}
