//! The platform on three planar motors: against its golden vectors, and by independent routes.

#![allow(clippy::unwrap_used)]

mod support;

use machine::Mechanism;
use machine::kinematics::{
    Attitude, Branch, JointMotion, Joints, KinematicsError, Pose, ToolMotion,
};
use machine::mechanisms::tri_planar::{Fold, Legs, Mounting, TriPlanar, TriPlanarBranch};
use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, Vector3};
use serde_json::Value;
use support::{Random, golden, number};

fn list<const N: usize>(value: &Value) -> [f64; N] {
    core::array::from_fn(|index| number(&value[index]))
}

fn matrix(value: &Value) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| number(&value[row][column]))
}

fn mechanism(params: &Value) -> TriPlanar {
    TriPlanar {
        side: number(&params["a"]),
        struts: [[number(&params["a"]); 2]; 3],
        mounting: None,
        home: None,
        stator: [list(&params["stator"][0]), list(&params["stator"][1])],
        inductor: number(&params["inductor"]),
        gap: number(&params["gap"]),
        clearance: number(&params["z_clear"]),
        type_1_limit: number(&params["margin1_min"]),
        type_2_limit: number(&params["sigma2_min"]),
        platform_mass: 0.8,
        platform_inertia: [2.1e-3, 2.3e-3, 4.0e-3],
        leg_mass: 0.15,
        inductor_mass: 0.35,
        legs: Legs::default(),
        elasticity: None,
    }
}

fn legs(modes: &Value) -> TriPlanarBranch {
    let fold = |mode| if mode > 0.0 { Fold::Outward } else { Fold::Inward };
    Legs(list::<3>(modes).map(fold)).into()
}

/// Roll, pitch and yaw about the fixed axes.
fn rotation(rpy: &Value) -> Matrix3<f64> {
    let [roll, pitch, yaw] = list(rpy);
    Rotation3::from_euler_angles(roll, pitch, yaw).into_inner()
}

/// The feet without the limits, which some golden poses break.
fn unlimited(mechanism: &TriPlanar) -> TriPlanar {
    let far = [-1e3, 1e3];
    TriPlanar {
        stator: [far; 2],
        gap: -1.0,
        clearance: 0.0,
        type_1_limit: 0.0,
        type_2_limit: 0.0,
        ..*mechanism
    }
}

fn at_rest() -> Joints<6> {
    Joints::zeros()
}

#[track_caller]
fn near(found: f64, expected: f64, tolerance: f64, context: &str) {
    let error = (found - expected).abs();
    assert!(error <= tolerance, "{found} against {expected} (off by {error:e}), {context}");
}

#[track_caller]
fn same_pose(found: &Pose, expected: &Pose, tolerance: f64, context: &str) {
    near((found.position - expected.position).amax(), 0.0, tolerance, context);
    near((found.rotation - expected.rotation).amax(), 0.0, tolerance, context);
}

