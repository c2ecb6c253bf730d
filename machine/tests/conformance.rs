//! What every mechanism must do, whatever it is: independent routes to the same numbers.

#![allow(clippy::unwrap_used)]

use machine::kinematics::{Attitude, JointMotion, Joints, ToolMotion};
use machine::mechanisms::{
    ActuatorBodies, Elasticity, FiveBar, FiveBarBranch, Prrrp, PrrrpBranch, TwinActuator,
    TwinBranch,
};
use machine::{Cartesian, CoreXy, Mechanism, Pose};
use nalgebra::{Vector2, Vector3};

/// Repeatable numbers from -1 to 1 (xorshift64*).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11;
        bits as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self, scale: f64, lift: bool) -> Vector3<f64> {
        let z = self.next();
        Vector3::new(self.next(), self.next(), if lift { z } else { 0.0 }) * scale
    }
}

const CASES: usize = 500;

/// Where a mechanism is tried, and how exactly.
struct Region {
    /// The middle of it [m].
    middle: Vector3<f64>,
    /// Half its edge [m].
    half: f64,
    /// Every tolerance, in terms of that of a linear mechanism with joints in metres: closed chains
    /// round more often, and their joints move faster than the tool.
    slack: f64,
}

/// Runs the suite over seeded motions of a linear mechanism.
fn conforms<const N: usize, M: Mechanism<N>>(mechanism: &M) {
    conforms_in(mechanism, &Region { middle: Vector3::new(0.1, 0.1, 0.0), half: 0.1, slack: 1.0 });
}

/// Runs the suite over seeded motions in `region`.
fn conforms_in<const N: usize, M: Mechanism<N>>(mechanism: &M, region: &Region) {
    let lift = N > 2;
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for case in 0..CASES {
        let tool = ToolMotion {
            position: random.vector(region.half, lift) + region.middle,
            velocity: random.vector(0.25, lift),
            acceleration: random.vector(10.0, lift),
            jerk: random.vector(500.0, lift),
            attitude: Attitude::LEVEL,
        };
        let context = format!("{} case {case}: {tool:?}", M::NAME);
        kinematics(mechanism, &tool, region.slack, &context);
        dynamics(mechanism, &tool, region.slack, &context);
    }
    transmission(mechanism);
}

#[track_caller]
fn near(found: f64, expected: f64, tolerance: f64, context: &str) {
    let error = (found - expected).abs();
    assert!(error <= tolerance, "{found} against {expected} (off by {error:e}), {context}");
}

fn kinematics<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    tool: &ToolMotion,
    slack: f64,
    context: &str,
) {
    let branch = mechanism.branch();
    let start = Joints::<N>::zeros();
    let q = mechanism.inverse(&Pose::at(tool.position), branch, &start).unwrap();
    let back = mechanism.forward(&q, branch).unwrap();
    near((back.position - tool.position).norm(), 0.0, 1e-15 * slack, context);
    let again = mechanism.inverse(&back, branch, &q).unwrap();
    near((again - q).norm(), 0.0, 1e-15 * slack, context);

    // Jacobian against central differences; forward is linear or smooth, so h² and rounding/h
    // both stay below 1e-9.
    let step = 1e-6;
    let jacobian = mechanism.jacobian(&mechanism.assemble(&q, branch, None).unwrap());
    for column in 0..N {
        let mut offset = Joints::<N>::zeros();
        offset[column] = step;
        let ahead = mechanism.forward(&(q + offset), branch).unwrap().position;
        let behind = mechanism.forward(&(q - offset), branch).unwrap().position;
        let difference = (ahead - behind) / (2.0 * step);
        for row in 0..3 {
            near(jacobian[(row, column)], difference[row], 1e-9 * slack, context);
        }
    }

    let motion: JointMotion<N> = mechanism.joint_motion(tool, branch, &q).unwrap();
    near((motion.position - q).norm(), 0.0, 1e-15 * slack, context);
    let linear = (jacobian * motion.velocity).fixed_rows::<3>(0).into_owned();
    near((linear - tool.velocity).norm(), 0.0, 1e-14 * slack, context);
    // Each derivative of the joints against a difference of the one below, along the path that the
    // tool's derivatives define.
    let h = 1e-5;
    let at = |t: f64| {
        let along = ToolMotion {
            position: tool.position
                + tool.velocity * t
                + tool.acceleration * (t * t / 2.0)
                + tool.jerk * (t * t * t / 6.0),
            velocity: tool.velocity + tool.acceleration * t + tool.jerk * (t * t / 2.0),
            acceleration: tool.acceleration + tool.jerk * t,
            jerk: tool.jerk,
            attitude: tool.attitude,
        };
        mechanism.joint_motion(&along, branch, &q).unwrap()
    };
    let (ahead, behind) = (at(h), at(-h));
    let speed = (ahead.position - behind.position) / (2.0 * h);
    let acceleration = (ahead.velocity - behind.velocity) / (2.0 * h);
    let jerk = (ahead.acceleration - behind.acceleration) / (2.0 * h);
    // Truncation jerk·h²/6 = 1e-8 in speed; rounding 1e-16/h elsewhere.
    near((speed - motion.velocity).norm(), 0.0, 1e-7 * slack, context);
    near((acceleration - motion.acceleration).norm(), 0.0, 1e-6 * slack, context);
    near((jerk - motion.jerk).norm(), 0.0, 1e-4 * slack, context);
}

