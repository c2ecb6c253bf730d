//! The mcm against its golden vectors, its attitudes and its dynamics.

#![allow(clippy::unwrap_used)]

mod support;

use machine::kinematics::{Attitude, Branch, Joints, TaskSpace, ToolMotion};
use machine::mechanisms::mcm::{McmBranch, McmLoad};
use machine::{Mcm, Mechanism, Pose};
use messages::math;
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;
use support::{Random, array, code_of, conforms, golden, near, number, vector};

fn mcm(parameters: &Value) -> Mcm {
    let of = |key: &str| number(&parameters[key]);
    Mcm {
        tool: of("l"),
        offset: of("x0"),
        height: of("z0"),
        reach: array(&parameters["limits"]["X"]),
        singular_distance: of("v_sing"),
        branch: McmBranch::default(),
        load: support::loads::MCM,
        elasticity: None,
    }
}

fn reference() -> Mcm {
    mcm(&golden("mcm")["params"])
}

fn branch(sign: &Value) -> McmBranch {
    McmBranch { side: Some(sign.as_i64().unwrap() as i32), lean: None }
}

/// A rotation whose −z is `axis`, turned about it by `roll` [rad].
fn pointing(axis: &Vector3<f64>, roll: f64) -> Matrix3<f64> {
    let up = -axis.normalize();
    let side = up.cross(&Vector3::new(0.3, -0.8, 0.52)).normalize();
    let (s, c) = math::sin_cos(roll);
    let x = side * c + up.cross(&side) * s;
    Matrix3::from_columns(&[x, up.cross(&x), up])
}

/// The golden Jacobian's lower rows are the rates of the tool's axis, ω × t.
fn check_jacobian(machine: &Mcm, q: &Joints<5>, expected: &Value, context: &str) {
    let jacobian = machine.jacobian(q);
    let axis = -machine.pose(q).rotation.column(2).into_owned();
    for column in 0..5 {
        let angular: Vector3<f64> = jacobian.fixed_view::<3, 1>(3, column).into_owned();
        let leaning = angular.cross(&axis);
        for row in 0..3 {
            let entry = number(&expected[row][column]);
            near(jacobian[(row, column)], entry, 1e-9, context);
            near(leaning[row], number(&expected[row + 3][column]), 1e-9, context);
        }
    }
}

#[test]
fn machine_angles_agree_with_the_golden_vectors() {
    let file = golden("mcm");
    let machine = reference();
    let limits: [f64; 2] = array(&file["params"]["limits"]["X"]);
    let cases = file["cases_ik_ar"].as_array().unwrap();
    assert_eq!(cases.len(), 15);
    for case in cases {
        let (input, output) = (&case["input"], &case["output"]);
        let context = input.to_string();
        let previous = Joints::from([0.0, 0.0, number(&input["prev_d"]), 0.0, 0.0]);
        let (a, r) = (number(&input["a"]), number(&input["r"]));
        let position = vector(&input["p"]);
        let solve =
            |side| machine.inverse_machine_angles(&position, a, r, side, &previous).unwrap();
        for solution in output["branches"].as_array().unwrap() {
            let q = solve(branch(&solution["sign"]).side);
            let expected = Joints::from(array::<5>(&solution["q"]));
            near((q - expected).amax(), 0.0, 1e-9, &context);
            let back = machine.forward(&q, machine.branch).unwrap();
            near((back.position - position).norm(), 0.0, 1e-14, &context);
            // Continuity keeps the side, wherever the limits are.
            let again = machine.inverse_machine_angles(&position, a, r, None, &q).unwrap();
            near((again - q).amax(), 0.0, 1e-12, &context);
        }
        let q = solve(branch(&input["sign"]).side);
        near((q - Joints::from(array::<5>(&output["q"]))).amax(), 0.0, 1e-9, &context);
        let axis = -machine.pose(&q).rotation.column(2).into_owned();
        near((axis - vector(&output["tool_axis_workpiece"])).amax(), 0.0, 1e-9, &context);
        check_jacobian(&machine, &q, &output["jacobian"], &context);
        let minor = machine.jacobian(&q);
        let determinant = minor[(0, 0)] * minor[(1, 2)] - minor[(0, 2)] * minor[(1, 0)];
        near(determinant.abs(), number(&output["det_xy_Xd"]).abs(), 1e-9, &context);
        // Without a previous joint position the carriage's travel chooses, if it can.
        let free = solve(None);
        assert!(limits[0] <= free[0] && free[0] <= limits[1], "{free} {context}");
    }
}

