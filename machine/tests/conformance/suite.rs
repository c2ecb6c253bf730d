//! What every mechanism must do, whatever it is: independent routes to the same numbers.

use machine::kinematics::{JointMotion, Joints, TaskSpace, ToolMotion};
use machine::{Mechanism, Pose};
use nalgebra::{SVector, Vector3};

use super::dynamics;
use super::sample::{Random, clear, counted, distance, later, near, rows, slope};

const CASES: usize = 200;

/// Longest step of the differences in time [s]: at 50 rad/s both the truncation (ω·h)⁴/30 and the
/// rounding 1e-12/h stay below 1e-7.
const INSTANT: f64 = 1e-4;

/// The most that a joint moves in a step in time [m or rad]: near a singularity all is quicker.
const STRIDE: f64 = 2e-3;

/// Step of the differences over joints [m or rad].
const STEP: f64 = 1e-4;

/// Runs the suite over seeded states. `branches` are the ways to solve the inverse, `joints` gives
/// states on the mechanism's own branch.
pub(crate) fn conforms<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    branches: &[M::Branch],
    mut joints: impl FnMut(&mut Random) -> Joints<N>,
) {
    let mut random = Random::new(0x9e37_79b9_7f4a_7c15);
    let mut taken = vec![0; branches.len()];
    let (mut cases, mut tries) = (0, 0);
    while cases < CASES {
        tries += 1;
        assert!(
            tries <= 20 * CASES,
            "{}: hardly a state of the sampler is of use",
            mechanism.name()
        );
        let q = joints(&mut random);
        let Ok(state) = mechanism.solve(&q, mechanism.branch(), None) else { continue };
        if !clear(mechanism, &state, 1.2) {
            continue;
        }
        let tool = random.motion(&mechanism.pose(&state), mechanism.task_space());
        let context = format!("{} case {cases}: {q:?} {tool:?}", mechanism.name());
        positions(mechanism, &q, &tool.pose(), &context);
        for (branch, taken) in branches.iter().zip(&mut taken) {
            *taken += usize::from(solves(mechanism, *branch, &q, &tool.pose(), &context));
        }
        jacobian(mechanism, &q, &context);
        let motion = motion(mechanism, &q, &tool, &context);
        dynamics::efforts(mechanism, &motion, &context);
        dynamics::power(mechanism, &motion, &context);
        if cases < 2 {
            dynamics::free_motion(mechanism, &motion, &context);
        }
        refusals(mechanism, &q, &tool, &context);
        cases += 1;
    }
    for (branch, taken) in branches.iter().zip(taken) {
        assert!(taken > CASES / 20, "{} {branch:?} solved only {taken} cases", mechanism.name());
    }
    dynamics::transmission(mechanism);
}

/// From joints to the tool and back, both ways round.
fn positions<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    q: &Joints<N>,
    pose: &Pose,
    context: &str,
) {
    let branch = mechanism.branch();
    let beside = q.map(|joint| joint + 1e-3);
    let found = mechanism.inverse(pose, branch, &beside).unwrap();
    let back = mechanism.forward(&found, branch).unwrap();
    near(distance(mechanism.task_space(), &back, pose), 0.0, 2e-12, 1.0, context);
    // A redundant chain may take other joints to the same place.
    if N <= rows(mechanism.task_space()) {
        near((found - q).amax(), 0.0, 1e-10, 1.0, context);
    }
    // The short ways lead to the same: to the bit, and to where an iteration ends.
    let solved = mechanism.solve(&found, branch, None).unwrap();
    assert_eq!(back, mechanism.pose(&solved), "{context}");
    let along = mechanism.locate(&beside, branch, Some(&solved));
    let found_beside = mechanism.solve(&beside, branch, Some(&solved));
    assert_eq!(along, found_beside.map(|chain| mechanism.pose(&chain)), "{context}");
    let known = mechanism.solve_at(pose, &found, branch, None).unwrap();
    near(distance(TaskSpace::Pose, &mechanism.pose(&known), &back), 0.0, 2e-12, 1.0, context);
    let again = mechanism.inverse(&back, branch, &found).unwrap();
    near((again - found).amax(), 0.0, 1e-10, 1.0, context);
}

/// Another branch has other joints for the same pose, or says why not.
fn solves<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    branch: M::Branch,
    q: &Joints<N>,
    pose: &Pose,
    context: &str,
) -> bool {
    match mechanism.inverse(pose, branch, q) {
        Ok(found) => {
            let back = mechanism.forward(&found, branch).unwrap();
            near(distance(mechanism.task_space(), &back, pose), 0.0, 2e-12, 1.0, context);
            true
        }
        Err(error) => {
            assert!(error.value.is_finite() && error.limit.is_finite(), "{error:?} {context}");
            false
        }
    }
}

/// The Jacobian against differences of the forward kinematics, linear and angular.
fn jacobian<const N: usize, M: Mechanism<N>>(mechanism: &M, q: &Joints<N>, context: &str) {
    let branch = mechanism.branch();
    let state = mechanism.solve(q, branch, None).unwrap();
    let jacobian = mechanism.jacobian(&state);
    let rotation = mechanism.pose(&state).rotation;
    for column in 0..N {
        let difference: SVector<f64, 6> = slope(STEP, |step| {
            let mut moved = *q;
            moved[column] += step;
            let moved = mechanism.solve(&moved, branch, Some(&state)).unwrap();
            let pose = mechanism.pose(&moved);
            // R(q + δ)·Rᵀ is 1 + φ× to first order, and its odd part is sin φ.
            let turn = pose.rotation * rotation.transpose();
            let odd = (turn - turn.transpose()) / 2.0;
            SVector::from([
                pose.position.x,
                pose.position.y,
                pose.position.z,
                odd[(2, 1)],
                odd[(0, 2)],
                odd[(1, 0)],
            ])
        });
        let scale = jacobian.column(column).amax();
        near((jacobian.column(column) - difference).amax(), 0.0, 1e-7, scale, context);
    }
}