fn golden_case(mechanism: &TriPlanar, case: &Value, tolerance: f64, fk_tolerance: f64) {
    let (input, output) = (&case["input"], &case["output"]);
    let context = &input.to_string();
    let branch = legs(&input["modes"]);
    let pose = Pose { position: list(&input["t"]).into(), rotation: matrix(&input["R"]) };
    let q = mechanism.inverse(&pose, branch, &at_rest()).unwrap();
    near((q - Joints::from(list::<6>(&output["motors"]))).amax(), 0.0, tolerance, context);

    let cold = mechanism.solve(&q, branch, None).unwrap();
    same_pose(&mechanism.pose(&cold), &pose, fk_tolerance, context);
    assert_eq!(mechanism.branch_of(&cold), branch, "{context}");
    let guess = Pose {
        position: list(&input["fk_guess_t"]).into(),
        rotation: matrix(&input["fk_guess_R"]),
    };
    // The guesses lie outside the limits now and then.
    if let Ok(guessed) = unlimited(mechanism).inverse(&guess, branch, &at_rest())
        && let Ok(start) = mechanism.solve(&guessed, branch, None)
    {
        let warm = mechanism.solve(&q, branch, Some(&start)).unwrap();
        same_pose(&mechanism.pose(&warm), &pose, fk_tolerance, context);
    }

    let known = mechanism.solve_at(&pose, &q, branch, None).unwrap();
    same_pose(&mechanism.pose(&known), &pose, fk_tolerance, context);
    // A pose that is not that of the feet, or no pose at all, does not matter.
    let misled = mechanism.solve_at(&guess, &q, branch, None).unwrap();
    same_pose(&mechanism.pose(&misled), &pose, fk_tolerance, context);
    let nowhere = Pose::at(pose.position * f64::NAN);
    let found = mechanism.solve_at(&nowhere, &q, branch, None).unwrap();
    assert_eq!(found, cold, "{context}");

    let inverse_jacobian = cold.inverse_jacobian();
    let expected =
        SMatrix::<f64, 6, 6>::from_fn(|row, column| number(&output["jinv"][row][column]));
    near((inverse_jacobian - expected).amax(), 0.0, tolerance, context);
    let jacobian = mechanism.jacobian(&cold);
    let identity = SMatrix::<f64, 6, 6>::identity();
    near((jacobian * expected - identity).amax(), 0.0, tolerance, context);
    let twist = SVector::<f64, 6>::from(list::<6>(&input["twist"]));
    let rates = Joints::from(list::<6>(&output["feet_vel"]));
    near((jacobian * rates - twist).amax(), 0.0, tolerance, context);
    let folding: [f64; 3] = list(&output["omega_dot"]);
    let attitude = Attitude {
        velocity: twist.fixed_rows::<3>(3).into_owned(),
        ..Attitude::fixed(pose.rotation)
    };
    let tool = ToolMotion {
        velocity: twist.fixed_rows::<3>(0).into_owned(),
        attitude,
        ..ToolMotion::rest(&pose)
    };
    let motion = mechanism.joint_motion(&tool, branch, &q).unwrap();
    near((motion.position - q).amax(), 0.0, 1e-15, context);
    near((motion.velocity - rates).amax(), 0.0, tolerance, context);

    let margins = mechanism.margins(&cold);
    let margin = |name: &str| margins.iter().find(|margin| margin.name == name).unwrap().value;
    near(margin("type_2"), number(&output["sigma2"]), tolerance, context);
    let corners = ["A", "B", "C"].map(|corner| number(&output["vertices"][corner][2]));
    let lowest = corners.into_iter().fold(f64::INFINITY, f64::min);
    near(margin("clearance"), lowest, tolerance, context);
    for (index, leg) in ["D", "E", "F"].into_iter().enumerate() {
        let expected = &output["legs"][leg];
        let type_1 = margin(&format!("type_1_{leg}"));
        near(type_1, number(&expected["type1_margin"]), tolerance, context);
        near(cold.fold_angles()[index], number(&expected["omega"]), tolerance, context);
        near(cold.fold_rates(&twist)[index], folding[index], tolerance, context);
    }
}

#[test]
fn it_agrees_with_the_golden_vectors() {
    let golden = golden("tri_planar");
    let mechanism = mechanism(&golden["params"]);
    let tolerance = number(&golden["tolerance"]);
    let fk_tolerance = number(&golden["fk_tolerance"]);
    let mut count = 0;
    for cases in ["cases", "cases_inward"] {
        for case in golden[cases].as_array().unwrap() {
            golden_case(&mechanism, case, tolerance, fk_tolerance);
            count += 1;
        }
    }
    assert_eq!(count, 19);

    let mut chain = None;
    for point in golden["trajectory"].as_array().unwrap() {
        let context = &point.to_string();
        let pose = Pose { position: list(&point["t"]).into(), rotation: rotation(&point["rpy"]) };
        let q = mechanism.inverse(&pose, TriPlanarBranch::default(), &at_rest()).unwrap();
        near((q - Joints::from(list::<6>(&point["motors"]))).amax(), 0.0, tolerance, context);
        let found = mechanism.solve(&q, TriPlanarBranch::default(), chain.as_ref()).unwrap();
        same_pose(&mechanism.pose(&found), &pose, fk_tolerance, context);
        chain = Some(found);
    }

    for level in golden["level"].as_array().unwrap() {
        let context = &level.to_string();
        let height = mechanism.side * 3.0_f64.sqrt() / 2.0;
        let z = number(&level["z_over_h"]) * height;
        let mut tool = ToolMotion::rest(&Pose::at(Vector3::new(0.0, 0.0, z)));
        tool.velocity.z = 1.0;
        let motion = mechanism.joint_motion(&tool, TriPlanarBranch::default(), &at_rest()).unwrap();
        let chain = mechanism.solve(&motion.position, TriPlanarBranch::default(), None).unwrap();
        for foot in 0..3 {
            let place = motion.position.fixed_rows::<2>(2 * foot).into_owned();
            let speed = motion.velocity.fixed_rows::<2>(2 * foot).into_owned();
            near(place.norm(), number(&level["R_feet"]), tolerance, context);
            let outward = speed.dot(&place) / place.norm();
            near(outward, number(&level["dR_dz"]), tolerance, context);
            near(chain.fold_angles()[foot], number(&level["omega"]), tolerance, context);
        }
    }
}

