//! The frame of a machine file.

#![allow(clippy::unwrap_used)]

use machine::document::Override;
use machine::kinematics::Joints;
use machine::{Machine, Mechanism, MechanismKind, MechanismVisitor, Pose};
use nalgebra::Vector3;

const COREXY: &str = include_str!("../../machines/corexy.toml");
const CARTESIAN: &str = include_str!("../../machines/cartesian.toml");
const GALVO: &str = include_str!("../../machines/galvo.toml");

/// `text` with tables added at its end.
fn with(text: &str, tables: &str) -> Result<Machine, String> {
    Machine::parse("m.toml", &format!("{text}\n{tables}\n"), &[])
        .map_err(|error| error.problems().next().unwrap().message())
}

/// The joints that bring the tool to a place.
struct JointsAt([f64; 3]);

impl MechanismVisitor for JointsAt {
    type Output = Vec<f64>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Vec<f64> {
        let pose = Pose::at(Vector3::from(self.0));
        let joints = mechanism.inverse(&pose, mechanism.branch(), &Joints::zeros()).unwrap();
        joints.iter().copied().collect()
    }
}

fn close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (one, other) in found.iter().zip(expected) {
        assert!((one - other).abs() < 1e-12, "{found:?} {expected:?}");
    }
}

#[test]
fn the_axes_of_a_mirrored_machine_run_from_the_far_corner() {
    let frame = "[frame]\nmirrored = [\"x\", \"y\"]\norigin = [\"200 mm\", \"200 mm\"]";
    let machine = with(CARTESIAN, frame).unwrap();
    close(&machine.mechanism.visit(JointsAt([0.2, 0.2, 0.0])), &[0.0, 0.0]);
    close(&machine.mechanism.visit(JointsAt([0.05, 0.18, 0.0])), &[0.15, 0.02]);
    close(&machine.home_joints, &[0.1, 0.1]);
    assert!(machine.mechanism.visit(IsLinear));
    let range = machine.axes[0].limits.position;
    close(&range, &[-1e-3, 0.201]);
    // The belts of a corexy see the head where it is.
    let machine = with(COREXY, frame).unwrap();
    close(&machine.mechanism.visit(JointsAt([0.05, 0.18, 0.0])), &[0.17, 0.13]);
    close(&machine.axes[1].limits.position, &[-0.201, 0.201]);
}

struct IsLinear;

impl MechanismVisitor for IsLinear {
    type Output = bool;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> bool {
        mechanism.is_linear()
    }
}

#[test]
fn an_area_may_lie_on_any_side_of_the_origin() {
    let settings: Vec<Override> = [
        "area.x=[\"-300 mm\", \"-100 mm\"]",
        "area.y=[\"-50 mm\", \"150 mm\"]",
        "home=[\"-110 mm\", \"0 mm\"]",
        "gcode.origins.g54=[\"-110 mm\", \"0 mm\"]",
    ]
    .map(|setting| setting.parse().unwrap())
    .to_vec();
    let machine = Machine::parse("m.toml", COREXY, &settings).unwrap();
    close(&machine.home_joints, &[-0.11, -0.11]);
    close(&machine.axes[0].limits.position, &[-0.351, 0.051]);
}

#[test]
fn a_turned_and_longer_axis_is_asked_for_what_the_tool_needs() {
    let frame = "[frame]\nscale_x = 1.0002\nrotation = \"10 mrad\"";
    let machine = with(CARTESIAN, frame).unwrap();
    let (sine, cosine) = messages::math::sin_cos(0.01);
    let joints = machine.mechanism.visit(JointsAt([0.2, 0.1, 0.0]));
    close(&joints, &[(0.2 * cosine + 0.1 * sine) / 1.0002, 0.1 * cosine - 0.2 * sine]);
}

#[test]
fn a_mesh_is_measured_over_the_area() {
    let mesh = |x: &str, dx: &str| {
        with(CARTESIAN, &format!("[frame.mesh]\nx = {x}\ny = [\"0 mm\", \"200 mm\"]\n{dx}"))
    };
    let (over, row) = ("[\"0 mm\", \"200 mm\"]", "[\"10 um\", \"-20 um\", \"30 um\"]");
    let machine = mesh(over, &format!("dx = [{row}, {row}, {row}]")).unwrap();
    // In the middle the tool was 20 um to the left: the carriage goes as far to the right, nearly.
    let joints = machine.mechanism.visit(JointsAt([0.1, 0.05, 0.0]));
    assert!((joints[0] - 0.10002).abs() < 1e-8 && joints[1] == 0.05, "{joints:?}");
    assert!(!machine.mechanism.visit(IsLinear));
    for (range, values, expected) in [
        ("[\"10 mm\", \"200 mm\"]", format!("dx = [{row}, {row}, {row}]"), "the mesh reaches from x = 0.01 m"),
        (over, format!("dx = [{row}, {row}]"), "a mesh of 2 lines in one direction is none"),
        (over, format!("dx = [{row}, {row}, [\"1 um\"]]"), "the rows of the mesh are not all of one"),
        (over, format!("dx = [{row}, {row}, {row}]\ndy = [{row}]"), "the rows of the mesh are not all"),
        (over, String::new(), "a mesh without deviations has no effect"),
        (
            over,
            "dx = [[\"0 mm\", \"20 mm\", \"0 mm\"], [\"0 mm\", \"0 mm\", \"0 mm\"], [\"0 mm\", \"0 mm\", \"0 mm\"]]"
                .to_owned(),
            "the deviations of the mesh change by",
        ),
    ] {
        let told = mesh(range, &values).unwrap_err();
        assert!(told.starts_with(expected), "{told}");
    }
}

#[test]
fn a_field_beyond_the_lens_is_refused() {
    let wide = GALVO.replacen("[\"-85 mm\", \"85 mm\"]", "[\"-300 mm\", \"300 mm\"]", 1);
    let told =
        with(&wide.replacen("x = [\"-90 mm\", \"90 mm\"]", "x = [\"-300 mm\", \"300 mm\"]", 1), "")
            .unwrap_err();
    assert!(told.starts_with("not all of the area is reached: the beam would leave"), "{told}");
    let MechanismKind::Galvo(head) = with(GALVO, "").unwrap().mechanism else { panic!() };
    assert!((head.reach() - 0.25 * 0.98).abs() < 1e-15);
    for (from, to, expected) in [
        ("focal_length = \"250 mm\"", "", "`distortion` has no effect"),
        (
            "focal_length = \"250 mm\"",
            "focal_length = \"250 mm\"\ndistance = \"0.3 m\"",
            "`distance` has",
        ),
        (
            "distortion = [-0.02, 0.0]",
            "distortion = [-0.5, 0.0]",
            "with this distortion beams of two",
        ),
    ] {
        let text = GALVO.replacen(from, to, 1);
        let text = if to.is_empty() {
            text.replacen("[mechanism.galvo]", "[mechanism.galvo]\ndistance = \"0.3 m\"", 1)
        } else {
            text
        };
        let told = with(&text, "").unwrap_err();
        assert!(told.starts_with(expected), "{told}");
    }
    let bare = GALVO.replacen("focal_length = \"250 mm\"", "", 1);
    let told = with(&bare, "").unwrap_err();
    assert!(told.starts_with("`focal_length` is missing"), "{told}");
}
