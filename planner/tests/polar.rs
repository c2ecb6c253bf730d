//! The polar machine of `machines/polar.toml`: a large cloud inside glass, lines through the centre of
//! the table and beside it, and a spiral that winds the table up farther than it can turn.

#![allow(clippy::unwrap_used)]

use core::f64::consts::{PI, TAU};
use std::path::Path;

use machine::{Machine, MechanismKind};
use messages::{Setpoint, math};
use nalgebra::Vector3;
use planner::drawing::{Action, Curve, Drawing, Power, Step};
use planner::job::cloud::Cloud;
use planner::law::profile::Move;
use planner::trajectory::Motion;
use planner::{Job, Plan, plan};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

fn machine() -> Machine {
    Machine::load(&Path::new(ROOT).join("machines/polar.toml"), &[]).unwrap()
}

/// The same with a table whose cable lets it turn `turns` to either side.
fn wound(turns: f64) -> Machine {
    let mut machine = machine();
    machine.axes[1].limits.position = [-turns * TAU, turns * TAU];
    if let MechanismKind::Polar(polar) = &mut machine.mechanism {
        polar.endless = false;
    }
    machine
}

fn drawn(machine: &Machine, steps: Vec<Step>) -> Job {
    let start = Vector3::from(machine.home);
    Job::of(Drawing { name: "test".to_owned(), start, steps, notes: Vec::new() })
}

fn planned(machine: &Machine, job: &Job) -> Plan {
    plan(machine, job).unwrap_or_else(|error| panic!("{error}"))
}

/// At a height in the middle of the axis.
fn at(x: f64, y: f64) -> Vector3<f64> {
    Vector3::new(x, y, 0.05)
}

fn line(from: Vector3<f64>, to: Vector3<f64>, speed: f64) -> Vec<Step> {
    let power = Power { level: 0.5, follows_speed: false };
    let mark = Action::Mark { curve: Curve::Line { from, to }, speed: Some(speed), power };
    vec![Step { action: Action::Rapid { to: from }, line: 3 }, Step { action: mark, line: 3 }]
}

fn lit(plan: &Plan) -> Vec<Setpoint> {
    plan.setpoints(1).filter(|sample| sample.laser.is_lit()).collect()
}

/// A bust: head, neck and shoulders as hollow bodies of revolution, by a spiral on each.
fn bust(count: usize) -> Vec<Vector3<f64>> {
    const GOLDEN: f64 = 2.399_963_229_728_653;
    let parts = [
        (0.52, 0.072, [0.013, 0.016, 0.018]),
        (0.13, 0.052, [0.007, 0.007, 0.006]),
        (0.35, 0.034, [0.026, 0.013, 0.014]),
    ];
    let mut points = Vec::with_capacity(count);
    for (index, (share, height, radii)) in parts.into_iter().enumerate() {
        let left = count - points.len();
        let some = if index == 2 { left } else { (share * count as f64) as usize };
        for number in 0..some {
            let up = 1.0 - 2.0 * (number as f64 + 0.5) / some as f64;
            let out = (1.0 - up * up).sqrt();
            let (sine, cosine) = math::sin_cos(GOLDEN * number as f64);
            points.push(Vector3::new(
                radii[0] * out * cosine,
                radii[1] * out * sine,
                height + radii[2] * up,
            ));
        }
    }
    points
}

