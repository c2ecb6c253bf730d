//! `graver kinematics`, line by line, against the golden vectors.

#![allow(clippy::unwrap_used)]

mod dynamics;
#[path = "../support/mod.rs"]
mod support;

use std::fs::File;
use std::path::Path;

use machine::kinematics::Joints;
use machine::mechanisms::tri_planar::{Fold, Legs, TriPlanarBranch};
use machine::{Machine, Mechanism, MechanismKind, Pose};
use messages::random::SplitMix64;
use nalgebra::{Rotation3, Vector3};
use serde_json::{Value, json};
use support::{Ended, Place, assert_valid, golden, number};

const MACHINES: [&str; 2] = ["cartesian", "corexy"];

/// The shipped machines, with their axes.
const ALL: [(&str, u64); 10] = [
    ("cartesian", 2),
    ("cartesian_steppers", 2),
    ("corexy", 2),
    ("five_bar", 2),
    ("prrrp", 2),
    ("polar", 3),
    ("tri_planar", 6),
    ("mcm", 5),
    ("twin_actuator", 2),
    ("serial", 3),
];

/// The golden vectors are exact to rounding.
const TOLERANCE: f64 = 1e-9;

/// Runs a verb on these lines of input.
fn kinematics(
    place: &Place,
    machine: &Path,
    motor: bool,
    verb: &str,
    input: impl AsRef<[u8]>,
) -> Ended {
    let more: &[&str] = if motor { &["--motor"] } else { &[] };
    kinematics_with(place, machine, more, verb, input)
}

/// Runs a verb on these lines of input, with more arguments.
fn kinematics_with(
    place: &Place,
    machine: &Path,
    more: &[&str],
    verb: &str,
    input: impl AsRef<[u8]>,
) -> Ended {
    let path = place.path(&format!("{verb}.jsonl"));
    std::fs::write(&path, input).unwrap();
    let input = path;
    let (output, error) = (place.path("output"), place.path("error"));
    let mut arguments = vec!["kinematics", "--machine", machine.to_str().unwrap()];
    arguments.extend(more);
    arguments.push(verb);
    let status = place
        .command(&arguments)
        .stdin(File::open(input).unwrap())
        .stdout(File::create(&output).unwrap())
        .stderr(File::create(&error).unwrap())
        .status()
        .unwrap();
    let ended = Ended {
        code: status.code(),
        output: std::fs::read_to_string(output).unwrap(),
        error: std::fs::read_to_string(error).unwrap(),
    };
    assert!(!ended.error.contains("panicked"), "{}", ended.error);
    ended
}

/// Inertia of a rotor in the machine files [kg·m²]; the golden vectors leave it out.
const ROTOR_INERTIA: f64 = 2e-6;

/// The machine of the golden vectors: the machine file's, but without the inertia of the screws.
fn without_screws(place: &Place, name: &str) -> std::path::PathBuf {
    let path = support::source("machines").join(format!("{name}.toml"));
    let text = std::fs::read_to_string(path).unwrap();
    assert_eq!(text.matches("rotor_inertia = \"2e-6 kg m^2\"").count(), 2, "{name}");
    let kept = text.lines().filter(|line| !line.starts_with("inertia ="));
    place.file(&format!("{name}.toml"), &kept.map(|line| format!("{line}\n")).collect::<String>())
}

fn replies(ended: &Ended) -> Vec<Value> {
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    let lines: Vec<Value> =
        ended.output.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    lines.iter().for_each(|line| assert_valid("kinematics", line));
    lines
}

/// What `dynamics` is asked of a golden motion without losses.
fn lossless_motion(pose: &Value) -> Value {
    json!({ "q": pose["q"], "qd": pose["qd"], "qdd": pose["qdd"], "friction": false })
}