fn dynamics<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    tool: &ToolMotion,
    slack: f64,
    context: &str,
) {
    let branch = mechanism.branch();
    let motion = mechanism.joint_motion(tool, branch, &Joints::zeros()).unwrap();
    let q = motion.position;
    let at = |q: Joints<N>| mechanism.assemble(&q, branch, None).unwrap();
    let assembly = at(q);
    let mass = mechanism.mass_matrix(&assembly);
    near((mass - mass.transpose()).amax(), 0.0, 1e-15 * slack, context);
    assert!(mass.cholesky().is_some(), "the mass matrix is not positive: {context}");

    // Column by column: inverse dynamics of a unit acceleration at rest, without gravity.
    let rest = |acceleration: Joints<N>| JointMotion {
        position: q,
        velocity: Joints::zeros(),
        acceleration,
        jerk: Joints::zeros(),
    };
    let effort = |motion: &JointMotion<N>| {
        mechanism.inverse_dynamics(&assembly, &motion.velocity, &motion.acceleration)
    };
    let held = effort(&rest(Joints::zeros()));
    near((held - mechanism.gravity(&assembly)).norm(), 0.0, 1e-12 * slack, context);
    for column in 0..N {
        let mut unit = Joints::<N>::zeros();
        unit[column] = 1.0;
        let effort = effort(&rest(unit)) - held;
        near((effort - mass.column(column)).norm(), 0.0, 1e-12 * slack, context);
    }

    // Power into the joints is the change of kinetic energy and the work against gravity: an
    // independent route through the energy alone.
    let h = 1e-6;
    let energy = |t: f64| {
        let velocity = motion.velocity + motion.acceleration * t;
        velocity.dot(&(mechanism.mass_matrix(&at(q + motion.velocity * t)) * velocity)) / 2.0
    };
    let change = (energy(h) - energy(-h)) / (2.0 * h);
    let power = effort(&motion).dot(&motion.velocity);
    let lifting = mechanism.gravity(&assembly).dot(&motion.velocity);
    near(power, change + lifting, 1e-7 * slack, context);
}

fn transmission<const N: usize, M: Mechanism<N>>(mechanism: &M) {
    let Some(stiffness) = mechanism.stiffness() else {
        assert_eq!(mechanism.damping().amax(), 0.0);
        return;
    };
    let damping = mechanism.damping();
    assert_eq!((stiffness - stiffness.transpose()).amax(), 0.0);
    assert_eq!((damping - damping.transpose()).amax(), 0.0);
    assert!(stiffness.cholesky().is_some() && damping.cholesky().is_some());
}

const SCREW: Elasticity = Elasticity { stiffness: 1e8, damping: 2.5e4 };

#[test]
fn the_cartesian_conforms() {
    conforms(&Cartesian { mass: [1.93, 0.33], elasticity: Some([SCREW; 2]) });
    conforms(&Cartesian { mass: [1.93, 0.33], elasticity: None });
}

#[test]
fn the_cartesian_with_a_lift_conforms() {
    let mechanism = Cartesian { mass: [1.93, 0.33, 0.2], elasticity: Some([SCREW; 3]) };
    conforms(&mechanism);
    assert_eq!(mechanism.gravity(&Joints::zeros()), Joints::from([0.0, 0.0, 0.2 * 9.806_65]));
}

#[test]
fn the_corexy_conforms() {
    let belts = [0.33, 1.06].map(|mass| Elasticity::damped(6e4, mass, 0.9));
    conforms(&CoreXy { mass: [0.33, 1.06], elasticity: Some(belts) });
    conforms(&CoreXy { mass: [0.33, 1.06], elasticity: None });
}

/// A machine like that of source 003 ch. 5, with no symmetry that could hide a mistake.
fn five_bar(working_mode: [i32; 2], assembly_mode: i32) -> FiveBar {
    FiveBar {
        half_base: 0.06,
        proximal: 0.21,
        distal: 0.26,
        proximal_mass: 0.17,
        proximal_inertia: 5.3e-4,
        distal_mass: 0.19,
        distal_inertia: 1.1e-3,
        tool_mass: 0.31,
        bar_mass: 0.2,
        type_1_limit: 0.05,
        type_2_limit: 0.05,
        branch: FiveBarBranch { working_mode, assembly_mode },
        elasticity: Some([Elasticity { stiffness: 900.0, damping: 3.0 }; 2]),
    }
}