#[test]
fn it_refuses_what_the_golden_vectors_refuse() {
    let golden = golden("tri_planar");
    let mut count = 0;
    for failing in golden["failing"].as_array().unwrap() {
        let mut params = golden["params"].clone();
        for (key, value) in failing["override"].as_object().unwrap() {
            params[key] = value.clone();
        }
        let mechanism = mechanism(&params);
        let input = &failing["input"];
        let pose = Pose { position: list(&input["t"]).into(), rotation: rotation(&input["rpy"]) };
        let branch = legs(&input["modes"]);
        let alone = mechanism.inverse(&pose, branch, &at_rest()).unwrap_err();
        assert_eq!(alone.code, failing["expect"].as_str().unwrap());
        let moving = mechanism.joint_motion(&ToolMotion::rest(&pose), branch, &at_rest());
        assert_eq!(moving.unwrap_err(), alone);
        count += 1;
    }
    assert_eq!(count, 4);
}

fn refusal(mechanism: &TriPlanar, pose: &Pose, branch: TriPlanarBranch) -> KinematicsError {
    mechanism.inverse(pose, branch, &at_rest()).unwrap_err()
}

#[test]
fn it_says_which_limit_and_by_how_much() {
    let mechanism = mechanism(&golden("tri_planar")["params"]);
    let height = mechanism.side * 3.0_f64.sqrt() / 2.0;
    let outward = TriPlanarBranch::default();
    let level = |x, y, z| Pose::at(Vector3::new(x, y, z * height));

    let error = refusal(&mechanism, &level(0.0, 0.0, 1.05), outward);
    assert_eq!((error.code, error.limit), ("unreachable_D", 1.0));
    near(error.value, 1.05, 1e-12, "reach");
    // At 0.6 h, cos ω = 0.8: D stands h·(0.8 + 1/3) away, 30° above the x axis.
    let radius = height * (0.8 + 1.0 / 3.0);
    let x = 0.4;
    let error = refusal(&mechanism, &level(x, 0.0, 0.6), outward);
    assert_eq!((error.code, error.axis), ("off_stator_D", Some(0)));
    near(error.value, x + radius * 3.0_f64.sqrt() / 2.0, 1e-12, "off stator");
    near(error.limit, 0.46, 1e-15, "off stator");
    let error = refusal(&mechanism, &level(0.0, -0.3, 0.6), outward);
    assert_eq!((error.code, error.axis), ("off_stator_F", Some(5)));
    near(error.value, -0.3 - radius, 1e-12, "off stator");
    near(error.limit, -0.36, 1e-15, "off stator");
    // Nearly flat, the struts cannot hold the platform's height.
    let error =
        refusal(&TriPlanar { clearance: 0.0, ..mechanism }, &level(0.0, 0.0, 0.05), outward);
    assert_eq!(error.code, "singular_platform");
    assert!(error.value > 0.0 && error.value < error.limit, "{error}");
    for bad in [f64::NAN, f64::INFINITY] {
        assert_eq!(refusal(&mechanism, &level(0.0, 0.0, bad), outward).code, "unreachable_D");
        let error = refusal(&mechanism, &level(bad, 0.0, 0.6), outward);
        assert_eq!(error.code, "off_stator_D");
    }

    let scattered = Joints::from([0.4, 0.3, -0.4, 0.3, 0.0, -0.3]);
    assert_eq!(mechanism.solve(&scattered, outward, None).unwrap_err().code, "no_assembly");
    let nowhere = Joints::from([f64::NAN; 6]);
    assert_eq!(mechanism.solve(&nowhere, outward, None).unwrap_err().code, "no_assembly");
    // The feet of one branch are no solution of another.
    let q = mechanism.inverse(&level(0.0, 0.0, 0.6), outward, &at_rest()).unwrap();
    let mixed = outward.choose("legs", &[-1, 1, 1]).unwrap();
    assert_eq!(mechanism.solve(&q, mixed, None).unwrap_err().code, "no_assembly");
    assert_eq!(mixed.choices(), [("legs", vec![-1, 1, 1])]);
    assert_eq!(outward.choose("legs", &[0, 1, 1]), None);
    assert_eq!(outward.choose("elbow", &[1, 1, 1]), None);
}

/// Anywhere over the stator, at any yaw, tilted by up to `tilt` [rad].
fn any_pose(random: &mut Random, height: f64, tilt: f64) -> Pose {
    let position = Vector3::new(
        random.next() * 0.25,
        random.next() * 0.15,
        (0.6 + 0.35 * random.next()) * height,
    );
    let yaw = Rotation3::from_axis_angle(&Vector3::z_axis(), random.next() * core::f64::consts::PI);
    let lean = Rotation3::new(Vector3::new(random.next() * tilt, random.next() * tilt, 0.0));
    Pose { position, rotation: (yaw * lean).into_inner() }
}

