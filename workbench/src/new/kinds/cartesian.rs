//! Two screws, the first of which carries the second; with a third one that lifts the head.

use super::parts::{ScrewPart, lift};
use super::{Kind, samples};
use crate::new::draft::{Asked, AxisDraft, Draft, Travel, Unit};
use crate::new::text::{kg, lengths, line};
use crate::new::{Request, Short};

/// Kilograms of a metre of axis: source 003's y axis has 1.6 kg for 200 mm.
const AXIS: f64 = 8.0;

/// Mass of the lift [kg], and of a metre of it.
const LIFT: [f64; 2] = [0.5, 4.0];

pub(super) fn draft(request: &Request, asked: &Asked) -> Result<Draft, Short> {
    let [width, depth] = request.area;
    let lifts = request.kind == Kind::CartesianLift;
    let lift_mass = if lifts { LIFT[0] + LIFT[1] * request.z } else { 0.0 };
    let masses = [request.head + lift_mass + AXIS * depth, request.head + lift_mass, request.head];
    let what = if lifts {
        [
            "the head, the lift and the y axis, 8 kg for a metre",
            "the head, and 0.5 kg and 4 kg for a metre of lift",
            "the head",
        ]
    } else {
        ["the head, and 8 kg for a metre of y axis", "the head", ""]
    };
    let own = lift(asked.rapid, asked.acceleration);
    let speeds = [asked.screws, asked.screws, lift(asked.screws, 0.0)[0]];
    let travels = [width, depth, request.z];
    let mut mechanism =
        "# The x carriage carries the whole y axis. A screw turns with the gear's output; it \
                         twists, and yields\n# along its axis.\n"
            .to_owned();
    let mut axes = Vec::new();
    let count = if lifts { 3 } else { 2 };
    for (index, name) in ["x", "y", "z"].into_iter().take(count).enumerate() {
        let screw = ScrewPart::new(name, travels[index], speeds[index])?;
        mechanism += &format!("[mechanism.cartesian.{name}]\n");
        mechanism += &line("mass", &kg(masses[index]), what[index]);
        mechanism += &screw.lines();
        mechanism += &format!("damping_ratio = 0.9\n\n[mechanism.cartesian.{name}.shaft]\n");
        mechanism += &screw.shaft();
        mechanism.push('\n');
        axes.push(AxisDraft {
            name: name.to_owned(),
            about: String::new(),
            unit: Unit::Length,
            output: "the screw",
            transmission: String::new(),
            efficiency: (0.8, "a ball screw and its gear"),
            travel: Travel::OfArea,
            own: (index == 2).then_some(own),
        });
    }
    mechanism.truncate(mechanism.trim_end().len());
    mechanism.push('\n');
    let mut home = vec![width / 2.0, depth / 2.0];
    if lifts {
        home.push(request.z / 2.0);
    }
    let carried = if lifts { ", a third one lifts the head" } else { "" };
    Ok(Draft {
        about: format!("Two ball-screw axes for laser marking{carried}."),
        description: format!("Ball screws, the y axis carried by the x axis{carried}"),
        home: format!("home = {}\n", lengths(&home)),
        area_about: "",
        area: [[0.0, width], [0.0, depth]],
        z: lifts.then_some([0.0, request.z]),
        mechanism,
        axes,
        sample: samples::letters_in(request.area, asked.speed),
    })
}
