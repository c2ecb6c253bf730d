//! Two belts, the second of which moves the bridge with the first, and a screw that lifts the head.

use super::parts::{ScrewPart, belt, lift};
use super::samples;
use crate::new::draft::{Asked, AxisDraft, Draft, Travel, Unit};
use crate::new::text::{kg, lengths, line};
use crate::new::{Request, Short};

/// Kilograms of a metre of bridge: source 003's has 0.73 kg for 200 mm.
const BRIDGE: f64 = 3.65;

/// Mass of the lift [kg], and of a metre of it.
const LIFT: [f64; 2] = [0.5, 4.0];

pub(super) fn draft(request: &Request, asked: &Asked) -> Result<Draft, Short> {
    let [width, depth] = request.area;
    let carried = request.head + LIFT[0] + LIFT[1] * request.z;
    let own = lift(asked.rapid, asked.acceleration);
    let screw = ScrewPart::new("z", request.z, lift(asked.screws, 0.0)[0])?;
    let mut mechanism = "# What drives the carriages stands in their axes.\n".to_owned();
    for (name, mass, what) in [
        ("x", carried, "the head, and 0.5 kg and 4 kg for a metre of lift"),
        ("y", carried + BRIDGE * width, "and 3.65 kg for a metre of bridge"),
        ("z", request.head, "the head"),
    ] {
        mechanism += &format!("[mechanism.cartesian.{name}]\n{}\n", line("mass", &kg(mass), what));
    }
    mechanism.truncate(mechanism.trim_end().len());
    mechanism.push('\n');
    let drawn = |name: &str, travel: f64| AxisDraft {
        name: name.to_owned(),
        about: String::new(),
        unit: Unit::Length,
        output: "the pulley",
        transmission: belt(name, travel),
        efficiency: (0.8, "a gear and a toothed belt"),
        travel: Travel::OfArea,
        own: None,
    };
    let lifted = AxisDraft {
        output: "the screw",
        transmission: screw.transmission("z"),
        efficiency: (0.8, "a ball screw and its gear"),
        own: Some(own),
        ..drawn("z", request.z)
    };
    Ok(Draft {
        about: "A gantry for laser marking: belts in x and y, a screw that lifts the head."
            .to_owned(),
        description: "Belts, the bridge in y bears the head in x, a screw lifts it".to_owned(),
        home: format!("home = {}\n", lengths(&[width / 2.0, depth / 2.0, request.z / 2.0])),
        area_about: "",
        area: [[0.0, width], [0.0, depth]],
        z: Some([0.0, request.z]),
        mechanism,
        axes: vec![drawn("x", width), drawn("y", depth), lifted],
        sample: samples::letters_in(request.area, asked.speed),
    })
}
