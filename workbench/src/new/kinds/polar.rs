//! An arm that swings the head over a rotary table, and a vertical axis.

use super::parts::{ScrewPart, disc, head_inertia, lift, link, table, tube};
use crate::new::draft::{Asked, AxisDraft, Draft, Travel, Unit};
use crate::new::text::{about, inertia, kg, lengths, line, mm, quantity};
use crate::new::{Request, Short};
use machine::kinematics::STANDARD_GRAVITY;

/// Arm over the farthest place from the table's centre, and the shortest arm [m].
const ARM: f64 = 1.25;
const SHORTEST: f64 = 0.1;

/// Density of glass [kg/m³], and the thickest block that is engraved [m].
const GLASS: f64 = 2500.0;
const THICKEST: f64 = 0.05;

pub(super) fn draft(request: &Request, asked: &Asked) -> Result<Draft, Short> {
    let Request { area: [width, depth], head, z, .. } = *request;
    let radius = (width * width + depth * depth).sqrt() / 2.0;
    let arm = (ARM * radius).max(SHORTEST);
    let tube = tube(head, arm / 0.25);
    let [arm_mass, arm_inertia] = link(tube, arm);
    let thickness = (z / 2.0).min(THICKEST);
    let [glass, glass_inertia] = disc(radius / 2.0, thickness, GLASS);
    let mut mechanism = "[mechanism.polar]\n".to_owned();
    for (key, value, what) in [
        ("arm", mm(arm), "1.25 of the farthest place from the table's centre"),
        ("center_distance", mm(arm), "the arm's length: the beam reaches the very centre"),
        ("height", mm(0.0), ""),
        ("arm_mass", kg(arm_mass), &*format!("a tube of {} kg a metre", about(tube))),
        ("arm_center", mm(arm / 2.0), ""),
        ("arm_inertia", inertia(arm_inertia), "of a rod: m L^2/12"),
        ("head_mass", kg(head), "it also moves up and down"),
        ("head_center", mm(arm), ""),
        ("head_inertia", inertia(head_inertia(head)), "a cube of half the density of aluminium"),
        (
            "table_inertia",
            inertia(table(radius)),
            "a disc of aluminium as wide as the area's diagonal",
        ),
        ("workpiece_mass", kg(glass), "glass, half as wide, up to 50 mm thick"),
        ("workpiece_inertia", inertia(glass_inertia), "the same, in the middle of the table"),
        ("counterbalance", quantity(head * STANDARD_GRAVITY, "N"), "the weight of the head"),
    ] {
        mechanism += &line(key, &value, what);
    }
    // A chord of the arm's circle: 2 a sin(angle/2).
    let half = messages::math::asin(radius / (2.0 * arm));
    let swing = 2.0 * half + 0.05;
    let [speed, acceleration] = [asked.rapid, asked.acceleration];
    let axis = |name: &str, travel: Travel, own: [f64; 2], output: &'static str| AxisDraft {
        name: name.to_owned(),
        about: String::new(),
        unit: Unit::Angle,
        output,
        transmission: String::new(),
        efficiency: (0.8, "a planetary gear"),
        travel,
        own: Some(own),
    };
    let mut th1 = axis(
        "th1",
        Travel::Given(
            [-swing, swing],
            "to both sides: a line through the centre goes on on the other one",
        ),
        [2.0 * speed / arm, 2.0 * acceleration / arm],
        "the arm",
    );
    th1.about =
        "The arm gets twice the speed and acceleration that the path asks of it in the middle."
            .to_owned();
    let mut th2 = axis(
        "th2",
        Travel::Unlimited,
        [5.0 * speed / radius, 5.0 * acceleration / radius],
        "the table",
    );
    th2.about =
        "The table gets those that the path asks of it at a fifth of the area's radius; nearer to \
                 the centre the tool is slower."
            .to_owned();
    let own = lift(speed, acceleration);
    let screw = ScrewPart::new("d", z, lift(asked.screws, 0.0)[0])?;
    let d = AxisDraft {
        unit: Unit::Length,
        output: "the screw",
        transmission: screw.transmission("d"),
        efficiency: (0.8, "a ball screw"),
        ..axis("d", Travel::Given([0.0, z], ""), own, "")
    };
    // Away from the centre, where the table's angle is not determined.
    let home = if width >= depth { [0.35 * width, 0.0] } else { [0.0, 0.35 * depth] };
    let ball = (0.15 * width.min(depth)).min(0.3 * z).min(0.012);
    let sample = format!(
        "# A ball of points inside glass, deepest layer first.\n\n[cloud]\nlayer = {0}\nring = {0}\n\
         dwell = \"1 ms\"\n\n[cloud.sphere]\ncenter = {1}\nradius = {2}\ncount = 20\nseed = 1\n",
        mm(ball / 6.0),
        lengths(&[home[0], home[1], z / 2.0]),
        mm(ball),
    ) + "\n[marking]\npower = \"80 %\"\n";
    Ok(Draft {
        about: "A polar machine for engraving inside glass, after source 000: an arm swings the head over a \
                rotary table, a vertical axis sets the depth."
            .to_owned(),
        description: "Swinging arm over a rotary table, vertical axis; marks inside glass".to_owned(),
        home: format!("home = {}\n", lengths(&[home[0], home[1], z / 2.0])),
        area_about: "In the frame of the table, which turns with the work.",
        area: [[-width / 2.0, width / 2.0], [-depth / 2.0, depth / 2.0]],
        z: Some([0.0, z]),
        mechanism,
        axes: vec![th1, th2, d],
        sample,
    })
}
