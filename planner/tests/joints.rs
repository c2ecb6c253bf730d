//! Planning by the joints, on the polar machine: moves of the joints between strokes, the turn of the
//! table and its unwinding, and the speed near the centre.

#![allow(clippy::unwrap_used)]

use core::f64::consts::TAU;

use machine::mechanisms::polar::{Polar, PolarBranch, PolarLoad};
use machine::{Actuator, Axis, Machine, MechanismKind};
use messages::Setpoint;
use nalgebra::Vector3;
use planner::drawing::{Action, Curve, Drawing, Power, Step};
use planner::trajectory::Motion;
use planner::verify::checker::Quantity;
use planner::{Job, Plan, PlanError, plan};

const ARM: f64 = 0.2;

/// Turns of the table to either side.
const TRAVEL: f64 = 1.5;

fn axis(
    name: &str,
    ratio: f64,
    position: [f64; 2],
    [velocity, acceleration, jerk]: [f64; 3],
) -> (Axis, Actuator) {
    let Machine { mut axes, mut actuators, .. } = Machine::builtin();
    let (mut axis, mut actuator) = (axes.remove(0), actuators.remove(0));
    (axis.name, actuator.name) = (name.to_owned(), name.to_owned());
    actuator.ratio = ratio;
    axis.limits.position = position;
    axis.limits.velocity = velocity;
    axis.limits.acceleration = acceleration;
    axis.limits.jerk = jerk;
    (axis, actuator)
}

/// Gives `machine` these axes with an actuator each.
fn put(machine: &mut Machine, drives: Vec<(Axis, Actuator)>) {
    (machine.axes, machine.actuators) = drives.into_iter().unzip();
    for (index, actuator) in machine.actuators.iter_mut().enumerate() {
        actuator.axis = index;
        machine.axes[index].actuators = index..index + 1;
    }
}

/// An arm that reaches the centre of a table whose cable lets it turn one and a half times.
fn machine() -> Machine {
    let mut machine = Machine::builtin();
    let load = PolarLoad {
        arm_mass: 0.4,
        arm_center: 0.1,
        arm_inertia: 1e-3,
        head_mass: 0.3,
        head_center: ARM,
        head_inertia: 1e-4,
        table_inertia: 2e-3,
        workpiece_mass: 0.5,
        workpiece_center: 0.0,
        workpiece_inertia: 1e-3,
        counterbalance: 0.3 * 9.81,
        gravity: 9.81,
    };
    machine.mechanism = MechanismKind::Polar(Polar {
        arm: ARM,
        center_distance: ARM,
        height: 0.0,
        singular_radius: 1e-5,
        endless: false,
        branch: PolarBranch { side: None, table_turn: None },
        load,
        elasticity: None,
    });
    let turning = [6.0, 300.0, 20_000.0];
    let drives = vec![
        axis("arm", 0.02, [-1.2, 1.2], turning),
        axis("table", 0.02, [-TRAVEL * TAU, TRAVEL * TAU], turning),
        axis("lift", 3e-4, [-0.05, 0.05], [0.1, 5.0, 500.0]),
    ];
    put(&mut machine, drives);
    machine.area.lower = [-0.1, -0.1, -0.05];
    machine.area.upper = [0.1, 0.1, 0.05];
    // The arm 0.3 rad from the centre: 2·a·sin(0.15) from it.
    machine.home_joints = vec![0.3, 0.0, 0.0];
    let out = 2.0 * ARM * messages::math::sin(0.15);
    machine.home = [-out * messages::math::sin(0.15), out * messages::math::cos(0.15), 0.0];
    machine
}

fn at(x: f64, y: f64) -> Vector3<f64> {
    Vector3::new(x, y, 0.0)
}

fn line(from: Vector3<f64>, to: Vector3<f64>, speed: f64) -> [Step; 2] {
    let power = Power { level: 0.5, follows_speed: true };
    let mark = Action::Mark { curve: Curve::Line { from, to }, speed: Some(speed), power };
    [Step { action: Action::Rapid { to: from }, line: 3 }, Step { action: mark, line: 3 }]
}

fn job(machine: &Machine, steps: Vec<Step>) -> Job {
    let start = Vector3::from(machine.home);
    Job::of(Drawing { name: "test".to_owned(), start, steps, notes: Vec::new() })
}