/// The same as built: legs that are not as drawn, a stator that stands askew, and a tool off the centroid.
fn as_built(drawn: &TriPlanar) -> TriPlanar {
    let frame = |position: [f64; 3], [roll, pitch, yaw]: [f64; 3]| Pose {
        position: position.into(),
        rotation: Rotation3::from_euler_angles(roll, pitch, yaw).into_inner(),
    };
    let off = [[0.4e-3, -0.7e-3], [1.1e-3, 0.2e-3], [-0.9e-3, 0.6e-3]];
    TriPlanar {
        struts: off.map(|pair| pair.map(|off| drawn.side + off)),
        mounting: Some(Mounting {
            base: frame([1.3e-3, -0.8e-3, 0.5e-3], [4e-3, -7e-3, 0.02]),
            tool: frame([2e-3, -1e-3, 15e-3], [0.01, 0.02, -0.3]),
        }),
        ..*drawn
    }
}

#[test]
fn a_platform_that_is_not_as_drawn_stands_as_it_was_measured() {
    let mechanism = as_built(&mechanism(&golden("tri_planar")["params"]));
    let height = mechanism.side * 3.0_f64.sqrt() / 2.0;
    let mut random = Random::new(0x0dd_ba11);
    let mut count = 0;
    while count < 500 {
        let pose = any_pose(&mut random, height, 0.5);
        let branch = TriPlanarBranch::default();
        let Ok(q) = mechanism.inverse(&pose, branch, &at_rest()) else { continue };
        let context = &format!("{pose:?}");
        let measured = mechanism.measured_struts(&pose, &q);
        for (found, wanted) in measured.iter().flatten().zip(mechanism.struts.iter().flatten()) {
            near(*found, *wanted, 1e-14, context);
        }
        count += 1;
    }
}

#[test]
fn feet_and_pose_lead_to_each_other_over_the_working_range() {
    let drawn = mechanism(&golden("tri_planar")["params"]);
    for mechanism in [as_built(&drawn), drawn] {
        lead_to_each_other(&mechanism);
    }
}

fn lead_to_each_other(mechanism: &TriPlanar) {
    let height = mechanism.side * 3.0_f64.sqrt() / 2.0;
    let mut random = Random::new(0x9e37_79b9_7f4a_7c15);
    let mut counts = [0; 2];
    let mut last: [Option<_>; 2] = [None; 2];
    for case in 0..4000 {
        let pose = any_pose(&mut random, height, 0.6);
        let mixed = TriPlanarBranch::from(Legs([Fold::Inward, Fold::Outward, Fold::Outward]));
        for (which, branch) in [TriPlanarBranch::default(), mixed].into_iter().enumerate() {
            let Ok(q) = mechanism.inverse(&pose, branch, &at_rest()) else { continue };
            let context = &format!("case {case} {branch:?}: {pose:?}");
            let cold = mechanism.solve(&q, branch, None).expect(context);
            // The least singular value is 0.05, so rounding of 1e-16 may grow twentyfold and more.
            same_pose(&mechanism.pose(&cold), &pose, 1e-13, context);
            let back = mechanism.inverse(&mechanism.pose(&cold), branch, &q).expect(context);
            near((back - q).amax(), 0.0, 1e-13, context);
            // From the last pose, anywhere else on the stator, and from close by.
            let warm = mechanism.solve(&q, branch, last[which].as_ref()).expect(context);
            same_pose(&mechanism.pose(&warm), &pose, 1e-13, context);
            let moved = q + Joints::from_fn(|_, _| random.next() * 1e-4);
            if let Ok(start) = mechanism.solve(&moved, branch, Some(&cold)) {
                let warm = mechanism.solve(&q, branch, Some(&start)).expect(context);
                same_pose(&mechanism.pose(&warm), &pose, 1e-13, context);
            }
            last[which] = Some(cold);
            counts[which] += 1;
        }
    }
    assert!(counts[0] > 1500 && counts[1] > 100, "{counts:?}");
}

/// A motion of the tool, and the same `time` later if its third derivatives last.
#[derive(Clone, Copy)]
struct Course {
    tool: ToolMotion,
}

impl Course {
    fn random(random: &mut Random, height: f64) -> Self {
        let pose = any_pose(random, height, 0.3);
        Self {
            tool: ToolMotion {
                velocity: random.vector(0.5),
                acceleration: random.vector(10.0),
                jerk: random.vector(500.0),
                attitude: Attitude {
                    velocity: random.vector(1.0),
                    acceleration: random.vector(20.0),
                    jerk: random.vector(1000.0),
                    ..Attitude::fixed(pose.rotation)
                },
                ..ToolMotion::rest(&pose)
            },
        }
    }