/// The replies of a verb to one request for each golden pose.
fn ask(
    place: &Place,
    machine: &Path,
    verb: &str,
    poses: &[Value],
    request: impl Fn(&Value) -> Value,
) -> Vec<Value> {
    let input: String = poses.iter().map(|pose| request(pose).to_string() + "\n").collect();
    let replies = replies(&kinematics(place, machine, true, verb, &input));
    assert_eq!(replies.len(), poses.len());
    replies
}

/// Asserts that two values agree, number by number, relative to the largest of them.
fn assert_close(found: &Value, expected: &Value, what: &str) {
    fn numbers(value: &Value) -> Vec<f64> {
        match value {
            Value::Array(values) => values.iter().flat_map(numbers).collect(),
            value => vec![value.as_f64().unwrap_or_else(|| panic!("{value}"))],
        }
    }
    let (found, expected) = (numbers(found), numbers(expected));
    assert_eq!(found.len(), expected.len(), "{what}");
    let scale = expected.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    for (a, b) in found.iter().zip(&expected) {
        assert!((a - b).abs() <= TOLERANCE * scale, "{what}: {found:?}, not {expected:?}");
    }
}

#[test]
fn every_verb_gives_the_golden_vectors_in_motor_angles() {
    for name in MACHINES {
        let place = Place::new();
        let machine = without_screws(&place, name);
        let golden = golden(name);
        let poses = golden["poses"].as_array().unwrap();
        let joints = |pose: &Value| json!({ "q": pose["q"] });

        let forward = ask(&place, &machine, "forward", poses, joints);
        let inverse = ask(
            &place,
            &machine,
            "inverse",
            poses,
            |pose| json!({ "pose": { "position": pose["x"] }, "branch": {} }),
        );
        let jacobian = ask(&place, &machine, "jacobian", poses, joints);
        let dynamics = ask(&place, &machine, "dynamics", poses, lossless_motion);
        let ellipse = ask(&place, &machine, "ellipse", poses, joints);
        for (index, pose) in poses.iter().enumerate() {
            let what = |verb: &str| format!("{name}, pose {index}, {verb}");
            assert_close(&forward[index]["pose"]["position"], &pose["x"], &what("forward"));
            assert_close(&inverse[index]["q"], &pose["q"], &what("inverse"));
            for margin in inverse[index]["margin"].as_object().unwrap().values() {
                assert!(margin.as_f64().unwrap() >= 0.0, "{}", what("margin"));
            }
            assert_close(&jacobian[index]["j"], &pose["J"], &what("jacobian"));
            assert_close(&jacobian[index]["det"], &pose["det_J"], &what("determinant"));
            let singular = &jacobian[index]["singular_values"];
            assert_close(singular, &pose["singular_values"], &what("singular values"));
            let effort: Vec<f64> = [0, 1]
                .map(|axis| {
                    number(pose, &format!("/tau/{axis}"))
                        + ROTOR_INERTIA * number(pose, &format!("/qdd/{axis}"))
                })
                .into();
            assert_close(&dynamics[index]["effort"], &json!(effort), &what("dynamics"));
            // The velocity ellipse has the singular values as semi-axes, the force ellipse their
            // inverses: source 003 eq. 5.13 and 5.14.
            let velocity = &ellipse[index]["velocity"];
            assert_close(&velocity["axes"], &pose["singular_values"], &what("velocity ellipse"));
            let inverses: Vec<f64> =
                [1, 0].map(|place| 1.0 / pose["singular_values"][place].as_f64().unwrap()).into();
            let force = &ellipse[index]["force"];
            assert_close(&force["axes"], &json!(inverses), &what("force ellipse"));
        }
    }
}

/// A machine file with the dimensions of the golden vectors.
struct Golden {
    name: &'static str,
    arguments: Vec<String>,
    place: Place,
}

impl Golden {
    fn new(name: &'static str, changes: &[String]) -> Self {
        let set = |change: &String| ["--set".to_owned(), format!("machine.{change}")];
        let arguments = changes.iter().flat_map(set).collect();
        Self { name, arguments, place: Place::new() }
    }