/// The plan, with every sample the derivative of the one before: joints, and the tool's speed.
fn planned(machine: &Machine, job: &Job) -> (Plan, Vec<Setpoint>) {
    let plan = plan(machine, job).unwrap_or_else(|error| panic!("{error}"));
    let samples: Vec<Setpoint> = plan.setpoints(1).collect();
    let step = 1e-3;
    for pair in samples.windows(2) {
        for axis in 0..3 {
            let (one, other) = (pair[0].position[axis], pair[1].position[axis]);
            let mean = (pair[0].velocity[axis] + pair[1].velocity[axis]) / 2.0;
            let off = (other - one) / step - mean;
            // The trapezoid's error is jerk·h²/12.
            let most = machine.axes[axis].limits.jerk * step * step;
            assert!(off.abs() <= most, "axis {axis} off by {off} at {}", pair[0].sequence);
        }
        let moved = Vector3::from(pair[1].tool) - Vector3::from(pair[0].tool);
        let mean = (pair[0].path_velocity + pair[1].path_velocity) / 2.0;
        let off = moved.norm() / step - mean;
        assert!(off.abs() <= 4e-3, "tool off by {off} m/s at {}", pair[0].sequence);
        let change = pair[1].path_velocity - pair[0].path_velocity;
        assert!(
            change.abs() <= 1.02 * machine.path.acceleration * step + 1e-9,
            "speed jumps by {change} at {}",
            pair[0].sequence
        );
    }
    (plan, samples)
}

#[test]
fn strokes_are_joined_by_moves_of_the_joints() {
    let machine = machine();
    let steps =
        [line(at(0.03, 0.02), at(0.05, 0.02), 0.05), line(at(-0.04, -0.01), at(-0.04, 0.03), 0.05)];
    let (plan, samples) = planned(&machine, &job(&machine, steps.concat()));
    let moves = plan
        .trajectory
        .pieces
        .iter()
        .filter(|piece| matches!(piece.motion, Motion::Joints(_)) && piece.duration > 0.01)
        .count();
    assert_eq!(moves, 2);
    assert!(!plan.trajectory.pieces.iter().any(|p| matches!(p.motion, Motion::Flight(_))));
    let first = &samples[0];
    assert_eq!(first.position[..3], machine.home_joints[..]);
    // Steady 50 mm/s while the laser is on, on both lines.
    let lit: Vec<_> = samples.iter().filter(|sample| sample.laser.is_lit()).collect();
    assert!(lit.len() > 1100, "{}", lit.len());
    assert!(plan.facts.notes.is_empty(), "{:?}", plan.facts.notes);
}

#[test]
fn a_line_beside_the_centre_is_slowed_there_and_only_there() {
    let machine = machine();
    let steps = line(at(-0.04, 0.001), at(0.04, 0.001), 0.05).to_vec();
    let (plan, samples) = planned(&machine, &job(&machine, steps));
    let near = |low: f64, high: f64| {
        let lit =
            samples.iter().filter(|s| s.laser.is_lit() && (low..high).contains(&s.tool[0].abs()));
        lit.map(|s| s.path_velocity)
            .fold((f64::INFINITY, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)))
    };
    // The table turns with v·y/ρ²: at 6 rad/s and 1 mm no more than 6 mm/s, which it comes to.
    let (least, most) = near(0.0, 2e-4);
    assert!(least > 5.5e-3 && most <= 6.0e-3 * 1.04, "{least} {most}");
    let (least, _) = near(0.017, 0.038);
    assert!((least - 0.05).abs() < 6e-5, "{least}");
    // Power follows the speed: what binds is told, not noted as a fault.
    let binding = &plan.facts.binding;
    assert!(binding.iter().any(|limit| limit.axis.as_deref() == Some("table")), "{binding:?}");
    assert!(plan.facts.uses.velocity[1] > 0.5 && plan.facts.uses.velocity[1] <= 1.0);
    // Power goes with the speed: 0.5 at 50 mm/s.
    // A sample's power is that of the mean speed since the one before.
    for pair in samples.windows(2).filter(|pair| pair.iter().all(|s| s.laser.power > 0.0)) {
        let mean = (pair[0].path_velocity + pair[1].path_velocity) / 2.0;
        let (power, expected) = (pair[1].laser.power, 0.5 * mean / 0.05);
        assert!((power - expected).abs() < 0.02, "{power} {expected}");
    }
}

#[test]
fn a_line_through_the_centre_is_crossed_without_a_slow_down_of_the_table() {
    let machine = machine();
    let steps = line(at(-0.04, 0.0), at(0.04, 0.0), 0.05).to_vec();
    let (plan, samples) = planned(&machine, &job(&machine, steps));
    assert!(plan.facts.notes.is_empty(), "{:?}", plan.facts.notes);
    let lit: Vec<_> = samples.iter().filter(|s| s.laser.is_lit()).collect();
    let arm = |s: &&Setpoint| s.position[0];
    assert!(arm(&lit[0]) * arm(lit.last().unwrap()) < 0.0, "the arm changes its side");
    let table: Vec<f64> = lit.iter().map(|s| s.position[1]).collect();
    let span = table.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b))
        - table.iter().fold(f64::INFINITY, |a, b| a.min(*b));
    // 80 mm of chord: θ₂ goes with θ₁/2, 2·asin(0.04/0.4)/2 to either side.
    assert!((span - 2.0 * messages::math::asin(0.1)).abs() < 1e-3, "{span}");
}