#[test]
fn tool_axes_agree_with_the_golden_vectors() {
    let file = golden("mcm");
    let machine = reference();
    let cases = file["cases_ik_dir"].as_array().unwrap();
    assert_eq!(cases.len(), 15);
    for case in cases {
        let (input, output) = (&case["input"], &case["output"]);
        let context = input.to_string();
        let previous = Joints::from(array::<5>(&input["prev_q"]));
        let axis = vector(&input["tool_axis"]);
        for roll in [0.0, 2.0] {
            let pose = Pose { position: vector(&input["p"]), rotation: pointing(&axis, roll) };
            let q = machine.inverse(&pose, branch(&input["sign_X"]), &previous).unwrap();
            near((q - Joints::from(array::<5>(&output["q"]))).amax(), 0.0, 1e-9, &context);
            let kept = machine.inverse(&pose, machine.branch, &q).unwrap();
            near((kept - q).amax(), 0.0, 1e-12, &context);
            let back = machine.forward(&q, machine.branch).unwrap();
            near((back.position - vector(&output["fk_p"])).amax(), 0.0, 1e-9, &context);
            let along = -back.rotation.column(2);
            near((along - vector(&output["fk_t"])).amax(), 0.0, 1e-9, &context);
            check_jacobian(&machine, &q, &output["jacobian"], &context);
            let margins = machine.margins(&q);
            let singularity = margins[0].value * margins[1].value;
            near(singularity, number(&output["singularity"]), 1e-9, &context);
        }
    }
}

/// The code of a pose: what the inverse says, and else which of the limits its joints break.
fn verdict(machine: &Mcm, limits: &Value, case: &Value) -> String {
    let input = &case["input"];
    let position = vector(&input["p"]);
    let turned = input["prev_d"].as_f64().unwrap_or(0.0);
    let previous = Joints::from([0.3, 0.0, turned, 0.0, 0.0]);
    let side = input["sign"].as_i64().map(|sign| sign as i32).or(Some(1));
    let solution = if case["kind"] == "ar" {
        let (a, r) = (number(&input["a"]), number(&input["r"]));
        machine.inverse_machine_angles(&position, a, r, side, &previous)
    } else {
        let rotation = pointing(&vector(&input["tool_axis"]), 0.0);
        machine.inverse(&Pose { position, rotation }, McmBranch { side, lean: None }, &previous)
    };
    match solution {
        Err(error) => error.code.to_owned(),
        Ok(q) => {
            let names = ["X", "Z", "d", "a", "r"];
            let broken = (0..5).find(|axis| {
                let [low, high]: [f64; 2] = array(&limits[names[*axis]]);
                q[*axis] < low || q[*axis] > high
            });
            broken.map_or("none".to_owned(), |axis| format!("limit_{}", names[axis]))
        }
    }
}

#[test]
fn what_cannot_be_reached_fails_with_the_golden_code() {
    let file = golden("mcm");
    let machine = reference();
    let mut kinematic = 0;
    for case in file["failing"].as_array().unwrap() {
        if case["kind"] != "cone" {
            let code = verdict(&machine, &file["params"]["limits"], case);
            assert_eq!(code, case["expect"].as_str().unwrap(), "{case}");
            kinematic += 1;
        }
    }
    assert_eq!(kinematic, 6);
    let level = |x: f64| Pose::at(Vector3::new(x, 0.0, 0.2));
    let at = |x| code_of(machine.inverse(&level(x), machine.branch, &Joints::zeros()));
    assert_eq!(at(0.020_000_1), "singular");
    assert_eq!(at(0.0), "unreachable_radius");
    assert_eq!(at(f64::NAN), "unreachable_radius");
}

/// Source 002 eq. 10, as its secant sees it.
fn secant_residual(
    x: f64,
    position: [f64; 2],
    offset: f64,
    arctangent: fn(f64, f64) -> f64,
) -> f64 {
    let gamma = arctangent(-position[0], position[1]);
    let d = gamma + arctangent(offset, x);
    let (sine, cosine) = math::sin_cos(d);
    -x + (position[1] - sine * offset) / cosine
}