    fn in_motor_angles(mut self) -> Self {
        self.arguments.push("--motor".to_owned());
        self
    }

    fn ask(&self, verb: &str, cases: &[Value], request: impl Fn(&Value) -> Value) -> Vec<Value> {
        let input: String = cases.iter().map(|case| request(case).to_string() + "\n").collect();
        let machine = support::source("machines").join(format!("{}.toml", self.name));
        let more: Vec<&str> = self.arguments.iter().map(String::as_str).collect();
        let replies = replies(&kinematics_with(&self.place, &machine, &more, verb, &input));
        assert_eq!(replies.len(), cases.len());
        replies
    }

    /// Asserts what each case expects, by pointers into the reply and into the case.
    fn check(
        &self,
        verb: &str,
        cases: &[Value],
        request: impl Fn(&Value) -> Value,
        expected: &[(&str, &str)],
    ) {
        for (index, (reply, case)) in self.ask(verb, cases, request).iter().zip(cases).enumerate() {
            for (found, wanted) in expected {
                let what = format!("{} {verb} {index} {found}: {reply}", self.name);
                let found = reply.pointer(found).unwrap_or_else(|| panic!("{what}"));
                assert_close(found, case.pointer(wanted).unwrap(), &what);
            }
        }
    }

    /// Asserts that a pose is refused with the golden code; a limit names its axis and both
    /// numbers.
    fn refuses(&self, case: &Value, request: &Value) {
        let reply = &self.ask("inverse", std::slice::from_ref(request), Value::clone)[0];
        let code = case["expect"].as_str().unwrap();
        assert_eq!(reply["error"]["code"], code, "{case}: {reply}");
        let (value, limit) = (number(reply, "/error/value"), number(reply, "/error/limit"));
        assert!(value != limit, "{reply}");
        if let Some(axis) = code.strip_prefix("limit_") {
            assert_eq!(reply["error"]["axis"], axis, "{reply}");
        }
    }
}

fn cases<'a>(golden: &'a Value, key: &str) -> &'a [Value] {
    golden[key].as_array().unwrap()
}

/// The linkages of source 003: what their golden files have in common.
#[test]
fn the_linkages_give_their_golden_vectors() {
    let rail = ["-600 mm", "600 mm"].map(|end| format!("\"{end}\"")).join(", ");
    let wide = ["p1", "p2"].map(|axis| format!("axis.{axis}.limits.position=[{rail}]"));
    let machines = [
        (Golden::new("five_bar", &[]), 0.0),
        (Golden::new("prrrp", &wide).in_motor_angles(), ROTOR_INERTIA),
    ];
    for (machine, rotor) in machines {
        let golden = golden(machine.name);
        let mut poses = cases(&golden, "poses").to_vec();
        for pose in &mut poses {
            // Motor angles count the rotors too, which the golden vectors leave out.
            let effort = [0, 1].map(|axis| {
                number(pose, &format!("/tau/{axis}"))
                    + rotor * number(pose, &format!("/qdd/{axis}"))
            });
            pose["tau"] = json!(effort);
        }
        let joints = |pose: &Value| json!({ "q": pose["q"] });
        let place = |pose: &Value| json!({ "pose": { "position": pose["x"] } });
        machine.check("inverse", &poses, place, &[("/q", "/q")]);
        machine.check("forward", &poses, joints, &[("/pose/position", "/x")]);
        let matrix = [("/j", "/J"), ("/det", "/det_J"), ("/singular_values", "/singular_values")];
        machine.check("jacobian", &poses, joints, &matrix);
        machine.check("dynamics", &poses, lossless_motion, &[("/effort", "/tau")]);
        machine.check("ellipse", &poses, joints, &[("/velocity/axes", "/singular_values")]);
        for (reply, pose) in machine.ask("ellipse", &poses, joints).iter().zip(&poses) {
            let turned = number(reply, "/velocity/angle") - number(pose, "/manip_major_axis_angle");
            // A line has no sense.
            let halves = turned / core::f64::consts::PI;
            assert!((halves - halves.round()).abs() < TOLERANCE, "{}: {turned}", machine.name);
        }
    }
}