#[test]
fn ten_thousand_points_are_marked_once_each_in_their_order() {
    const COUNT: usize = 10_000;
    let machine = machine();
    let points = bust(COUNT);
    let cloud = Cloud {
        layer: 1e-3,
        ring: 2e-3,
        spacing: [0.0; 2],
        radius: f64::INFINITY,
        heights: [f64::NEG_INFINITY, f64::INFINITY],
        glass: None,
        dwell: 1e-3,
        from: 0,
    };
    let home = Vector3::from(machine.home);
    let plan = planned(&machine, &Job::of(cloud.draw("bust", &points, 0.8, home, 1)));
    assert_eq!(plan.facts.strokes, COUNT);

    // Every point once: as sets they are the same.
    let marked: Vec<[f64; 3]> = plan.artwork.strokes.iter().map(|dot| dot.points[0]).collect();
    let sorted = |mut points: Vec<[f64; 3]>| {
        points.sort_by(|one, other| one.partial_cmp(other).unwrap());
        points
    };
    let asked = points.iter().map(|point| (*point).into()).collect();
    assert_eq!(sorted(marked.clone()), sorted(asked));

    // The deepest layer first, in it ring by ring from within, and in a ring round and round.
    let place = |[x, y, z]: [f64; 3]| {
        ((z / cloud.layer).floor() as i64, (math::hypot(x, y) / cloud.ring).floor() as i64)
    };
    let order: Vec<(i64, i64)> = marked.iter().map(|point| place(*point)).collect();
    assert!(order.is_sorted());
    assert!(order.last().unwrap().0 - order[0].0 > 50, "several layers");
    for ring in 0..marked.len() {
        if ring > 0 && order[ring] == order[ring - 1] {
            continue;
        }
        let same = order[ring..].iter().take_while(|other| **other == order[ring]).count();
        let turned: f64 = marked[ring..ring + same]
            .windows(2)
            .map(|pair| {
                let angle = |point: [f64; 3]| math::atan2(point[1], point[0]);
                (angle(pair[1]) - angle(pair[0])).rem_euclid(TAU)
            })
            .sum();
        assert!(turned < TAU + 1e-9, "ring {:?} goes round more than once", order[ring]);
    }

    // Each is lit once, for its time, with the tool standing on it.
    let mut lit = vec![0; COUNT];
    let mut before = 0;
    for sample in plan.setpoints(1) {
        if !sample.laser.is_lit() {
            continue;
        }
        let number = sample.stroke as usize;
        assert!(number == before || number == before + 1, "stroke {number} after {before}");
        before = number;
        lit[number - 1] += 1;
        let off = Vector3::from(sample.tool) - Vector3::from(marked[number - 1]);
        // The cycle in which it is lit may begin some microseconds before the tool stands.
        assert!(off.norm() < 1e-8, "point {number} is missed by {off}");
    }
    assert!(lit.iter().all(|cycles| (1..=2).contains(cycles)));

    // Limits, which the plan has checked sample by sample, are used and kept.
    let uses = &plan.facts.uses;
    let axes = [&uses.velocity, &uses.acceleration, &uses.current, &uses.voltage, &uses.heat];
    assert!(axes.into_iter().flatten().all(|share| *share <= 1.0), "{uses:?}");
    assert!(uses.path_jerk > 0.98 && uses.path_jerk <= 1.001, "{uses:?}");

    // Nearly as fast as can be: no move can be quicker than the tool alone on a straight line, nor
    // than each axis alone.
    let (mut taken, mut least) = (0.0, 0.0);
    for piece in &plan.trajectory.pieces {
        let Motion::Joints(step) = &piece.motion else { continue };
        if piece.duration <= 1e-3 {
            continue;
        }
        let (from, to) = (step.at(0.0).position, step.at(piece.duration).position);
        let mut bound: f64 = 0.0;
        for (index, axis) in machine.axes.iter().enumerate() {
            let limits = &axis.limits;
            let alone = Move::new(
                (to[index] - from[index]).abs(),
                limits.velocity,
                limits.acceleration,
                limits.jerk.min(1e9),
            );
            bound = bound.max(alone.duration());
        }
        let place = |joints: &[f64]| {
            let MechanismKind::Polar(polar) = &machine.mechanism else { unreachable!() };
            let joints = nalgebra::Vector3::new(joints[0], joints[1], joints[2]);
            use machine::Mechanism;
            polar.forward(&joints, polar.branch).unwrap().position
        };
        let path = &machine.path;
        let way = (place(&to) - place(&from)).norm();
        let tool = Move::new(way, path.rapid.max(path.speed), path.acceleration, path.jerk);
        taken += piece.duration;
        least += bound.max(tool.duration());
    }
    assert!(taken < 1.15 * least, "{taken} s, where nothing below {least} s is possible");
}

