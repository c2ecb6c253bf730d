//! Paths through poses: where the tool is and how it is turned at each, on the way between them, and
//! what is refused.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use machine::kinematics::{Attitude, Joints};
use machine::{Machine, Mechanism, MechanismVisitor, Override, Pose};
use messages::Setpoint;
use nalgebra::{Matrix3, Vector3};
use planner::geometry::attitude::turned;
use planner::trajectory::{Errand, Motion, Reference};
use planner::{Job, Plan, plan};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
const JOB: &str = "jobs/tri_planar_poses.toml";

fn machine(file: &str, overrides: &[&str]) -> Machine {
    let overrides: Vec<Override> = overrides.iter().map(|text| text.parse().unwrap()).collect();
    Machine::load(&Path::new(ROOT).join(file), &overrides).unwrap()
}

fn platform() -> Machine {
    machine("machines/tri_planar.toml", &[])
}

fn arm() -> Machine {
    machine("planner/tests/poses/arm.toml", &[])
}

fn shipped(machine: &Machine, overrides: &[&str]) -> Plan {
    let overrides: Vec<Override> = overrides.iter().map(|text| text.parse().unwrap()).collect();
    let job = Job::read(&Path::new(ROOT).join(JOB), &overrides, machine).unwrap();
    plan(machine, &job).unwrap_or_else(|error| panic!("{error}"))
}

/// A pose [mm, degrees] as x, y, z, roll, pitch and yaw.
type Written = [f64; 6];

/// The poses of the shipped job.
const POSES: [Written; 10] = [
    [-25.0, 0.0, 0.0, 2.0, -6.0, 0.0],
    [-18.0, 14.0, 2.0, 5.0, -4.0, 3.0],
    [-6.0, 17.0, 4.0, 7.0, -1.0, 6.0],
    [4.0, 8.0, 5.0, 4.0, 2.0, 8.0],
    [8.0, -5.0, 4.0, -2.0, 4.0, 6.0],
    [16.0, -14.0, 2.0, -6.0, 5.0, 2.0],
    [27.0, -10.0, 0.0, -5.0, 7.0, -3.0],
    [30.0, 3.0, -2.0, 0.0, 8.0, -6.0],
    [22.0, 14.0, -2.0, 5.0, 5.0, -4.0],
    [10.0, 20.0, 0.0, 6.0, 1.0, 0.0],
];

fn pose(machine: &Machine, [x, y, z, roll, pitch, yaw]: Written) -> (Vector3<f64>, Matrix3<f64>) {
    let rotation = turned(roll.to_radians(), pitch.to_radians(), yaw.to_radians());
    (Vector3::from(machine.home) + Vector3::new(x, y, z) * 1e-3, rotation)
}

fn read(text: &str, machine: &Machine) -> Result<Job, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("poses.toml");
    std::fs::write(&path, text).unwrap();
    Job::read(&path, &[], machine).map_err(|error| {
        let line = error.position().map_or(0, |(line, _)| line);
        format!("line {line}: {error:?}")
    })
}

/// The poses that the joints of each sample have, found by forward kinematics.
struct Found<'a>(&'a [Setpoint]);

impl MechanismVisitor for Found<'_> {
    type Output = Vec<Pose>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Vec<Pose> {
        let pose = |sample: &Setpoint| {
            let joints = Joints::<N>::from_fn(|axis, _| sample.position[axis]);
            mechanism.forward(&joints, mechanism.branch()).unwrap()
        };
        self.0.iter().map(pose).collect()
    }
}