#[test]
fn the_five_bar_conforms_in_every_working_mode() {
    let above = |height| Region { middle: Vector3::new(0.01, height, 0.0), half: 0.05, slack: 1e3 };
    conforms_in(&five_bar([1, -1], 1), &above(0.3));
    conforms_in(&five_bar([-1, 1], -1), &above(-0.3));
    conforms_in(&five_bar([-1, 1], -1), &above(0.3));
    let one_sided = Region { half: 0.02, ..above(0.3) };
    conforms_in(&five_bar([1, 1], 1), &one_sided);
    conforms_in(&five_bar([-1, -1], 1), &one_sided);
}

#[test]
fn the_prrrp_conforms_on_both_sides() {
    for side in [1, -1] {
        let mechanism = Prrrp {
            link: 0.31,
            link_mass: 0.23,
            link_inertia: 1.8e-3,
            cart_mass: 0.21,
            tool_mass: 0.33,
            bar_mass: 0.19,
            type_1_limit: 0.1,
            type_2_limit: 0.1,
            branch: PrrrpBranch { side },
            elasticity: Some([SCREW; 2]),
        };
        let middle = Vector3::new(0.17 * f64::from(side), -0.4, 0.0);
        conforms_in(&mechanism, &Region { middle, half: 0.07, slack: 1e3 });
    }
}

#[test]
fn the_twin_actuator_conforms_on_a_base_line_that_lies_askew() {
    let bodies = |mass| ActuatorBodies {
        housing_inertia: 0.01 * mass,
        rod_mass: mass,
        rod_inertia: 0.002,
        rod_centre: 0.15,
    };
    for elbow in [1, -1] {
        let mechanism = TwinActuator {
            bases: [Vector2::new(-0.1, 0.05), Vector2::new(0.66, -0.1)],
            offset: 0.07,
            offset_angle: 2.3,
            bodies: [bodies(0.4), bodies(0.6)],
            tool_mass: 0.3,
            baseline_limit: 0.1,
            near_limit: 0.02,
            branch: TwinBranch { elbow },
            elasticity: Some([SCREW; 2]),
        };
        let middle = Vector3::new(0.3, 0.4 * f64::from(elbow), 0.0);
        conforms_in(&mechanism, &Region { middle, half: 0.08, slack: 1e3 });
    }
}

/// Twice round the motors: nowhere a jump.
#[test]
fn the_five_bars_angles_are_continuous_round_a_motor() {
    // With both motors in one place the machine may turn without end.
    let mechanism = FiveBar { half_base: 0.0, ..five_bar([1, -1], 1) };
    let mut previous = Joints::zeros();
    let mut first = None;
    for step in 0..=2000 {
        let turn = f64::from(step) / 1000.0 * core::f64::consts::TAU;
        let (sine, cosine) = signals::math::sin_cos(turn);
        let pose = Pose::at(Vector3::new(cosine, sine, 0.0) * 0.3);
        let q = mechanism.inverse(&pose, mechanism.branch, &previous).unwrap();
        if let Some(start) = first {
            near((q - previous).amax(), core::f64::consts::TAU / 1000.0, 1e-12, "step");
            near(q[0] - start, turn, 1e-9, "since the start");
        } else {
            first = Some(q[0]);
        }
        previous = q;
    }
}

/// A force on the head alone stretches only its own direction, by force over stiffness.
#[test]
fn the_belts_are_two_springs_along_x_and_y() {
    let belts = [Elasticity::damped(6e4, 0.33, 0.9), Elasticity::damped(3e4, 1.06, 0.9)];
    let corexy = CoreXy { mass: [0.33, 1.06], elasticity: Some(belts) };
    let inverse = corexy.stiffness().unwrap().try_inverse().unwrap();
    let jacobian = corexy.jacobian(&Joints::zeros()).fixed_view::<2, 2>(0, 0).into_owned();
    let give = jacobian * inverse * jacobian.transpose();
    near(give[(0, 0)], 1.0 / 6e4, 1e-18, "x");
    near(give[(1, 1)], 1.0 / 3e4, 1e-18, "y");
    near(give[(0, 1)], 0.0, 1e-18, "across");
}

#[test]
fn a_planar_mechanism_refuses_to_leave_its_plane() {
    let corexy = CoreXy { mass: [0.33, 1.06], elasticity: None };
    let pose = |z| Pose::at(Vector3::new(0.1, 0.1, z));
    let error = corexy.inverse(&pose(0.01), (), &Joints::zeros()).unwrap_err();
    assert_eq!((error.code, error.value), ("out_of_plane", 0.01));
    let error = corexy.inverse(&pose(f64::NAN), (), &Joints::zeros()).unwrap_err();
    assert_eq!(error.code, "out_of_plane");
    let flat = Cartesian { mass: [1.0, 1.0], elasticity: None };
    assert_eq!(flat.inverse(&pose(-0.01), (), &Joints::zeros()).unwrap_err().value, -0.01);
}
