//! The polar machine against its golden vectors, and through the centre of its table.

#![allow(clippy::unwrap_used)]

mod support;

use machine::kinematics::{Attitude, Branch, Joints, ToolMotion};
use machine::mechanisms::polar::{PolarBranch, PolarLoad};
use machine::{Friction, Mechanism, Polar, Pose};
use messages::math;
use nalgebra::{Rotation3, Vector3, Vector6};
use serde_json::Value;
use support::{array, code_of, conforms, golden, near, number, vector};

fn polar(parameters: &Value) -> Polar {
    let of = |key: &str| number(&parameters[key]);
    Polar {
        arm: of("a1"),
        center_distance: of("c"),
        height: of("z0"),
        singular_radius: of("rho_sing"),
        endless: parameters["limits"]["th2"][0].is_null(),
        branch: PolarBranch::default(),
        load: PolarLoad {
            arm_mass: of("m1"),
            arm_center: of("ac"),
            arm_inertia: of("Izz1"),
            head_mass: of("m2"),
            head_center: of("rc2"),
            head_inertia: of("Izz2"),
            table_inertia: of("It"),
            workpiece_mass: of("mw"),
            workpiece_center: of("rw"),
            workpiece_inertia: of("Iw"),
            counterbalance: of("F_cb"),
            gravity: of("g"),
        },
        elasticity: None,
    }
}

fn reference() -> Polar {
    polar(&golden("polar")["params"])
}

fn side(value: &Value) -> PolarBranch {
    PolarBranch::default().choose("side", &[value.as_i64().unwrap() as i32]).unwrap()
}

fn previous(input: &Value) -> Joints<3> {
    Joints::from([0.0, number(&input["prev_th2"]), 0.0])
}

/// A line through `point` [m] along the unit vector `along`, at `speed`, with acceleration and jerk.
fn line(point: Vector3<f64>, along: Vector3<f64>, [v, a, j]: [f64; 3]) -> ToolMotion {
    ToolMotion {
        position: point,
        velocity: along * v,
        acceleration: along * a,
        jerk: along * j,
        attitude: Attitude::LEVEL,
    }
}

fn compare(parameters: &str, cases: &str) -> usize {
    let file = golden("polar");
    let machine = polar(&file[parameters]);
    let tolerance = number(&file["tolerance"]);
    let cases = file[cases].as_array().unwrap();
    for case in cases {
        let (input, output) = (&case["input"], &case["output"]);
        let context = input.to_string();
        let branch = side(&input["branch"]);
        let pose = Pose::at(vector(&input["p"]));
        let q = machine.inverse(&pose, branch, &previous(input)).unwrap();
        let expected: [f64; 3] = array(&output["q"]);
        near((q - Joints::from(expected)).amax(), 0.0, tolerance, &context);
        let back = machine.forward(&q, branch).unwrap().position;
        near((back - vector(&output["fk"])).amax(), 0.0, tolerance, &context);
        assert_eq!(machine.branch_of(&q).side, branch.side);
        let again = machine.inverse(&pose, machine.branch_of(&q), &Joints::zeros()).unwrap();
        near((again - q).amax(), 0.0, 1e-12, &context);
        let jacobian = machine.jacobian(&q);
        for row in 0..3 {
            let expected: [f64; 3] = array(&output["jacobian"][row]);
            for column in 0..3 {
                near(jacobian[(row, column)], expected[column], tolerance, &context);
            }
        }
    }
    cases.len()
}

#[test]
fn kinematics_agree_with_the_golden_vectors() {
    assert_eq!(compare("params", "cases"), 15);
    assert_eq!(compare("params_b", "cases_b"), 4);
}