#[test]
fn every_mode_of_the_five_bar_gives_its_golden_vector() {
    let golden = golden("five_bar");
    let wide = ["th1", "th2"].map(|axis| format!("axis.{axis}.limits.position=unlimited"));
    let machine = Golden::new("five_bar", &wide);
    for mode in cases(&golden["modes_at"], "modes") {
        let signs: Vec<i32> =
            cases(mode, "working_mode").iter().map(|sign| sign.as_f64().unwrap() as i32).collect();
        let assembly = mode["reproduced_by_assembly"].as_f64().unwrap() as i32;
        let request = |assembly: i32| {
            json!({
                "pose": { "position": golden["modes_at"]["x"] },
                "branch": { "working_mode": signs, "assembly_mode": assembly },
            })
        };
        machine.check(
            "inverse",
            std::slice::from_ref(mode),
            |_| request(assembly),
            &[("/q", "/q")],
        );
        machine.refuses(&json!({ "expect": "wrong_assembly_mode" }), &request(-assembly));
    }
}

#[test]
fn the_polar_machine_gives_its_golden_vectors() {
    let golden = golden("polar");
    let inverse = |case: &Value| {
        json!({
            "pose": { "position": case["input"]["p"] },
            "branch": { "side": case["input"]["branch"] },
            "previous": [0, case["input"]["prev_th2"], 0],
        })
    };
    let joints = |case: &Value| json!({ "q": case["output"]["q"] });
    let reference = Golden::new("polar", &[]);
    // With the arm longer than the table is far, the centre is out of reach.
    let blind = Golden::new(
        "polar",
        &[
            "mechanism.polar.center_distance=240 mm".to_owned(),
            "axis.th1.limits.position=[\"-0.7 rad\", \"0.7 rad\"]".to_owned(),
            "axis.th2.limits.position=[\"-2 rev\", \"2 rev\"]".to_owned(),
        ],
    );
    for (machine, key) in [(&reference, "cases"), (&blind, "cases_b")] {
        let cases = cases(&golden, key);
        machine.check("inverse", cases, inverse, &[("/q", "/output/q")]);
        machine.check("forward", cases, joints, &[("/pose/position", "/output/fk")]);
        machine.check("jacobian", cases, joints, &[("/j", "/output/jacobian")]);
    }
    for case in cases(&golden, "failing") {
        assert_eq!(case["params"], "params");
        reference.refuses(case, &inverse(case));
    }
    // Each line stays near the line before it, here to the other side of the centre.
    let crossing = |knot: &Value| {
        let mut request = json!({ "pose": { "position": [knot["x"], knot["y"], 0.05] } });
        if number(knot, "/x") == -0.05 {
            request["previous"] = json!([-0.2, 1.47, 0.05]);
        }
        request
    };
    let knots = cases(&golden, "center_crossing");
    reference.check("inverse", knots, crossing, &[("/q", "/q"), ("/branch/side", "/branch")]);
}

