//! Inertia, efforts and energy.

use machine::Mechanism;
use machine::kinematics::{JointMotion, Joints};
use nalgebra::SVector;

use super::sample::{clear, near, slope};

const STEP: f64 = 1e-4;

/// Symmetry, and one equation read forwards and backwards.
pub(crate) fn efforts<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    motion: &JointMotion<N>,
    context: &str,
) {
    let (branch, still) = (mechanism.branch(), Joints::<N>::zeros());
    let JointMotion { position: q, velocity, acceleration, .. } = *motion;
    let chain = mechanism.solve(&q, branch, None).unwrap();
    let mass = mechanism.mass_matrix(&chain);
    let heaviest = mass.amax();
    near((mass - mass.transpose()).amax(), 0.0, 1e-14, heaviest, context);
    let Some(factors) = mass.cholesky() else {
        panic!("the mass matrix is not positive: {context}")
    };

    // Column by column: inverse dynamics of a unit acceleration at rest, without gravity.
    let held = mechanism.inverse_dynamics(&chain, &still, &still);
    let gravity = mechanism.gravity(&chain);
    near((held - gravity).amax(), 0.0, 1e-12, gravity.amax(), context);
    for column in 0..N {
        let mut unit = still;
        unit[column] = 1.0;
        let effort = mechanism.inverse_dynamics(&chain, &still, &unit) - held;
        let scale = heaviest.max(gravity.amax());
        near((effort - mass.column(column)).amax(), 0.0, 1e-12, scale, context);
    }

    // Forward dynamics of the inverse's efforts.
    let effort = mechanism.inverse_dynamics(&chain, &velocity, &acceleration);
    let back = factors.solve(&(effort - mechanism.bias(&chain, &velocity)));
    near((back - acceleration).amax(), 0.0, 1e-9, acceleration.amax(), context);

    // What moving adds to the bias goes with the square of the speed.
    let moving = mechanism.bias(&chain, &velocity) - gravity;
    let faster = mechanism.bias(&chain, &(velocity * -2.0)) - gravity;
    near((faster - moving * 4.0).amax(), 0.0, 1e-10, moving.amax() + gravity.amax(), context);

    // Gravity has a potential: the derivatives of its efforts are symmetric.
    let at = |q: Joints<N>| mechanism.gravity(&mechanism.solve(&q, branch, Some(&chain)).unwrap());
    let across = |joint: usize| {
        slope(STEP, |step| {
            let mut moved = q;
            moved[joint] += step;
            at(moved)
        })
    };
    let gradients: [Joints<N>; N] = core::array::from_fn(across);
    for (row, gradient) in gradients.iter().enumerate() {
        for (column, other) in gradients.iter().enumerate() {
            near(gradient[column], other[row], 1e-6, gradient.amax(), context);
        }
    }
}

/// Power into the joints is the change of kinetic energy and the work against gravity: an
/// independent route through the energy alone.
pub(crate) fn power<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    motion: &JointMotion<N>,
    context: &str,
) {
    let branch = mechanism.branch();
    let chain = mechanism.solve(&motion.position, branch, None).unwrap();
    let energy = |t: f64| {
        let q = motion.position + motion.velocity * t + motion.acceleration * (t * t / 2.0);
        let velocity = motion.velocity + motion.acceleration * t;
        let there = mechanism.solve(&q, branch, Some(&chain)).unwrap();
        SVector::from([velocity.dot(&(mechanism.mass_matrix(&there) * velocity)) / 2.0])
    };
    let change = slope(STEP, energy)[0];
    let effort = mechanism.inverse_dynamics(&chain, &motion.velocity, &motion.acceleration);
    let lifting = mechanism.gravity(&chain).dot(&motion.velocity);
    let scale = effort.abs().dot(&motion.velocity.abs());
    near(effort.dot(&motion.velocity), change + lifting, 1e-7, scale, context);
}

/// Left alone for ten seconds, a mechanism neither gains nor loses energy.
pub(crate) fn free_motion<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    motion: &JointMotion<N>,
    context: &str,
) {
    // A lively fall needs so short a step: the error of the integration goes with its fourth power.
    const STEP: f64 = 5e-4;
    let branch = mechanism.branch();
    let mut chain = mechanism.solve(&motion.position, branch, None).unwrap();
    let (mut q, mut velocity, mut work) = (motion.position, motion.velocity, 0.0);
    let kinetic = |chain: &M::ChainState, velocity: &Joints<N>| {
        velocity.dot(&(mechanism.mass_matrix(chain) * velocity)) / 2.0
    };
    let start = kinetic(&chain, &velocity);
    let mut largest = start;
    for _ in 0..20_000 {
        // Rates of joints, velocity, and work against gravity.
        let rates = |q: Joints<N>, velocity: Joints<N>| {
            let there = mechanism.solve(&q, branch, Some(&chain)).ok()?;
            if !clear(mechanism, &there, 1.5) {
                return None;
            }
            let fall = mechanism.mass_matrix(&there).cholesky()?;
            let acceleration = fall.solve(&-mechanism.bias(&there, &velocity));
            Some((velocity, acceleration, mechanism.gravity(&there).dot(&velocity)))
        };
        let step = |from: &(Joints<N>, Joints<N>, f64), share: f64| {
            rates(q + from.0 * (share * STEP), velocity + from.1 * (share * STEP))
        };
        // Towards a singularity the motion has no bounded derivatives: the run ends there.
        let Some(first) = rates(q, velocity) else { break };
        let Some(second) = step(&first, 0.5) else { break };
        let Some(third) = step(&second, 0.5) else { break };
        let Some(fourth) = step(&third, 1.0) else { break };
        q += (first.0 + (second.0 + third.0) * 2.0 + fourth.0) * (STEP / 6.0);
        velocity += (first.1 + (second.1 + third.1) * 2.0 + fourth.1) * (STEP / 6.0);
        work += (first.2 + (second.2 + third.2) * 2.0 + fourth.2) * (STEP / 6.0);
        let Ok(there) = mechanism.solve(&q, branch, Some(&chain)) else { break };
        chain = there;
        let energy = kinetic(&chain, &velocity);
        largest = largest.max(energy);
        let gained = energy + work - start;
        assert!(gained.abs() <= 1e-6 * largest, "gained {gained:e} of {largest:e}, {context}");
    }
}

/// Springs and dampers are symmetric and hold.
pub(crate) fn transmission<const N: usize, M: Mechanism<N>>(mechanism: &M) {
    let Some(stiffness) = mechanism.stiffness() else {
        assert_eq!(mechanism.damping().amax(), 0.0);
        return;
    };
    let damping = mechanism.damping();
    assert_eq!((stiffness - stiffness.transpose()).amax(), 0.0);
    assert_eq!((damping - damping.transpose()).amax(), 0.0);
    assert!(stiffness.cholesky().is_some() && damping.cholesky().is_some());
}