#[test]
fn dynamics_statics_and_feed_agree_with_the_golden_vectors() {
    let file = golden("polar");
    let machine = reference();
    let parameters = &file["params"];
    let tolerance = number(&file["tolerance"]);
    let limits = Joints::from(
        ["th1_rate_max", "th2_rate_max", "d_rate_max"].map(|key| number(&parameters[key])),
    );
    for case in file["cases"].as_array().unwrap() {
        let (input, output) = (&case["input"], &case["output"]);
        let context = input.to_string();
        let q = Joints::from(array::<3>(&output["q"]));
        let mass = machine.mass_matrix(&q);
        let gravity = machine.gravity(&q);
        let velocity = Joints::from(array::<3>(&input["qd"]));
        let friction = Joints::from_fn(|axis, _| {
            let [coulomb, viscous] = ["coul", "visc"].map(|key| number(&parameters[key][axis]));
            Friction { coulomb, viscous }.torque(velocity[axis])
        });
        let acceleration = Joints::from(array(&input["qdd"]));
        let effort = machine.inverse_dynamics(&q, &velocity, &acceleration) + friction;
        let diagonal: [f64; 3] = array(&output["M_diag"]);
        let (held, tau): ([f64; 3], [f64; 3]) = (array(&output["G"]), array(&output["tau"]));
        for axis in 0..3 {
            near(mass[(axis, axis)], diagonal[axis], tolerance, &context);
            near(gravity[axis], held[axis], tolerance, &context);
            near(effort[axis], tau[axis], tolerance, &context);
        }
        let minor = machine.jacobian(&q).fixed_view::<2, 2>(0, 0).determinant();
        near(minor, number(&output["det_xy"]), tolerance, &context);
        let margin = machine.margins(&q)[0];
        near(margin.value, number(&output["det_xy"]).abs(), tolerance, &context);

        // The golden wrench is in the arm's frame, the mechanism's in that of the work.
        let to_work = Rotation3::from_axis_angle(&Vector3::z_axis(), q[0] - q[1]);
        let [force, moment] = ["wrench_f", "wrench_m"].map(|key| to_work * vector(&input[key]));
        let wrench = Vector6::from_fn(|row, _| if row < 3 { force[row] } else { moment[row - 3] });
        let statics = machine.wrench_efforts(&q, &wrench);
        let expected: [f64; 2] = array(&output["static"]);
        near(statics[0], expected[0], tolerance, &context);
        near(statics[2], expected[1], tolerance, &context);
        // What the table bears: the force's moment about its axis, and the moment, both backwards.
        let tool = machine.pose(&q).position;
        let borne = -(tool.cross(&force) + moment).z;
        near(statics[1], borne, tolerance, &context);

        let speed = vector(&input["v_workpiece"]);
        let tool = line(vector(&input["p"]), speed, [1.0, 0.0, 0.0]);
        let motion = machine.joint_motion(&tool, side(&input["branch"]), &previous(input)).unwrap();
        let expected = Joints::from(array::<3>(&output["qd_for_v"]));
        near((motion.velocity - expected).amax(), 0.0, tolerance, &context);
        // The share of its speed at which the motion keeps every joint's limit.
        let uses = motion.velocity.abs().component_div(&limits);
        let share = 1.0 / uses.max().max(1.0);
        near(share, number(&output["feed_scale"]), tolerance, &context);
    }
}

/// The code of a pose: what the inverse says, and else which of the limits its joints break.
fn verdict(machine: &Polar, parameters: &Value, input: &Value) -> String {
    let pose = Pose::at(vector(&input["p"]));
    match machine.inverse(&pose, side(&input["branch"]), &previous(input)) {
        Err(error) => error.code.to_owned(),
        Ok(q) => {
            let limits = &parameters["limits"];
            let names = ["th1", "th2", "d"];
            let broken = (0..3).find(|axis| {
                let [low, high] = [0, 1].map(|end| limits[names[*axis]][end].as_f64());
                low.is_some_and(|low| q[*axis] < low) || high.is_some_and(|high| q[*axis] > high)
            });
            broken.map_or("none".to_owned(), |axis| format!("limit_{}", names[axis]))
        }
    }
}