    /// The rotation follows Ω(t) by the Magnus expansion, exact to the fourth order in `time`.
    fn later(&self, time: f64) -> ToolMotion {
        let Self { tool } = *self;
        let Attitude { rotation, velocity, acceleration, jerk } = tool.attitude;
        let angle = velocity * time
            + acceleration * (time * time / 2.0)
            + jerk * (time * time * time / 6.0)
            - velocity.cross(&acceleration) * (time * time * time / 12.0);
        ToolMotion {
            position: tool.position
                + tool.velocity * time
                + tool.acceleration * (time * time / 2.0)
                + tool.jerk * (time * time * time / 6.0),
            velocity: tool.velocity + tool.acceleration * time + tool.jerk * (time * time / 2.0),
            acceleration: tool.acceleration + tool.jerk * time,
            jerk: tool.jerk,
            attitude: Attitude {
                rotation: Rotation3::new(angle).into_inner() * rotation,
                velocity: velocity + acceleration * time + jerk * (time * time / 2.0),
                acceleration: acceleration + jerk * time,
                jerk,
            },
        }
    }
}

/// Courses over the stator that every limit allows.
fn courses(mechanism: &TriPlanar, branch: TriPlanarBranch, count: usize) -> Vec<Course> {
    let height = mechanism.side * 3.0_f64.sqrt() / 2.0;
    let mut random = Random::new(0x5851_f42d_4c95_7f2d);
    let mut courses = Vec::new();
    while courses.len() < count {
        let course = Course::random(&mut random, height);
        let pose = course.tool.pose();
        if mechanism.inverse(&pose, branch, &at_rest()).is_ok() {
            courses.push(course);
        }
    }
    courses
}

#[test]
fn every_derivative_of_the_joints_is_that_of_the_one_below() {
    let drawn = mechanism(&golden("tri_planar")["params"]);
    for mechanism in [as_built(&drawn), drawn] {
        derivatives_hold(&mechanism);
    }
}

fn derivatives_hold(mechanism: &TriPlanar) {
    let mixed = TriPlanarBranch::from(Legs([Fold::Outward, Fold::Inward, Fold::Outward]));
    for branch in [TriPlanarBranch::default(), mixed] {
        for course in courses(mechanism, branch, 200) {
            let context = &format!("{branch:?} {:?}", course.tool);
            let free = unlimited(mechanism);
            let at = |time: f64| {
                free.joint_motion(&course.later(time), branch, &at_rest()).expect(context)
            };
            let h = 1e-5;
            let (behind, motion, ahead) = (at(-h), at(0.0), at(h));
            for (found, low, high) in [
                (motion.velocity, behind.position, ahead.position),
                (motion.acceleration, behind.velocity, ahead.velocity),
                (motion.jerk, behind.acceleration, ahead.acceleration),
            ] {
                let difference = (high - low) / (2.0 * h);
                // The truncation h²/6 of the derivative two orders up grows near the limits.
                let scale = 1.0 + found.amax();
                near((found - difference).amax() / scale, 0.0, 1e-5, context);
            }
            // What moves the feet moves the platform.
            let chain = mechanism.solve(&motion.position, branch, None).expect(context);
            let twist = mechanism.jacobian(&chain) * motion.velocity;
            near((twist.fixed_rows::<3>(0) - course.tool.velocity).amax(), 0.0, 1e-12, context);
            let spin = course.tool.attitude.velocity;
            near((twist.fixed_rows::<3>(3) - spin).amax(), 0.0, 1e-12, context);
        }
    }
}

/// Kinetic and potential energy from the bodies alone: speeds of their points by differences of
/// their places. A thin uniform triangle has the inertia of a third of its mass in the middle of
/// each side.
fn energy(
    mechanism: &TriPlanar,
    branch: TriPlanarBranch,
    course: &Course,
    time: f64,
) -> (f64, f64) {
    let h = 3e-6;
    let points = |time: f64| {
        let tool = course.later(time);
        let q = unlimited(mechanism).inverse(&tool.pose(), branch, &at_rest()).unwrap();
        let (a, rotation) = (mechanism.side, tool.attitude.rotation);
        let corner = |x: f64, y: f64| tool.position + rotation * Vector3::new(x * a, y * a, 0.0);
        let root = 3.0_f64.sqrt();
        let corners =
            [corner(0.5, -0.5 / root), corner(-0.5, -0.5 / root), corner(0.0, 1.0 / root)];
        let mut points = Vec::new();
        for (leg, [one, other]) in [[0, 2], [2, 1], [0, 1]].into_iter().enumerate() {
            let foot = Vector3::new(q[2 * leg], q[2 * leg + 1], 0.0);
            let third = mechanism.leg_mass / 3.0;
            points.push((third, (corners[one] + corners[other]) / 2.0));
            points.push((third, (corners[one] + foot) / 2.0));
            points.push((third, (foot + corners[other]) / 2.0));
            points.push((mechanism.inductor_mass, foot));
        }
        points.push((mechanism.platform_mass, tool.position));
        points
    };
    let (behind, here, ahead) = (points(time - h), points(time), points(time + h));
    let (mut kinetic, mut potential) = (0.0, 0.0);
    for ((low, high), (mass, place)) in behind.iter().zip(&ahead).zip(&here) {
        kinetic += mass * ((high.1 - low.1) / (2.0 * h)).norm_squared() / 2.0;
        potential += mass * 9.806_65 * place.z;
    }
    let attitude = course.later(time).attitude;
    let spin = attitude.rotation.tr_mul(&attitude.velocity);
    let inertia = Vector3::from(mechanism.platform_inertia);
    (kinetic + spin.dot(&inertia.component_mul(&spin)) / 2.0, potential)
}

