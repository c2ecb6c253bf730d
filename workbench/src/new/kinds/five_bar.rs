//! Two arms on two motors whose forearms carry the head: the shipped machine in another size.

use super::parts::{link, tube};
use super::samples;
use crate::new::Request;
use crate::new::draft::{Asked, AxisDraft, Draft, Travel, Unit};
use crate::new::text::{about, inertia, kg, lengths, line, mm};
use core::f64::consts::PI;

/// The shipped machine: half of its base, arm, forearm, the middle of its area from the base line, and its area [m].
const BASE: f64 = 0.05;
const ARM: f64 = 0.2;
const FOREARM: f64 = 0.25;
const MIDDLE: f64 = 0.33;
const AREA: [f64; 2] = [0.16, 0.12];
/// Length of the guide that keeps its head from turning [m].
const GUIDE: f64 = 0.24;

pub(super) fn draft(request: &Request, asked: &Asked) -> Draft {
    let [width, depth] = request.area;
    let scale = (width / AREA[0]).max(depth / AREA[1]);
    let tube = tube(request.head, scale);
    let [proximal, distal] = [ARM, FOREARM].map(|length| link(tube, scale * length));
    let middle = scale * MIDDLE;
    let said = format!("a tube of {} kg a metre", about(tube));
    let mut mechanism = "[mechanism.five_bar]\n".to_owned();
    for (key, value, what) in [
        ("half_base", mm(scale * BASE), "half the distance of the motors"),
        ("proximal", mm(scale * ARM), "motor to elbow"),
        ("distal", mm(scale * FOREARM), "elbow to tool"),
        ("proximal_mass", kg(proximal[0]), said.as_str()),
        ("proximal_inertia", inertia(proximal[1]), "of a rod: m L^2/12"),
        ("distal_mass", kg(distal[0]), ""),
        ("distal_inertia", inertia(distal[1]), ""),
        ("tool_mass", kg(request.head), "the head"),
        ("bar_mass", kg(tube * scale * GUIDE), "the guide of the head, moves in y only"),
        ("working_mode", "[1, -1]".to_owned(), "elbows out"),
        ("assembly_mode", "1".to_owned(), "the tool beyond the elbows"),
    ] {
        mechanism += &line(key, &value, what);
    }
    let axis = |name: &str| AxisDraft {
        name: name.to_owned(),
        about: String::new(),
        unit: Unit::Angle,
        output: "the arm",
        transmission: String::new(),
        efficiency: (0.7, "a gear of some stages"),
        travel: Travel::Found([-PI / 4.0, 1.25 * PI], 3_f64.to_radians()),
        own: None,
    };
    Draft {
        about: format!(
            "A five-bar (5R) for laser marking: the machine of source 003, chapter 5, {} times as large.",
            about(scale)
        ),
        description: "Two arms on two motors whose forearms carry the laser head".to_owned(),
        home: format!("home = {}\n", lengths(&[0.0, middle])),
        area_about: "Both arms stay away from their singularities in it.",
        area: [[-width / 2.0, width / 2.0], [middle - depth / 2.0, middle + depth / 2.0]],
        z: None,
        mechanism,
        axes: vec![axis("th1"), axis("th2")],
        sample: samples::letters_in(request.area, asked.speed),
    }
}