#[test]
fn the_sources_secant_stops_at_once_where_y_is_0_and_the_closed_form_does_not() {
    let machine = reference();
    let trap = &golden("mcm")["secant_trap"][0];
    let place: [f64; 2] = array(&trap["p_xy"]);
    for (x, residual) in trap["residual_at"].as_object().unwrap() {
        let x: f64 = x.parse().unwrap();
        assert!(number(residual).abs() < 1e-12);
        near(secant_residual(x, place, machine.offset, math::atan2), 0.0, 1e-12, "any X solves it");
    }
    let position = Vector3::new(place[0], place[1], 0.2);
    let q = machine.inverse_machine_angles(&position, 0.0, 0.0, Some(1), &Joints::zeros()).unwrap();
    near(q[0], number(&trap["true_X"]), 1e-15, "X");
    // With the printed arctan a point with y < 0 is even away from its own solution.
    let below = Vector3::new(0.1, -0.25, 0.2);
    let q = machine.inverse_machine_angles(&below, 0.0, 0.0, Some(1), &Joints::zeros()).unwrap();
    let printed = |y, x| math::atan(y / x);
    near(secant_residual(q[0], [0.1, -0.25], machine.offset, math::atan2), 0.0, 1e-12, "atan2");
    assert!(secant_residual(q[0], [0.1, -0.25], machine.offset, printed).abs() > 0.1);
}

/// From the starts 0.30 and 0.31 the secant finds the given solution in most places only; the closed
/// form in all of them.
#[test]
fn the_closed_form_finds_what_the_secant_misses() {
    let machine = reference();
    let mut random = Random::new(5);
    let (mut secant, mut printed, cases) = (0, 0, 1000);
    for _ in 0..cases {
        let (x, d) = (0.3 + 0.2 * random.next(), 3.0 * random.next());
        let q = Joints::from([x, 0.1, d, 0.0, 0.0]);
        let place = machine.forward(&q, machine.branch).unwrap().position;
        let found = machine.inverse_machine_angles(&place, 0.0, 0.0, Some(1), &q).unwrap();
        near((found - q).amax(), 0.0, 1e-12, &format!("{q}"));
        let solve = |arctangent: fn(f64, f64) -> f64| {
            let residual =
                |x: f64| secant_residual(x, [place.x, place.y], machine.offset, arctangent);
            let (mut before, mut here) = (0.30, 0.31);
            for _ in 0..60 {
                let (low, high) = (residual(before), residual(here));
                if high == low {
                    break;
                }
                (before, here) = (here, here - high * (here - before) / (high - low));
            }
            (here - x).abs() < 1e-6
        };
        secant += i32::from(solve(math::atan2));
        printed += i32::from(solve(|y, x| math::atan(y / x)));
    }
    assert!(secant < cases && secant > cases * 8 / 10, "atan2: {secant} of {cases}");
    assert!(printed < cases * 6 / 10, "arctan as printed: {printed} of {cases}");
}

fn still(position: Vector3<f64>, rotation: Matrix3<f64>) -> ToolMotion {
    ToolMotion::rest(&Pose { position, rotation })
}

/// Upright, the turn stays; a tool that begins to lean from there has none.
#[test]
fn an_upright_tool_keeps_its_turn() {
    let machine = reference();
    let previous = Joints::from([0.3, 0.1, 0.2, 0.4, 1.7]);
    let mut tool = still(Vector3::new(-0.1, 0.28, 0.05), Matrix3::identity());
    tool.velocity = Vector3::new(0.1, -0.2, 0.03);
    let motion = machine.joint_motion(&tool, machine.branch, &previous).unwrap();
    assert_eq!((motion.position[3], motion.position[4]), (0.0, 1.7));
    for rates in [motion.velocity, motion.acceleration, motion.jerk] {
        assert_eq!((rates[3], rates[4]), (0.0, 0.0));
        assert!(rates.iter().all(|rate| rate.is_finite()));
    }
    let linear = machine.jacobian(&motion.position) * motion.velocity;
    near((linear.fixed_rows::<3>(0) - tool.velocity).norm(), 0.0, 1e-15, "velocity");
    tool.attitude.velocity = Vector3::new(0.01, 0.0, 0.0);
    let error = machine.joint_motion(&tool, machine.branch, &previous).unwrap_err();
    assert_eq!((error.code, error.value), ("singular_axis", 0.01));
    // Turning about itself is not leaning.
    tool.attitude.velocity = Vector3::new(0.0, 0.0, 3.0);
    assert!(machine.joint_motion(&tool, machine.branch, &previous).is_ok());
}