#[test]
fn a_line_through_the_centre_is_one_stroke_with_the_arm_on_both_sides() {
    let machine = machine();
    for angle in [0.0, 0.3, 1.9, -2.4] {
        let (sine, cosine) = math::sin_cos(angle);
        let out = at(0.04 * cosine, 0.04 * sine);
        let steps = line(at(-out.x, -out.y), out, 0.05);
        let plan = planned(&machine, &drawn(&machine, steps));
        assert!(plan.facts.notes.is_empty(), "{:?}", plan.facts.notes);
        assert_eq!(plan.facts.strokes, 1);
        let lit = lit(&plan);
        for pair in lit.windows(2) {
            assert_eq!(pair[1].sequence, pair[0].sequence + 1, "lit without a break");
            assert!((pair[1].path_velocity - 0.05).abs() < 1e-9);
            assert!((pair[1].position[1] - pair[0].position[1]).abs() < 1e-2, "the table goes on");
            // On the line, a straight one.
            let across = pair[1].tool[0] * sine - pair[1].tool[1] * cosine;
            assert!(across.abs() < 1e-9, "{across}");
        }
        let arm = [lit[0].position[0], lit[lit.len() - 1].position[0]];
        assert!(arm[0] * arm[1] < 0.0, "the arm changes its side: {arm:?}");
    }
}

#[test]
fn a_line_beside_the_centre_is_as_fast_as_the_table_can_turn() {
    let machine = machine();
    let steps = line(at(-0.04, 1e-3), at(0.04, 1e-3), 0.05);
    let plan = planned(&machine, &drawn(&machine, steps));
    let lit = lit(&plan);
    assert!(lit.windows(2).all(|pair| pair[1].sequence == pair[0].sequence + 1));
    let table = &machine.axes[1].limits;
    let near = lit.iter().filter(|sample| sample.tool[0].abs() < 2e-4);
    let least = near.map(|sample| sample.path_velocity).fold(f64::INFINITY, f64::min);
    // A steady v at a distance y turns the table with θ̈ = v²·x·y·2/ρ⁴, at most 0.65·(v/y)². A speed
    // that varies is faster where the table turns evenly, up to the table's own speed.
    let bound = (table.acceleration / 0.65).sqrt() * 1e-3;
    assert!(
        least > 0.9 * bound && least <= table.velocity * 1e-3 * 1.04,
        "{least} m/s of {bound} m/s"
    );
    let uses = &plan.facts.uses;
    assert!(uses.acceleration[1] > 0.85 && uses.acceleration[1] <= 1.0, "{uses:?}");
    assert!(uses.velocity[1] <= 1.0 && uses.path_acceleration <= 1.001, "{uses:?}");
    assert!(plan.facts.notes[0].text.contains("slowed to"), "{:?}", plan.facts.notes);
    // Away from the centre nothing is slowed.
    for sample in lit.iter().filter(|sample| (0.03..0.0399).contains(&sample.tool[0].abs())) {
        let speed = sample.path_velocity;
        assert!((speed - 0.05).abs() < 1e-6, "{speed} m/s at x {} m", sample.tool[0]);
    }
}

#[test]
fn a_stroke_is_timed_in_the_configuration_in_which_it_can_be_entered() {
    let mut machine = machine();
    // The nearest configuration is the one with the arm on the same side: its own speed is a third of what
    // it was, so that to change the side takes longer. On the way there the tool would leave the area.
    machine.axes[0].limits.velocity = 2.0;
    machine.area.upper[0] = 0.062;
    let corner = at(0.06, -0.04);
    let mut steps = line(at(0.06, 0.04), at(0.03, 0.045), 0.05);
    steps.insert(0, Step { action: Action::Rapid { to: corner }, line: 2 });
    steps.insert(1, Step { action: Action::Dwell { time: 0.05, lit: None }, line: 2 });
    let plan = planned(&machine, &drawn(&machine, steps));
    let samples: Vec<Setpoint> = plan.setpoints(1).collect();
    let on = |sample: &&Setpoint| (Vector3::from(sample.tool) - corner).norm() < 1e-9;
    let before = samples.iter().find(on).unwrap();
    let lit: Vec<_> = samples.iter().filter(|sample| sample.laser.is_lit()).collect();
    assert!(lit.iter().all(|sample| sample.position[0] * before.position[0] < 0.0));
    for pair in lit.windows(2) {
        let moved = (Vector3::from(pair[1].tool) - Vector3::from(pair[0].tool)).norm() / 1e-3;
        assert!((moved - pair[0].path_velocity).abs() < 2.1e-3, "{moved}");
    }
    assert!(samples.iter().all(|sample| sample.tool[0] <= 0.062 + 1e-9));
    assert!(plan.facts.uses.velocity.iter().all(|share| *share <= 1.0));
}

