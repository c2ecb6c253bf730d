//! Paths that are too long to be held: they are gone in one go all the same, within every limit, and in the
//! same time as if they were known whole.

#![allow(missing_docs, clippy::unwrap_used)]

use machine::Machine;
use messages::math::{TURN, sin_cos};
use nalgebra::Vector3;
use planner::drawing::{Action, Curve, Drawing, Power, Step};
use planner::{Job, plan_through};

/// Chords of a long path: more than two of its parts.
const CHORDS: usize = 90_000;

/// Rounds of a circle of this radius [m] in chords, from its right.
const RADIUS: f64 = 0.02;

/// Chords of a round.
const ROUND: usize = 10_000;

fn job(machine: &Machine, count: usize, power: Power, speed: f64, wave: f64) -> Job {
    let home = Vector3::from(machine.home);
    let point = |index: usize| {
        let angle = TURN * index as f64 / ROUND as f64;
        let (sine, cosine) = sin_cos(angle);
        let radius = RADIUS * (1.0 + wave * sin_cos(40.0 * angle).0);
        home + Vector3::new(radius * cosine, radius * sine, 0.0)
    };
    let mut steps = vec![Step { action: Action::Rapid { to: point(0) }, line: 1 }];
    steps.extend((0..count).map(|index| {
        let curve = Curve::Line { from: point(index), to: point(index + 1) };
        Step { action: Action::Mark { curve, speed: Some(speed), power }, line: index as u64 + 2 }
    }));
    let drawing = Drawing { name: "long".into(), start: home, steps, notes: Vec::new() };
    Job::of(drawing)
}

/// How long the plan of a job lasts [s]. Its tool goes within the limits, and where it is lit never slower
/// than `least` [m/s], but for `few` samples at its ends.
fn goes_on(machine: &Machine, job: &Job, least: f64, few: usize) -> f64 {
    let (mut slow, mut lit) = (0, 0);
    let mut before: Option<[f64; 3]> = None;
    let facts = plan_through(machine, job, |setpoints| {
        for setpoint in setpoints {
            if let Some(before) = before {
                let way = messages::artwork::distance(&before, &setpoint.tool);
                assert!(way <= 1.01e-3 * machine.path.rapid.max(machine.path.speed));
            }
            before = Some(setpoint.tool);
            if setpoint.laser.is_lit() {
                lit += 1;
                slow += usize::from(setpoint.path_velocity < least);
            }
        }
    })
    .unwrap();
    assert!(lit > 0 && slow <= few, "{slow} of {lit} lit samples are slower than {least} m/s");
    assert_eq!(facts.strokes, 1);
    facts.duration
}

fn machine() -> Machine {
    let mut machine = Machine::builtin();
    (machine.path.speed, machine.path.rapid) = (0.2, 0.2);
    machine
}

#[test]
fn a_long_path_is_gone_in_one_go() {
    let machine = machine();
    let length = CHORDS as f64 * TURN * RADIUS / ROUND as f64;
    for follows_speed in [true, false] {
        let power = Power { level: 0.5, follows_speed };
        let long = job(&machine, CHORDS, power, 0.1, 0.0);
        let least = if follows_speed { 0.0998 } else { 0.09999 };
        let duration = goes_on(&machine, &long, least, 80);
        // The way to the circle and from rest and to rest again take less than half a second.
        assert!((duration - length / 0.1).abs() < 0.5, "{duration} s for {length} m");
    }
}

#[test]
fn a_long_path_that_slows_takes_as_long_as_its_rounds() {
    let machine = machine();
    let power = Power { level: 0.5, follows_speed: true };
    let time =
        |rounds: usize| goes_on(&machine, &job(&machine, rounds * ROUND, power, 0.1, 0.02), 0.0, 0);
    let (two, three, all) = (time(2), time(3), time(9));
    let expected = three + 6.0 * (three - two);
    assert!(all < 1.005 * expected, "{all} s instead of {expected} s");
}