#[test]
fn power_into_the_feet_is_the_change_of_energy() {
    let mechanism = mechanism(&golden("tri_planar")["params"]);
    let mixed = TriPlanarBranch::from(Legs([Fold::Outward, Fold::Outward, Fold::Inward]));
    for branch in [TriPlanarBranch::default(), mixed] {
        for course in courses(&mechanism, branch, 200) {
            let context = &format!("{branch:?} {:?}", course.tool);
            let motion: JointMotion<6> =
                mechanism.joint_motion(&course.tool, branch, &at_rest()).unwrap();
            let chain = mechanism.solve(&motion.position, branch, None).unwrap();
            let mass = mechanism.mass_matrix(&chain);
            assert_eq!(mass, mass.transpose());
            assert!(mass.cholesky().is_some(), "{context}");
            let kinetic = motion.velocity.dot(&(mass * motion.velocity)) / 2.0;
            let (expected, _) = energy(&mechanism, branch, &course, 0.0);
            near(kinetic / expected, 1.0, 1e-6, context);

            let h = 2e-5;
            let total = |time: f64| {
                let (kinetic, potential) = energy(&mechanism, branch, &course, time);
                kinetic + potential
            };
            let change = (total(h) - total(-h)) / (2.0 * h);
            let effort = mechanism.inverse_dynamics(&chain, &motion.velocity, &motion.acceleration);
            let power = effort.dot(&motion.velocity);
            near((power - change) / (1.0 + power.abs()), 0.0, 2e-4, context);
            let still = mechanism.bias(&chain, &at_rest());
            near((still - mechanism.gravity(&chain)).amax(), 0.0, 1e-12, context);
        }
    }
}

/// Power tells only the part of the bias along the velocity; the Lagrangian's derivatives tell all
/// of it: `Ṁ·q̇ − ∂T/∂q + ∂V/∂q`.
#[test]
fn the_bias_is_that_of_lagrange() {
    let mechanism = mechanism(&golden("tri_planar")["params"]);
    let branch = TriPlanarBranch::default();
    for course in courses(&mechanism, branch, 100) {
        let context = &format!("{:?}", course.tool);
        let motion = mechanism.joint_motion(&course.tool, branch, &at_rest()).unwrap();
        let (q, velocity) = (motion.position, motion.velocity);
        let chain = mechanism.solve(&q, branch, None).unwrap();
        let mass = |q: Joints<6>| {
            mechanism.mass_matrix(&mechanism.solve(&q, branch, Some(&chain)).unwrap())
        };
        let h = 1e-6;
        let change = (mass(q + velocity * h) - mass(q - velocity * h)) / (2.0 * h);
        let mut expected = change * velocity + mechanism.gravity(&chain);
        for joint in 0..6 {
            let mut offset = at_rest();
            offset[joint] = h;
            let kinetic = |q| velocity.dot(&(mass(q) * velocity)) / 2.0;
            expected[joint] -= (kinetic(q + offset) - kinetic(q - offset)) / (2.0 * h);
        }
        let found = mechanism.bias(&chain, &velocity);
        near((found - expected).amax() / (1.0 + found.amax()), 0.0, 1e-6, context);
    }
}

#[test]
fn a_level_load_spreads_the_feet_by_a_third_of_it_over_tan_omega() {
    let massless = TriPlanar { leg_mass: 0.0, ..mechanism(&golden("tri_planar")["params"]) };
    let height = massless.side * 3.0_f64.sqrt() / 2.0;
    for share in [0.3, 0.5, 0.7, 0.9] {
        let pose = Pose::at(Vector3::new(0.1, -0.05, share * height));
        let q = massless.inverse(&pose, massless.branch(), &at_rest()).unwrap();
        let held = massless.gravity(&massless.solve(&q, massless.branch(), None).unwrap());
        let slope = share / (1.0_f64 - share * share).sqrt();
        let thrust = 0.8 * 9.806_65 / (3.0 * slope);
        for leg in 0..3 {
            let out = Vector3::new(q[2 * leg] - 0.1, q[2 * leg + 1] + 0.05, 0.0).normalize();
            let force = Vector3::new(held[2 * leg], held[2 * leg + 1], 0.0);
            // The feet hold against spreading, inwards.
            near((force + out * thrust).amax(), 0.0, 1e-12, &format!("{share} {leg}"));
        }
    }
}