#[test]
fn the_mcm_gives_its_golden_vectors() {
    let golden = golden("mcm");
    let machine = Golden::new("mcm", &[]);
    let joints = |case: &Value| json!({ "q": case["output"]["q"] });
    // The tool's attitude in the angles of the machine, or as the direction of the beam.
    let inverse = |case: &Value| {
        let input = &case["input"];
        let mut pose = json!({ "position": input["p"] });
        for key in ["a", "r"].into_iter().filter(|key| input.get(*key).is_some()) {
            pose[key] = input[key].clone();
        }
        if let Some(axis) = input.get("tool_axis") {
            pose["axis"] = axis.clone();
        }
        let side = input.get("sign").or(input.get("sign_X")).cloned().unwrap_or(json!(1));
        let turned = input.get("prev_d").cloned().unwrap_or(json!(0));
        let previous = input.get("prev_q").cloned().unwrap_or(json!([0.3, 0, turned, 0, 0]));
        json!({ "pose": pose, "branch": { "side": side }, "previous": previous })
    };
    for (key, place, axis) in [
        ("cases_ik_ar", "/input/p", "/output/tool_axis_workpiece"),
        ("cases_ik_dir", "/output/fk_p", "/output/fk_t"),
    ] {
        let cases = cases(&golden, key);
        machine.check("inverse", cases, inverse, &[("/q", "/output/q")]);
        let pose = [("/pose/position", place), ("/pose/axis", axis)];
        machine.check("forward", cases, joints, &pose);
        machine.check("jacobian", cases, joints, &[("/j", "/output/jacobian")]);
    }
    for case in cases(&golden, "failing").iter().filter(|case| case["kind"] != "cone") {
        machine.refuses(case, &inverse(case));
    }
}

/// Rz(yaw)·Ry(pitch)·Rx(roll), row by row.
fn rotation(angles: &Value) -> Value {
    let [(sr, cr), (sp, cp), (sy, cy)] =
        [0, 1, 2].map(|index| messages::math::sin_cos(number(angles, &format!("/{index}"))));
    json!([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ])
}

/// The product of two square matrices, row by row.
fn product(one: &Value, other: &Value) -> Value {
    let size = one.as_array().unwrap().len();
    let entry = |row: usize, column: usize| -> f64 {
        (0..size)
            .map(|index| {
                number(one, &format!("/{row}/{index}"))
                    * number(other, &format!("/{index}/{column}"))
            })
            .sum()
    };
    let row = |row| (0..size).map(|column| entry(row, column)).collect::<Vec<_>>();
    json!((0..size).map(row).collect::<Vec<_>>())
}

#[test]
fn the_tri_planar_platform_gives_its_golden_vectors() {
    let golden = golden("tri_planar");
    let machine = Golden::new("tri_planar", &[]);
    let legs = |case: &Value| json!({ "legs": case["input"]["modes"] });
    let joints = |case: &Value| json!({ "q": case["output"]["motors"], "branch": legs(case) });
    let inverse = |case: &Value| {
        let input = &case["input"];
        let pose = json!({ "position": input["t"], "rotation": rotation(&input["rpy"]) });
        json!({ "pose": pose, "branch": legs(case) })
    };
    for key in ["cases", "cases_inward"] {
        let cases = cases(&golden, key);
        machine.check("inverse", cases, inverse, &[("/q", "/output/motors")]);
        let identity: Vec<Vec<f64>> = (0..6)
            .map(|row| (0..6).map(|column| f64::from(u8::from(row == column))).collect())
            .collect();
        for (reply, case) in machine.ask("jacobian", cases, joints).iter().zip(cases) {
            let product = product(&reply["j"], &case["output"]["jinv"]);
            assert_close(&product, &json!(identity), "the golden matrix is the inverse");
        }
        // Each on its own, because poses that lie far apart give no start for each other.
        for case in cases {
            let pose = [("/pose/position", "/input/t"), ("/pose/rotation", "/input/R")];
            machine.check("forward", core::slice::from_ref(case), joints, &pose);
        }
    }
    let path = |knot: &Value| json!({ "pose": { "position": knot["t"], "rotation": rotation(&knot["rpy"]) } });
    machine.check("inverse", cases(&golden, "trajectory"), path, &[("/q", "/motors")]);
    for case in cases(&golden, "failing") {
        let changes: Vec<String> = case["override"]
            .as_object()
            .unwrap()
            .iter()
            .map(|(key, value)| format!("mechanism.tri_planar.{key}={value} m"))
            .collect();
        Golden::new("tri_planar", &changes).refuses(case, &inverse(case));
    }
}

