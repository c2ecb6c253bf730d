//! Open chains against closed forms, and what they refuse.

#![allow(clippy::unwrap_used)]

use core::f64::consts::{FRAC_PI_2, PI};

use machine::kinematics::{Joints, TaskSpace, ToolMotion};
use machine::mechanisms::serial::{JointKind, Link};
use machine::{Mechanism, Pose, Serial};
use messages::math;
use nalgebra::{Matrix2, Matrix3, Vector3};

const GRAVITY: f64 = 9.806_65;

fn link(kind: JointKind, twist: f64, length: f64, offset: f64) -> Link {
    Link {
        twist,
        length,
        offset,
        angle: 0.0,
        kind,
        mass: 0.0,
        center: Vector3::zeros(),
        inertia: Matrix3::zeros(),
        lower: -PI,
        upper: PI,
    }
}

fn chain<const N: usize>(task_space: TaskSpace, links: [Link; N], tool: [f64; 3]) -> Serial<N> {
    Serial {
        base: Pose::at(Vector3::zeros()),
        links,
        tool: Pose::at(Vector3::from(tool)),
        task_space,
        gravity: Vector3::new(0.0, 0.0, -GRAVITY),
        elasticity: None,
    }
}

/// Lengths, centres, masses and inertias of a planar arm.
const LENGTH: [f64; 2] = [0.3, 0.25];
const CENTER: [f64; 2] = [0.12, 0.1];
const MASS: [f64; 2] = [1.7, 0.9];
const INERTIA: [f64; 2] = [0.013, 0.006];

fn planar() -> Serial<2> {
    let body = |joint: usize, length| Link {
        mass: MASS[joint],
        center: Vector3::new(CENTER[joint], 0.0, 0.0),
        inertia: Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, INERTIA[joint])),
        ..link(JointKind::Revolute, 0.0, length, 0.0)
    };
    chain(TaskSpace::Plane, [body(0, 0.0), body(1, LENGTH[0])], [LENGTH[1], 0.0, 0.0])
}

#[test]
fn a_planar_arm_has_the_closed_forms_of_the_textbook() {
    // Hung up in the plane of gravity, to have all three parts of the efforts.
    let arm = Serial { gravity: Vector3::new(0.0, -GRAVITY, 0.0), ..planar() };
    let (q, rate) = (Joints::from([0.7, 1.1]), Joints::from([1.3, -2.1]));
    let state = arm.solve(&q, (), None).unwrap();
    let (s2, c2) = math::sin_cos(q[1]);
    let (c1, c12) = (math::cos(q[0]), math::cos(q[0] + q[1]));
    let (s1, s12) = (math::sin(q[0]), math::sin(q[0] + q[1]));
    let [l1, l2] = LENGTH;
    let [r1, r2] = CENTER;
    let [m1, m2] = MASS;
    let [i1, i2] = INERTIA;

    let tool = Vector3::new(l1 * c1 + l2 * c12, l1 * s1 + l2 * s12, 0.0);
    assert!((arm.pose(&state).position - tool).amax() < 1e-15);
    let far = i2 + m2 * r2 * r2;
    let cross = far + m2 * l1 * r2 * c2;
    let near = i1 + m1 * r1 * r1 + m2 * l1 * l1 + 2.0 * cross - far;
    let mass = arm.mass_matrix(&state);
    assert!((mass - Matrix2::new(near, cross, cross, far)).amax() < 1e-15, "{mass}");
    let pull = m2 * l1 * r2 * s2;
    let lift = m2 * GRAVITY * r2 * c12;
    let expected = Joints::from([
        -pull * (2.0 * rate[0] * rate[1] + rate[1] * rate[1])
            + (m1 * r1 + m2 * l1) * GRAVITY * c1
            + lift,
        pull * rate[0] * rate[0] + lift,
    ]);
    let bias = arm.bias(&state, &rate);
    assert!((bias - expected).amax() < 1e-14, "{bias} {expected}");
}

#[test]
fn the_polar_arm_of_table_1_is_where_the_source_says() {
    // Source 000 table 1 with one d for the prismatic joint, and eq. 3.3.
    let (a1, l2) = (0.25, -0.04);
    let slide = Link { upper: 0.2, lower: 0.0, ..link(JointKind::Prismatic, 0.0, a1, 0.0) };
    let arm =
        chain(TaskSpace::Space, [link(JointKind::Revolute, 0.0, 0.0, 0.0), slide], [0.0, 0.0, l2]);
    let q = Joints::from([0.4, 0.07]);
    let pose = arm.forward(&q, ()).unwrap();
    let (s, c) = math::sin_cos(0.4);
    assert!((pose.position - Vector3::new(a1 * c, a1 * s, 0.07 + l2)).amax() < 1e-16);
    assert!((pose.rotation - Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)).amax() < 1e-16);
    // Two joints reach a cylinder only: on it the inverse works, off it the way is told.
    let back = arm.inverse(&pose, (), &Joints::zeros()).unwrap();
    assert!((back - q).amax() < 1e-12, "{back}");
    let off = Pose::at(pose.position + Vector3::new(c, s, 0.0) * 0.01);
    let error = arm.inverse(&off, (), &q).unwrap_err();
    assert!(error.code == "unreachable" && error.limit <= 1e-12, "{error:?}");
    assert!((error.value - 0.01).abs() < 1e-9, "{error:?}");
}