/// Against a rigid-body library that knows nothing of these equations; the file says how.
#[test]
fn its_dynamics_are_those_of_an_independent_library() {
    let vectors = golden("independent_tri_planar");
    let tolerance = number(&vectors["tolerance"]);
    let template = unlimited(&mechanism(&golden("tri_planar")["params"]));
    let mut count = 0;
    for machine in vectors["machines"].as_array().unwrap() {
        let params = &machine["params"];
        let mechanism = TriPlanar {
            side: number(&params["side"]),
            struts: [[number(&params["side"]); 2]; 3],
            platform_mass: number(&params["platform_mass"]),
            platform_inertia: list(&params["platform_inertia"]),
            leg_mass: number(&params["leg_mass"]),
            inductor_mass: number(&params["inductor_mass"]),
            ..template
        };
        for case in machine["cases"].as_array().unwrap() {
            let context = &case["position"].to_string();
            let joints = |key: &str| Joints::from(list::<6>(&case[key]));
            let branch = legs(&case["modes"]);
            let pose = Pose {
                position: list(&case["position"]).into(),
                rotation: matrix(&case["rotation"]),
            };
            let q = mechanism.inverse(&pose, branch, &at_rest()).unwrap();
            near((q - joints("feet")).amax(), 0.0, tolerance, context);
            let chain = mechanism.solve(&q, branch, None).unwrap();
            same_pose(&mechanism.pose(&chain), &pose, tolerance, context);

            let velocity = joints("velocity");
            let twist = mechanism.jacobian(&chain) * velocity;
            near((twist - joints("twist")).amax() / twist.amax(), 0.0, tolerance, context);
            let expected =
                SMatrix::<f64, 6, 6>::from_fn(|row, column| number(&case["mass"][row][column]));
            let mass = mechanism.mass_matrix(&chain);
            near((mass - expected).amax() / mass.amax(), 0.0, tolerance, context);
            let gravity = mechanism.gravity(&chain);
            near((gravity - joints("gravity")).amax() / gravity.amax(), 0.0, tolerance, context);
            let bias = mechanism.bias(&chain, &velocity);
            near((bias - joints("bias")).amax() / bias.amax(), 0.0, tolerance, context);
            let effort = mechanism.inverse_dynamics(&chain, &velocity, &joints("acceleration"));
            near((effort - joints("effort")).amax() / effort.amax(), 0.0, tolerance, context);
            count += 1;
        }
    }
    assert_eq!(count, 14);
}

/// Poses over the stator with at least one leg folded below the platform, whose limits all are kept.
fn inward_poses(mechanism: &TriPlanar, count: usize) -> Vec<(Pose, TriPlanarBranch, Joints<6>)> {
    let height = mechanism.side * 3.0_f64.sqrt() / 2.0;
    let mut random = Random::new(0x1234_5678_9abc_def1);
    let mut poses = Vec::new();
    while poses.len() < count {
        let folds =
            core::array::from_fn(
                |_| {
                    if random.next() < 0.0 { Fold::Inward } else { Fold::Outward }
                },
            );
        let branch = TriPlanarBranch::from(Legs(folds));
        let pose = any_pose(&mut random, height, 1.0);
        if branch != TriPlanarBranch::default()
            && let Ok(q) = mechanism.inverse(&pose, branch, &at_rest())
        {
            poses.push((pose, branch, q));
        }
    }
    poses
}