#[test]
fn what_cannot_be_reached_fails_with_the_golden_code() {
    let file = golden("polar");
    for case in file["failing"].as_array().unwrap() {
        let parameters = &file[case["params"].as_str().unwrap()];
        let code = verdict(&polar(parameters), parameters, &case["input"]);
        assert_eq!(code, case["expect"].as_str().unwrap(), "{case}");
    }
    // The blind disc of an arm that is longer than the table is far.
    let blind = polar(&file["params_b"]);
    let error = blind
        .inverse(&Pose::at(Vector3::new(0.009, 0.0, 0.05)), blind.branch, &Joints::zeros())
        .unwrap_err();
    assert_eq!((error.code, error.value), ("unreachable_radius", 0.009));
    near(error.limit, 0.01, 1e-15, "blind disc");
    let edge = line(Vector3::new(0.01, 0.0, 0.05), Vector3::y(), [0.1, 0.0, 0.0]);
    let on_edge = blind.joint_motion(&edge, blind.branch, &Joints::zeros()).unwrap_err();
    assert!(["singular_edge", "unreachable_radius"].contains(&on_edge.code), "{on_edge}");
    let lost = Pose::at(Vector3::new(f64::NAN, 0.0, 0.05));
    assert_eq!(code_of(blind.inverse(&lost, blind.branch, &Joints::zeros())), "unreachable_radius");
}

#[test]
fn a_line_through_the_centre_switches_the_side_and_moves_the_table_on() {
    let machine = reference();
    let mut q = Joints::from([-0.2, 1.47, 0.05]);
    for knot in golden("polar")["center_crossing"].as_array().unwrap() {
        let place = Vector3::new(number(&knot["x"]), number(&knot["y"]), 0.05);
        let tool = line(place, Vector3::x(), [0.1, 0.0, 0.0]);
        let moved = machine.joint_motion(&tool, machine.branch, &q).unwrap();
        let expected = Joints::from(array::<3>(&knot["q"]));
        near((moved.position - expected).amax(), 0.0, 1e-9, &knot.to_string());
        let solved = machine.inverse(&Pose::at(place), machine.branch, &q).unwrap();
        near((solved - expected).amax(), 0.0, 1e-9, &knot.to_string());
        assert_eq!(machine.branch_of(&solved).side, side(&knot["branch"]).side);
        q = moved.position;
    }
}

/// On a line along the unit vector at angle φ: θ₁ = 2·asin(σ/2a), θ₂ = θ₁/2 + π/2 − φ. The expected
/// derivatives are those of these two functions, by hand.
#[test]
fn rates_on_a_line_through_the_centre_are_exact_at_any_distance() {
    let machine = reference();
    let arm = machine.arm;
    let [v, a, j] = [0.3, 2.0, -40.0];
    for angle in [0.0, 0.7, 2.0, -2.9] {
        let (sine, cosine) = math::sin_cos(angle);
        let along = Vector3::new(cosine, sine, 0.0);
        let lead = core::f64::consts::FRAC_PI_2 - angle;
        for size in [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1.9e-4, 2.1e-4, 1e-3, 0.05] {
            for distance in [-size, size] {
                let tool = line(along * distance, along, [v, a, j]);
                let near_by = Joints::from([distance / arm, lead, 0.0]);
                let found = machine.joint_motion(&tool, machine.branch, &near_by).unwrap();
                let context = format!("{angle} {distance:e}: {found:?}");
                // u = σ/2a; half = asin u; half' = u'/c, c = √(1 − u²), and so on.
                let [u, u1, u2, u3] = [distance, v, a, j].map(|part| part / (2.0 * arm));
                let c = (1.0 - u * u).sqrt();
                let half = math::asin(u);
                let half1 = u1 / c;
                let half2 = u2 / c + u * u1 * u1 / (c * c * c);
                let half3 = u3 / c
                    + (3.0 * u * u1 * u2 + u1 * u1 * u1) / (c * c * c)
                    + 3.0 * u * u * u1 * u1 * u1 / (c * c * c * c * c);
                near(found.position[0], 2.0 * half, 1e-12, &context);
                near(found.position[1], half + lead, 1e-12, &context);
                // Outside of the singular radius rounding of the position is divided by ρ.
                let loss = if size > machine.singular_radius { 1e3 } else { 1.0 };
                for (found, expected) in
                    [(found.velocity, half1), (found.acceleration, half2), (found.jerk, half3)]
                {
                    let scale = 1e-9 * loss * (1.0 + expected.abs());
                    near(found[0], 2.0 * expected, scale, &context);
                    near(found[1], expected, scale, &context);
                }
            }
        }
    }
}

