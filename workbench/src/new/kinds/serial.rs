//! A SCARA: two turning joints and a slide.

use super::parts::{ScrewPart, head_inertia, lift, tube};
use super::samples;
use crate::new::draft::{Asked, AxisDraft, Draft, Travel, Unit};
use crate::new::text::{about, lengths, line, mm};
use crate::new::{Request, Short};
use core::f64::consts::PI;

/// The shipped machine's links [m], the nearest place of its area, and the farthest.
const LINKS: [f64; 2] = [0.25, 0.2];
const REACH: [f64; 2] = [0.17, 0.425];

pub(super) fn draft(request: &Request, asked: &Asked) -> Result<Draft, Short> {
    let Request { area: [width, depth], head, z, .. } = *request;
    // The smallest with (near·s + width)² + (depth/2)² = (far·s)².
    let [near, far] = REACH;
    let square = far * far - near * near;
    let across = width * width + depth * depth / 4.0;
    let root = (near * near * width * width + square * across).sqrt();
    let scale = ((near * width + root) / square).max(0.2);
    let x = near * scale;
    let middle = x + width / 2.0;
    let links = LINKS.map(|length| scale * length);
    let tube = tube(head, scale);
    let bend =
        (middle * middle - links[0] * links[0] - links[1] * links[1]) / (2.0 * links[0] * links[1]);
    let elbow = messages::math::acos(bend.clamp(-1.0, 1.0));
    let along = links[0] + links[1] * messages::math::cos(elbow);
    let shoulder = -messages::math::atan2(links[1] * messages::math::sin(elbow), along);
    let mut mechanism = "[mechanism.serial]\n".to_owned();
    mechanism += &line("freedom", "\"space\"", "x, y and z; the beam shines straight down");
    mechanism += "\n[mechanism.serial.base]\nposition = [\"0 mm\", \"0 mm\", \"0 mm\"]\n";
    for (index, name) in ["j1", "j2"].into_iter().enumerate() {
        let length = links[index];
        let mass = tube * length;
        // A tube, and at its end the motor of the next joint: half as much again.
        let whole = 1.5 * mass;
        let center = length * (0.5 * mass + 0.5 * mass) / whole;
        let across = mass * length * length * (1.0 / 12.0 + 1.0 / 36.0 + 1.0 / 18.0);
        mechanism += "\n[[mechanism.serial.link]]\n";
        mechanism += &line("joint", "\"revolute\"", name);
        if index == 1 {
            mechanism += &line("length", &mm(links[0]), "of the link before");
        }
        let said = format!("a tube of {} kg a metre, and the next motor", about(tube));
        mechanism += &line("mass", &crate::new::text::kg(whole), &said);
        mechanism += &line("center", &lengths(&[center, 0.0, 0.0]), "");
        mechanism += &line("inertia", &inertias([across / 10.0, across, across]), "");
    }
    mechanism += "\n[[mechanism.serial.link]]\n";
    mechanism += &line("joint", "\"prismatic\"", "j3, up along z");
    mechanism += &line("length", &mm(links[1]), "of the link before");
    mechanism += &line("mass", &crate::new::text::kg(head), "the head");
    mechanism += &line("center", &lengths(&[0.0, 0.0, 0.0]), "");
    mechanism += &line("inertia", &inertias([head_inertia(head); 3]), "");
    let own = lift(asked.rapid, asked.acceleration);
    let screw = ScrewPart::new("j3", z, lift(asked.screws, 0.0)[0])?;
    let turning = |name: &str, output: &'static str, wide: [f64; 2]| AxisDraft {
        name: name.to_owned(),
        about: String::new(),
        unit: Unit::Angle,
        output,
        transmission: String::new(),
        efficiency: (0.8, "a planetary gear"),
        travel: Travel::Found(wide, 3_f64.to_radians()),
        own: None,
    };
    let slide = AxisDraft {
        name: "j3".to_owned(),
        about: String::new(),
        unit: Unit::Length,
        output: "the screw",
        transmission: screw.transmission("j3"),
        efficiency: (0.8, "a ball screw"),
        travel: Travel::Given([-z, 0.0], ""),
        own: Some(own),
    };
    let degrees = |value: f64| (value.to_degrees() * 10.0).round() / 10.0;
    Ok(Draft {
        about: "A serial arm by modified Denavit-Hartenberg parameters (source 000 sec. 3): a SCARA, two \
                turning joints and a vertical slide."
            .to_owned(),
        description: format!(
            "SCARA: two turning joints and a slide, {} mm reach",
            about((links[0] + links[1]) * 1e3)
        ),
        home: format!(
            "home_axes = [\"{} deg\", \"{} deg\", {}]\n",
            degrees(shoulder),
            degrees(elbow),
            mm(-z / 2.0)
        ),
        area_about: "",
        area: [[x, x + width], [-depth / 2.0, depth / 2.0]],
        z: Some([-z, 0.0]),
        mechanism,
        axes: vec![
            turning("j1", "the arm", [-PI, PI]),
            turning("j2", "the forearm", [0.05, PI - 0.05]),
            slide,
        ],
        sample: samples::letters_in(request.area, asked.speed),
    })
}

fn inertias(values: [f64; 3]) -> String {
    let values = values.map(crate::new::text::inertia);
    format!("[{}]", values.join(", "))
}
