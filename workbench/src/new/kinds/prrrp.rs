//! Two carts on one rail, with a link from each to the head.

use super::parts::{belt, link, tube};
use super::samples;
use crate::new::Request;
use crate::new::draft::{Asked, AxisDraft, Draft, Travel, Unit};
use crate::new::text::{about, inertia, kg, lengths, line, mm};

/// Nearest and farthest place of the head from the rail, in links: the shipped machine's.
const REACH: [f64; 2] = [0.433, 0.893];

/// The shortest link [m].
const SHORTEST: f64 = 0.1;

/// Link, cart and guide of the shipped machine: [m], and [kg] beside its head of 0.33 kg.
const LINK: f64 = 0.3;
const CART: f64 = 0.2;
const GUIDE: f64 = 0.24;

pub(super) fn draft(request: &Request, asked: &Asked) -> Draft {
    let [width, depth] = request.area;
    let length = (width / (REACH[1] - REACH[0])).max(SHORTEST);
    let middle = (REACH[0] + REACH[1]) / 2.0 * length;
    let scale = length / LINK;
    let tube = tube(request.head, scale);
    let [mass, about_center] = link(tube, length);
    let mut mechanism = "[mechanism.prrrp]\n".to_owned();
    for (key, value, what) in [
        ("link", mm(length), "the head from 0.43 to 0.89 of it away from the rail"),
        ("link_mass", kg(mass), &*format!("a tube of {} kg a metre", about(tube))),
        ("link_inertia", inertia(about_center), "of a rod: m L^2/12"),
        (
            "cart_mass",
            kg(CART * (request.head / 0.33).max(1.0)),
            "as heavy beside the head as source 003's",
        ),
        ("tool_mass", kg(request.head), "the head"),
        ("bar_mass", kg(tube * scale * GUIDE), "the guide of the head, moves in y only"),
        ("side", "1".to_owned(), "the head at positive x"),
    ] {
        mechanism += &line(key, &value, what);
    }
    let travel = depth + (REACH[1] - REACH[0]) * length;
    let wide = 2.0 * length + depth;
    let axis = |name: &str| AxisDraft {
        name: name.to_owned(),
        about: String::new(),
        unit: Unit::Length,
        output: "the pulley",
        transmission: belt(name, travel),
        efficiency: (0.8, "a gear and a toothed belt"),
        travel: Travel::Found([-wide, wide], 5e-3),
        own: None,
    };
    Draft {
        about: "A PRRRP (\"assi impropri\") for laser marking, after source 003, chapter 6: two carts on one \
                rail along y, drawn by belts, and a link from each to the head."
            .to_owned(),
        description: "Two carts on one rail along y, links to the laser head".to_owned(),
        home: format!("home = {}\n", lengths(&[middle, 0.0])),
        area_about: "",
        area: [[middle - width / 2.0, middle + width / 2.0], [-depth / 2.0, depth / 2.0]],
        z: None,
        mechanism,
        axes: vec![axis("p1"), axis("p2")],
        sample: samples::letters_in(request.area, asked.speed),
    }
}