#[test]
fn a_table_at_the_end_of_its_travel_is_unwound_in_the_dark() {
    let machine = machine();
    let circle = |turns: f64| Curve::Arc {
        centre: Vector3::zeros(),
        major: at(0.02, 0.0),
        minor: at(0.0, 0.02),
        start: 0.0,
        sweep: turns * TAU,
        rise: Vector3::zeros(),
    };
    let power = Power { level: 1.0, follows_speed: false };
    let mark = |turns: f64| Step {
        action: Action::Mark { curve: circle(turns), speed: Some(0.05), power },
        line: 9,
    };
    let dwell = Step { action: Action::Dwell { time: 0.0, lit: None }, line: 9 };
    // Two circles of two turns in the same sense: after the first, three turns of travel have one left.
    let steps = vec![mark(2.0), dwell, mark(2.0)];
    let (plan, samples) = planned(&machine, &job(&machine, steps));
    let dark = samples.iter().filter(|s| !s.laser.is_lit());
    let most = dark.map(|s| s.velocity[1].abs()).fold(0.0, f64::max);
    assert!(most > 3.0, "{most}");
    for sample in &samples {
        assert!(sample.position[1].abs() <= TRAVEL * TAU + 1e-9);
    }
    assert_eq!(plan.facts.strokes, 2);
    // Four turns do not fit into three: they are marked in two parts that meet.
    let (plan, samples) = planned(&machine, &job(&machine, vec![mark(4.0)]));
    assert_eq!(plan.facts.strokes, 2);
    for sample in &samples {
        assert!(sample.position[1].abs() <= TRAVEL * TAU + 1e-9);
    }
    assert!(plan.facts.notes.iter().any(|note| note.line == 9 && note.text.contains("in 2 parts")));
    // An arm is no table: what it does not reach is refused.
    let far = line(at(0.09, 0.02), at(0.09, -0.02), 0.05);
    let mut narrow = machine.clone();
    narrow.axes[0].limits.position = [-0.4, 0.4];
    let Err(PlanError::Limit { line, violation, .. }) = plan_of(&narrow, far.to_vec()) else {
        panic!("the arm does not turn so far")
    };
    assert_eq!((line, violation.axis.as_deref()), (3, Some("arm")));
    assert_eq!(violation.quantity, Quantity::JointPosition);
}

fn plan_of(machine: &Machine, steps: Vec<Step>) -> Result<Plan, PlanError> {
    plan(machine, &job(machine, steps))
}

#[test]
fn a_job_begins_where_the_joints_stand() {
    let machine = machine();
    let mut job = job(&machine, line(at(0.03, 0.02), at(0.05, 0.02), 0.05).to_vec());
    let mut standing = [0.0; messages::MAX_AXES];
    standing[..3].copy_from_slice(&[-0.2, 8.0, 0.01]);
    job.standing = Some(standing);
    let (_, samples) = planned(&machine, &job);
    assert_eq!(samples[0].position[..3], standing[..3]);
    // The nearest turn: the table stays on the turn that it is on.
    let last = samples.last().unwrap().position[1];
    assert!((last - 8.0).abs() < core::f64::consts::PI, "{last}");
}

#[test]
fn a_cloud_is_marked_from_below_in_rings_and_soon_planned() {
    let machine = machine();
    let text = "[cloud]\nface = \"0 mm\"\nindex = 1.5\npulses = 40\npulse_rate = \"20 kHz\"\n\
                spacing = \"0.1 mm\"\nfrom = 10\n[cloud.sphere]\n\
                center = [\"0 mm\", \"0 mm\", \"-20 mm\"]\nradius = \"12 mm\"\ncount = 1000\n";
    let path = std::env::temp_dir().join(format!("graver-cloud-{}.toml", std::process::id()));
    std::fs::write(&path, text).unwrap();
    let read = Job::read(&path, &[], &machine);
    std::fs::remove_file(&path).unwrap();
    let job = read.unwrap();
    let (plan, samples) = planned(&machine, &job);
    let lit: u64 = samples.iter().filter(|s| s.laser.is_lit()).count() as u64;
    // 40 pulses at 20 kHz are 2 ms.
    let strokes = plan.facts.strokes as u64;
    assert!((strokes * 2..=strokes * 3).contains(&lit), "{lit} {strokes}");
    assert!(strokes > 900 && strokes <= 990, "{strokes}");
    let heights: Vec<f64> = plan.artwork.strokes.iter().map(|s| s.points[0][2]).collect();
    // z from −32 to −8 mm below the face is a lens travel of two thirds; a layer is 0.2 mm.
    assert!(heights[0] < -0.02 && heights.last().unwrap() > &-0.0062, "{:?}", heights.len());
    let layer = 0.2e-3 / 1.5;
    assert!(heights.windows(2).all(|pair| pair[1] > pair[0] - layer));
    assert!(plan.facts.notes.iter().any(|note| note.text.starts_with("10 points are taken")));
    assert_eq!(plan.facts.uses.current.len(), 3);
}
