//! Every mechanism with a force and a moment at its tool, against a general rigid-body engine.
//!
//! `independent_wrench.json` was made with pinocchio 4.1: three cases for each kind, random
//! dimensions, bodies and states. The engine has trees of rigid bodies, with gravity along −z:
//! loops are cut at the tool or at a foot, closed by Newton's method on the engine's own Jacobians,
//! and held by Lagrange multipliers, which come with the joints' efforts from one linear system. The
//! head of a planar linkage is a body of its own on two guides. What the tool exerts acts backwards on
//! the tool's body, and on a table, where there is one, as it is. Nothing there knows the equations
//! here. SI units.

#![allow(clippy::unwrap_used)]

mod support;

use machine::kinematics::{Joints, TaskSpace};
use machine::mechanisms::mcm::{McmBranch, McmLoad};
use machine::mechanisms::polar::{PolarBranch, PolarLoad};
use machine::mechanisms::serial::{JointKind, Link};
use machine::mechanisms::tri_planar::{Fold, Legs, TriPlanar};
use machine::mechanisms::{
    ActuatorBodies, FiveBar, FiveBarBranch, Prrrp, PrrrpBranch, TwinActuator, TwinBranch,
};
use machine::{Cartesian, CoreXy, EquationOfMotion, Mcm, Mechanism, Polar, Pose, Serial};
use nalgebra::{Matrix3, SMatrix, Vector2, Vector6};
use serde_json::Value;
use support::{array, golden, number, vector};

/// Relative to the largest entry; the loops of the other side are closed to 1e-14.
const TOLERANCE: f64 = 1e-9;

const GRAVITY: f64 = machine::kinematics::STANDARD_GRAVITY;

fn cases(kind: &str) -> Vec<Value> {
    let cases = golden("independent_wrench")[kind].as_array().unwrap().clone();
    assert_eq!(cases.len(), 3);
    cases
}

#[track_caller]
fn near<const R: usize, const C: usize>(
    what: &str,
    found: SMatrix<f64, R, C>,
    expected: SMatrix<f64, R, C>,
    scale: f64,
) {
    let error = (found - expected).amax();
    assert!(error <= TOLERANCE * scale, "{what}: {found} against {expected}, {error:e}");
}

fn check<const N: usize, M: Mechanism<N>>(mechanism: &M, case: &Value) {
    let joints = |key: &str| Joints::from(array::<N>(&case[key]));
    let [q, velocity, acceleration] = ["q", "velocity", "acceleration"].map(joints);
    let chain = mechanism.solve(&q, mechanism.branch(), None).unwrap();
    let position = vector(&case["position"]);
    near("position", mechanism.pose(&chain).position, position, 1e-3);

    let wrench = Vector6::from(array::<6>(&case["wrench"]));
    let (pushed, expected) = (mechanism.wrench_efforts(&chain, &wrench), joints("wrench_effort"));
    near("wrench", pushed, expected, expected.amax());
    let effort = mechanism.inverse_dynamics(&chain, &velocity, &acceleration) + pushed;
    near("effort", effort, joints("effort"), joints("effort").amax());

    let equation = EquationOfMotion::of(mechanism, &chain, &velocity);
    let mass = SMatrix::<f64, N, N>::from_fn(|row, column| number(&case["mass"][row][column]));
    near("mass", equation.mass, mass, mass.amax());
    let scale = joints("velocity_effort").amax().max(joints("gravity").amax()).max(1e-3);
    near("velocity", equation.velocity, joints("velocity_effort"), scale);
    near("gravity", equation.gravity, joints("gravity"), scale);
    let mut form = equation.centrifugal * velocity.component_mul(&velocity);
    let mut columns = equation.coriolis.iter();
    for one in 0..N {
        for other in one + 1..N {
            form += columns.next().unwrap() * (velocity[one] * velocity[other]);
        }
    }
    assert_eq!(columns.next(), None);
    near("centrifugal and Coriolis", form, joints("velocity_effort"), scale);
}

