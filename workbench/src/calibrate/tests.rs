#![allow(clippy::unwrap_used)]

mod frames;

use super::*;
use machine::mechanisms::tri_planar::{Mounting, TriPlanar};
use machine::{Mechanism, Pose};
use messages::random::SplitMix64;
use nalgebra::{Rotation3, UnitQuaternion, Vector3};

const FILE: &str = include_str!("../../../machines/tri_planar.toml");

const ALL: [Part; 3] = [Part::Legs, Part::Base, Part::Tool];

fn machine() -> Machine {
    Machine::parse("tri_planar.toml", FILE, &[]).unwrap()
}

fn platform(machine: &Machine) -> TriPlanar {
    let MechanismKind::TriPlanar(mechanism) = &machine.mechanism else { panic!() };
    **mechanism
}

fn frame(position: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Pose {
    Pose {
        position: position.into(),
        rotation: Rotation3::from_euler_angles(roll, pitch, yaw).into_inner(),
    }
}

/// A machine as it was built: legs off by up to 50 µm, the stator by 1 mm and 2 mrad, a tool.
fn built() -> TriPlanar {
    let drawn = platform(&machine());
    let off = [[50e-6, -31e-6], [12e-6, 44e-6], [-50e-6, 8e-6]];
    TriPlanar {
        struts: off.map(|pair| pair.map(|off| drawn.side + off)),
        mounting: Some(Mounting {
            base: frame([1e-3, -0.6e-3, 0.3e-3], [2e-3, -1e-3, 1.5e-3]),
            tool: frame([0.2e-3, -0.1e-3, 0.4e-3], [1e-3, 2e-3, -1e-3]),
        }),
        ..drawn
    }
}

/// Poses of the machine as built, each number of the place with a deviation of `noise` [m] and each turn
/// of five times that per metre; `spread` says how far they are turned [rad] and apart in height [m].
fn measured(count: usize, noise: f64, spread: [f64; 2], seed: u64) -> Vec<Measurement> {
    let built = built();
    let mut random = SplitMix64::new(seed);
    let mut even = |half: f64| random.between(-half, half);
    let mut found = Vec::new();
    while found.len() < count {
        let [tilt, height] = spread;
        let pose = frame(
            [even(0.06), even(0.06), 0.104 + even(height)],
            [even(tilt), even(tilt), even(2.0 * tilt)],
        );
        let mut normal = || (0..12).map(|_| even(0.5)).sum::<f64>();
        let (shift, turn) = (Vector3::from_fn(|_, _| normal()), Vector3::from_fn(|_, _| normal()));
        let Ok(feet) = built.inverse(&pose, built.branch(), &machine::kinematics::Joints::zeros())
        else {
            continue;
        };
        let pose = Pose {
            position: pose.position + shift * noise,
            rotation: Rotation3::new(turn * (5.0 * noise)).into_inner() * pose.rotation,
        };
        found.push(Measurement { line: found.len() + 2, feet, pose });
    }
    found
}

/// The identified numbers beside those of the machine as built.
fn beside(report: &CalibrationReport) -> Vec<(Identified, f64)> {
    let (built, drawn) = (built(), platform(&machine()));
    let Mounting { base, tool } = built.mounting.unwrap();
    let six = |pose: &Pose| {
        let (roll, pitch, yaw) = Rotation3::from_matrix_unchecked(pose.rotation).euler_angles();
        [pose.position.x, pose.position.y, pose.position.z, roll, pitch, yaw]
    };
    assert_eq!(drawn.mounting, None);
    let all = built.struts.into_iter().flatten().chain(six(&base)).chain(six(&tool));
    report.numbers.iter().cloned().zip(all).collect()
}

#[test]
fn exact_poses_give_the_lengths_and_the_mounting_exactly() {
    let measurements = measured(20, 0.0, [0.25, 0.025], 1);
    let report = calibrate(&machine(), "poses.csv", &measurements, &ALL).unwrap();
    assert_eq!((report.rank, report.unknowns), (18, 18));
    assert!(report.before.rms > 1e-4 && report.after.max < 1e-12, "{report:?}");
    for (number, wanted) in beside(&report) {
        assert!((number.value - wanted).abs() < 1e-9, "{number:?} {wanted}");
    }
}

#[test]
fn noisy_poses_give_the_lengths_within_what_the_report_says_of_them() {
    let mut off = 0.0_f64;
    for seed in 1..=20 {
        let measurements = measured(40, 1e-6, [0.25, 0.025], seed);
        let report = calibrate(&machine(), "poses.csv", &measurements, &ALL).unwrap();
        // The noise of place and of turn at a corner, along a strut, less what 18 numbers take up.
        let expected = 1e-6 * (1.0 + 25.0 * 0.2 * 0.2 / 3.0 * 0.5_f64).sqrt();
        let rms = report.after.rms / ((240.0 - 18.0) / 240.0_f64).sqrt();
        assert!((rms / expected - 1.0).abs() < 0.25, "{rms} {expected}");
        for (number, wanted) in beside(&report) {
            let error = (number.value - wanted).abs();
            let deviation = number.deviation.unwrap();
            assert!(error < 5.0 * deviation, "{number:?} {wanted}");
            off = off.max(error / deviation);
            if number.name.starts_with("leg") {
                assert!(error < 6e-6, "{number:?} {wanted}");
            }
        }
        assert!(report.before.rms > 50.0 * report.after.rms);
    }
    assert!(off > 1.0, "the deviations say too much: {off}");
}

#[test]
fn with_a_known_tool_the_lengths_come_out_within_two_micrometres() {
    let known = built().mounting.unwrap().tool;
    let mut machine = machine();
    let mechanism = platform(&machine);
    let mounting = Mounting { base: frame([0.0; 3], [0.0; 3]), tool: known };
    machine.mechanism =
        MechanismKind::TriPlanar(Box::new(TriPlanar { mounting: Some(mounting), ..mechanism }));
    for seed in 1..=5 {
        let measurements = measured(40, 1e-6, [0.25, 0.025], 100 + seed);
        let free = [Part::Legs, Part::Base];
        let report = calibrate(&machine, "poses.csv", &measurements, &free).unwrap();
        for (number, wanted) in beside(&report).into_iter().take(6) {
            assert!((number.value - wanted).abs() < 2e-6, "{number:?} {wanted}");
        }
    }
}

#[test]
fn directions_that_the_poses_do_not_determine_are_named_and_stay_as_they_were() {
    // Level at one height: turns of the tool about z and of the stator about z go together only with more.
    let measurements = measured(30, 0.0, [0.0, 0.0], 3);
    let report = calibrate(&machine(), "poses.csv", &measurements, &ALL).unwrap();
    assert!(report.rank < 18 && report.open.len() == 18 - report.rank, "{report:?}");
    assert!(report.after.max < 1e-9, "{report:?}");
    let named: Vec<&str> = report.open.iter().flatten().map(|share| share.name).collect();
    assert!(named.contains(&"base z") && named.contains(&"tool z"), "{named:?}");
    let is_open = |name: &str| {
        report.numbers.iter().find(|number| number.name == name).unwrap().deviation.is_none()
    };
    assert!(is_open("base z") && is_open("tool z"));
    for direction in &report.open {
        let square: f64 = direction.iter().map(|share| share.part * share.part).sum();
        assert!((0.5..=1.0 + 1e-9).contains(&square), "{direction:?}");
    }
}

#[test]
fn noise_does_not_pass_for_a_spread_of_the_poses() {
    let exact = calibrate(&machine(), "poses.csv", &measured(30, 0.0, [0.0, 0.0], 3), &ALL);
    let rank = exact.unwrap().rank;
    for noise in [1e-6, 5e-6] {
        let measurements = measured(30, noise, [0.0, 0.0], 3);
        let report = calibrate(&machine(), "poses.csv", &measurements, &ALL).unwrap();
        assert!(report.rank <= rank && report.open.len() == 18 - report.rank, "{report:?}");
        assert!(report.after.rms < 2.0 * noise, "{report:?}");
        // Along what is open nothing goes astray.
        for number in report.numbers.iter().filter(|number| number.deviation.is_none()) {
            assert!(number.change().abs() < 5e-3, "{number:?}");
        }
    }
}

#[test]
fn the_machine_file_with_what_was_found_keeps_its_comments_and_measures_the_same() {
    let measurements = measured(40, 1e-6, [0.25, 0.025], 7);
    let report = calibrate(&machine(), "poses.csv", &measurements, &ALL).unwrap();
    let mut text = write::machine_file(FILE, &report, &ALL).unwrap();
    for _ in 0..2 {
        let lines: Vec<&str> = text.lines().collect();
        for line in FILE.lines() {
            assert!(lines.contains(&line), "{line}");
        }
        let calibrated = Machine::parse("new.toml", &text, &[]).unwrap();
        let again = calibrate(&calibrated, "poses.csv", &measurements, &ALL).unwrap();
        assert!((again.before.rms - report.after.rms).abs() < 2e-9, "{again:?}");
        // Written over once more, nothing is there twice.
        text = write::machine_file(&text, &again, &ALL).unwrap();
    }
    assert_eq!(text.matches("legs_length").count(), 1);
    assert_eq!(text.matches("base = {").count(), 1);
    let tables = format!("{FILE}\n[mechanism.tri_planar.base]\nroll = \"1 mrad\" # as hung\n");
    let text = write::machine_file(&tables, &report, &ALL).unwrap();
    assert!(text.contains("# as hung") && !text.contains("base = {"), "{text}");
    assert!(Machine::parse("new.toml", &text, &[]).is_ok());
}

/// A file of measurements.
fn written(measurements: &[Measurement]) -> String {
    let mut text = "# feet and tool\nxD,yD,xE,yE,xF,yF,x,y,z,qw,qx,qy,qz\n".to_owned();
    for Measurement { feet, pose, .. } in measurements {
        let turned = Rotation3::from_matrix_unchecked(pose.rotation);
        let q = UnitQuaternion::from_rotation_matrix(&turned);
        let place = pose.position;
        let all = feet.iter().chain(place.iter()).copied().chain([q.w, q.i, q.j, q.k]);
        text += &all.map(|value| format!("{value:.12}")).collect::<Vec<_>>().join(",");
        text.push('\n');
    }
    text
}

#[test]
fn measurements_are_read_as_they_were_written() {
    let measurements = measured(5, 1e-6, [0.25, 0.02], 9);
    let found = read("poses.csv", &written(&measurements)).unwrap();
    for (found, wanted) in found.iter().zip(&measurements) {
        assert!((found.feet - wanted.feet).amax() < 1e-11);
        assert!((found.pose.position - wanted.pose.position).amax() < 1e-11);
        assert!((found.pose.rotation - wanted.pose.rotation).amax() < 1e-10);
    }
    assert_eq!(found.iter().map(|found| found.line).collect::<Vec<_>>(), [3, 4, 5, 6, 7]);
    // The columns may stand in any order.
    let text = "qw,qx,qy,qz,x,y,z,xD,yD,xE,yE,xF,yF\n1,0,0,0,1,2,3,4,5,6,7,8,9\n";
    let found = read("poses.csv", text).unwrap()[0];
    assert_eq!(found.feet.as_slice(), [4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
    assert_eq!(found.pose, Pose::at(Vector3::new(1.0, 2.0, 3.0)));
}

#[test]
fn what_cannot_be_measurements_is_refused_with_line_value_and_what_would_be_right() {
    let good = written(&measured(4, 0.0, [0.25, 0.02], 9));
    let header = "xD,yD,xE,yE,xF,yF,x,y,z,qw,qx,qy,qz";
    let refused = |text: &str, free: &[Part]| {
        let machine = machine();
        let found = read("poses.csv", text)
            .and_then(|found| calibrate(&machine, "poses.csv", &found, free).map(|_| ()));
        found.unwrap_err().to_string()
    };
    let strange = format!("{header}\n0,0,0,0,0,0,0,0,104,1,0,0,0\n");
    let error = refused(&strange, &[Part::Legs]);
    assert!(error.contains("poses.csv:2: a leg would be 104"), "{error}");
    for (text, due) in [
        (String::new(), "poses.csv:1: there is no header"),
        (good.replace("xD,", "x_D,"), "poses.csv:2: no column is called `x_D`"),
        (good.replace(",qz\n", "\n"), "poses.csv:2: `qz` is missing"),
        (good.replace("yD", "xD"), "poses.csv:2: `xD` stands there twice"),
        (format!("{header}\n1,2\n"), "poses.csv:2: 2 numbers, and the header has 13"),
        (
            format!("{header}\n0,0,0,0,0,0,0,0,0,nan,0,0,0\n"),
            "qw is `nan`, and must be a finite number",
        ),
        (format!("{header}\n0,0,0,0,0,0,0,0,0,one,0,0,0\n"), "qw is `one`"),
        (format!("{header}\n0,0,0,0,0,0,0,0,0,0.5,0,0,0\n"), "have the length 0.500000"),
        (
            good.lines().take(5).collect::<Vec<_>>().join("\n"),
            "3 poses are too few for 18 unknowns: measure 4",
        ),
        (format!("{header}\n"), "0 poses are too few"),
    ] {
        let error = refused(&text, &ALL);
        assert!(error.contains(due), "{error} for {due}");
    }
    let builtin = Machine::builtin();
    let error = calibrate(&builtin, "poses.csv", &measured(9, 0.0, [0.2, 0.02], 1), &ALL);
    assert!(error.unwrap_err().to_string().contains("mechanism `corexy`"));
}
