//! Speeds that a job leaves open: which is chosen, and which corners are passed at it.

#![allow(clippy::unwrap_used)]

mod support;

use nalgebra::Vector3;
use planner::drawing::{Action, Curve, Drawing, Power, Step};
use planner::plan;
use planner::{Job, PlanFacts};
use support::machine;

/// Lines of so many metres whose direction turns by 20° to and fro, marked at one speed that is left open.
fn bends(length: f64, count: u64) -> Job {
    let mut place = Vector3::zeros();
    let steps = (1..=count).map(|line| {
        let side = if line % 2 == 0 { 0.18 } else { -0.18 };
        let to = place + Vector3::new(1.0, side, 0.0).normalize() * length;
        let curve = Curve::Line { from: place, to };
        place = to;
        let power = Power { level: 0.5, follows_speed: false };
        Step { action: Action::Mark { curve, speed: None, power }, line }
    });
    let steps = steps.collect();
    let name = "bends".to_owned();
    Job::of(Drawing { name, start: Vector3::zeros(), steps, notes: Vec::new() })
}

fn facts(length: f64, speed: &str) -> PlanFacts {
    let machine = machine(false, &[&format!("path.speed=\"{speed}\"")]);
    plan(&machine, &bends(length, 20)).unwrap().facts
}

/// Loops at its corners are no quicker than a speed that passes them, which a faster machine has as well.
#[test]
fn a_faster_machine_passes_the_corners_that_a_slower_one_passes() {
    let slow = facts(1e-3, "0.02 m/s");
    let fast = facts(1e-3, "1 m/s");
    assert_eq!((slow.strokes, fast.strokes), (1, 1));
    assert!(slow.speed <= 0.02 && fast.speed > slow.speed, "{} m/s", fast.speed);
    assert!(fast.duration < slow.duration, "{} s after {} s", fast.duration, slow.duration);
}

/// Where the lines are long, loops at their ends cost less than going slowly along them.
#[test]
fn long_lines_are_ended_at_corners_that_would_slow_them() {
    let slow = facts(10e-3, "0.02 m/s");
    let fast = facts(10e-3, "1 m/s");
    assert_eq!((slow.strokes, fast.strokes), (1, 20));
    assert!(fast.duration < 0.5 * slow.duration, "{} s after {} s", fast.duration, slow.duration);
}
