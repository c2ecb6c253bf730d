//! Paths in space: the shipped jobs of the platform with six degrees of freedom, corners, and letters
//! away from home.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use machine::Machine;
use messages::{Setpoint, math};
use nalgebra::Vector3;
use planner::drawing::{Action, Curve};
use planner::{Job, plan};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

fn platform() -> Machine {
    Machine::load(&Path::new(ROOT).join("machines/tri_planar.toml"), &[]).unwrap()
}

fn written(name: &str, text: &str, machine: &Machine) -> Result<Job, planner::job::JobError> {
    let path = std::env::temp_dir().join(format!("graver-{name}-{}.toml", std::process::id()));
    std::fs::write(&path, text).unwrap();
    let job = Job::read(&path, &[], machine);
    std::fs::remove_file(&path).unwrap();
    job
}

/// The samples of a shipped job, each joint's velocity the derivative of its positions, and the tool
/// that another way, forward kinematics, finds for each lit one.
fn marked(job: &str) -> Vec<(Setpoint, Vector3<f64>, Vector3<f64>)> {
    let machine = platform();
    let job = Job::read(&Path::new(ROOT).join("jobs").join(job), &[], &machine).unwrap();
    let plan = plan(&machine, &job).unwrap_or_else(|error| panic!("{error}"));
    let uses = &plan.facts.uses;
    let of_joints = [&uses.velocity, &uses.acceleration, &uses.jerk, &uses.current, &uses.voltage];
    let most = of_joints.into_iter().flatten().copied().fold(0.0, f64::max);
    assert!(most <= 1.0, "{most}");
    let samples: Vec<Setpoint> = plan.setpoints(1).collect();
    let step = 1e-3;
    for pair in samples.windows(3) {
        for axis in 0..6 {
            // Central differences: they err by jerk·h²/6, and by h·a step of the jerk's share.
            let rate = (pair[2].position[axis] - pair[0].position[axis]) / (2.0 * step);
            let off = rate - pair[1].velocity[axis];
            let jerk = pair.iter().map(|s| s.jerk[axis].abs()).fold(0.0, f64::max);
            assert!(
                off.abs() <= jerk * step * step + 1e-9,
                "{axis}: {off} at {}",
                pair[1].sequence
            );
            let rate = (pair[2].velocity[axis] - pair[0].velocity[axis]) / (2.0 * step);
            let off = rate - pair[1].acceleration[axis];
            assert!(off.abs() <= jerk * step + 1e-9, "{axis}: {off} at {}", pair[1].sequence);
        }
    }
    let machine::MechanismKind::TriPlanar(mechanism) = machine.mechanism.clone() else { panic!() };
    use machine::Mechanism;
    let lit = samples.into_iter().filter(|sample| sample.laser.is_lit());
    let home = Vector3::from(machine.home);
    lit.map(|sample| {
        let joints = machine::kinematics::Joints::<6>::from_fn(|axis, _| sample.position[axis]);
        let pose = mechanism.forward(&joints, mechanism.branch()).unwrap();
        let up = pose.rotation.column(2).into_owned();
        (sample, pose.position - home, up)
    })
    .collect()
}

#[test]
fn a_tilted_circle_is_gone_with_the_platform_in_its_plane() {
    let (sine, cosine) = math::sin_cos(10.0_f64.to_radians());
    let normal = Vector3::new(0.0, -sine, cosine);
    let found = marked("tri_planar.toml");
    // 2π·20 mm at 20 mm/s is 6.283 s.
    assert!((6275..=6290).contains(&found.len()), "{}", found.len());
    for (index, (sample, place, up)) in found.iter().enumerate() {
        // The light goes on within the first cycle, whose sample is still of the way in.
        let off = sample.path_velocity - 0.02;
        assert!(index == 0 || off.abs() < 1e-9, "{off} at {index} of {}", found.len());
        assert!((place.norm() - 0.02).abs() < 1e-9, "{place}");
        assert!(place.dot(&normal).abs() < 1e-9, "{place}");
        assert!((up - normal).amax() < 1e-9, "{up}");
    }
    let top = found.iter().map(|(_, place, _)| place.z).fold(0.0, f64::max);
    assert!((top - 0.02 * sine).abs() < 1e-8, "{top}");
}

#[test]
fn a_tilt_follows_the_position_round_a_circle() {
    let (sine, cosine) = math::sin_cos(5.0_f64.to_radians());
    for (_, place, up) in marked("tri_planar_nutation.toml") {
        assert!((place.norm() - 0.02).abs() < 1e-9 && place.z.abs() < 1e-9, "{place}");
        let expected = place / 0.02 * sine + Vector3::z() * cosine;
        assert!((up - expected).amax() < 1e-7, "{up} {expected}");
    }
}

#[test]
fn corners_are_joined_by_straight_lines() {
    let machine = platform();
    let text = "[path]\nat = [\"1 mm\", \"0 mm\", \"2 mm\"]\n\
                points = [[\"0 mm\", \"0 mm\"], [\"5 mm\", \"0 mm\", \"1 mm\"], [\"5 mm\", \"5 mm\"]]\n";
    let job = written("corners", text, &machine).unwrap();
    let home = Vector3::from(machine.home);
    assert_eq!(job.drawing.start, home);
    let ends = [[0.001, 0.0, 0.002], [0.006, 0.0, 0.003], [0.006, 0.005, 0.002]];
    assert_eq!(job.drawing.steps.len(), 2);
    for (index, step) in job.drawing.steps.iter().enumerate() {
        let Action::Mark { curve: Curve::Line { from, to }, .. } = step.action else { panic!() };
        assert!((from - home - Vector3::from(ends[index])).amax() < 1e-12);
        assert!((to - home - Vector3::from(ends[index + 1])).amax() < 1e-12);
    }
    for text in ["[path]\n", "[path]\npoints = [[\"0 mm\", \"0 mm\"]]\n"] {
        assert!(written("wrong", text, &machine).is_err(), "{text}");
    }
}

#[test]
fn letters_may_lie_beside_home() {
    let machine = Machine::builtin();
    let text = "[letters]\ntext = \"O\"\nheight = \"20 mm\"\nat = [\"30 mm\", \"-10 mm\"]\n";
    let job = written("beside", text, &machine).unwrap();
    let home = Vector3::from(machine.home);
    assert_eq!(job.drawing.start, home);
    let Action::Mark { curve, .. } = &job.drawing.steps[0].action else { panic!() };
    // The ellipse starts at its right, half of its width from its middle.
    assert!((curve.from() - home - Vector3::new(0.04, -0.01, 0.0)).amax() < 1e-12);
}
