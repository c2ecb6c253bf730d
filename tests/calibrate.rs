//! `graver calibrate`: measured poses in, a machine file out that says how the platform is built.

#![allow(clippy::unwrap_used)]

mod support;

use machine::kinematics::Joints;
use machine::{Machine, Mechanism, MechanismKind, Pose};
use messages::random::SplitMix64;
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use support::{Place, assert_valid, number, source};

/// Poses of the shipped platform with these values of its legs and stator, measured to a micrometre.
fn measurements(count: usize) -> String {
    spread_measurements(count, 1.0)
}

/// The same, turned and lifted by this share only.
fn spread_measurements(count: usize, spread: f64) -> String {
    let file = std::fs::read_to_string(source("machines/tri_planar.toml")).unwrap();
    let built = file.replace(
        "side = \"200 mm\"",
        "side = \"200 mm\"\n\
         legs_length = [[\"200.05 mm\", \"199.97 mm\"], [\"200.01 mm\", \"200.04 mm\"], [\"199.95 mm\", \"200 mm\"]]\n\
         base = { position = [\"1 mm\", \"-0.6 mm\", \"0.3 mm\"], roll = \"2 mrad\", pitch = \"-1 mrad\" }",
    );
    let machine = Machine::parse("built.toml", &built, &[]).unwrap();
    let MechanismKind::TriPlanar(mechanism) = machine.mechanism else { panic!() };
    let mut random = SplitMix64::new(5);
    let mut text = "xD,yD,xE,yE,xF,yF,x,y,z,qw,qx,qy,qz\n".to_owned();
    let mut made = 0;
    while made < count {
        let mut even = |half: f64| random.between(-half, half);
        let position = Vector3::new(even(0.06), even(0.06), 0.104 + even(0.02) * spread);
        let [roll, pitch, yaw] = [even(0.25), even(0.25), even(0.4)].map(|turn| turn * spread);
        let rotation = Rotation3::from_euler_angles(roll, pitch, yaw);
        let pose = Pose { position, rotation: rotation.into_inner() };
        let Ok(feet) = mechanism.inverse(&pose, mechanism.branch(), &Joints::zeros()) else {
            continue;
        };
        let place = position + Vector3::from_fn(|_, _| even(1.7e-6));
        let q = UnitQuaternion::from_rotation_matrix(&rotation);
        let all = feet.iter().chain(place.iter()).copied().chain([q.w, q.i, q.j, q.k]);
        text += &all.map(|value| format!("{value:.9}")).collect::<Vec<_>>().join(",");
        text.push('\n');
        made += 1;
    }
    text
}

#[test]
fn the_calibrated_machine_file_is_sound_and_marks_its_sample() {
    let place = Place::new();
    let poses = place.file("poses.csv", &measurements(40));
    let machine = source("machines/tri_planar.toml");
    let out = place.path("calibrated.toml");
    let [poses, machine, out] = [&poses, &machine, &out].map(|path| path.to_str().unwrap());
    let found =
        place.graver(&["calibrate", poses, "--machine", machine, "--out", out, "--json"]).json(0);
    assert_valid("calibrate", &found);
    assert_eq!(found["rank"], 18);
    assert!(number(&found, "/after/rms") < 1.2e-6 && number(&found, "/before/rms") > 1e-4);
    let legs = [0.200_05, 0.199_97, 0.200_01, 0.200_04, 0.199_95, 0.2];
    for (index, leg) in legs.into_iter().enumerate() {
        let found = number(&found, &format!("/numbers/{index}/value"));
        assert!((found - leg).abs() < 5e-6, "{index}: {found}");
    }
    place.graver(&["check", "--machine", out, "--json"]).json(0);
    let marked = place.graver(&["simulate", "--machine", out, "--json"]).json(0);
    assert_eq!(marked["outcome"], "completed");
    assert!(number(&marked, "/marks/error_max") < 5e-6);
    let [before, after] = [machine, out].map(|path| std::fs::read_to_string(path).unwrap());
    for line in before.lines().filter(|line| line.contains('#') && !line.contains("sample")) {
        assert!(after.contains(line), "lost: {line}");
    }
    // The file that it makes explains the measurements as well as it said.
    let again = place.graver(&["calibrate", poses, "--machine", out, "--json"]).json(0);
    assert!((number(&again, "/before/rms") - number(&found, "/after/rms")).abs() < 2e-9);
}

