//! Letters on a cylinder, marked by a machine that leans its tool against the normal.

#![allow(clippy::unwrap_used)]

#[path = "../../machine/tests/support/loads.rs"]
mod loads;

use machine::mechanisms::mcm::{Mcm, McmBranch};
use machine::surface::{Cone, Placement, Projection, Shape, Surface};
use machine::{Actuator, Axis, Machine, Mechanism, MechanismKind};
use nalgebra::{Matrix3, SVector, Vector3};
use planner::drawing::{Action, Curve, Drawing, Power, Step};
use planner::geometry::attitude::{AttitudeLaw, turned};
use planner::verify::checker::Quantity;
use planner::{Job, PlanError, plan};

const RADIUS: f64 = 0.03;

fn axis(
    name: &str,
    ratio: f64,
    travel: f64,
    [velocity, acceleration, jerk]: [f64; 3],
) -> (Axis, Actuator) {
    let Machine { mut axes, mut actuators, .. } = Machine::builtin();
    let (mut axis, mut actuator) = (axes.remove(0), actuators.remove(0));
    (axis.name, actuator.name) = (name.to_owned(), name.to_owned());
    actuator.ratio = ratio;
    axis.limits.position = [-travel, travel];
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

fn mechanism() -> Mcm {
    Mcm {
        tool: 0.1,
        offset: 0.0,
        height: 0.3,
        reach: [0.0, 0.4],
        singular_distance: 1e-3,
        branch: McmBranch { side: Some(1), lean: None },
        load: loads::MCM,
        elasticity: None,
    }
}

fn machine() -> Machine {
    let mut machine = Machine::builtin();
    machine.mechanism = MechanismKind::Mcm(mechanism());
    let (linear, turning) = ([0.3, 3.0, 300.0], [5.0, 60.0, 4000.0]);
    let drives = vec![
        axis("x", 1e-3, 0.4, linear),
        axis("z", 1e-3, 0.4, linear),
        axis("table", 0.02, 20.0, turning),
        axis("tilt", 0.02, 1.5, turning),
        axis("turn", 0.02, 6.0, turning),
    ];
    put(&mut machine, drives);
    machine.area.lower = [-0.4; 3];
    machine.area.upper = [0.4; 3];
    machine.path.acceleration = 2.0;
    machine.path.jerk = 100.0;
    machine.home_joints = vec![0.2, 0.1, 0.0, 0.5, 0.0];
    let home = mechanism().forward(&SVector::from([0.2, 0.1, 0.0, 0.5, 0.0]), mechanism().branch);
    machine.home = home.unwrap().position.into();
    machine
}

fn read(name: &str, text: &str) -> Job {
    let path = std::env::temp_dir().join(format!("graver-{name}-{}.toml", std::process::id()));
    std::fs::write(&path, text).unwrap();
    let job = Job::read(&path, &[], &machine());
    std::fs::remove_file(&path).unwrap();
    job.unwrap()
}

const LETTER: &str = "[letters]\ntext = \"O\"\nheight = \"8 mm\"\n\n[marking]\nspeed = \"20 mm/s\"\n\n\
                      [surface]\nposition = [\"150 mm\", \"0 mm\", \"0 mm\"]\n\
                      rotation = [\"45 deg\", \"0 deg\", \"0 deg\"]\n\n";

#[test]
fn a_letter_lies_on_the_cylinder_and_the_beam_against_its_normal() {
    let cylinder = "[surface.cylinder]\nradius = \"30 mm\"\nheight = \"40 mm\"\n";
    let job = read("surface", &format!("{LETTER}{cylinder}"));
    let machine = machine();
    let planned = plan(&machine, &job).unwrap_or_else(|error| panic!("{error}"));
    let cone =
        Cone { bottom: RADIUS, top: RADIUS, length: 0.04, projection: Projection::Developed };
    let placement = Placement {
        rotation: turned(core::f64::consts::FRAC_PI_4, 0.0, 0.0),
        translation: Vector3::new(0.15, 0.0, 0.0),
    };
    let surface = Surface { shape: Shape::Cone(cone), placement };
    let samples: Vec<_> = planned.setpoints(1).collect();
    let mechanism = mechanism();
    let mut lit = 0;
    for pair in samples.windows(2) {
        for index in 0..5 {
            let moved = (pair[1].position[index] - pair[0].position[index]) / 1e-3;
            let mean = (pair[0].velocity[index] + pair[1].velocity[index]) / 2.0;
            let most = machine.axes[index].limits.jerk * 1e-6;
            assert!((moved - mean).abs() <= most, "axis {index} at {}", pair[0].sequence);
        }
        let sample = &pair[0];
        if !sample.laser.is_lit() || sample.laser.power == 0.0 {
            continue;
        }
        lit += 1;
        let joints = SVector::from_fn(|row, _| sample.position[row]);
        let pose = mechanism.forward(&joints, mechanism.branch).unwrap();
        let point = Vector3::from(sample.tool);
        assert!((pose.position - point).norm() < 1e-9);
        let place = [point.x, point.y, point.z];
        assert!(surface.height(place).unwrap().abs() < 1e-9);
        let normal = Vector3::from(surface.normal_beside(place).unwrap());
        let off = (pose.rotation.column(2) - normal).norm();
        assert!(off < 1e-9, "the beam is {off} off the normal");
        assert!((sample.path_velocity - 0.02).abs() < 1e-9 || !planned.facts.notes.is_empty());
    }
    // An isometry: the O of 8 mm is a circle of 8 mm, 25.13 mm at 20 mm/s.
    assert!((planned.facts.length - 8e-3 * core::f64::consts::PI).abs() < 1e-9);
    assert!(lit >= 1250, "{lit}");
}

#[test]
fn a_drawing_beyond_the_edge_is_refused() {
    let cylinder = "[surface.cylinder]\nradius = \"30 mm\"\nheight = \"6 mm\"\n";
    let job = read("edge", &format!("{LETTER}{cylinder}"));
    let Err(PlanError::Unreachable { cause, .. }) = plan(&machine(), &job) else {
        panic!("8 mm do not fit on 6 mm")
    };
    assert_eq!(cause.code, "off_surface");
}

/// A lean that follows the place, and is none in the middle of the line.
fn line_through_upright(machine: &Machine) -> Job {
    let center = Vector3::from(machine.home) + Vector3::new(0.02, 0.03, 0.0);
    // About the way that the head is turned there.
    let half = Vector3::new(-0.006, 0.019, 0.0);
    let curve = Curve::Line { from: center - half, to: center + half };
    let power = Power { level: 1.0, follows_speed: false };
    let action = Action::Mark { curve, speed: Some(0.02), power };
    Job {
        attitude: AttitudeLaw::Following { center, gradient: 10.0, base: Matrix3::identity() },
        ..Job::of(Drawing {
            name: "upright".to_owned(),
            start: Vector3::from(machine.home),
            steps: vec![Step { action, line: 4 }],
            notes: Vec::new(),
        })
    }
}

#[test]
fn a_path_through_the_upright_tool_goes_on_with_the_tilt_of_the_other_sign() {
    let machine = machine();
    let planned = plan(&machine, &line_through_upright(&machine)).unwrap_or_else(|e| panic!("{e}"));
    let lit: Vec<_> = planned.setpoints(1).filter(|sample| sample.laser.is_lit()).collect();
    assert_eq!(planned.facts.strokes, 1);
    for pair in lit.windows(2) {
        assert_eq!(pair[1].sequence, pair[0].sequence + 1, "lit without a break");
        for index in 0..5 {
            let moved = (pair[1].position[index] - pair[0].position[index]) / 1e-3;
            let mean = (pair[0].velocity[index] + pair[1].velocity[index]) / 2.0;
            assert!((moved - mean).abs() < 1e-4, "axis {index}: {moved} {mean}");
        }
    }
    let tilts = [lit[0].position[3], lit[lit.len() - 1].position[3]];
    assert!(tilts[0] * tilts[1] < 0.0, "{tilts:?}");
    assert!(tilts.iter().all(|tilt| (tilt.abs() - 0.199).abs() < 2e-3), "{tilts:?}");
}

#[test]
fn a_path_through_the_upright_tool_is_refused_where_the_tilt_goes_one_way_only() {
    let mut machine = machine();
    machine.axes[3].limits.position[0] = 0.0;
    let Err(PlanError::Limit { line, violation, .. }) =
        plan(&machine, &line_through_upright(&machine))
    else {
        panic!("the tilt has no other side")
    };
    assert_eq!((line, violation.quantity, violation.limit), (4, Quantity::JointPosition, 0.0));
    assert_eq!(violation.axis, Some(machine.axes[3].name.clone()));
}