/// A six-axis arm with the link parameters of Craig's Puma 560 [m].
fn puma() -> Serial<6> {
    let turn = |twist, length, offset| link(JointKind::Revolute, twist, length, offset);
    chain(
        TaskSpace::Pose,
        [
            turn(0.0, 0.0, 0.0),
            turn(-FRAC_PI_2, 0.0, 0.0),
            turn(0.0, 0.4318, 0.1245),
            turn(-FRAC_PI_2, 0.0203, 0.4318),
            turn(FRAC_PI_2, 0.0, 0.0),
            turn(-FRAC_PI_2, 0.0, 0.0),
        ],
        [0.0, 0.0, 0.0],
    )
}

#[test]
fn a_puma_stands_where_its_closed_form_says_and_is_found_from_afar() {
    let arm = puma();
    let (a2, a3, d3, d4) = (0.4318, 0.0203, 0.1245, 0.4318);
    let mut found = 0;
    for case in 0..100 {
        let part = |k: f64| 2.0 * (0.618_033_988_7 * k * (f64::from(case) + 1.0)).fract() - 1.0;
        let q = Joints::from([
            2.0 * part(1.0),
            part(2.0) - 1.0,
            part(3.0),
            2.0 * part(4.0),
            1.0 + 0.6 * part(5.0),
            2.0 * part(6.0),
        ]);
        let pose = arm.forward(&q, ()).unwrap();
        // Craig's wrist position.
        let (s1, c1) = math::sin_cos(q[0]);
        let (s23, c23) = math::sin_cos(q[1] + q[2]);
        let (s2, c2) = math::sin_cos(q[1]);
        let out = a2 * c2 + a3 * c23 - d4 * s23;
        let wrist =
            Vector3::new(c1 * out - d3 * s1, s1 * out + d3 * c1, -a3 * s23 - a2 * s2 - d4 * c23);
        assert!((pose.position - wrist).amax() < 1e-15, "{case}");
        // From far away any configuration will do; but it must reach the pose, within the limits.
        let Ok(other) = arm.inverse(&pose, (), &Joints::from_element(0.3)) else { continue };
        found += 1;
        let back = arm.forward(&other, ()).unwrap();
        assert!((back.position - pose.position).amax() < 1e-12);
        assert!((back.rotation - pose.rotation).amax() < 2e-12);
        assert!(other.amax() <= PI);
    }
    assert_eq!(found, 100);
}

#[test]
fn limits_singularities_and_far_targets_are_told_apart() {
    let mut arm = planar();
    arm.links[0].lower = -0.5;
    arm.links[0].upper = 0.5;
    // Straight up, with either elbow, takes a shoulder beyond its limit.
    let up = Pose::at(Vector3::new(0.0, 0.5, 0.0));
    let error = arm.inverse(&up, (), &Joints::from([0.4, 1.0])).unwrap_err();
    assert_eq!((error.code, error.axis), ("out_of_limits", Some(0)));
    assert_eq!(error.limit, 0.5);
    assert!(error.value > 0.5, "{error:?}");

    let error = arm.inverse(&Pose::at(Vector3::new(1.0, 0.0, 0.0)), (), &Joints::from([0.1, 0.5]));
    let error = error.unwrap_err();
    assert_eq!(error.code, "unreachable");
    assert!((error.value - 0.45).abs() < 1e-6, "{error:?}");

    let high = Pose::at(Vector3::new(0.4, 0.1, 0.02));
    let error = arm.inverse(&high, (), &Joints::from([0.1, 0.5])).unwrap_err();
    assert_eq!((error.code, error.value), ("out_of_plane", 0.02));

    for wrong in [f64::NAN, f64::INFINITY] {
        let nowhere = Pose::at(Vector3::new(0.4, wrong, 0.0));
        let error = arm.inverse(&nowhere, (), &Joints::from([0.1, 0.5])).unwrap_err();
        assert_eq!(error.code, "not_a_number");
        let error = arm.inverse(&up, (), &Joints::from([0.1, wrong])).unwrap_err();
        assert_eq!(error.code, "not_a_number");
    }

    // Stretched out it may stand, but not move.
    let stretched = Joints::from([0.2, 0.0]);
    let mut tool = ToolMotion::rest(&arm.forward(&stretched, ()).unwrap());
    let motion = arm.joint_motion(&tool, (), &stretched).unwrap();
    assert_eq!(motion.velocity, Joints::from([0.0, 0.0]));
    tool.velocity.x = -0.1;
    let error = arm.joint_motion(&tool, (), &stretched).unwrap_err();
    assert_eq!((error.code, error.limit), ("singular", 1e-4));
}
