//! `graver kinematics`, line by line, against the golden vectors.

#![allow(clippy::unwrap_used)]

mod support;

use std::fs::File;
use std::path::Path;

use serde_json::{Value, json};
use support::{Ended, Place, assert_valid, golden, number};

const MACHINES: [&str; 2] = ["cartesian", "corexy"];

/// The golden vectors are exact to rounding.
const TOLERANCE: f64 = 1e-9;

/// Runs a verb on these lines of input.
fn kinematics(place: &Place, machine: &Path, motor: bool, verb: &str, input: &str) -> Ended {
    let input = place.file(&format!("{verb}.jsonl"), input);
    let (output, error) = (place.path("output"), place.path("error"));
    let mut arguments = vec!["kinematics", "--machine", machine.to_str().unwrap()];
    if motor {
        arguments.push("--motor");
    }
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
        let dynamics = ask(
            &place,
            &machine,
            "dynamics",
            poses,
            |pose| json!({ "q": pose["q"], "qd": pose["qd"], "qdd": pose["qdd"] }),
        );
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

#[test]
fn a_wrench_at_the_tool_adds_its_virtual_work() {
    for name in MACHINES {
        let place = Place::new();
        let machine = without_screws(&place, name);
        let golden = golden(name);
        let poses = &golden["poses"].as_array().unwrap()[..3];
        let at_rest = ask(
            &place,
            &machine,
            "dynamics",
            poses,
            |pose| json!({ "q": pose["q"], "qd": [0, 0], "qdd": [0, 0], "wrench": [3, -2] }),
        );
        for (reply, pose) in at_rest.iter().zip(poses) {
            let expected: Vec<f64> = [0, 1]
                .map(|axis| {
                    3.0 * number(pose, &format!("/J/0/{axis}"))
                        - 2.0 * number(pose, &format!("/J/1/{axis}"))
                })
                .into();
            assert_close(&reply["effort"], &json!(expected), name);
        }
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
fn input_that_is_not_json_ends_with_its_line() {
    let place = Place::new();
    let machine = support::source("machines/corexy.toml");
    for broken in ["{", "7", "{\"p\": [1, 2]}", "{\"q\": [1, NaN]}", "{\"q\": \"1\"}"] {
        let input = format!("{{\"q\": [0.1, 0.05]}}\n{broken}\n{{\"q\": [0.1, 0.05]}}\n");
        let ended = kinematics(&place, &machine, false, "forward", &input);
        assert_eq!(ended.code, Some(2), "{broken}: {}", ended.error);
        assert!(ended.error.contains("line 2"), "{broken}: {}", ended.error);
        assert_eq!(ended.output.lines().count(), 1, "{broken}: what came before is answered");
    }
}
