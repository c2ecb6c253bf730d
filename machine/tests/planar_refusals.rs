//! What the planar linkages refuse, by which code, and with which number against which limit.

#![allow(clippy::unwrap_used)]

use machine::kinematics::{Branch, Joints, KinematicsError, ToolMotion};
use machine::mechanisms::{
    ActuatorBodies, FiveBar, FiveBarBranch, Prrrp, PrrrpBranch, TwinActuator, TwinBranch,
};
use machine::{Mechanism, Pose};
use nalgebra::{Vector2, Vector3};

const FIVE_BAR: FiveBar = FiveBar {
    half_base: 0.05,
    proximal: 0.2,
    distal: 0.25,
    proximal_mass: 0.156,
    proximal_inertia: 5.2e-4,
    distal_mass: 0.195,
    distal_inertia: 1.0e-3,
    tool_mass: 0.33,
    bar_mass: 0.186,
    type_1_limit: 0.1,
    type_2_limit: 0.2,
    branch: FiveBarBranch { working_mode: [1, -1], assembly_mode: 1 },
    elasticity: None,
};

const PRRRP: Prrrp = Prrrp {
    link: 0.3,
    link_mass: 0.234,
    link_inertia: 1.755e-3,
    cart_mass: 0.2,
    tool_mass: 0.33,
    bar_mass: 0.186,
    type_1_limit: 0.3,
    type_2_limit: 0.1,
    branch: PrrrpBranch { side: 1 },
    elasticity: None,
};

const BODIES: ActuatorBodies =
    ActuatorBodies { housing_inertia: 0.01, rod_mass: 0.4, rod_inertia: 0.002, rod_center: 0.15 };

const TWIN: TwinActuator = TwinActuator {
    bases: [Vector2::new(0.0, 0.0), Vector2::new(0.8, 0.0)],
    offset: 0.06,
    offset_angle: 2.0,
    bodies: [BODIES; 2],
    tool_mass: 0.3,
    baseline_limit: 0.1,
    near_limit: 0.02,
    branch: TwinBranch { elbow: 1 },
    elasticity: None,
};

fn pose(x: f64, y: f64) -> Pose {
    Pose::at(Vector3::new(x, y, 0.0))
}

#[track_caller]
fn refused<M: Mechanism<2>>(mechanism: &M, x: f64, y: f64) -> KinematicsError {
    let still = Joints::zeros();
    let error = mechanism.inverse(&pose(x, y), mechanism.branch(), &still).unwrap_err();
    // A motion through the same place is refused alike.
    let moving = ToolMotion {
        velocity: Vector3::new(0.1, -0.2, 0.0),
        acceleration: Vector3::new(3.0, 4.0, 0.0),
        ..ToolMotion::rest(&pose(x, y))
    };
    let of_motion = mechanism.joint_motion(&moving, mechanism.branch(), &still).unwrap_err();
    assert_eq!(format!("{of_motion:?}"), format!("{error:?}"));
    error
}

#[track_caller]
fn check(error: KinematicsError, code: &str, axis: Option<usize>, value: f64, limit: f64) {
    assert_eq!((error.code, error.axis), (code, axis), "{error:?}");
    assert!((error.value - value).abs() < 1e-12, "{error:?}, not {value}");
    assert!((error.limit - limit).abs() < 1e-12, "{error:?}, not {limit}");
}

#[test]
fn the_five_bar_says_which_arm_is_too_short_or_too_long() {
    check(refused(&FIVE_BAR, -0.05, 0.46), "unreachable_leg_1", Some(0), 0.46, 0.45);
    check(refused(&FIVE_BAR, -0.42, 0.0), "unreachable_leg_2", Some(1), 0.47, 0.45);
    check(refused(&FIVE_BAR, -0.05, 0.03), "unreachable_leg_1", Some(0), 0.03, 0.05);
    // r = 0.4496: (a² + b² − r²)/2ab is the cosine between the links.
    let cosine = (0.25_f64 * 0.25 + 0.2 * 0.2 - 0.4496 * 0.4496) / (2.0 * 0.25 * 0.2);
    let sine = (1.0 - cosine * cosine).sqrt();
    check(
        refused(&FIVE_BAR, 0.4496 * 0.6 - 0.05, 0.4496 * 0.8),
        "singular_type_1",
        Some(0),
        sine,
        0.1,
    );
}