/// Joints, their rates and the tool of all samples: rates are differences, no limit is exceeded, and the
/// joints turn the tool as the trajectory says. The largest use of a limit of the joints.
fn hold_together(machine: &Machine, plan: &Plan) -> f64 {
    let uses = &plan.facts.uses;
    let of_joints = [&uses.velocity, &uses.acceleration, &uses.jerk, &uses.current, &uses.voltage];
    let most = of_joints.into_iter().flatten().copied().fold(0.0, f64::max);
    assert!(most <= 1.0, "{most}");
    let samples: Vec<Setpoint> = plan.setpoints(1).collect();
    let step = 1e-3;
    for three in samples.windows(3) {
        for axis in 0..6 {
            let jerk = three.iter().map(|s| s.jerk[axis].abs()).fold(0.0, f64::max);
            // Central differences: they err by jerk·h²/6, and by h·a step of the jerk's share.
            let rate = (three[2].position[axis] - three[0].position[axis]) / (2.0 * step);
            assert!((rate - three[1].velocity[axis]).abs() <= jerk * step * step + 1e-9);
            let rate = (three[2].velocity[axis] - three[0].velocity[axis]) / (2.0 * step);
            assert!((rate - three[1].acceleration[axis]).abs() <= jerk * step + 1e-9);
        }
    }
    let mut cursor = planner::trajectory::Cursor::default();
    let found = machine.mechanism.visit(Found(&samples));
    for (sample, found) in samples.iter().zip(&found) {
        let time = sample.sequence as f64 * step;
        let Reference::Tool(tool) = plan.trajectory.at(time, &mut cursor) else { continue };
        assert!((tool.position - found.position).amax() < 1e-9, "{time}");
        assert!((tool.attitude.rotation - found.rotation).amax() < 1e-9, "{time}");
    }
    most
}

/// The tool's attitude at so much of the time since the first light.
fn attitudes(plan: &Plan) -> Vec<(f64, Attitude)> {
    let mut cursor = planner::trajectory::Cursor::default();
    (0..=20_000)
        .filter_map(|index| {
            let time = plan.trajectory.end() * f64::from(index) / 20_000.0;
            let found = plan.trajectory.at(time, &mut cursor);
            found.tool().map(|tool| (time, tool.attitude))
        })
        .collect()
}

#[test]
fn a_smooth_path_passes_every_pose_exactly_and_without_a_stop() {
    for machine in [platform(), arm()] {
        let plan = shipped(&machine, &[]);
        let paths: Vec<_> = plan
            .trajectory
            .pieces
            .iter()
            .filter_map(|piece| match &piece.motion {
                Motion::Path { path, errand: Errand::Marks, .. } => Some(path.clone()),
                _ => None,
            })
            .collect();
        let path = &paths[0];
        assert!(paths.iter().all(|other| other == path), "one path, without a stop");
        let knots: Vec<f64> =
            [0.0].into_iter().chain(path.seams()).chain([path.length()]).collect();
        assert_eq!(knots.len(), POSES.len());
        for (knot, written) in knots.iter().zip(POSES) {
            let (position, rotation) = pose(&machine, written);
            let tool = path.tool(*knot, [1.0, 0.0, 0.0]);
            assert!((tool.position - position).amax() < 1e-12, "{written:?}");
            assert!((tool.attitude.rotation - rotation).amax() < 1e-12, "{written:?}");
        }
        let lit: Vec<Setpoint> =
            plan.setpoints(1).filter(|sample| sample.laser.is_lit()).skip(1).collect();
        for sample in &lit {
            assert!((sample.path_velocity - 0.02).abs() < 1e-9, "{}", sample.path_velocity);
        }
        hold_together(&machine, &plan);
    }
}

#[test]
fn the_turning_has_no_jump_in_rate_acceleration_or_jerk_where_the_tool_goes_evenly() {
    let plan = shipped(&platform(), &[]);
    let found = attitudes(&plan);
    let most = found.iter().map(|(_, attitude)| attitude.jerk.amax()).fold(0.0, f64::max);
    // Lit, the tool goes evenly; the rest of the path is flown with the tool held as it is at the end.
    for pair in found.windows(2) {
        let ([(before, one), (after, other)], step) = ([pair[0], pair[1]], pair[1].0 - pair[0].0);
        if after - before > 1e-3 {
            continue;
        }
        let turn = other.rotation * one.rotation.transpose();
        let spin = Vector3::new(turn[(2, 1)], turn[(0, 2)], turn[(1, 0)]) / step;
        assert!((spin - (one.velocity + other.velocity) / 2.0).amax() < 1e-5, "{before}");
        let mean = (one.acceleration + other.acceleration) / 2.0;
        let difference = (other.velocity - one.velocity) / step;
        assert!((difference - mean).amax() < 1e-3 * (1.0 + mean.amax()), "{before}");
        let off = (other.jerk - one.jerk).amax();
        assert!(off < 0.02 * most, "{before}: {off} of {most}");
    }
    let rate = found.iter().map(|(_, attitude)| attitude.velocity.norm()).fold(0.0, f64::max);
    assert!(rate > 0.05, "{rate}");
}

