//! What every mechanism costs: `cargo bench -p machine --bench mechanisms -- --quick`.
//!
//! Each case goes round sixteen positions near by, so that no branch of the code is learnt by heart
//! and iterations start as they do along a path. `docs/mechanisms.md` holds numbers.

// A benchmark stops where a test would.
#![allow(missing_docs, clippy::unwrap_used)]

#[path = "../tests/support/loads.rs"]
mod loads;

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use machine::kinematics::{Attitude, Joints, TaskSpace, ToolMotion};
use machine::mechanisms::mcm::McmBranch;
use machine::mechanisms::polar::PolarBranch;
use machine::mechanisms::serial::{JointKind, Link};
use machine::mechanisms::tri_planar::Legs;
use machine::mechanisms::{
    ActuatorBodies, FiveBar, FiveBarBranch, Prrrp, PrrrpBranch, TriPlanar, TwinActuator, TwinBranch,
};
use machine::{Cartesian, CoreXy, Mcm, Mechanism, Polar, Pose, Serial};
use nalgebra::{Matrix3, Vector2, Vector3};

const POSITIONS: usize = 16;

const GRAVITY: f64 = 9.806_65;

/// One position of a mechanism, with all that it is asked there.
struct Case<const N: usize, M: Mechanism<N>> {
    q: Joints<N>,
    pose: Pose,
    tool: ToolMotion,
    /// The chain at the position before.
    before: M::ChainState,
    velocity: Joints<N>,
    acceleration: Joints<N>,
}

/// Positions on a small round about `middle` [m or rad].
fn round<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    middle: Joints<N>,
) -> [Case<N, M>; POSITIONS] {
    let branch = mechanism.branch();
    let joints = |index: usize| {
        Joints::<N>::from_fn(|axis, _| {
            let turn = index as f64 / POSITIONS as f64 + axis as f64 * 0.37;
            middle[axis] + 1e-3 * (4.0 * (turn.fract() - 0.5).abs() - 1.0)
        })
    };
    let flat = |vector: Vector3<f64>| match mechanism.task_space() {
        TaskSpace::Plane => Vector3::new(vector.x, vector.y, 0.0),
        _ => vector,
    };
    core::array::from_fn(|index| {
        let q = joints(index);
        let before =
            mechanism.solve(&joints((index + POSITIONS - 1) % POSITIONS), branch, None).unwrap();
        let pose = mechanism.pose(&mechanism.solve(&q, branch, None).unwrap());
        let tool = ToolMotion {
            position: pose.position,
            velocity: flat(Vector3::new(0.2, -0.1, 0.05)),
            acceleration: flat(Vector3::new(-4.0, 5.0, 1.0)),
            jerk: flat(Vector3::new(200.0, 300.0, -100.0)),
            attitude: Attitude::fixed(pose.rotation),
        };
        let motion = mechanism.joint_motion(&tool, branch, &q).unwrap();
        let (velocity, acceleration) = (motion.velocity, motion.acceleration);
        Case { q, pose, tool, before, velocity, acceleration }
    })
}

fn measure<const N: usize, M: Mechanism<N>>(
    criterion: &mut Criterion,
    name: &str,
    mechanism: M,
    middle: [f64; N],
) {
    let branch = mechanism.branch();
    let cases = round(&mechanism, Joints::from(middle));
    let mut group = criterion.benchmark_group(name);
    let mut next = cases.iter().cycle();
    group.bench_function("inverse and forward", |bencher| {
        bencher.iter(|| {
            let case = black_box(next.next().unwrap());
            let q = mechanism.inverse(&case.pose, branch, &case.q).unwrap();
            mechanism.locate(&q, branch, Some(&case.before)).unwrap()
        });
    });
    let mut next = cases.iter().cycle();
    group.bench_function("joint motion", |bencher| {
        bencher.iter(|| {
            let case = black_box(next.next().unwrap());
            mechanism.joint_motion(&case.tool, branch, &case.q).unwrap()
        });
    });
    let mut next = cases.iter().cycle();
    group.bench_function("solve and inverse dynamics", |bencher| {
        bencher.iter(|| {
            let case = black_box(next.next().unwrap());
            let there = mechanism.solve(&case.q, branch, Some(&case.before)).unwrap();
            mechanism.inverse_dynamics(&there, &case.velocity, &case.acceleration)
        });
    });
    let mut next = cases.iter().cycle();
    group.bench_function("solve from nothing", |bencher| {
        bencher.iter(|| {
            let case = black_box(next.next().unwrap());
            mechanism.solve(&case.q, branch, None).unwrap()
        });
    });
    group.finish();
}