/// 401 samples at 1 kHz through the centre: no step of a joint is larger than its rate allows, and
/// the table takes 2e-4 rad for 50 µm.
#[test]
fn a_marked_line_through_the_centre_is_smooth() {
    let machine = reference();
    let mut q = Joints::from([-0.08, 1.5, 0.0]);
    for sample in -200..=200 {
        let x = f64::from(sample) * 1e-4;
        let tool = line(Vector3::new(x, 0.0, 0.0), Vector3::x(), [0.1, 0.0, 0.0]);
        let moved = machine.joint_motion(&tool, machine.branch, &q).unwrap();
        if sample > -200 {
            near(moved.position[1] - q[1], 2e-4, 1e-6, "table");
            near(moved.position[0] - q[0], 4e-4, 2e-6, "arm");
        }
        let back = machine.forward(&moved.position, machine.branch).unwrap().position;
        near((back - tool.position).norm(), 0.0, 1e-15, "round trip");
        q = moved.position;
    }
    near(q[0], 0.08, 1e-3, "the arm crosses to the other side");
}

/// On a circle through the centre, of radius R at angular speed ω, the direction of the tool from
/// the centre turns at ω/2: θ₂' = θ₁'/2 − ω/2, and θ₂'' = θ₁''/2.
#[test]
fn a_circle_through_the_centre_is_smooth() {
    let machine = reference();
    let (radius, turning) = (0.02, 5.0);
    let mut q = Joints::zeros();
    let mut first = true;
    for sample in -400..=400 {
        let angle = f64::from(sample) * 1e-4;
        let (s, c) = math::sin_cos(angle);
        let tool = ToolMotion {
            position: Vector3::new(radius * s, radius * (1.0 - c), 0.0),
            velocity: Vector3::new(c, s, 0.0) * (radius * turning),
            acceleration: Vector3::new(-s, c, 0.0) * (radius * turning * turning),
            jerk: Vector3::new(-c, -s, 0.0) * (radius * turning * turning * turning),
            attitude: Attitude::LEVEL,
        };
        if first {
            let side = PolarBranch { side: Some(-1), table_turn: None };
            q = machine.joint_motion(&tool, side, &q).unwrap().position;
            first = false;
        }
        let moved = machine.joint_motion(&tool, machine.branch, &q).unwrap();
        assert!((moved.position - q).amax() < 2e-3, "{sample}: {moved:?} after {q:?}");
        near(moved.velocity[1], (moved.velocity[0] - turning) / 2.0, 1e-6, &format!("{sample}"));
        // Next to the centre the fourth derivative of the path, which nobody gives, is missing:
        // 1e-4 of ω², where the limits are in the thousands.
        near(moved.acceleration[1], moved.acceleration[0] / 2.0, 3e-3, &format!("{sample}"));
        let back = machine.forward(&moved.position, machine.branch).unwrap().position;
        near((back - tool.position).norm(), 0.0, 1e-12, "round trip");
        q = moved.position;
    }
}