#[test]
fn the_twin_actuator_gives_its_golden_vectors() {
    let golden = golden("twin_actuator");
    let machine = Golden::new("twin_actuator", &[]);
    let inverse = |case: &Value| json!({ "pose": { "position": case["input"]["P"] } });
    let joints = |case: &Value| json!({ "q": case["output"]["L_total"] });
    let poses = cases(&golden, "cases");
    machine.check("inverse", poses, inverse, &[("/q", "/output/L_total")]);
    machine.check("forward", poses, joints, &[("/pose/position", "/output/fk_P")]);
    let matrix = [("/j", "/output/jacobian"), ("/det", "/output/det")];
    machine.check("jacobian", poses, joints, &matrix);
    // The product of the semi-axes is the determinant.
    for (reply, case) in machine.ask("ellipse", poses, joints).iter().zip(poses) {
        let area = number(reply, "/velocity/axes/0") * number(reply, "/velocity/axes/1");
        assert_close(&json!(area), &json!(number(case, "/output/det").abs()), "ellipse");
    }
    for case in cases(&golden, "failing").iter().filter(|case| case["kind"] == "ik") {
        machine.refuses(case, &inverse(case));
    }
}

#[test]
fn joint_coordinates_differ_from_motor_angles_by_the_ratio() {
    let place = Place::new();
    let machine = support::source("machines/cartesian.toml");
    let input = "{\"q\": [0.05, 0.15]}\n";
    let reply = &replies(&kinematics(&place, &machine, false, "forward", input))[0];
    assert_close(&reply["pose"]["position"], &json!([0.05, 0.15]), "cartesian joints");
}

/// Machines whose frame is mirrored, skew and scaled, turned and off by a mesh, and whose axis turns.
#[test]
fn a_place_and_its_joints_are_the_same_both_ways() {
    let place = Place::new();
    for (file, from, to) in [
        ("diode_corexy", [0.0, 0.0, 0.0], [0.3, 0.2, 0.0]),
        ("gantry", [0.0, 0.0, -0.01], [0.6, 0.4, 0.04]),
        ("rotary", [0.0, 0.0, -0.005], [0.2, 0.188, 0.04]),
        ("galvo", [-0.085, -0.085, 0.0], [0.085, 0.085, 0.0]),
    ] {
        let machine = support::source(&format!("machines/{file}.toml"));
        let places: Vec<[f64; 3]> = (0..64)
            .map(|index| {
                let share =
                    [index % 4, index / 4 % 4, index / 16].map(|step| f64::from(step) / 3.0);
                core::array::from_fn(|row| from[row] + (to[row] - from[row]) * share[row])
            })
            .collect();
        let pose = |place: &[f64; 3]| json!({"pose": {"position": place}}).to_string() + "\n";
        let input: String = places.iter().map(pose).collect();
        let joints = replies(&kinematics(&place, &machine, false, "inverse", input.as_str()));
        let back = |reply: &Value| json!({"q": reply["q"]}).to_string() + "\n";
        let input: String = joints.iter().map(back).collect();
        let found = replies(&kinematics(&place, &machine, false, "forward", input.as_str()));
        assert_eq!(found.len(), places.len(), "{joints:#?}");
        for (wanted, found) in places.iter().zip(&found) {
            let position = found["pose"]["position"].as_array().unwrap();
            for (row, value) in position.iter().enumerate() {
                let error = value.as_f64().unwrap() - wanted[row];
                assert!(error.abs() < 1e-12, "{file} {wanted:?}: {found}");
            }
        }
    }
}