/// A beam that leans one way, passes the vertical and leans the other way: the head keeps its turn, the
/// tilt changes its sign, and all rates are those of the joints before and after.
#[test]
fn a_path_through_the_vertical_keeps_the_heads_turn() {
    let machine = reference();
    // Leans about an axis of the work by 0.4 rad/s while the tool goes on.
    let rate = Vector3::new(0.24, 0.32, 0.0);
    let velocity = Vector3::new(0.03, -0.05, 0.01);
    let at = |time: f64| {
        let turn = nalgebra::Rotation3::new(rate * time);
        ToolMotion {
            position: Vector3::new(-0.1, 0.28, 0.05) + velocity * time,
            velocity,
            attitude: Attitude { velocity: rate, ..Attitude::fixed(*turn.matrix()) },
            ..still(Vector3::zeros(), Matrix3::identity())
        }
    };
    let first = machine.inverse(&at(-0.5).pose(), machine.branch, &Joints::zeros()).unwrap();
    for step in [2e-3, 1e-5, 3.3e-8] {
        let mut previous = first;
        // Up to near the vertical in coarse steps, then across it in fine ones.
        for index in 0..=500 {
            let tool = at(-0.5 + (0.5 - 50.0 * step) * f64::from(index) / 500.0);
            previous = machine.joint_motion(&tool, machine.branch, &previous).unwrap().position;
        }
        assert!(previous[3] > 0.0);
        let mut rates: Option<Joints<5>> = None;
        let mut branch = machine.branch;
        for index in -50..=50 {
            let tool = at(f64::from(index) * step);
            if index > 0 {
                // Away from the vertical the side of the lean says which solution it is.
                branch = branch.choose("lean", &[-1]).unwrap();
            }
            let motion = machine.joint_motion(&tool, branch, &previous).unwrap();
            let case = format!("step {step:e} at {index}: {:?}", motion.velocity);
            assert!((motion.position - previous).amax() < 10.0 * step + 1e-3, "{case}");
            near(
                machine
                    .forward(&motion.position, branch)
                    .unwrap()
                    .position
                    .metric_distance(&tool.position),
                0.0,
                1e-12,
                &case,
            );
            if let Some(rates) = rates {
                assert!((motion.velocity - rates).amax() < 30.0 * step + 1e-5, "{case}");
            }
            (previous, rates) = (motion.position, Some(motion.velocity));
        }
        assert!(previous[3] < 0.0, "the tilt changes its sign");
        near(previous[3], -0.4 * 50.0 * step, 1e-9, "tilt");
    }
    // A head that is turned across the way would have to jump.
    let mut across = first;
    across[4] += 1.2;
    let error = machine.joint_motion(&at(0.0), machine.branch, &across).unwrap_err();
    assert_eq!((error.code, error.axis), ("singular_axis", Some(4)));
}

#[test]
fn it_conforms() {
    let machine = reference();
    assert_eq!(machine.task_space(), TaskSpace::Axis);
    for side in [1, -1] {
        conforms(&machine, McmBranch { side: Some(side), lean: None }, |random| {
            let (s, c) = math::sin_cos(3.0 * random.next());
            let radius = 0.3 + 0.1 * random.next();
            let mut tool = still(
                Vector3::new(radius * c, radius * s, 0.2 + 0.1 * random.next()),
                Matrix3::identity(),
            );
            let (s, c) = math::sin_cos(3.0 * random.next());
            let (lean, level) = math::sin_cos(0.9 + 0.6 * random.next());
            let axis = Vector3::new(lean * c, lean * s, -level);
            tool.velocity = random.vector(0.2);
            tool.acceleration = random.vector(2.0);
            tool.jerk = random.vector(50.0);
            tool.attitude = Attitude {
                rotation: pointing(&axis, random.next()),
                velocity: random.vector(0.5),
                acceleration: random.vector(3.0),
                jerk: random.vector(40.0),
            };
            tool
        });
    }
}

#[test]
fn branches_have_names_and_values() {
    let free = McmBranch::default();
    assert!(free.choices().is_empty());
    let chosen = free.choose("sign", &[-1]).unwrap();
    assert_eq!(chosen.choices(), [("side", vec![-1])]);
    assert_eq!(chosen.choose("side", &[]), Some(free));
    assert_eq!(free.choose("side", &[0]), None);
    assert_eq!(free.choose("elbow", &[1]), None);
    let machine = reference();
    let leaning = chosen.choose("lean", &[-1]).unwrap();
    assert_eq!(leaning.choices(), [("side", vec![-1]), ("lean", vec![-1])]);
    assert_eq!(leaning.choose("lean", &[]), Some(chosen));
    assert_eq!(machine.branch_of(&Joints::from([-0.2, 0.0, 0.0, -0.1, 0.0])), leaning);
    let straight = chosen.choose("lean", &[1]);
    assert_eq!(Some(machine.branch_of(&Joints::from([-0.2, 0.0, 0.0, 0.0, 0.0]))), straight);
}