#[test]
fn what_calibrate_cannot_do_it_says() {
    let place = Place::new();
    let machine = source("machines/tri_planar.toml");
    let machine = machine.to_str().unwrap();
    let few = place.file("few.csv", &measurements(2));
    let nan = place.file("nan.csv", &measurements(5).replacen("0.", "nan.", 1));
    let header = place.file("header.csv", &measurements(5).replace("qw,", "w,"));
    for (file, due) in [
        (few.to_str().unwrap(), "2 poses are too few for 18 unknowns: measure 4 at least"),
        (nan.to_str().unwrap(), "nan.csv:2: "),
        (header.to_str().unwrap(), "header.csv:1: no column is called `w`"),
        ("nowhere.csv", "nowhere.csv: cannot be read"),
    ] {
        let ended = place.graver(&["calibrate", file, "--machine", machine]);
        assert_eq!(ended.code, Some(2), "{}", ended.error);
        assert!(ended.error.contains(due), "{}", ended.error);
    }
    let poses = place.file("poses.csv", &measurements(8));
    let poses = poses.to_str().unwrap();
    let ended = place.graver(&["calibrate", poses]);
    assert_eq!(ended.code, Some(2));
    assert!(ended.error.contains("only `tri_planar` is calibrated"), "{}", ended.error);
    let ended = place.graver(&["calibrate", poses, "--machine", machine, "--out", machine]);
    assert_eq!(ended.code, Some(2), "{}", ended.error);
    let ended = place.graver(&["calibrate", poses, "--machine", machine, "--free", "wings"]);
    assert_eq!(ended.code, Some(2), "{}", ended.error);
    let out = place.path("out.toml");
    let out = out.to_str().unwrap();
    let set = ["--set", "machine.path.jerk=400 m/s^3"];
    let ended =
        place.graver(&["calibrate", poses, "--machine", machine, "--out", out, set[0], set[1]]);
    assert_eq!(ended.code, Some(2), "{}", ended.error);
    assert!(
        ended.error.contains(
            "--out does not write the changes that --set makes to the machine: change the machine file instead"
        ),
        "{}",
        ended.error
    );
}

#[test]
fn measurements_that_do_not_fit_write_no_machine_file() {
    let place = Place::new();
    // The quaternions from the machine's frame to the tool, and not back.
    let mut conjugated = String::new();
    for (number, line) in measurements(40).lines().enumerate() {
        let cells = line.split(',').enumerate().map(|(column, cell)| {
            if number > 0 && column > 9 {
                (-cell.parse::<f64>().unwrap()).to_string()
            } else {
                cell.to_owned()
            }
        });
        conjugated += &cells.collect::<Vec<_>>().join(",");
        conjugated.push('\n');
    }
    let poses = place.file("conjugated.csv", &conjugated);
    let machine = source("machines/tri_planar.toml");
    let out = place.path("calibrated.toml");
    let [poses, machine, path] = [&poses, &machine, &out].map(|path| path.to_str().unwrap());
    let ended = place.graver(&["calibrate", poses, "--machine", machine, "--out", path]);
    assert_eq!(ended.code, Some(2), "{}", ended.error);
    for due in
        ["conjugated.csv: the poses do not fit this machine", "mm rms", "in line ", "quaternion"]
    {
        assert!(ended.error.contains(due), "{}", ended.error);
    }
    assert!(!out.exists());
}

#[test]
fn open_combinations_are_said_with_what_to_measure() {
    let place = Place::new();
    let poses = place.file("level.csv", &spread_measurements(30, 0.0));
    let machine = source("machines/tri_planar.toml");
    let [poses, machine] = [&poses, &machine].map(|path| path.to_str().unwrap());
    let ended = place.graver(&["calibrate", poses, "--machine", machine]);
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    for due in [
        "of 18 numbers are determined\n",
        "\nopen      ",
        ": these poses do not determine it; the file's values are kept\n",
        "\n          measure poses at other heights and other angles to determine it\n",
        "(not determined by these poses)",
    ] {
        assert!(ended.error.contains(due), "{due}: {}", ended.error);
    }
}
