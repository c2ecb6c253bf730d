//! Two crossed belts.

use super::{parts, samples};
use crate::new::Request;
use crate::new::draft::{Asked, AxisDraft, Draft, Travel, Unit};
use crate::new::text::{kg, lengths, line, mm, quantity};

/// Kilograms of a metre of bridge: source 003's has 0.73 kg for 200 mm.
const BRIDGE: f64 = 3.65;

/// The lowest resonance of the load on its belts that the loops leave alone [rad/s].
const RESONANCE: f64 = 400.0;

/// Both belts of source 003 together [N/m].
const SOURCE_BELTS: f64 = 60e3;

pub(super) fn draft(request: &Request, asked: &Asked) -> Draft {
    let [width, depth] = request.area;
    let mass = request.head + BRIDGE * width;
    let radius = parts::pulley(width + depth);
    let needed = mass * RESONANCE * RESONANCE;
    let (stiffness, why) = if needed > SOURCE_BELTS {
        (
            needed,
            "what keeps the bridge's resonance at 400 rad/s, above the loops: choose belts for it",
        )
    } else {
        (SOURCE_BELTS, "source 003's: 15 N/mm a span")
    };
    let mut mechanism =
        "# x = (a + b)/2, y = (a - b)/2, with a and b the travels of the belts.\n[mechanism.corexy]\n".to_owned();
    mechanism += &line("mass_x", &kg(request.head), "the head");
    mechanism += &line("mass_y", &kg(mass), "the head, and 3.65 kg for a metre of bridge");
    let turn = "small, for few turns of gear; no turn is longer than the travel";
    mechanism += &line("pulley_radius", &mm(radius), turn);
    mechanism += "\n# Both belts together, in each direction; leave the table out for rigid belts.\n\
                  [mechanism.corexy.belt]\n";
    mechanism += &line("stiffness", &quantity(stiffness * 1e-3, "N/mm"), why);
    mechanism += "damping_ratio = 0.9\n";
    let axis = |name: &str| AxisDraft {
        name: name.to_owned(),
        about: String::new(),
        unit: Unit::Length,
        output: "the pulley",
        transmission: String::new(),
        efficiency: (0.8, "a gear and a toothed belt"),
        travel: Travel::OfArea,
        own: None,
    };
    Draft {
        about: "A CoreXY for laser marking: two crossed belts.".to_owned(),
        description: "Two crossed belts, laser head on a bridge".to_owned(),
        home: format!("home = {}\n", lengths(&[width / 2.0, depth / 2.0])),
        area_about: "",
        area: [[0.0, width], [0.0, depth]],
        z: None,
        mechanism,
        axes: vec![axis("a"), axis("b")],
        sample: samples::letters_in(request.area, asked.speed),
    }
}
