//! Machines with a rotary table, and the platform on planar motors.

use machine::kinematics::Joints;
use machine::mechanisms::mcm::McmBranch;
use machine::mechanisms::polar::PolarBranch;
use machine::mechanisms::tri_planar::{Fold, Legs, TriPlanar};
use machine::{Mcm, Mechanism, Polar, Pose};
use nalgebra::{Rotation3, Vector3};

use super::suite::conforms;
use super::{SCREW, loads};

#[test]
fn the_polar_machine_conforms_on_both_sides() {
    let load = loads::POLAR;
    let sides = [None, Some(1), Some(-1)].map(|side| PolarBranch { side, table_turn: None });
    // With the arm as long as the table is far, and with a blind disc.
    for (center_distance, sign) in [(0.25, 1.0), (0.25, -1.0), (0.23, 1.0)] {
        let mechanism = Polar {
            arm: 0.25,
            center_distance,
            height: 0.03,
            singular_radius: 2e-4,
            endless: true,
            branch: PolarBranch::default(),
            load,
            elasticity: Some([SCREW; 3]),
        };
        conforms(&mechanism, &sides, |random| {
            let mut q = random.joints([[0.1, 0.62], [-3.0, 9.0], [0.0, 0.12]]);
            q[0] *= sign;
            q
        });
    }
}

#[test]
fn the_mcm_conforms_on_both_sides() {
    let mechanism = Mcm {
        tool: 0.12,
        offset: 0.02,
        height: 0.45,
        reach: [0.1, 0.5],
        singular_distance: 1e-4,
        branch: McmBranch::default(),
        load: loads::MCM,
        elasticity: Some([SCREW; 5]),
    };
    let sides = [None, Some(1), Some(-1)].map(|side| McmBranch { side, lean: None });
    conforms(&mechanism, &sides, |random| {
        random.joints([[0.2, 0.45], [0.0, 0.35], [-3.0, 9.0], [0.2, 1.5], [-2.0, 2.0]])
    });
}

#[test]
fn the_platform_on_planar_motors_conforms() {
    let mixed = Legs([Fold::Inward, Fold::Outward, Fold::Outward]);
    for legs in [Legs::default(), mixed] {
        let mechanism = TriPlanar {
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
            legs,
            elasticity: Some([SCREW; 6]),
        };
        conforms(&mechanism, &[legs.into()], |random| {
            loop {
                let spot = random.vector(1.0);
                let tilt = random.vector(0.3);
                let pose = Pose {
                    position: Vector3::new(spot.x * 0.15, spot.y * 0.1, 0.1 + 0.02 * spot.z),
                    rotation: Rotation3::from_euler_angles(tilt.x, tilt.y, 3.0 * tilt.z)
                        .into_inner(),
                };
                if let Ok(q) = mechanism.inverse(&pose, legs.into(), &Joints::zeros()) {
                    return q;
                }
            }
        });
    }
}
