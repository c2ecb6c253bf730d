//! Two actuators of variable length that meet in one joint: the shipped machine in another size.

use super::parts::{Straight, tube};
use super::samples;
use crate::new::Request;
use crate::new::draft::{Asked, AxisDraft, Draft, Travel, Unit};
use crate::new::text::{about, inertia, kg, lengths, line, mm};

/// The machine of source 004's kind: distance of its bases, its tool's offset, where the middle of its
/// area is, and the side of the square that it reaches [m].
const BASES: f64 = 0.8;
const OFFSET: f64 = 0.06;
const MIDDLE: [f64; 2] = [0.4, 0.36];
const SQUARE: f64 = 0.2;

/// Its rod, and what the inertia of its housing and rod are for a kilogram of rod.
const ROD: f64 = 0.32;
const HOUSING: f64 = 0.048;
const ROD_INERTIA: f64 = 7.6e-3;

pub(super) fn draft(request: &Request, asked: &Asked) -> Draft {
    let [width, depth] = request.area;
    let scale = (width / SQUARE).max(depth / SQUARE).max(0.2);
    let [x, y] = MIDDLE.map(|place| scale * place);
    let rod = tube(request.head, scale) * scale * ROD;
    let square = scale * scale;
    let mut mechanism = "[mechanism.twin_actuator]\n".to_owned();
    mechanism += &line("base_a", &lengths(&[0.0, 0.0]), "A");
    mechanism +=
        &line("base_b", &lengths(&[scale * BASES, 0.0]), "B, four times the larger side away");
    mechanism += &line("offset", &mm(scale * OFFSET), "joint to tool");
    mechanism += &line("offset_angle", "\"2 rad\"", "from the way to A, clockwise");
    mechanism += &line("tool_mass", &kg(request.head), "the head");
    mechanism += &line("elbow", "1", "the joint above the base line");
    mechanism += "baseline_margin = 0.1\n";
    mechanism += &line("near_margin", &mm((scale * 0.02).min(0.1)), "");
    for (index, body) in ["body_a", "body_b"].into_iter().enumerate() {
        let first = |text: &'static str| if index == 0 { text } else { "" };
        mechanism += &format!("\n[mechanism.twin_actuator.{body}]\n");
        let housing = first("as source 004's kind of machine, by size and mass");
        mechanism += &line("housing_inertia", &inertia(HOUSING * rod * square), housing);
        mechanism += &line("rod_mass", &kg(rod), first("a tube that bears the head"));
        mechanism += &line("rod_inertia", &inertia(ROD_INERTIA * rod * square), "");
        mechanism += &line("rod_center", &mm(scale * 0.15), first("joint to its centre of mass"));
    }
    // What the area takes of the actuators: some more than its diagonal.
    let stroke = 1.5 * width.max(depth);
    let axis = |name: &str| {
        // The joint beside the tool may go faster than the tool.
        let Straight { output, transmission, efficiency } =
            Straight::new(name, stroke, 1.3 * asked.screws);
        AxisDraft {
            name: name.to_owned(),
            about: String::new(),
            unit: Unit::Length,
            output,
            transmission,
            efficiency,
            travel: Travel::Found([scale * 0.1, scale * 2.0 * BASES], scale * 0.01),
            own: None,
        }
    };
    Draft {
        about: format!(
            "A twin actuator for laser marking, after source 004: two actuators of variable length turn about \
             their bases and meet in one joint; the head hangs {} mm beside it.",
            about(scale * OFFSET * 1e3)
        ),
        description: "Two actuators of variable length".to_owned(),
        home: format!("home = {}\n", lengths(&[x, y])),
        area_about: "",
        area: [[x - width / 2.0, x + width / 2.0], [y - depth / 2.0, y + depth / 2.0]],
        z: None,
        mechanism,
        axes: vec![axis("la"), axis("lb")],
        sample: samples::letters_in(request.area, asked.speed),
    }
}