#[test]
fn the_five_bar_keeps_its_forearms_out_of_line() {
    // Both elbows on the inner side, at (∓(0.28 − 0.2·c), 0.2·s).
    let inner = FiveBar {
        half_base: 0.28,
        branch: FiveBarBranch { working_mode: [-1, 1], assembly_mode: 1 },
        ..FIVE_BAR
    };
    let (s, c) = (0.6, 0.8);
    let forearm = 0.28 - 0.2 * c;
    let tool = (0.25_f64 * 0.25 - forearm * forearm).sqrt();
    let q = inner.inverse(&pose(0.0, 0.2 * s + tool), inner.branch, &Joints::zeros()).unwrap();
    assert!((messages::math::cos(q[0]) - c).abs() < 1e-12, "{q}");
    let margins = inner.margins(&inner.solve(&q, inner.branch, None).unwrap());
    assert_eq!(margins.iter().map(|margin| margin.name).collect::<Vec<_>>(), ["type_1", "type_2"]);
    // sin(Φ1 − Φ2) with both forearms at the same slope.
    let sine = 2.0 * forearm * tool / (0.25 * 0.25);
    assert!((margins[1].value - sine).abs() < 1e-12, "{margins:?}");
    let strict = FiveBar { type_2_limit: sine + 0.01, ..inner };
    check(refused(&strict, 0.0, 0.2 * s + tool), "singular_type_2", None, sine, sine + 0.01);
}

#[test]
fn the_prrrp_refuses_what_its_links_cannot_span() {
    check(refused(&PRRRP, 0.31, 0.0), "unreachable_radius", None, 0.31, 0.3);
    check(refused(&PRRRP, -0.31, 0.0), "unreachable_radius", None, 0.31, 0.3);
    check(refused(&PRRRP, -0.2, 0.5), "wrong_side", None, -0.2, 0.0);
    check(refused(&PRRRP, 0.021, 0.5), "singular_type_2", None, 0.07, 0.1);
    check(refused(&PRRRP, 0.288, 0.5), "singular_type_1", None, 0.28, 0.3);
    let solve = |low: f64, high: f64| PRRRP.solve(&[low, high].into(), PRRRP.branch, None);
    check(solve(0.0, 0.61).unwrap_err(), "unreachable_radius", None, 0.305, 0.3);
    check(solve(0.2, 0.1).unwrap_err(), "carts_crossed", Some(1), 0.1, 0.2);
    let margins = PRRRP.margins(&solve(0.1, 0.46).unwrap());
    let values = [margins[0].value, margins[1].value];
    assert!((values[0] - 0.6).abs() + (values[1] - 0.8).abs() < 1e-12, "{margins:?}");
}

#[test]
fn the_twin_actuator_refuses_its_base_line_and_its_pivot() {
    // h·sin θh = 0.0546; |P − A| = 0.05.
    let sideways = 0.06 * messages::math::sin(2.0);
    check(refused(&TWIN, 0.03, 0.04), "unreachable_near_A", Some(0), 0.05, sideways);
    // √(|P − A|² − 0.0546²) = 0.015.
    let radius = (sideways * sideways + 0.015 * 0.015).sqrt();
    check(refused(&TWIN, 0.0, radius), "unreachable_near_A", Some(0), 0.015, 0.02);
    assert_eq!(refused(&TWIN, 0.4, -0.3).code, "wrong_elbow");
    let baseline = refused(&TWIN, 0.44, 0.08);
    assert_eq!((baseline.code, baseline.limit), ("singular_baseline", 0.1));
    assert!(baseline.value.abs() < 0.1, "{baseline:?}");
    let solve = |la: f64, lb: f64| TWIN.solve(&[la, lb].into(), TWIN.branch, None);
    // The cosine at A of sides 0.8, 0.3 and 0.4: the two are shorter than the base.
    let cosine = (0.64 + 0.09 - 0.16) / (2.0 * 0.8 * 0.3);
    check(solve(0.3, 0.4).unwrap_err(), "unreachable_lengths", None, cosine, 1.0);
    assert_eq!(solve(-0.5, 0.6).unwrap_err().code, "unreachable_lengths");
    let margins = TWIN.margins(&solve(0.5, 0.5).unwrap());
    // An isosceles triangle 0.3 high on a base of 0.8.
    assert!((margins[0].value - 0.6).abs() < 1e-12, "{margins:?}");
    let forwards = 0.06 * messages::math::cos(2.0);
    assert!((margins[1].value - (0.5 - forwards)).abs() < 1e-12, "{margins:?}");
}

