//! A head on two carriages, turned and tilted, over a rotary table: the shipped machine in another size.

use super::parts::{Straight, head_inertia, table, tube};
use super::samples;
use crate::new::Request;
use crate::new::draft::{Asked, AxisDraft, Draft, Travel, Unit};
use crate::new::text::{about, inertia, kg, lengths, line, mm, quantity};
use core::f64::consts::TAU;
use machine::kinematics::STANDARD_GRAVITY;

/// The largest work of the shipped machine [m]: as wide as high.
const WORK: f64 = 0.2;

pub(super) fn draft(request: &Request, asked: &Asked) -> Draft {
    let Request { area: [width, depth], head, z, .. } = *request;
    let scale = (width.max(depth) / WORK).max(z / WORK).max(0.2);
    let part = tube(head, scale) * scale;
    let [carriage, slide] = [1.6 * part, part];
    let yoke = 0.3 * head + 0.2 * part;
    let weight = (slide + head) * STANDARD_GRAVITY;
    let mut mechanism = "[mechanism.mcm]\n".to_owned();
    for (key, value, what) in [
        ("tool", mm(0.12 * scale), "tilting axis to focus"),
        ("offset", mm(0.02 * scale), ""),
        ("height", mm(0.45 * scale), "tilting axis over the table with Z at 0"),
        ("singular_distance", mm(1e-4 * scale.max(1.0)), ""),
        ("carriage_mass", kg(carriage), "machined aluminium, by size and head"),
        ("slide_mass", kg(slide), "the same, with the yoke"),
        (
            "table_inertia",
            inertia(2.0 * table(width.max(depth) / 2.0)),
            "a table of aluminium, and as much for the work",
        ),
        ("yoke_inertia", inertia(yoke * 0.0016 * scale * scale), "an arm of a third of the tool"),
        ("head_mass", kg(head), "the head"),
        ("head_center", mm(0.0), "hung in its centre of mass: no brake on the tilt"),
    ] {
        mechanism += &line(key, &value, what);
    }
    let cube = inertia(head_inertia(head));
    let cube = format!("[{cube}, {cube}, {cube}]");
    mechanism += &line("head_inertia", &cube, "a cube of half the density of aluminium");
    mechanism += &line("counterbalance", &quantity(weight, "N"), "the weight of slide and head");
    let [speed, acceleration] = [asked.rapid, asked.acceleration];
    let linear = |name: &str, from: f64, to: f64| {
        let own = [1.6 * speed, 2.0 * acceleration];
        let Straight { output, transmission, efficiency } =
            Straight::new(name, (to - from) * scale, 1.6 * asked.screws);
        AxisDraft {
            name: name.to_owned(),
            about: String::new(),
            unit: Unit::Length,
            output,
            transmission,
            efficiency,
            travel: Travel::Given([from * scale, to * scale], ""),
            own: Some(own),
        }
    };
    // A turning axis gets what the path asks of it when it alone moves the tool at this radius.
    let turning = |name: &str, radius: f64, range: [f64; 2], why: &'static str, output| AxisDraft {
        name: name.to_owned(),
        about: String::new(),
        unit: Unit::Angle,
        output,
        transmission: String::new(),
        efficiency: (0.8, "a planetary gear"),
        travel: Travel::Given(range, why),
        own: Some([speed, acceleration].map(|of| of / (radius * scale))),
    };
    let mut axes = vec![linear("X", 0.1, 0.5), linear("Z", 0.0, 0.35)];
    axes[0].about =
        "The carriages get 1.6 of the path's speed and twice its acceleration.".to_owned();
    let wind = "what would wind up farther is unwound with the laser off";
    let mut d = turning("d", 0.031, [-2.0 * TAU, 2.0 * TAU], wind, "the table");
    d.about = format!(
        "Table, tilt and turn get what moves the tool with the path's speed and acceleration at {}, {} and \
         {} mm from their axes.",
        about(31.0 * scale),
        about(62.0 * scale),
        about(42.0 * scale)
    );
    axes.push(d);
    axes.push(turning("a", 0.062, [0.0, 1.75], "", "the head"));
    axes.push(turning("r", 0.042, [-TAU, TAU], "", "the yoke"));
    let slow = quantity(0.2 * asked.speed, "m/s");
    let sample = samples::letters(samples::letter_height(0.053 * scale, asked.speed)).replace(
        "around the machine's home",
        "on a cone that stands on the table, unrolled: lengths stay what they are",
    ) + &format!(
        "\n# The cone's own y is its axis: turned up here, and its z, where the letters lie, towards the head.\n\
         [surface]\nposition = {}\nrotation = [\"90 deg\", \"0 deg\", \"180 deg\"]\n\n[surface.cone]\n\
         bottom_radius = {}\ntop_radius = {}\nheight = {}\nprojection = \"develop\"\n",
        lengths(&[0.0, 0.0, 0.12 * scale]),
        mm(0.045 * scale),
        mm(0.035 * scale),
        mm(0.1 * scale),
    ) + &samples::marking("\"optimum\"", &format!("max_speed = {slow}\n"));
    Draft {
        about: format!(
            "An MCM for marking on cones and cylinders, after source 002: the work on a rotary table, the head \
             on two carriages X and Z, turned about the vertical and tilted. Work up to {} mm wide and high.",
            about(WORK * scale * 1e3)
        ),
        description: "Five axes: X, Z, rotary table d, tilt a, turn r; marks on cones".to_owned(),
        home: format!(
            "# X, Z, d, a and r; the tool's place follows.\nhome_axes = [{}, {}, \"0 deg\", \"45 deg\", \"180 deg\"]\n",
            mm(0.32 * scale),
            mm(0.1 * scale)
        ),
        area_about: "In the frame of the table, which turns with the work.",
        area: [[-0.45 * scale, 0.45 * scale]; 2],
        z: Some([0.0, 0.45 * scale]),
        mechanism,
        axes,
        sample,
    }
}
