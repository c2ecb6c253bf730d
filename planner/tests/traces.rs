//! Bézier curves are marked as the curves that they are, whatever their control points.

#![allow(clippy::unwrap_used)]

use machine::Machine;
use nalgebra::Vector3;
use planner::drawing::{Action, Curve, Drawing, Power, Step};
use planner::job::Job;
use planner::light::Policy;

type Points = [Vector3<f64>; 4];

fn plan(actions: Vec<Action>, policy: Policy) -> planner::Plan {
    let machine = Machine::builtin();
    let start = Vector3::from(machine.home);
    let steps = actions.into_iter().map(|action| Step { action, line: 1 }).collect();
    let drawing = Drawing { name: "traces".to_owned(), start, steps, notes: Vec::new() };
    let mut job = Job::of(drawing);
    job.marking.policy = Some(policy);
    planner::plan(&machine, &job).unwrap()
}

const FULL: Power = Power { level: 1.0, follows_speed: false };

fn trace(points: Points) -> Action {
    Action::Trace { points, speed: Some(0.2), power: FULL }
}

/// The lit places of the tool.
fn lit(plan: &planner::Plan) -> Vec<Vector3<f64>> {
    let lit = plan.setpoints(1).filter(|setpoint| setpoint.laser.power > 0.0);
    lit.map(|setpoint| Vector3::new(setpoint.tool[0], setpoint.tool[1], setpoint.tool[2])).collect()
}

/// The four cubics that drawing programs make of a circle around home.
fn circle(radius: f64) -> Vec<Points> {
    let home = Vector3::from(Machine::builtin().home);
    let out = 0.552_284_749_830_793_6 * radius;
    (0..4)
        .map(|quarter| {
            let turn = |x: f64, y: f64| {
                let (x, y) = match quarter {
                    0 => (x, y),
                    1 => (-y, x),
                    2 => (-x, -y),
                    _ => (y, -x),
                };
                home + Vector3::new(x, y, 0.0)
            };
            [turn(radius, 0.0), turn(radius, out), turn(out, radius), turn(0.0, radius)]
        })
        .collect()
}

#[test]
fn a_circle_of_curves_is_as_large_and_as_quick_as_a_circle() {
    let radius = 0.01;
    let home = Vector3::from(Machine::builtin().home);
    let to_start = || Action::Rapid { to: home + Vector3::new(radius, 0.0, 0.0) };
    let curves = circle(radius).into_iter().map(trace);
    let arc = Curve::Arc {
        centre: home,
        major: Vector3::new(radius, 0.0, 0.0),
        minor: Vector3::new(0.0, radius, 0.0),
        start: 0.0,
        sweep: core::f64::consts::TAU,
        rise: Vector3::zeros(),
    };
    for policy in [Policy::Constant, Policy::Proportional] {
        let of_curves = plan([to_start()].into_iter().chain(curves.clone()).collect(), policy);
        let arc = Action::Mark { curve: arc, speed: Some(0.2), power: FULL };
        let of_arc = plan(vec![to_start(), arc], policy);
        assert_eq!(of_curves.facts.strokes, 1);
        let ratio = of_curves.facts.duration / of_arc.facts.duration;
        assert!((ratio - 1.0).abs() < 0.02, "{policy:?}: {ratio}");
        // The cubics themselves are outside of the circle by up to 2.7e-4 of the radius.
        for place in lit(&of_curves) {
            let off = (place - home).norm() - radius;
            assert!((-1e-6..2.73e-4 * radius + 1e-6).contains(&off), "{off}");
        }
        let extent = lit(&of_curves).iter().map(|place| place.x - home.x).fold(0.0, f64::max);
        assert!((extent - radius).abs() < 1e-6, "{extent}");
    }
}

#[test]
fn handles_that_are_drawn_in_and_cusps_are_marked() {
    let home = Vector3::from(Machine::builtin().home);
    let at = |x: f64, y: f64| home + Vector3::new(x, y, 0.0) * 1e-3;
    let cases = [
        // A straight line whose handles are its ends.
        [at(0.0, 0.0), at(0.0, 0.0), at(10.0, 0.0), at(10.0, 0.0)],
        // One handle drawn in.
        [at(0.0, 0.0), at(0.0, 0.0), at(6.0, 8.0), at(10.0, 0.0)],
        // A cusp in the middle.
        [at(0.0, 0.0), at(10.0, 10.0), at(0.0, 10.0), at(10.0, 0.0)],
        // A loop.
        [at(0.0, 0.0), at(20.0, 10.0), at(-10.0, 10.0), at(10.0, 0.0)],
        // There and back.
        [at(0.0, 0.0), at(10.0, 0.0), at(10.0, 0.0), at(0.0, 0.0)],
        // Very small.
        [at(0.0, 0.0), at(1e-3, 0.0), at(1e-3, 1e-3), at(0.0, 1e-3)],
        // Nothing.
        [at(1.0, 1.0); 4],
    ];
    let point = |points: &Points, t: f64| {
        let r = 1.0 - t;
        points[0] * (r * r * r)
            + points[1] * (3.0 * r * r * t)
            + points[2] * (3.0 * r * t * t)
            + points[3] * (t * t * t)
    };
    for points in cases {
        for policy in [Policy::Constant, Policy::Proportional] {
            let plan = plan(vec![Action::Rapid { to: points[0] }, trace(points)], policy);
            let all: Vec<_> =
                (0..=20_000).map(|index| point(&points, f64::from(index) / 20_000.0)).collect();
            for place in lit(&plan).iter().step_by(7) {
                let off = all.iter().map(|near| (near - place).norm()).fold(f64::MAX, f64::min);
                // A corner is rounded within the machine's tolerance of 5 µm.
                assert!(off < 6e-6, "{points:?} {policy:?}: {off}");
            }
        }
    }
}