/// The joints' motion against differences of itself and against the tool's.
fn motion<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    q: &Joints<N>,
    tool: &ToolMotion,
    context: &str,
) -> JointMotion<N> {
    let (branch, task_space) = (mechanism.branch(), mechanism.task_space());
    let motion = mechanism.joint_motion(tool, branch, q).unwrap();
    if N <= rows(task_space) {
        near((motion.position - q).amax(), 0.0, 1e-10, 1.0, context);
    }

    // Each derivative against a difference of the one below, along the tool's own path.
    let instant = INSTANT.min(STRIDE / motion.velocity.amax());
    let at = |t: f64| mechanism.joint_motion(&later(tool, t), branch, &motion.position).unwrap();
    let check = |found: &Joints<N>, difference: Joints<N>, name: &str| {
        let context = format!("{name}, {context}");
        near((found - difference).amax(), 0.0, 2e-6, found.amax(), &context);
    };
    check(&motion.velocity, slope(instant, |t| at(t).position), "velocity");
    check(&motion.acceleration, slope(instant, |t| at(t).velocity), "acceleration");
    check(&motion.jerk, slope(instant, |t| at(t).acceleration), "jerk");

    // The tool's velocity is J·q̇, and its acceleration J·q̈ + J̇·q̇.
    let state = mechanism.solve(&motion.position, branch, None).unwrap();
    let pose = mechanism.pose(&state);
    let jacobian = mechanism.jacobian(&state);
    let tool_rate = |t: f64| {
        let moved = motion.position
            + motion.velocity * t
            + motion.acceleration * (t * t / 2.0)
            + motion.jerk * (t * t * t / 6.0);
        let rate = motion.velocity + motion.acceleration * t + motion.jerk * (t * t / 2.0);
        let moved = mechanism.solve(&moved, branch, Some(&state)).unwrap();
        mechanism.jacobian(&moved) * rate
    };
    let split = |rates: SVector<f64, 6>| {
        (rates.fixed_rows::<3>(0).into_owned(), rates.fixed_rows::<3>(3).into_owned())
    };
    let (linear, angular) = split(jacobian * motion.velocity);
    let turned = |wanted: &Vector3<f64>, found: &Vector3<f64>| {
        counted(task_space, &pose, &(wanted - found)).amax()
    };
    near((linear - tool.velocity).amax(), 0.0, 1e-10, 1.0, context);
    near(turned(&tool.attitude.velocity, &angular), 0.0, 1e-10, 1.0, context);
    let (linear_rate, angular_rate) = split(slope(instant, tool_rate));
    // Near a singularity quick joints nearly cancel.
    let scale = motion.acceleration.amax().max(20.0);
    near((linear_rate - tool.acceleration).amax(), 0.0, 1e-6, scale, context);
    // The direction's acceleration has what spinning about itself adds: both sides need it.
    let axis = pose.rotation.column(2).into_owned();
    let bend = |spin: &Vector3<f64>, rate: &Vector3<f64>| {
        let swing = axis.cross(&spin.cross(&spin.cross(&axis)));
        counted(task_space, &pose, rate) + counted(task_space, &pose, &swing)
    };
    let wanted = bend(&tool.attitude.velocity, &tool.attitude.acceleration);
    near((wanted - bend(&angular, &angular_rate)).amax(), 0.0, 1e-6, scale, context);
    motion
}

/// What cannot be done is refused with numbers, not clamped.
fn refusals<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    q: &Joints<N>,
    tool: &ToolMotion,
    context: &str,
) {
    let (branch, task_space) = (mechanism.branch(), mechanism.task_space());
    let lengths = rows(task_space).min(3);
    for row in 0..lengths {
        let mut far = *tool;
        far.position[row] += 1e3;
        match mechanism.inverse(&far.pose(), branch, q) {
            Ok(found) => {
                let there = mechanism.forward(&found, branch).unwrap();
                near(distance(task_space, &there, &far.pose()), 0.0, 1e-11, 1e3, context);
            }
            Err(error) => {
                assert!(error.value.is_finite() && error.limit.is_finite(), "{error:?} {context}");
                assert_ne!(error.value, error.limit, "{error:?} {context}");
                assert!(mechanism.joint_motion(&far, branch, q).is_err(), "{context}");
            }
        }
        let mut nowhere = *tool;
        nowhere.position[row] = f64::NAN;
        assert!(mechanism.inverse(&nowhere.pose(), branch, q).is_err(), "{context}");
        assert!(mechanism.joint_motion(&nowhere, branch, q).is_err(), "{context}");
    }
    if rows(task_space) > 3 {
        let mut nowhere = *tool;
        nowhere.attitude.rotation[(0, 2)] = f64::NAN;
        assert!(mechanism.inverse(&nowhere.pose(), branch, q).is_err(), "{context}");
    }
}
