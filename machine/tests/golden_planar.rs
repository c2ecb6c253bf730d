//! The planar linkages against their golden vectors.

#![allow(clippy::unwrap_used)]

use machine::kinematics::{Attitude, JointMotion, Joints, ToolMotion};
use machine::mechanisms::{
    ActuatorBodies, FiveBar, FiveBarBranch, Prrrp, PrrrpBranch, TwinActuator, TwinBranch,
};
use machine::{Mechanism, Pose};
use messages::math;
use nalgebra::{Matrix2, Vector2, Vector3};
use serde_json::Value;

/// Relative; the golden vectors come from other equations for the same things.
const TOLERANCE: f64 = 1e-9;

fn golden(name: &str) -> Value {
    let path = format!("{}/../tests/golden/{name}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn list<'a>(file: &'a Value, key: &str) -> &'a [Value] {
    file[key].as_array().unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn pair(value: &Value) -> Vector2<f64> {
    Vector2::new(number(&value[0]), number(&value[1]))
}

fn in_plane(value: &Value) -> Vector3<f64> {
    Vector3::new(number(&value[0]), number(&value[1]), 0.0)
}

fn signs(value: &Value) -> [i32; 2] {
    let sign = |value: &Value| if number(value) > 0.0 { 1 } else { -1 };
    [sign(&value[0]), sign(&value[1])]
}

#[track_caller]
fn check(what: &str, found: f64, expected: f64, scale: f64) {
    let error = (found - expected).abs();
    assert!(error <= TOLERANCE * scale, "{what}: {found} against {expected}, off by {error:e}");
}

#[track_caller]
fn check_pair(what: &str, found: Vector2<f64>, expected: Vector2<f64>) {
    let scale = expected.amax().max(f64::MIN_POSITIVE);
    check(what, found.x, expected.x, scale);
    check(what, found.y, expected.y, scale);
}

/// Checks what the files of source 003 have in common, joints being `p` times those of the file;
/// gives the assembly and the motion.
fn check_pose<M: Mechanism<2>>(
    mechanism: &M,
    pose: &Value,
    p: f64,
) -> (M::ChainState, JointMotion<2>) {
    let branch = mechanism.branch();
    let tool = ToolMotion {
        position: in_plane(&pose["x"]),
        velocity: in_plane(&pose["v"]),
        acceleration: in_plane(&pose["a"]),
        jerk: Vector3::zeros(),
        attitude: Attitude::LEVEL,
    };
    let still = Joints::zeros();
    let q = mechanism.inverse(&Pose::at(tool.position), branch, &still).unwrap();
    check_pair("inverse", q / p, pair(&pose["q"]));
    let forward = mechanism.forward(&(pair(&pose["q"]) * p), branch).unwrap().position;
    check_pair("forward", forward.xy(), pair(&pose["x"]));

    let motion = mechanism.joint_motion(&tool, branch, &still).unwrap();
    check_pair("position", motion.position / p, pair(&pose["q"]));
    check_pair("velocity", motion.velocity / p, pair(&pose["qd"]));
    check_pair("acceleration", motion.acceleration / p, pair(&pose["qdd"]));

    let chain = mechanism.solve(&q, branch, None).unwrap();
    assert_eq!(mechanism.branch_of(&chain), branch);
    let effort = mechanism.inverse_dynamics(&chain, &motion.velocity, &motion.acceleration);
    check_pair("tau", effort * p, pair(&pose["tau"]));
    check("power", effort.dot(&motion.velocity), number(&pose["power"]), effort.norm());

    let j = mechanism.jacobian(&chain).fixed_view::<2, 2>(0, 0) * p;
    for row in 0..2 {
        check_pair("J", j.row(row).transpose(), pair(&pose["J"][row]));
    }
    let det = number(&pose["det_J"]);
    check("det J", j.determinant(), det, det.abs());
    let singular = j.singular_values();
    let ordered = Vector2::new(singular.max(), singular.min());
    check_pair("singular values", ordered, pair(&pose["singular_values"]));
    // The larger axis of the ellipse, which has no sense: compared modulo half a turn.
    let product = j * j.transpose();
    let spread = product[(0, 0)] - product[(1, 1)];
    let angle = math::atan2(2.0 * product[(0, 1)], spread) / 2.0;
    let off = (angle - number(&pose["manip_major_axis_angle"])) / core::f64::consts::PI;
    check("angle", off, off.round(), 1.0);
    (chain, motion)
}

fn five_bar() -> FiveBar {
    let file = golden("five_bar");
    let value = |key: &str| number(&file["params"][key]);
    FiveBar {
        half_base: value("e_half_base"),
        proximal: value("b_proximal"),
        distal: value("a_distal"),
        proximal_mass: value("m_proximal"),
        proximal_inertia: value("I_proximal_com"),
        distal_mass: value("m_distal"),
        distal_inertia: value("I_distal_com"),
        tool_mass: value("m_ee"),
        bar_mass: value("m_bar_y"),
        type_1_limit: 0.1,
        type_2_limit: 0.1,
        branch: FiveBarBranch {
            working_mode: signs(&file["params"]["working_mode"]),
            assembly_mode: 1,
        },
        elasticity: None,
    }
}

/// `a × b`.
fn cross(a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}

/// The force in the cut at the tool, each side with half of what the tool carries, from the moments
/// of both distal links about their elbows. A free body on its own: the mechanism's dynamics have no
/// such force.
fn reaction(
    link: (f64, f64),
    load: Vector2<f64>,
    links: [Vector2<f64>; 2],
    hinges: [Vector2<f64>; 2],
    tool: Vector2<f64>,
    turning: [f64; 2],
) -> Vector2<f64> {
    let (mass, inertia) = link;
    let moments = [0, 1].map(|side| {
        let centre = (hinges[side] + tool) / 2.0;
        inertia * turning[side]
            + cross(links[side] / 2.0, centre * mass)
            + cross(links[side], load.component_mul(&tool) / 2.0)
    });
    let [d1, d2] = links;
    let arms = Matrix2::new(-d1.y, d1.x, d2.y, -d2.x);
    arms.try_inverse().unwrap() * Vector2::from(moments)
}

#[test]
fn the_five_bar_agrees_with_its_golden_vectors() {
    let file = golden("five_bar");
    let mechanism = five_bar();
    let poses = list(&file, "poses");
    assert_eq!(poses.len(), 15);
    for pose in poses {
        let (chain, motion) = check_pose(&mechanism, pose, 1.0);
        // Passive joints, relative to the proximal links.
        let [th1, ph1, th2, ph2] = [0, 1, 2, 3].map(|index| number(&pose["Q4"][index]));
        let [_, pd1, _, pd2] = [0, 1, 2, 3].map(|index| number(&pose["Q4d"][index]));
        let [_, pdd1, _, pdd2] = [0, 1, 2, 3].map(|index| number(&pose["Q4dd"][index]));
        let (v, a) = (motion.velocity, motion.acceleration);
        let (tool_even, even) = chain.even_accelerations(&v);
        let absolute = [th1 + ph1, th2 + ph2];
        let mut turning = [0.0; 2];
        for arm in 0..2 {
            let (sine, cosine) = math::sin_cos(absolute[arm]);
            check_pair("distal", chain.distal[arm] / 0.25, Vector2::new(cosine, sine));
            let rate = chain.distal_rates[arm].dot(&v) - v[arm];
            check("passive velocity", rate, [pd1, pd2][arm], v.amax());
            turning[arm] = chain.distal_rates[arm].dot(&a) + even[arm];
            check("passive acceleration", turning[arm] - a[arm], [pdd1, pdd2][arm], a.amax());
        }
        let tool = chain.jacobian * a + tool_even;
        check_pair("tool acceleration", tool, pair(&pose["a"]));
        let hinges = [0, 1].map(|arm| {
            let p = chain.proximal[arm];
            Vector2::new(-p.y, p.x) * a[arm] - p * (v[arm] * v[arm])
        });
        let link = (mechanism.distal_mass, mechanism.distal_inertia);
        let load = Vector2::new(mechanism.tool_mass, mechanism.tool_mass + mechanism.bar_mass);
        let found = reaction(link, load, chain.distal, hinges, tool, turning);
        check_pair("R", found, pair(&pose["R"]));
    }
}

/// All four working modes and both assemblies of one place; the assembly that does not give the
/// place back is refused.
#[test]
fn every_mode_of_the_five_bar_is_its_own() {
    let file = golden("five_bar");
    let mechanism = five_bar();
    let place = Pose::at(in_plane(&file["modes_at"]["x"]));
    let modes = list(&file["modes_at"], "modes");
    assert_eq!(modes.len(), 4);
    for mode in modes {
        let assembly_mode = mode["reproduced_by_assembly"].as_i64().unwrap() as i32;
        let working_mode = signs(&mode["working_mode"]);
        let branch = FiveBarBranch { working_mode, assembly_mode };
        let q = mechanism.inverse(&place, branch, &Joints::zeros()).unwrap();
        check_pair("q", q, pair(&mode["q"]));
        let other = FiveBarBranch { assembly_mode: -assembly_mode, ..branch };
        let refused = mechanism.inverse(&place, other, &Joints::zeros()).unwrap_err();
        assert_eq!(refused.code, "wrong_assembly_mode");
        for answer in list(mode, "fk") {
            let assembly_mode = answer["assembly"].as_i64().unwrap() as i32;
            let asked = FiveBarBranch { assembly_mode, ..branch };
            let chain = mechanism.solve(&q, asked, None).unwrap();
            check_pair("forward", chain.tool, pair(&answer["x"]));
            let [p1, p2] = chain.proximal;
            let [d1, d2] = chain.distal;
            let found = mechanism.branch_of(&chain);
            assert_eq!(found.assembly_mode, assembly_mode);
            if found.assembly_mode == branch.assembly_mode {
                assert_eq!(found, branch);
                let (det_a, det_b) = (number(&mode["detA"]), number(&mode["detB"]));
                check("det A", cross(p1, d1) * cross(p2, d2), det_a, det_a.abs());
                check("det B", cross(d1, d2), det_b, det_b.abs());
            }
        }
    }
}

#[test]
fn the_prrrp_agrees_with_its_golden_vectors() {
    let file = golden("prrrp");
    let value = |key: &str| number(&file["params"][key]);
    let mechanism = Prrrp {
        link: value("L"),
        link_mass: value("m_link"),
        link_inertia: value("I_link_com"),
        cart_mass: value("m_cart"),
        tool_mass: value("m_ee"),
        bar_mass: value("m_bar_y"),
        type_1_limit: 0.1,
        type_2_limit: 0.1,
        branch: PrrrpBranch { side: 1 },
        elasticity: None,
    };
    let poses = list(&file, "poses");
    assert_eq!(poses.len(), 15);
    for pose in poses {
        let (chain, motion) = check_pose(&mechanism, pose, value("p_m_per_rad"));
        let (v, a) = (motion.velocity, motion.acceleration);
        check_pair("carts", motion.position, pair(&pose["carts"]));
        check_pair("cart velocity", v, pair(&pose["cart_vel"]));
        check_pair("cart acceleration", a, pair(&pose["cart_acc"]));
        let force = mechanism.inverse_dynamics(&chain, &v, &a);
        check_pair("cart force", force, pair(&pose["cart_force"]));
        let (tool_even, even) = chain.even_accelerations(&v);
        let tool = chain.jacobian * a + tool_even;
        check_pair("tool acceleration", tool, pair(&pose["a"]));
        let turning = [0, 1].map(|cart| chain.link_rates[cart].dot(&a) + even[cart]);
        let hinges = [0, 1].map(|cart| Vector2::new(0.0, a[cart]));
        let link = (mechanism.link_mass, mechanism.link_inertia);
        let load = Vector2::new(mechanism.tool_mass, mechanism.tool_mass + mechanism.bar_mass);
        let found = reaction(link, load, chain.links, hinges, tool, turning);
        check_pair("R", found, pair(&pose["R"]));
    }
}

fn twin_actuator() -> TwinActuator {
    let file = golden("twin_actuator");
    let value = |key: &str| number(&file["params"][key]);
    let bodies = ActuatorBodies {
        housing_inertia: 0.01,
        rod_mass: 0.4,
        rod_inertia: 0.002,
        rod_center: 0.15,
    };
    TwinActuator {
        bases: [pair(&file["params"]["A"]), pair(&file["params"]["B"])],
        offset: value("h"),
        offset_angle: value("th_h"),
        bodies: [bodies; 2],
        tool_mass: 0.3,
        baseline_limit: value("sin_min"),
        near_limit: value("sing_a"),
        branch: TwinBranch { elbow: 1 },
        elasticity: None,
    }
}

#[test]
fn the_twin_actuator_agrees_with_its_golden_vectors() {
    let file = golden("twin_actuator");
    let mechanism = twin_actuator();
    let branch = mechanism.branch;
    let cases = list(&file, "cases");
    assert_eq!(cases.len(), 15);
    for case in cases {
        let (input, output) = (&case["input"], &case["output"]);
        let tool = ToolMotion {
            velocity: in_plane(&input["v"]),
            ..ToolMotion::rest(&Pose::at(in_plane(&input["P"])))
        };
        let lengths = pair(&output["L_total"]);
        let q = mechanism.inverse(&tool.pose(), branch, &Joints::zeros()).unwrap();
        check_pair("lengths", q, lengths);
        let chain = mechanism.solve(&lengths, branch, None).unwrap();
        check_pair("forward", chain.tool, pair(&output["fk_P"]));
        check_pair("J", chain.joint, pair(&output["J"]));
        check("theta", chain.angle(), number(&output["theta"]), 1.0);
        for row in 0..2 {
            let expected = pair(&output["jacobian"][row]);
            check_pair("jacobian", chain.jacobian.row(row).transpose(), expected);
        }
        let det = number(&output["det"]);
        check("det", chain.jacobian.determinant(), det, det.abs());
        let motion = mechanism.joint_motion(&tool, branch, &Joints::zeros()).unwrap();
        check_pair("rates", motion.velocity, pair(&output["L_rate"]));
        // det = (La − h·cos θh)·Lb/(q·La·sin θ′), from the margins.
        let margin = |name: &str| {
            let margins = mechanism.margins(&chain);
            margins.iter().find(|margin| margin.name == name).unwrap().value
        };
        let base = (mechanism.bases[1] - mechanism.bases[0]).norm();
        let formula = margin("near_a") * q[1] / (base * q[0] * margin("baseline"));
        check("det formula", formula, number(&output["det_formula"]), det.abs());
    }
}

#[test]
fn the_twin_actuator_refuses_what_its_golden_vectors_refuse() {
    let file = golden("twin_actuator");
    let mechanism = twin_actuator();
    let mut refused = 0;
    for case in list(&file, "failing").iter().filter(|case| case["kind"] == "ik") {
        let expected = case["expect"].as_str().unwrap();
        let pose = Pose::at(in_plane(&case["input"]["P"]));
        let answer = mechanism.inverse(&pose, mechanism.branch, &Joints::zeros());
        if expected == "limit_la" {
            // The stroke is a limit of the axis: in reach of the mechanism, not of the axis.
            let stroke = answer.unwrap()[0] - number(&file["params"]["La"]);
            let longest = number(&file["params"]["limits"]["la"][1]);
            assert!(stroke > longest, "{stroke} against {longest}");
        } else {
            assert_eq!(answer.unwrap_err().code, expected, "{case}");
        }
        refused += 1;
    }
    assert_eq!(refused, 4);
}
