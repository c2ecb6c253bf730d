//! The frame of a machine file.

#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use machine::document::{Attachment, Attachments, Override, Problem};
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

/// File, line and text of what is wrong.
type Told = (String, Option<usize>, String);

/// A machine file with a mesh in a file beside it that says `csv`, and with `more` keys of it.
fn with_file(csv: &str, more: &str) -> Result<Machine, Vec<Told>> {
    let text = format!("{CARTESIAN}\n[frame.mesh]\nfile = \"mesh.csv\"\n{more}\n");
    let file = Attachment { path: PathBuf::from("mesh.csv"), text: Ok(csv.to_owned()) };
    let files = Attachments::Read([("mesh.csv".to_owned(), file)].into());
    Machine::simulated(Some(("m.toml", &text)), files, &[], &[]).map_err(|error| {
        let told = |problem: &Problem| {
            (error.file_of(problem).to_owned(), problem.line(), problem.message())
        };
        error.problems().map(told).collect()
    })
}

#[test]
fn a_mesh_may_stand_in_a_file_of_its_own() {
    let row = "[\"10 um\", \"-20 um\", \"30 um\"]";
    let over = "x = [\"0 mm\", \"200 mm\"]\ny = [\"0 mm\", \"200 mm\"]";
    let zero = "[\"0 um\", \"1 um\", \"0 um\"]";
    let inside =
        format!("[frame.mesh]\n{over}\ndx = [{row}, {row}, {row}]\ndy = [{zero}, {zero}, {zero}]");
    let expected = with(CARTESIAN, &inside).unwrap().mechanism;
    // In any order of points and columns, with remarks, in the units that the first line names.
    let mut points: Vec<String> = Vec::new();
    for y in [0.0, 10.0, 20.0] {
        for (x, dx, dy) in [(0.0, 10.0, 0.0), (100.0, -20.0, 0.001), (200.0, 30.0, 0.0)] {
            points.push(format!("{dy}; {y};{dx} ;{x}"));
        }
    }
    points.reverse();
    let head = "# measured on a glass scale\n\ndy [mm];y [cm];dX [um];x [mm]";
    let found = with_file(&format!("\u{feff}{head}\r\n{}\r\n", points.join("\r\n")), "").unwrap();
    let joints = |mechanism: &MechanismKind| {
        [[0.0, 0.0], [0.1, 0.05], [0.2, 0.2], [0.013, 0.177]]
            .map(|[x, y]| mechanism.visit(JointsAt([x, y, 0.0])))
    };
    for (found, expected) in joints(&found.mechanism).iter().zip(joints(&expected)) {
        close(found, &expected);
    }
}

#[test]
fn what_is_wrong_with_a_mesh_file_is_told_at_its_line() {
    let head = "x [mm],y [mm],dx [um]";
    let points = |skip: usize, more: &str| {
        let at = |index: usize| format!("{},{},1\n", 100 * (index % 3), 100 * (index / 3));
        let lines: String = (0..9).filter(|index| *index != skip).map(at).collect();
        format!("{head}\n{lines}{more}")
    };
    assert!(with_file(&points(9, ""), "").is_ok());
    for (csv, line, expected) in [
        (String::new(), 1, "the file of the mesh is empty"),
        ("x [mm],y [mm],dz [um]\n".to_owned(), 1, "a mesh has no column `dz [um]`"),
        ("x [mm],y,dx [um]\n".to_owned(), 1, "the column `y` has no unit of length"),
        ("x [mm],x [mm],dx [um]\n".to_owned(), 1, "the column `x` stands twice"),
        ("x [mm],y [mm]\n".to_owned(), 1, "a mesh needs the columns x and y"),
        (format!("{head}\n0,0,1\n0,100\n"), 3, "the line has 2 values, and the first line 3"),
        (format!("{head}\n0,0,nan\n"), 2, "`nan` is no number"),
        (format!("{head}\n0,0,1 mm\n"), 2, "`1 mm` is no number"),
        (format!("{head}\n0,0,2e7\n"), 2, "`dx` cannot be `2e7`"),
        (format!("{head}\n0,0,1\n"), 1, "the points of the mesh stand at 1 values of x"),
        (points(4, ""), 9, "the point x = 0.1 m, y = 0.1 m of the grid is missing"),
        (points(9, "100,0,1\n"), 11, "the point x = 0.1 m, y = 0 m stands twice"),
        (points(9, "130,0,1\n"), 3, "x = 0.1 m is on no line of the grid"),
    ] {
        let told = with_file(&csv, "").unwrap_err();
        let (file, found, message) = &told[0];
        assert_eq!((file.as_str(), *found), ("mesh.csv", Some(line)), "{csv}: {told:?}");
        assert!(message.starts_with(expected), "{csv}: {told:?}");
    }
    // What the machine file says wrongly of it stands there.
    let narrow = points(9, "").replace("200,", "150,").replace("100,", "75,");
    let told = with_file(&narrow, "").unwrap_err();
    assert!(told[0].0 == "m.toml" && told[0].2.starts_with("the mesh reaches from"), "{told:?}");
    let told = with_file(&points(9, ""), "x = [\"0 mm\", \"200 mm\"]").unwrap_err();
    assert!(told[0].0 == "m.toml" && told[0].2.contains("or in a file"), "{told:?}");
    // What is unusual is a warning that names the line.
    let far = points(9, "").replace("100,100,1", "100,100,1.2e4");
    let told = with_file(&far, "").unwrap_err();
    assert!(told[0].2.starts_with("the deviations of the mesh change by"), "{told:?}");
    let wide = points(9, "").replace(",1\n", ",1.2e4\n");
    let warnings = with_file(&wide, "").unwrap().warnings;
    let warned = warnings.iter().filter(|it| it.text.starts_with("mesh.csv:2: `dx` of 1.2e4 is"));
    assert_eq!(warned.count(), 1, "{warnings:?}");
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