/// A tree of rigid bodies, by an engine that knows nothing of this mechanism's equations: efforts by
/// recursive Newton and Euler, inertias by composite bodies.
#[test]
fn pose_and_dynamics_agree_with_a_tree_of_rigid_bodies() {
    let file = golden("independent_mcm");
    let parameters = &file["params"];
    let of = |key: &str| number(&parameters[key]);
    let machine = Mcm {
        tool: of("l"),
        offset: of("x0"),
        height: of("z0"),
        load: McmLoad {
            carriage_mass: of("carriage_mass"),
            slide_mass: of("slide_mass"),
            table_inertia: of("table_inertia"),
            yoke_inertia: of("yoke_inertia"),
            head_mass: of("head_mass"),
            head_center: of("head_center"),
            head_inertia: array(&parameters["head_inertia"]),
            counterbalance: of("counterbalance"),
            gravity: of("gravity"),
        },
        ..reference()
    };
    let tolerance = number(&file["tolerance"]);
    let cases = file["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 12);
    for case in cases {
        let context = case["q"].to_string();
        let joints = |key: &str| Joints::from(array::<5>(&case[key]));
        let (q, velocity, acceleration) = (joints("q"), joints("velocity"), joints("acceleration"));
        let pose = machine.pose(&q);
        near((pose.position - vector(&case["position"])).amax(), 0.0, tolerance, &context);
        let mass = machine.mass_matrix(&q);
        for row in 0..5 {
            let expected: [f64; 5] = array(&case["mass"][row]);
            for column in 0..5 {
                near(mass[(row, column)], expected[column], tolerance, &context);
            }
            if row < 3 {
                let expected = vector(&case["rotation"][row]).transpose();
                near((pose.rotation.row(row) - expected).amax(), 0.0, tolerance, &context);
            }
        }
        let effort = machine.inverse_dynamics(&q, &velocity, &acceleration);
        for (found, key) in [
            (machine.bias(&q, &velocity), "bias"),
            (machine.gravity(&q), "gravity"),
            (effort, "effort"),
        ] {
            near((found - joints(key)).amax(), 0.0, tolerance, &format!("{key} {context}"));
        }
    }
}

/// A rest that `home_axes` gives is held to the area, the limits and the margins as one by a place is.
#[test]
fn a_home_by_its_axes_is_refused_where_the_machine_cannot_rest() {
    let text = include_str!("../../machines/mcm.toml");
    let given = "home_axes = [\"320 mm\", \"100 mm\", \"0 deg\", \"45 deg\", \"180 deg\"]";
    assert!(text.contains(given));
    let refused = |home: &str, expected: &[&str]| {
        let changed = text.replacen(given, &format!("home_axes = [{home}]"), 1);
        let error = machine::Machine::parse("mcm.toml", &changed, &[]).unwrap_err();
        let problems: Vec<(Option<usize>, String)> =
            error.problems().map(|problem| (problem.line(), format!("{problem:?}"))).collect();
        for part in expected {
            assert!(problems.iter().any(|(_, text)| text.contains(part)), "{part}: {problems:?}");
        }
        let line = 1 + text.lines().position(|line| line == given).unwrap();
        assert!(problems.iter().any(|(at, _)| *at == Some(line)), "{problems:?}");
    };
    // Lowered by 500 mm the tool is 135 mm below the table.
    refused(
        r#""320 mm", "500 mm", "0 deg", "45 deg", "180 deg""#,
        &["outside the area: z is -0.134853 m, the area is from 0 m to 0.45 m", "widen the area"],
    );
    // The carriage over the table's axis, nearer than 0.1 mm.
    refused(
        r#""0.05 mm", "100 mm", "0 deg", "45 deg", "180 deg""#,
        &["`distance` is 0.000050, and must be 0.0001 or more", "farther from it"],
    );
}

#[test]
fn a_home_by_its_axes_is_refused_outside_of_their_limits() {
    let text = include_str!("../../machines/mcm.toml");
    let changed = text.replacen("\"45 deg\", \"180 deg\"", "\"-20 deg\", \"180 deg\"", 1);
    let error = machine::Machine::parse("mcm.toml", &changed, &[]).unwrap_err();
    let all = format!("{:?}", error.problems().collect::<Vec<_>>());
    assert!(all.contains("axis `a` is at -0.3490658503988659 rad at home"), "{all}");
    assert!(all.contains("`home_axes`"), "{all}");
}