#[test]
fn a_line_without_an_answer_is_an_error_in_its_place() {
    let place = Place::new();
    let machine = support::source("machines/corexy.toml");
    let input = concat!(
        "{\"pose\": {\"position\": [0.1, 0.1]}}\n",
        "{\"pose\": {\"position\": [0.9, 0.1]}}\n",
        "\n",
        "{\"q\": [0.1, 0.1]}\n",
        "{\"pose\": {\"position\": [0.1]}}\n",
        "{\"pose\": {\"position\": [0.1, 0.1]}, \"previous\": [1]}\n",
        "{\"pose\": {\"position\": [0.02, 0.03]}}\n",
    );
    let replies = replies(&kinematics(&place, &machine, false, "inverse", input));
    let codes: Vec<_> = replies.iter().map(|reply| reply["error"]["code"].as_str()).collect();
    let bad = Some("bad_request");
    assert_eq!(codes, [None, Some("limit_a"), bad, bad, bad, None], "{replies:#?}");
    let limit = &replies[1]["error"];
    assert_eq!(limit["axis"], "a");
    assert!(number(limit, "/value") > number(limit, "/limit"), "{limit}");
    assert_close(&replies[5]["q"], &json!([0.05, -0.01]), "the line after the errors");
}

#[test]
fn input_that_is_not_json_ends_with_an_error_that_names_its_line() {
    let place = Place::new();
    let machine = support::source("machines/corexy.toml");
    let good = b"{\"q\": [0.1, 0.05]}\n";
    let long = [b' '; (1 << 20) + 1];
    let broken: [(&[u8], &str); 9] = [
        (b"{", "column 1: EOF"),
        (b"7", "invalid type"),
        (b"{\"p\": [1, 2]}", "column 4: unknown field `p`"),
        (b"{\"q\": [1, NaN]}", "column 11: expected value"),
        (b"{\"q\": \"1\"}", "invalid type"),
        (b"{\"q\": [1e999, 0]}", "number out of range"),
        (b"\xff\xfe{\"q\": [0, 0]}", "column 1: this is not UTF-8 text"),
        (b"{\"q\": [0, 0], \"\xe9\": 1}", "column 16: this is not UTF-8 text"),
        (&long, "more than 1048576 bytes"),
    ];
    for (broken, told) in broken {
        let input = [good, broken, b"\n", good].concat();
        let ended = kinematics(&place, &machine, false, "forward", &input);
        assert_eq!(ended.code, Some(2), "{told}: {}", ended.error);
        assert!(ended.error.contains("line 2"), "{told}: {}", ended.error);
        let lines: Vec<Value> =
            ended.output.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        let [answered, refused] = lines.as_slice() else { panic!("{told}: {}", ended.output) };
        assert!(answered["pose"].is_object(), "what came before is answered: {answered}");
        assert_valid("kinematics", refused);
        assert_eq!(refused["error"]["code"], "not_json", "{refused}");
        let detail = refused["error"]["detail"].as_str().unwrap();
        assert!(detail.contains("line 2") && detail.contains(told), "{told}: {detail}");
        assert!(ended.error.contains(told), "{told}: {}", ended.error);
    }
}

/// The numbers that a key of a request may have, and what a line may ask for with them.
fn extreme_request(random: &mut SplitMix64, axes: u64) -> String {
    const NUMBERS: [&str; 14] = [
        "0", "0.1", "-0.1", "0.2", "3.14", "1e-9", "1e-308", "4.9e-324", "1e9", "-1e9", "1.1e9",
        "1e200", "-1.7e308", "1e308",
    ];
    let mut number = || NUMBERS[random.below(NUMBERS.len() as u64) as usize].to_owned();
    let mut list =
        |count: u64| format!("[{}]", [(); 9].map(|()| number())[..count as usize].join(","));
    format!(
        "{{\"q\":{},\"qd\":{},\"qdd\":{},\"wrench\":{},\"previous\":{},\"pose\":{{\"position\":{}{}}}}}\n",
        list(axes),
        list(axes),
        list(axes),
        list(6),
        list(axes),
        list(3),
        [
            String::new(),
            format!(",\"axis\":{}", list(3)),
            format!(",\"rotation\":[{},{},{}]", list(3), list(3), list(3)),
            ",\"rotation\":[[1,0,0],[0,1,0],[0,0,1]]".to_owned(),
        ][random.below(4) as usize],
    )
}