/// Half circles about two centres by turns, growing and then shrinking: a closed line that goes round
/// the table's centre in one sense all the way.
fn spiral(halves: i32) -> Vec<Step> {
    let (first, step) = (0.02, 0.002);
    let power = Power { level: 1.0, follows_speed: false };
    let mut steps = Vec::new();
    let mut place = at(first, 0.0);
    for half in 0..2 * halves {
        let grown = if half < halves { half } else { 2 * halves - 1 - half };
        let radius = first + step * f64::from(grown);
        let side = if half % 2 == 0 { 1.0 } else { -1.0 };
        let centre = place - Vector3::x() * (side * radius);
        let curve = Curve::Arc {
            centre,
            major: Vector3::x() * (side * radius),
            minor: Vector3::y() * (side * radius),
            start: 0.0,
            sweep: PI,
            rise: Vector3::zeros(),
        };
        place = centre - Vector3::x() * (side * radius);
        steps.push(Step { action: Action::Mark { curve, speed: Some(0.05), power }, line: 7 });
    }
    steps
}

#[test]
fn a_spiral_of_more_turns_than_the_table_has_is_unwound_in_the_dark() {
    let machine = wound(1.5);
    let steps = spiral(8);
    let Action::Mark { curve, .. } = &steps[15].action else { unreachable!() };
    let Curve::Arc { centre, major, .. } = curve else { unreachable!() };
    let end = centre - major;
    assert!((end - at(0.02, 0.0)).norm() < 1e-12, "closed: {end}");
    let endless = planned(&self::machine(), &drawn(&machine, steps.clone()));
    assert_eq!(endless.facts.strokes, 1, "one stroke where the table turns without end");

    let plan = planned(&machine, &drawn(&machine, steps));
    let strokes = &plan.artwork.strokes;
    // Eight turns on three of travel.
    assert!((3..=5).contains(&strokes.len()), "{}", strokes.len());
    for pair in strokes.windows(2) {
        let (before, after) = (pair[0].points.last().unwrap(), &pair[1].points[0]);
        let gap = Vector3::from(*before) - Vector3::from(*after);
        assert!(gap.norm() < 1e-12, "the parts are {} m apart", gap.norm());
    }
    assert!((plan.facts.length - endless.facts.length).abs() < 1e-9);
    assert!(plan.facts.notes.iter().any(|note| note.line == 7 && note.text.contains("in 4 parts")));

    let mut dark_speed: f64 = 0.0;
    let mut before: Option<Setpoint> = None;
    for sample in plan.setpoints(1) {
        assert!(sample.position[1].abs() <= 1.5 * TAU + 1e-9);
        if !sample.laser.is_lit() {
            dark_speed = dark_speed.max(sample.velocity[1].abs());
            continue;
        }
        if let Some(before) = before.filter(|before| before.stroke != sample.stroke) {
            // Within two cycles of the point where both meet.
            let apart = Vector3::from(sample.tool) - Vector3::from(before.tool);
            assert!(apart.norm() < 2.5 * 0.05 * 1e-3, "{apart}");
            let turned = (sample.position[1] - before.position[1]).abs() / TAU;
            assert!((turned - turned.round()).abs() < 0.01 && turned > 0.5, "{turned} turns");
        }
        before = Some(sample);
    }
    assert!(dark_speed > 2.0, "{dark_speed}");
}