/// At a miss of 1 mm the table turns by almost half a turn, at up to v/ρ.
#[test]
fn a_line_beside_the_centre_turns_the_table() {
    let machine = reference();
    let at = |x: f64, q: &Joints<3>| {
        let tool = line(Vector3::new(x, 1e-3, 0.0), Vector3::x(), [0.05, 0.0, 0.0]);
        machine.joint_motion(&tool, machine.branch, q).unwrap()
    };
    let start = at(-0.1, &Joints::zeros());
    let mut q = start.position;
    let mut fastest = 0.0_f64;
    for sample in -1000..=1000 {
        let moved = at(f64::from(sample) * 1e-4, &q);
        fastest = fastest.max(moved.velocity[1].abs());
        assert!((moved.position[1] - q[1]).abs() < 0.11, "{moved:?}");
        q = moved.position;
    }
    near(fastest, 0.05 / 1e-3, 0.2, "v/rho");
    near((q[1] - start.position[1]).abs(), 3.13, 0.01, "half a turn");
}

#[test]
fn a_path_may_start_and_end_in_the_centre() {
    let machine = reference();
    let along = Vector3::new(0.6, -0.8, 0.0);
    let q = Joints::from([0.01, 2.5, 0.0]);
    // At rest the table stays; there is no better angle.
    let rest = line(Vector3::zeros(), along, [0.0; 3]);
    let held = machine.joint_motion(&rest, machine.branch, &q).unwrap();
    assert_eq!(
        (held.position, held.velocity),
        (Joints::from([0.0, 2.5, 0.0]), Joints::<3>::zeros())
    );
    // Coming to rest, or leaving it, the jerk alone tells the direction.
    let stop = line(Vector3::zeros(), along, [0.0, 0.0, -100.0]);
    let ending = machine.joint_motion(&stop, machine.branch, &q).unwrap();
    let before = line(along * -1e-3, along, [0.02, -1.0, -100.0]);
    let coming = machine.joint_motion(&before, machine.branch, &q).unwrap();
    near((ending.position - coming.position).amax(), 0.0, 5e-3, "the same table angle");
    near(ending.jerk[1], ending.jerk[0] / 2.0, 1e-9, "jerk");
}

#[test]
fn it_conforms() {
    for (parameters, low) in [("params", 2e-3), ("params_b", 0.03)] {
        let machine = polar(&golden("polar")[parameters]);
        let branch = side(&Value::from(1));
        conforms(&machine, branch, |random| {
            let radius = low + 0.1 * (random.next() + 1.0) / 2.0;
            let (s, c) = math::sin_cos(3.0 * random.next());
            let mut tool = line(
                Vector3::new(radius * c, radius * s, 0.05 * random.next()),
                Vector3::zeros(),
                [0.0; 3],
            );
            // Slower near the centre, where the table follows as v/ρ.
            let pace = radius / 0.1;
            tool.velocity = random.vector(0.2 * pace);
            tool.acceleration = random.vector(2.0 * pace);
            tool.jerk = random.vector(50.0 * pace);
            tool
        });
    }
}

#[test]
fn branches_have_names_and_values() {
    let free = PolarBranch::default();
    assert!(free.choices().is_empty());
    let chosen = free.choose("branch", &[-1]).unwrap().choose("table_turn", &[3]).unwrap();
    assert_eq!(chosen.choices(), [("side", vec![-1]), ("table_turn", vec![3])]);
    assert_eq!(chosen.choose("branch", &[]).unwrap().choose("table_turn", &[]), Some(free));
    assert_eq!(free.choose("side", &[2]), None);
    assert_eq!(free.choose("elbow", &[1]), None);
    assert_eq!(chosen.in_any_turn(), free.choose("side", &[-1]).unwrap());
    let machine = reference();
    let pose = Pose::at(Vector3::new(0.03, 0.04, 0.0));
    let q = machine.inverse(&pose, chosen, &Joints::zeros()).unwrap();
    assert!(q[0] < 0.0 && (q[1] / math::TURN - 3.0).abs() <= 0.5, "{q}");
}