/// Every verb of every machine: each line has an answer whose numbers are all there, or an error.
#[test]
fn extreme_numbers_get_finite_answers_or_an_error_with_value_and_limit() {
    let place = Place::new();
    let mut random = SplitMix64::new(75);
    let mut too_large = 0;
    for (name, axes) in ALL {
        let machine = support::source("machines").join(format!("{name}.toml"));
        for verb in ["forward", "inverse", "jacobian", "dynamics", "matrices", "ellipse"] {
            for motor in [false, true] {
                let input: String = (0..60).map(|_| extreme_request(&mut random, axes)).collect();
                let replies = replies(&kinematics(&place, &machine, motor, verb, input.as_bytes()));
                assert_eq!(replies.len(), 60, "{name} {verb}");
                for reply in &replies {
                    assert!(!reply.to_string().contains("null"), "{name} {verb}: {reply}");
                    if reply["error"]["code"] == "too_large" {
                        too_large += 1;
                        assert_eq!(number(reply, "/error/limit"), 1e9, "{reply}");
                        assert!(number(reply, "/error/value").abs() > 1e9, "{reply}");
                    }
                }
            }
        }
    }
    assert!(too_large > 1000, "only {too_large} lines were refused for their size");
}

/// A pose of the shipped platform with all legs inward that shares its feet with another one, which
/// is rare, and its number.
fn ambiguous_pose() -> (Pose, u8) {
    let path = support::source("machines/tri_planar.toml");
    let MechanismKind::TriPlanar(mechanism) = Machine::load(&path, &[]).unwrap().mechanism else {
        panic!("another mechanism");
    };
    let inward = TriPlanarBranch::from(Legs([Fold::Inward; 3]));
    let mut random = SplitMix64::new(3);
    loop {
        let [x, y, z] = [0.25, 0.15, 0.06].map(|most| random.between(-most, most));
        let [roll, pitch, yaw] = [0.9, 0.9, 3.0].map(|most| random.between(-most, most));
        let rotation = Rotation3::from_euler_angles(roll, pitch, yaw).into_inner();
        let pose = Pose { position: Vector3::new(x, y, 0.1 + z), rotation };
        let Ok(q) = mechanism.inverse(&pose, inward, &Joints::zeros()) else { continue };
        let chain = mechanism.solve_at(&pose, &q, inward, None).unwrap();
        if let Some(number) = mechanism.branch_of(&chain).assembly {
            return (pose, number);
        }
    }
}

#[test]
fn forward_asks_for_the_assembly_that_inverse_names_where_there_are_several() {
    let (pose, assembly) = ambiguous_pose();
    let machine = Golden::new("tri_planar", &[]);
    let rows: Vec<Vec<f64>> =
        (0..3).map(|row| (0..3).map(|column| pose.rotation[(row, column)]).collect()).collect();
    let position: [f64; 3] = pose.position.into();
    let wanted = json!({ "position": position, "rotation": rows });
    let legs = json!({ "legs": [-1, -1, -1] });
    // Each on its own: a line before would be a start near by.
    let ask = |verb: &str, request: Value| machine.ask(verb, &[request], Value::clone).remove(0);
    let solved = ask("inverse", json!({ "pose": wanted, "branch": legs }));
    assert_eq!(solved["branch"]["assembly"], assembly, "{solved}");
    let refused = ask("forward", json!({ "q": solved["q"], "branch": legs }));
    assert_eq!(refused["error"]["code"], "ambiguous_assembly", "{refused}");
    assert!(number(&refused, "/error/value") >= 2.0, "{refused}");
    let back = ask("forward", json!({ "q": solved["q"], "branch": solved["branch"] }));
    assert_close(&back["pose"]["position"], &json!(position), "position");
    assert_close(&back["pose"]["rotation"], &json!(rows), "rotation");
    assert_eq!(back["branch"], solved["branch"]);
}