fn planar(criterion: &mut Criterion) {
    measure(criterion, "cartesian", Cartesian::rigid([1.93, 0.33]), [0.01, 0.02]);
    measure(criterion, "corexy", CoreXy::rigid([0.33, 1.06]), [0.01, 0.02]);
    let five_bar = FiveBar {
        half_base: 0.05,
        proximal: 0.2,
        distal: 0.25,
        proximal_mass: 0.17,
        proximal_inertia: 5.3e-4,
        distal_mass: 0.19,
        distal_inertia: 1.1e-3,
        tool_mass: 0.31,
        bar_mass: 0.2,
        type_1_limit: 0.05,
        type_2_limit: 0.1,
        branch: FiveBarBranch { working_mode: [1, -1], assembly_mode: 1 },
        elasticity: None,
    };
    measure(criterion, "five_bar", five_bar, [2.3, 0.9]);
    let prrrp = Prrrp {
        link: 0.3,
        link_mass: 0.23,
        link_inertia: 1.8e-3,
        cart_mass: 0.21,
        tool_mass: 0.33,
        bar_mass: 0.19,
        type_1_limit: 0.05,
        type_2_limit: 0.1,
        branch: PrrrpBranch { side: 1 },
        elasticity: None,
    };
    measure(criterion, "prrrp", prrrp, [-0.2, 0.2]);
    let bodies = ActuatorBodies {
        housing_inertia: 0.004,
        rod_mass: 0.4,
        rod_inertia: 0.002,
        rod_center: 0.15,
    };
    let twin = TwinActuator {
        bases: [Vector2::new(0.0, 0.0), Vector2::new(0.6, 0.0)],
        offset: 0.07,
        offset_angle: 2.3,
        bodies: [bodies; 2],
        tool_mass: 0.3,
        baseline_limit: 0.1,
        near_limit: 0.02,
        branch: TwinBranch { elbow: 1 },
        elasticity: None,
    };
    measure(criterion, "twin_actuator", twin, [0.5, 0.45]);
}

fn spatial(criterion: &mut Criterion) {
    let polar = Polar {
        arm: 0.25,
        center_distance: 0.25,
        height: 0.0,
        singular_radius: 2e-4,
        endless: true,
        branch: PolarBranch::default(),
        load: loads::POLAR,
        elasticity: None,
    };
    measure(criterion, "polar", polar, [0.4, 1.0, 0.05]);
    let mcm = Mcm {
        tool: 0.12,
        offset: 0.02,
        height: 0.45,
        reach: [0.1, 0.5],
        singular_distance: 1e-4,
        branch: McmBranch::default(),
        load: loads::MCM,
        elasticity: None,
    };
    measure(criterion, "mcm", mcm, [0.3, 0.1, 0.5, 0.6, 0.4]);
    measure(criterion, "serial, two joints", two_joints(), [0.3, 1.2]);
    measure(criterion, "serial, six joints", six_joints(), [0.3, -1.0, 1.0, 0.4, 1.0, 0.2]);
    let platform = TriPlanar {
        side: 0.2,
        struts: [[0.2; 2]; 3],
        mounting: None,
        home: None,
        stator: [[-0.5, 0.5], [-0.4, 0.4]],
        inductor: 0.08,
        gap: 0.005,
        clearance: 0.02,
        type_1_limit: 0.15,
        type_2_limit: 0.05,
        platform_mass: 0.8,
        platform_inertia: [2.1e-3, 2.3e-3, 4.0e-3],
        leg_mass: 0.15,
        inductor_mass: 0.35,
        legs: Legs::default(),
        elasticity: None,
    };
    let level = Pose::at(Vector3::new(0.02, 0.01, 0.105));
    let feet = platform.inverse(&level, platform.branch(), &Joints::zeros()).unwrap();
    measure(criterion, "tri_planar", platform, feet.into());
}

fn link(twist: f64, length: f64, offset: f64) -> Link {
    Link {
        twist,
        length,
        offset,
        angle: 0.0,
        kind: JointKind::Revolute,
        mass: 1.5,
        center: Vector3::new(0.08, -0.02, 0.03),
        inertia: Matrix3::from_diagonal(&Vector3::new(9e-3, 7e-3, 6e-3)),
        lower: -3.1,
        upper: 3.1,
    }
}

fn chain<const N: usize>(task_space: TaskSpace, links: [Link; N], tool: Vector3<f64>) -> Serial<N> {
    Serial {
        base: Pose::at(Vector3::zeros()),
        links,
        tool: Pose::at(tool),
        task_space,
        gravity: Vector3::new(0.0, 0.0, -GRAVITY),
        elasticity: None,
    }
}

fn two_joints() -> Serial<2> {
    let links = [link(0.0, 0.0, 0.0), link(0.0, 0.3, 0.0)];
    chain(TaskSpace::Plane, links, Vector3::new(0.25, 0.0, 0.0))
}

fn six_joints() -> Serial<6> {
    use core::f64::consts::FRAC_PI_2;
    chain(
        TaskSpace::Pose,
        [
            link(0.0, 0.0, 0.0),
            link(-FRAC_PI_2, 0.0, 0.15),
            link(0.0, 0.43, 0.0),
            link(-FRAC_PI_2, 0.02, 0.43),
            link(FRAC_PI_2, 0.0, 0.0),
            link(-FRAC_PI_2, 0.0, 0.06),
        ],
        Vector3::new(0.0, 0.0, 0.1),
    )
}

criterion_group!(benches, planar, spatial);
criterion_main!(benches);
