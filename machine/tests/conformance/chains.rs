//! Open chains, from two joints to six and with every freedom.

use core::f64::consts::FRAC_PI_2;

use machine::kinematics::{Joints, TaskSpace};
use machine::mechanisms::serial::{JointKind, Link, Serial};
use machine::transmission::Elasticity;
use machine::{Mechanism, Pose};
use nalgebra::{Matrix3, Rotation3, Vector3};

use super::sample::Random;
use super::suite::conforms;

const GEAR: Elasticity = Elasticity { stiffness: 2e4, damping: 5.0 };

/// A link with its mass off its axis, and none of its inertias alike.
fn link(kind: JointKind, twist: f64, length: f64, offset: f64, limits: [f64; 2]) -> Link {
    Link {
        twist,
        length,
        offset,
        angle: 0.1,
        kind,
        mass: 1.5,
        center: Vector3::new(0.08, -0.02, 0.03),
        inertia: Matrix3::new(9e-3, 1e-3, -5e-4, 1e-3, 7e-3, 8e-4, -5e-4, 8e-4, 6e-3),
        lower: limits[0],
        upper: limits[1],
    }
}

fn chain<const N: usize>(task_space: TaskSpace, links: [Link; N]) -> Serial<N> {
    Serial {
        base: Pose {
            position: Vector3::new(0.1, -0.2, 0.3),
            rotation: Rotation3::from_euler_angles(0.2, -0.1, 0.5).into_inner(),
        },
        links,
        tool: Pose {
            position: Vector3::new(0.03, 0.02, 0.11),
            rotation: Rotation3::from_euler_angles(0.3, 0.6, -0.2).into_inner(),
        },
        task_space,
        gravity: Vector3::new(0.0, 0.0, -9.806_65),
        elasticity: Some([GEAR; N]),
    }
}

/// Joints within `ranges` where the chain moves easily: differences next to a singularity would need
/// steps of their own.
fn easily<const N: usize>(
    arm: Serial<N>,
    ranges: [[f64; 2]; N],
) -> impl FnMut(&mut Random) -> Joints<N> {
    move |random| {
        loop {
            let q = random.joints(ranges);
            let state = arm.solve(&q, (), None).unwrap();
            if arm.margins(&state)[0].value > 0.03 {
                return q;
            }
        }
    }
}

const TURN: [f64; 2] = [-3.1, 3.1];
const SLIDE: [f64; 2] = [-0.3, 0.3];

use JointKind::{Prismatic, Revolute};

#[test]
fn a_planar_arm_conforms() {
    let mut arm = chain(
        TaskSpace::Plane,
        [link(Revolute, 0.0, 0.0, 0.0, TURN), link(Revolute, 0.0, 0.3, 0.0, TURN)],
    );
    arm.base = Pose::at(Vector3::new(0.1, -0.2, 0.0));
    arm.tool = Pose::at(Vector3::new(0.25, 0.0, 0.0));
    conforms(&arm, &[()], easily(arm, [[-2.0, 2.0], [0.3, 2.6]]));
}

#[test]
fn a_chain_with_a_slide_conforms() {
    let arm = chain(
        TaskSpace::Space,
        [
            link(Revolute, 0.0, 0.0, 0.2, TURN),
            link(Revolute, -FRAC_PI_2, 0.05, 0.1, TURN),
            link(Prismatic, FRAC_PI_2, 0.1, 0.4, SLIDE),
        ],
    );
    conforms(&arm, &[()], easily(arm, [[-2.0, 2.0], [0.4, 1.4], [-0.2, 0.2]]));
}

#[test]
fn a_redundant_chain_conforms() {
    let arm = chain(
        TaskSpace::Space,
        [
            link(Revolute, 0.0, 0.0, 0.2, TURN),
            link(Revolute, -FRAC_PI_2, 0.05, 0.0, TURN),
            link(Revolute, 0.0, 0.4, 0.05, TURN),
            link(Revolute, 0.3, 0.3, 0.05, TURN),
        ],
    );
    conforms(&arm, &[()], easily(arm, [[-2.0, 2.0], [-0.5, 0.5], [0.5, 2.0], [-1.0, 1.0]]));
}

#[test]
fn a_chain_that_directs_its_beam_conforms() {
    let arm = chain(
        TaskSpace::Axis,
        [
            link(Prismatic, 0.0, 0.0, 0.2, SLIDE),
            link(Prismatic, -FRAC_PI_2, 0.05, 0.0, SLIDE),
            link(Prismatic, -FRAC_PI_2, 0.1, 0.3, SLIDE),
            link(Revolute, 0.4, 0.1, 0.05, TURN),
            link(Revolute, -FRAC_PI_2, 0.05, 0.05, TURN),
        ],
    );
    conforms(
        &arm,
        &[()],
        easily(arm, [[-0.2, 0.2], [-0.2, 0.2], [-0.2, 0.2], [-1.5, 1.5], [0.3, 1.2]]),
    );
}

#[test]
fn a_six_axis_arm_conforms() {
    let arm = chain(
        TaskSpace::Pose,
        [
            link(Revolute, 0.0, 0.0, 0.0, TURN),
            link(Revolute, -FRAC_PI_2, 0.0, 0.15, TURN),
            link(Revolute, 0.0, 0.43, 0.0, TURN),
            link(Revolute, -FRAC_PI_2, 0.02, 0.43, TURN),
            link(Revolute, FRAC_PI_2, 0.0, 0.0, TURN),
            link(Revolute, -FRAC_PI_2, 0.0, 0.06, TURN),
        ],
    );
    conforms(
        &arm,
        &[()],
        easily(arm, [[-2.0, 2.0], [-2.0, 0.2], [0.2, 2.0], [-2.0, 2.0], [0.4, 1.8], [-2.0, 2.0]]),
    );
}