/// NaN and infinity anywhere give an error, never a number.
#[test]
fn what_is_not_a_number_is_refused() {
    fn check<M: Mechanism<2>>(mechanism: &M, x: f64, y: f64) {
        let branch = mechanism.branch();
        let inside = pose(x, y);
        let q = mechanism.inverse(&inside, branch, &Joints::zeros()).unwrap();
        for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            refused(mechanism, wrong, y);
            refused(mechanism, x, wrong);
            for axis in 0..2 {
                let mut joints = q;
                joints[axis] = wrong;
                assert!(mechanism.solve(&joints, branch, None).is_err(), "{joints}");
            }
        }
    }
    check(&FIVE_BAR, 0.0, 0.3);
    check(&PRRRP, 0.2, 0.1);
    check(&TWIN, 0.4, 0.36);
}

#[test]
fn branches_are_chosen_by_name_and_value() {
    let branch = FIVE_BAR.branch;
    assert_eq!(branch.choices(), [("working_mode", vec![1, -1]), ("assembly_mode", vec![1])]);
    let chosen = branch.choose("working_mode", &[-1, -1]).unwrap();
    assert_eq!(chosen.working_mode, [-1, -1]);
    assert_eq!(chosen.choose("assembly_mode", &[-1]).unwrap().assembly_mode, -1);
    assert_eq!(branch.choose("working_mode", &[1]), None);
    assert_eq!(branch.choose("working_mode", &[1, 0]), None);
    assert_eq!(branch.choose("elbow", &[1]), None);
    assert_eq!(PRRRP.branch.choose("side", &[-1]), Some(PrrrpBranch { side: -1 }));
    assert_eq!(PRRRP.branch.choose("side", &[2]), None);
    assert_eq!(TWIN.branch.choose("elbow", &[-1]), Some(TwinBranch { elbow: -1 }));
    assert_eq!(TWIN.branch.choices(), [("elbow", vec![1])]);
}

/// As the equations give them, beyond half a turn too; a place that the arm came to the other way
/// round keeps its turns.
#[test]
fn the_five_bars_angles_are_those_of_the_equations_unless_a_turn_lies_between() {
    let place = pose(-0.2, 0.1);
    let machine = FiveBar {
        branch: FiveBarBranch { working_mode: [1, 1], assembly_mode: 1 },
        type_2_limit: 0.0,
        ..FIVE_BAR
    };
    let (x, y): (f64, f64) = (-0.15, 0.1);
    let r = messages::math::hypot(x, y);
    let expected = messages::math::atan2(y, x)
        + messages::math::acos((0.04 + r * r - 0.0625) / (2.0 * 0.2 * r));
    assert!(expected > core::f64::consts::PI, "{expected}");
    let q = machine.inverse(&place, machine.branch, &Joints::zeros()).unwrap();
    assert!((q[0] - expected).abs() < 1e-12, "{q}");
    let turned = Joints::from([expected - 3.0 * core::f64::consts::TAU, q[1]]);
    let again = machine.inverse(&place, machine.branch, &turned).unwrap();
    assert!((again - turned).amax() < 1e-12, "{again}");
}