fn value(case: &Value) -> impl Fn(&str) -> f64 {
    let params = case["params"].clone();
    move |key| number(&params[key])
}

fn pair(value: &Value) -> Vector2<f64> {
    Vector2::from(array::<2>(value))
}

#[test]
fn carriages_on_screws_leave_moments_to_their_guides() {
    for case in cases("cartesian") {
        check(&Cartesian::<2>::rigid(array(&case["params"]["mass"])), &case);
    }
    for case in cases("cartesian_lift") {
        check(&Cartesian::<3>::rigid(array(&case["params"]["mass"])), &case);
    }
}

#[test]
fn crossed_belts_leave_moments_to_their_guides() {
    for case in cases("corexy") {
        check(&CoreXy::<2>::rigid(array(&case["params"]["mass"])), &case);
    }
}

#[test]
fn the_five_bar_leaves_moments_to_the_guides_of_its_head() {
    for case in cases("five_bar") {
        let value = value(&case);
        let mechanism = FiveBar {
            half_base: value("half_base"),
            proximal: value("proximal"),
            distal: value("distal"),
            proximal_mass: value("proximal_mass"),
            proximal_inertia: value("proximal_inertia"),
            distal_mass: value("distal_mass"),
            distal_inertia: value("distal_inertia"),
            tool_mass: value("tool_mass"),
            bar_mass: value("bar_mass"),
            type_1_limit: 0.05,
            type_2_limit: 0.05,
            branch: FiveBarBranch { working_mode: [1, -1], assembly_mode: 1 },
            elasticity: None,
        };
        check(&mechanism, &case);
    }
}

#[test]
fn the_prrrp_leaves_moments_to_the_guides_of_its_head() {
    for case in cases("prrrp") {
        let value = value(&case);
        let mechanism = Prrrp {
            link: value("link"),
            link_mass: value("link_mass"),
            link_inertia: value("link_inertia"),
            cart_mass: value("cart_mass"),
            tool_mass: value("tool_mass"),
            bar_mass: value("bar_mass"),
            type_1_limit: 0.05,
            type_2_limit: 0.05,
            branch: PrrrpBranch { side: 1 },
            elasticity: None,
        };
        check(&mechanism, &case);
    }
}

#[test]
fn a_moment_on_the_plate_of_the_twin_actuator_loads_both_actuators() {
    for case in cases("twin_actuator") {
        let params = &case["params"];
        let bodies = [0, 1].map(|actuator| {
            let value = |key: &str| number(&params["bodies"][actuator][key]);
            ActuatorBodies {
                housing_inertia: value("housing_inertia"),
                rod_mass: value("rod_mass"),
                rod_inertia: value("rod_inertia"),
                rod_center: value("rod_center"),
            }
        });
        let mechanism = TwinActuator {
            bases: [pair(&params["base_a"]), pair(&params["base_b"])],
            offset: number(&params["offset"]),
            offset_angle: number(&params["offset_angle"]),
            bodies,
            tool_mass: number(&params["tool_mass"]),
            baseline_limit: 0.05,
            near_limit: 0.01,
            branch: TwinBranch { elbow: 1 },
            elasticity: None,
        };
        check(&mechanism, &case);
        let chain = mechanism.solve(&Joints::from(array(&case["q"])), mechanism.branch, None);
        let moment = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        let borne = mechanism.wrench_efforts(&chain.unwrap(), &moment);
        assert!(borne.iter().all(|effort| effort.abs() > 0.1), "{borne}");
    }
}