#[test]
fn limits_of_the_joints_slow_a_path_through_poses_and_are_kept() {
    let limited = [
        "axis.xD.limits.jerk=2 m/s^3",
        "axis.yE.limits.acceleration=0.05 m/s^2",
        "axis.xF.limits.velocity=0.04 m/s",
    ];
    let machine = machine("machines/tri_planar.toml", &limited);
    let plan = shipped(&machine, &["marking.speed=50 mm/s"]);
    let most = hold_together(&machine, &plan);
    assert!(most > 0.95, "{most}");
    let slowed = plan.facts.notes.iter().any(|note| note.text.contains("slowed"));
    assert!(slowed, "{:?}", plan.facts.notes);
}

#[test]
fn between_straight_lines_the_turning_rests_at_corners_only() {
    let machine = platform();
    let straight = [
        [-20.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [-10.0, 0.0, 0.0, 0.0, 4.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 8.0, 0.0],
        [0.0, 15.0, 0.0, 6.0, 8.0, 0.0],
    ];
    for policy in ["constant", "proportional"] {
        let job = read(&format!("{}[marking]\npolicy = \"{policy}\"\n", text(&straight)), &machine);
        let plan = plan(&machine, &job.unwrap()).unwrap_or_else(|error| panic!("{error}"));
        hold_together(&machine, &plan);
        let mut seen = [false; 4];
        let mut cursor = planner::trajectory::Cursor::default();
        for index in 0..=200_000 {
            let time = plan.trajectory.end() * f64::from(index) / 200_000.0;
            let found = plan.trajectory.at(time, &mut cursor);
            let motion = plan.trajectory.piece_at(time).map(|piece| &piece.motion);
            let (Some(tool), Some(Motion::Path { errand: Errand::Marks, .. })) =
                (found.tool(), motion)
            else {
                continue;
            };
            for (number, written) in straight.iter().enumerate() {
                let (position, rotation) = pose(&machine, *written);
                // A corner may be rounded.
                if (tool.position - position).norm() < 3e-6 {
                    seen[number] = true;
                    let off = (tool.attitude.rotation - rotation).amax();
                    assert!(off < 1e-4, "{number}: {off}");
                    let rate = tool.attitude.velocity.norm();
                    let goes_on = number == 1 && tool.velocity.norm() > 0.01;
                    assert!(goes_on == (rate > 1e-3), "{number}: {rate}");
                }
            }
        }
        assert_eq!(seen, [true; 4], "{policy}");
    }
}

/// A job through `poses`.
fn text(poses: &[Written]) -> String {
    let line = |[x, y, z, roll, pitch, yaw]: &Written| {
        format!(
            "  {{ at = [\"{x} mm\", \"{y} mm\", \"{z} mm\"], roll = \"{roll} deg\", \
             pitch = \"{pitch} deg\", yaw = \"{yaw} deg\" }},\n"
        )
    };
    format!("[path]\nposes = [\n{}]\n", poses.iter().map(line).collect::<String>())
}

#[test]
fn points_may_be_joined_by_a_smooth_curve_on_any_machine() {
    let machine = Machine::builtin();
    let points = [[0.0, 0.0], [10.0, 4.0], [20.0, 0.0], [25.0, 10.0], [10.0, 20.0]];
    let written: Vec<String> =
        points.iter().map(|[x, y]| format!("[\"{x} mm\", \"{y} mm\"]")).collect();
    let text = format!("[path]\nsmooth = true\npoints = [{}]\n", written.join(", "));
    let plan = plan(&machine, &read(&text, &machine).unwrap()).unwrap();
    assert_eq!(plan.facts.strokes, 1);
    let home = Vector3::from(machine.home);
    let mut cursor = planner::trajectory::Cursor::default();
    let mut least = [f64::INFINITY; 5];
    for index in 0..=100_000 {
        let time = plan.trajectory.end() * f64::from(index) / 100_000.0;
        if let Some(tool) = plan.trajectory.at(time, &mut cursor).tool() {
            for (least, [x, y]) in least.iter_mut().zip(points) {
                let point = home + Vector3::new(x, y, 0.0) * 1e-3;
                *least = least.min((tool.position - point).norm());
            }
        }
    }
    assert!(least.iter().all(|least| *least < 2e-6), "{least:?}");
    // Poses that turn nothing are points.
    let poses = "[path]\nposes = [{ at = [\"0 mm\", \"0 mm\"] }, { at = [\"9 mm\", \"0 mm\"] }]\n";
    assert!(planner::plan(&machine, &read(poses, &machine).unwrap()).is_ok());
}

#[test]
fn poses_that_cannot_be_are_refused_at_their_line_with_what_would_be_right() {
    let level = "{ at = [\"0 mm\", \"0 mm\"] }";
    let refused = |poses: &str, rest: &str, machine: &Machine| {
        read(&format!("[path]\nposes = [\n  {level},\n  {poses}\n]\n{rest}"), machine).unwrap_err()
    };
    let platform = platform();
    for (poses, due) in [
        (
            "{ at = [\"0 mm\", \"0 mm\"], roll = \"3 deg\" }",
            "points 1 and 2 of the path are at the same place",
        ),
        (
            "{ at = [\"5 mm\", \"0 mm\"], yaw = \"180 deg\" }",
            "turns by 180.0000 deg; at half a turn the direction is not",
        ),
        ("{ at = [\"5 mm\", \"0 mm\"], roll = \"70 deg\" }", "cannot take pose 2"),
        ("{ at = [\"500 mm\", \"0 mm\"] }", "outside the area"),
        ("{ at = [\"5 mm\", \"0 mm\"], roll = \"nan deg\" }", "nan"),
        ("{ at = [\"5 mm\", \"0 mm\"], rol = \"1 deg\" }", "did you mean `roll`?"),
    ] {
        let error = refused(poses, "", &platform);
        assert!(error.contains(due) && error.starts_with("line 4:"), "{error}");
    }
    let leaning = "{ at = [\"5 mm\", \"0 mm\"], roll = \"3 deg\" }";
    let error = refused(leaning, "", &Machine::builtin());
    assert!(error.contains("which the mechanism `corexy` cannot"), "{error}");
    assert!(error.contains("leave roll, pitch and yaw out, or use a machine that can"), "{error}");
    assert!(error.contains("such as tri_planar, mcm or a serial arm"), "{error}");
    let error = refused(leaning, "[attitude]\nroll = \"3 deg\"\n", &platform);
    assert!(error.contains("both say how the tool is turned"), "{error}");
    let single = format!("[path]\nposes = [{level}]\n");
    assert!(read(&single, &platform).unwrap_err().contains("needs at least two poses"));
    let none = read("[path]\nposes = []\n", &platform).unwrap_err();
    assert!(none.starts_with("line 1:") && none.contains("needs at least two poses"), "{none}");
    let none = read("[path]\npoints = []\n", &platform).unwrap_err();
    assert!(none.contains("needs at least two points"), "{none}");
    let both = format!("[path]\npoints = [[\"0 mm\", \"0 mm\"]]\nposes = [{level}, {leaning}]\n");
    assert!(read(&both, &platform).unwrap_err().contains("needs exactly one of"));
}

#[test]
fn a_smooth_curve_that_turns_back_on_itself_is_refused_where_it_does() {
    let points = |points: &[[f64; 2]]| {
        let line = |[x, y]: &[f64; 2]| format!("  [\"{x} mm\", \"{y} mm\"],\n");
        format!("points = [\n{}]\n", points.iter().map(line).collect::<String>())
    };
    let poses = |points: &[[f64; 2]]| {
        let line = |[x, y]: &[f64; 2]| format!("  {{ at = [\"{x} mm\", \"{y} mm\"] }},\n");
        format!("poses = [\n{}]\n", points.iter().map(line).collect::<String>())
    };
    let there_and_back = [[0.0, 0.0], [10.0, 0.0], [0.0, 0.0]];
    let farther_than_back = [[-5.0, 0.0], [0.0, 0.0], [10.0, 0.0], [5.0, 0.0]];
    let machine = Machine::builtin();
    for path in [points(&there_and_back), poses(&there_and_back)] {
        let error = read(&format!("[path]\nsmooth = true\n{path}"), &machine).unwrap_err();
        assert!(error.starts_with("line 5:"), "{error}");
        assert!(error.contains("turns back on itself at point 2"), "{error}");
        assert!(error.contains("leave out `smooth`"), "{error}");
        // With straight lines the tool stops where it turns back.
        let job = read(&format!("[path]\n{path}"), &machine).unwrap();
        assert!(plan(&machine, &job).is_ok(), "{path}");
    }
    for path in [points(&farther_than_back), poses(&farther_than_back)] {
        let error = read(&format!("[path]\nsmooth = true\n{path}"), &machine).unwrap_err();
        assert!(error.starts_with("line 6:"), "{error}");
    }
    // Points that lead round are gone in one go.
    let round = points(&[[0.0, 0.0], [10.0, 0.0], [10.0, 1.0], [0.0, 1.0]]);
    let job = read(&format!("[path]\nsmooth = true\n{round}"), &machine).unwrap();
    assert_eq!(plan(&machine, &job).unwrap().facts.strokes, 1);
}

/// The platform with all legs folded below it, at a height at which more than one pose closes them.
fn folded() -> Machine {
    let text = std::fs::read_to_string(Path::new(ROOT).join("machines/tri_planar.toml")).unwrap();
    let text = text
        .replace("inductor = \"80 mm\"", "inductor = \"40 mm\"\nlegs = [-1, -1, -1]")
        .replace("clearance = \"20 mm\"", "clearance = \"10 mm\"")
        .replace("type_1_margin = 0.15", "type_1_margin = 0.1")
        .replace("type_2_margin = 0.05", "type_2_margin = 0.02")
        .replace("z = [\"70 mm\", \"140 mm\"]", "z = [\"70 mm\", \"160 mm\"]")
        .replace(
            "home = [\"0 mm\", \"0 mm\", \"104 mm\"]",
            "home = [\"0 mm\", \"0 mm\", \"138 mm\"]",
        );
    Machine::parse("folded.toml", &text, &[]).unwrap()
}

#[test]
fn a_machine_whose_assembly_only_its_home_tells_is_planned() {
    let machine = folded();
    let machine::MechanismKind::TriPlanar(mechanism) = &machine.mechanism else { panic!() };
    let home = Joints::<6>::from_fn(|axis, _| machine.home_joints[axis]);
    let unknown = machine::mechanisms::tri_planar::TriPlanar { home: None, ..**mechanism };
    let error = unknown.solve(&home, unknown.branch(), None).unwrap_err();
    assert_eq!(error.code, "ambiguous_assembly");
    let leaning = [
        [-6.0, 0.0, -3.0, 1.0, 0.0, 0.0],
        [0.0, 4.0, 0.0, 0.0, 1.0, 1.0],
        [6.0, 0.0, 2.0, -1.0, 0.0, 0.0],
    ];
    for text in [
        "[path.circle]\nradius = \"5 mm\"\n".to_owned(),
        text(&leaning).replace("[path]", "[path]\nsmooth = true"),
    ] {
        let job = read(&format!("{text}[marking]\nspeed = \"10 mm/s\"\n"), &machine).unwrap();
        let plan = plan(&machine, &job).unwrap_or_else(|error| panic!("{error}"));
        hold_together(&machine, &plan);
    }
}