#[test]
fn the_branch_of_the_inverse_leads_back_to_its_pose_with_legs_folded_inwards() {
    let mechanism = mechanism(&golden("tri_planar")["params"]);
    let (mut ambiguous, mut carried_on) = (0, 0);
    for (pose, branch, q) in inward_poses(&mechanism, 12_000) {
        let context = &format!("{branch:?}: {pose:?}");
        let known = mechanism.solve_at(&pose, &q, branch, None).expect(context);
        same_pose(&mechanism.pose(&known), &pose, 1e-12, context);
        let named = mechanism.branch_of(&known);
        assert_eq!(named.legs, branch.legs, "{context}");
        let back = mechanism.solve(&q, named, None).expect(context);
        same_pose(&mechanism.pose(&back), &pose, 1e-12, context);
        assert_eq!(mechanism.branch_of(&back), named, "{context}");

        // Without a number there is either this one pose only, or a refusal that says how many.
        match (named.assembly, mechanism.solve(&q, branch, None)) {
            (None, found) => {
                same_pose(&mechanism.pose(&found.expect(context)), &pose, 1e-12, context)
            }
            (Some(number), Err(error)) => {
                assert_eq!((error.code, error.limit), ("ambiguous_assembly", 1.0), "{context}");
                assert!(
                    error.value >= 2.0 && f64::from(number) <= error.value,
                    "{context} {error}"
                );
                each_assembly_closes(&mechanism, &q, branch, error.value as i32, context);
                ambiguous += 1;
            }
            (Some(number), Ok(_)) => panic!("assembly {number} is not the only one: {context}"),
        }
        // A machine that is known to stand near by at home carries its assembly on from there.
        if named.assembly.is_some() {
            let aside = Vector3::new(1e-3, -2e-3, 1e-3);
            let beside = Pose { position: pose.position + aside, ..pose };
            let free = TriPlanar { legs: branch.legs, ..unlimited(&mechanism) };
            if let Ok(feet) = free.inverse(&beside, branch, &at_rest()) {
                let home = free.standing_near(&feet, &beside);
                assert!(home.is_some(), "{context}");
                let built = TriPlanar { home, ..mechanism };
                let carried = built.solve(&q, branch, None).expect(context);
                same_pose(&built.pose(&carried), &pose, 1e-12, context);
                carried_on += 1;
            }
        }
        // A solution near by goes on as it is, whichever it is.
        let near = mechanism.solve(&q, branch, Some(&known)).expect(context);
        same_pose(&mechanism.pose(&near), &pose, 1e-12, context);
    }
    assert!(ambiguous > 3, "only {ambiguous} of the poses are not the only ones");
    assert!(carried_on > 3, "only {carried_on} of them have a home beside them");
}

/// Each number gives another pose on the same feet; beyond the last there is none.
fn each_assembly_closes(
    mechanism: &TriPlanar,
    q: &Joints<6>,
    branch: TriPlanarBranch,
    count: i32,
    context: &str,
) {
    let mut found: Vec<Pose> = Vec::new();
    for number in 1..=count {
        let chosen = branch.choose("assembly", &[number]).unwrap();
        let chain = mechanism.solve(q, chosen, None).expect(context);
        assert_eq!(mechanism.branch_of(&chain), chosen, "{context}");
        let pose = mechanism.pose(&chain);
        let feet = unlimited(mechanism).inverse(&pose, branch, &at_rest()).expect(context);
        near((feet - q).amax(), 0.0, 1e-9, context);
        let tilt = pose.rotation[(2, 2)];
        assert!(found.iter().all(|other| other.rotation[(2, 2)] >= tilt - 1e-9), "{context}");
        assert!(found.iter().all(|other| (other.position - pose.position).amax() > 1e-6));
        found.push(pose);
    }
    let beyond = branch.choose("assembly", &[count + 1]).unwrap();
    let error = mechanism.solve(q, beyond, None).unwrap_err();
    assert_eq!((error.code, error.limit), ("no_assembly", f64::from(count)), "{context}");
}

/// Which is why a cold start takes it at once.
#[test]
fn with_all_legs_outward_a_platform_tilted_by_less_than_45_degrees_is_the_only_one() {
    let mechanism = mechanism(&golden("tri_planar")["params"]);
    let height = mechanism.side * 3.0_f64.sqrt() / 2.0;
    let (mut random, outward) = (Random::new(77), TriPlanarBranch::default());
    let mut count = 0;
    while count < 3000 {
        let pose = any_pose(&mut random, height, 0.75);
        let Ok(q) = mechanism.inverse(&pose, outward, &at_rest()) else { continue };
        if pose.rotation[(2, 2)] < 0.5_f64.sqrt() {
            continue;
        }
        let context = &format!("{pose:?}");
        let first = mechanism.solve(&q, outward.choose("assembly", &[1]).unwrap(), None);
        same_pose(&mechanism.pose(&first.expect(context)), &pose, 1e-12, context);
        if let Ok(second) = mechanism.solve(&q, outward.choose("assembly", &[2]).unwrap(), None) {
            assert!(mechanism.pose(&second).rotation[(2, 2)] < 0.5_f64.sqrt(), "{context}");
        }
        let cold = mechanism.solve(&q, outward, None).expect(context);
        same_pose(&mechanism.pose(&cold), &pose, 1e-12, context);
        count += 1;
    }
}

#[test]
fn an_assembly_is_named_by_a_number_from_1() {
    let outward = TriPlanarBranch::default();
    let second = outward.choose("assembly", &[2]).unwrap();
    assert_eq!(second.choices(), [("legs", vec![1, 1, 1]), ("assembly", vec![2])]);
    assert_eq!(second.choose("assembly", &[]), Some(outward));
    assert_eq!(second.in_any_turn(), outward);
    for bad in [0, -1, 256] {
        assert_eq!(outward.choose("assembly", &[bad]), None);
    }
}
