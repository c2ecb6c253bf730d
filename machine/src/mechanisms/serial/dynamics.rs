//! Inertia and efforts of an open chain, in the machine frame.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::task::Chain;
use super::{JointKind, Serial};
use crate::kinematics::{Joints, Pose};

/// One link where it stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Placed {
    /// Origin of its frame [m].
    pub(super) origin: Vector3<f64>,
    /// Direction of its joint.
    pub(super) axis: Vector3<f64>,
    /// Centre of mass [m].
    center: Vector3<f64>,
    /// Inertia about the centre of mass, machine frame [kg·m²].
    inertia: Matrix3<f64>,
}

/// An open chain at one joint position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SerialChainState<const N: usize> {
    pub(super) links: [Placed; N],
    pub(super) tool: Pose,
    pub(super) joints: Joints<N>,
}

impl<const N: usize> Serial<N> {
    /// The links of `chain` with their masses.
    pub(super) fn placed(&self, chain: &Chain<f64, N>) -> [Placed; N] {
        core::array::from_fn(|joint| {
            let (link, frame) = (&self.links[joint], &chain.links[joint]);
            let rotation = frame.rotation();
            let origin = Vector3::from(frame.origin);
            Placed {
                origin,
                axis: rotation.column(2).into_owned(),
                center: origin + rotation * link.center,
                inertia: rotation * link.inertia * rotation.transpose(),
            }
        })
    }

    /// Velocity of the point `at` and angular velocity of whatever joint `joint` carries, per joint
    /// rate.
    pub(super) fn column(
        &self,
        links: &[Placed; N],
        joint: usize,
        at: &Vector3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let Placed { origin, axis, .. } = &links[joint];
        match self.links[joint].kind {
            JointKind::Revolute => (axis.cross(&(at - origin)), *axis),
            JointKind::Prismatic => (*axis, Vector3::zeros()),
        }
    }

    /// Source 000 eq. 7.2, M = Σ m·Jvᵀ·Jv + Jωᵀ·I·Jω.
    pub(super) fn inertia(&self, links: &[Placed; N]) -> SMatrix<f64, N, N> {
        let mut matrix = SMatrix::<f64, N, N>::zeros();
        for (body, placed) in links.iter().enumerate() {
            let columns: [_; N] = core::array::from_fn(|joint| {
                if joint <= body {
                    self.column(links, joint, &placed.center)
                } else {
                    (Vector3::zeros(), Vector3::zeros())
                }
            });
            let mass = self.links[body].mass;
            for row in 0..=body {
                let (linear, angular) = columns[row];
                let (momentum, spin) = (linear * mass, placed.inertia * angular);
                for (column, (linear, angular)) in columns.iter().enumerate().take(row + 1) {
                    let share = momentum.dot(linear) + spin.dot(angular);
                    matrix[(row, column)] += share;
                    if column < row {
                        matrix[(column, row)] += share;
                    }
                }
            }
        }
        matrix
    }

    /// Efforts that keep `velocity` constant [N or N·m], by Newton and Euler's equations: motion
    /// outwards, then forces inwards. Gravity is the base's acceleration upwards.
    pub(super) fn efforts(&self, links: &[Placed; N], velocity: &Joints<N>) -> Joints<N> {
        let mut spin = Vector3::zeros();
        let mut spin_rate = Vector3::zeros();
        let mut acceleration = -self.gravity;
        let mut origin = self.base.position;
        let mut forces = [(Vector3::zeros(), Vector3::zeros()); N];
        for (joint, placed) in links.iter().enumerate() {
            let from = placed.origin - origin;
            acceleration += spin_rate.cross(&from) + spin.cross(&spin.cross(&from));
            let rate = placed.axis * velocity[joint];
            match self.links[joint].kind {
                JointKind::Revolute => {
                    spin_rate += spin.cross(&rate);
                    spin += rate;
                }
                JointKind::Prismatic => acceleration += spin.cross(&rate) * 2.0,
            }
            let arm = placed.center - placed.origin;
            let center = acceleration + spin_rate.cross(&arm) + spin.cross(&spin.cross(&arm));
            forces[joint] = (
                center * self.links[joint].mass,
                placed.inertia * spin_rate + spin.cross(&(placed.inertia * spin)),
            );
            origin = placed.origin;
        }

        // Source 000 eq. 5.1, 5.2, 5.6 and 5.7, with the links' own inertia.
        let mut efforts = Joints::zeros();
        let mut force = Vector3::zeros();
        let mut moment = Vector3::zeros();
        let mut from = self.base.position;
        for joint in (0..N).rev() {
            let placed = &links[joint];
            moment += (from - placed.origin).cross(&force);
            from = placed.origin;
            force += forces[joint].0;
            moment += forces[joint].1 + (placed.center - placed.origin).cross(&forces[joint].0);
            efforts[joint] = match self.links[joint].kind {
                JointKind::Revolute => moment.dot(&placed.axis),
                JointKind::Prismatic => force.dot(&placed.axis),
            };
        }
        efforts
    }
}