#[test]
fn a_moment_on_the_polar_machine_loads_the_arm_and_the_table() {
    for case in cases("polar") {
        let value = value(&case);
        let mechanism = Polar {
            arm: value("arm"),
            center_distance: value("center_distance"),
            height: value("height"),
            singular_radius: 2e-4,
            endless: true,
            branch: PolarBranch::default(),
            load: PolarLoad {
                arm_mass: value("arm_mass"),
                arm_center: value("arm_center"),
                arm_inertia: value("arm_inertia"),
                head_mass: value("head_mass"),
                head_center: value("head_center"),
                head_inertia: value("head_inertia"),
                table_inertia: value("table_inertia"),
                workpiece_mass: value("workpiece_mass"),
                workpiece_center: value("workpiece_center"),
                workpiece_inertia: value("workpiece_inertia"),
                counterbalance: value("counterbalance"),
                gravity: GRAVITY,
            },
            elasticity: None,
        };
        check(&mechanism, &case);
    }
}

#[test]
fn a_moment_on_the_mcm_loads_its_head_and_the_table() {
    for case in cases("mcm") {
        let value = value(&case);
        let mechanism = Mcm {
            tool: value("tool"),
            offset: value("offset"),
            height: value("height"),
            reach: [0.1, 0.5],
            singular_distance: 1e-4,
            branch: McmBranch::default(),
            load: McmLoad {
                carriage_mass: value("carriage_mass"),
                slide_mass: value("slide_mass"),
                table_inertia: value("table_inertia"),
                yoke_inertia: value("yoke_inertia"),
                head_mass: value("head_mass"),
                head_center: value("head_center"),
                head_inertia: array(&case["params"]["head_inertia"]),
                counterbalance: value("counterbalance"),
                gravity: GRAVITY,
            },
            elasticity: None,
        };
        check(&mechanism, &case);
    }
}

fn matrix(value: &Value) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| number(&value[row][column]))
}

fn pose(value: &Value) -> Pose {
    Pose { position: vector(&value["position"]), rotation: matrix(&value["rotation"]) }
}

fn check_serial<const N: usize>(case: &Value) {
    let params = &case["params"];
    let links = core::array::from_fn(|joint| {
        let link = &params["links"][joint];
        let value = |key: &str| number(&link[key]);
        Link {
            twist: value("twist"),
            length: value("length"),
            offset: value("offset"),
            angle: value("angle"),
            kind: if link["kind"] == "R" { JointKind::Revolute } else { JointKind::Prismatic },
            mass: value("mass"),
            center: vector(&link["center"]),
            inertia: matrix(&link["inertia"]),
            lower: -10.0,
            upper: 10.0,
        }
    });
    let chain = Serial::<N> {
        base: pose(&params["base"]),
        links,
        tool: pose(&params["tool"]),
        task_space: TaskSpace::Pose,
        gravity: nalgebra::Vector3::new(0.0, 0.0, -GRAVITY),
        elasticity: None,
    };
    check(&chain, case);
}

#[test]
fn a_wrench_loads_every_joint_of_an_open_chain() {
    let [two, four, six] = <[Value; 3]>::try_from(cases("serial")).unwrap();
    check_serial::<2>(&two);
    check_serial::<4>(&four);
    check_serial::<6>(&six);
}

#[test]
fn a_wrench_loads_every_foot_of_the_platform() {
    for case in cases("tri_planar") {
        let value = value(&case);
        let fold = |mode: f64| if mode > 0.0 { Fold::Outward } else { Fold::Inward };
        let mechanism = TriPlanar {
            side: value("side"),
            struts: [[value("side"); 2]; 3],
            mounting: None,
            home: None,
            stator: [[-0.6, 0.6]; 2],
            inductor: 0.02,
            gap: 0.005,
            clearance: 0.01,
            type_1_limit: 0.01,
            type_2_limit: 0.01,
            platform_mass: value("platform_mass"),
            platform_inertia: array(&case["params"]["platform_inertia"]),
            leg_mass: value("leg_mass"),
            inductor_mass: value("motor_mass"),
            legs: Legs(array::<3>(&case["modes"]).map(fold)),
            elasticity: None,
        };
        check(&mechanism, &case);
    }
}
