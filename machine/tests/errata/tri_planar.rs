//! Source 001.

use machine::kinematics::Joints;
use machine::mechanisms::tri_planar::{Legs, TriPlanar};
use machine::{Mechanism, Pose};
use nalgebra::{Rotation3, Vector3};

const SIDE: f64 = 0.2;
const ROOT_3: f64 = 1.732_050_807_568_877_2;

/// Without limits: the equations alone.
fn machine() -> TriPlanar {
    TriPlanar {
        side: SIDE,
        struts: [[SIDE; 2]; 3],
        mounting: None,
        home: None,
        stator: [[-1e3, 1e3]; 2],
        inductor: 0.08,
        gap: -1.0,
        clearance: -1.0,
        type_1_limit: 0.0,
        type_2_limit: 0.0,
        platform_mass: 0.8,
        platform_inertia: [2.1e-3, 2.3e-3, 4.0e-3],
        leg_mass: 0.15,
        inductor_mass: 0.35,
        legs: Legs::default(),
        elasticity: None,
    }
}

/// Eq. 3: A, B and C must be a apart. As printed A and B have five rows.
#[test]
fn the_corners_are_a_side_apart() {
    let c = Vector3::new(0.0, SIDE / ROOT_3, 0.0);
    for sign in [1.0, -1.0] {
        let right = Vector3::new(sign * SIDE / 2.0, -ROOT_3 / 6.0 * SIDE, 0.0);
        assert!(((right - c).norm() - SIDE).abs() < 1e-16);
        // The first three rows, and the first two read as one quotient.
        let rows = Vector3::new(sign * SIDE / 2.0, 2.0 / ROOT_3, -ROOT_3 / 6.0 * SIDE);
        let quotient = Vector3::new(sign * SIDE / 2.0 / (2.0 / ROOT_3), -ROOT_3 / 6.0 * SIDE, 0.0);
        assert!(((rows - c).norm() - SIDE).abs() > 0.5 * SIDE);
        assert!(((quotient - c).norm() - SIDE).abs() > 0.02 * SIDE);
    }
}

/// Eq. 5 to 8: the foot F must lie in the stator's plane, a from A and from B. The angle of eq. 8
/// brings it there with R₃F = (0, −h, 0), and with the sign of its sine left open.
#[test]
fn the_foot_hangs_on_the_far_side_of_its_hinge() {
    let height = ROOT_3 / 2.0 * SIDE;
    let (mut closed, mut roots, mut bent, mut met) = (0, 0, 0, 0);
    for case in 0..300 {
        let part = |k: f64| 2.0 * (0.618_033_988_7 * k * (f64::from(case) + 1.0)).fract() - 1.0;
        let rotation = Rotation3::from_euler_angles(0.5 * part(1.0), 0.5 * part(2.0), part(3.0));
        let r = rotation.matrix();
        let position = Vector3::new(0.1 * part(4.0), 0.1 * part(5.0), 0.1 + 0.03 * part(6.0));
        // Eq. 8 as printed.
        let (m, n) = (height * r[(2, 1)], height * r[(2, 2)]);
        let p = SIDE * r[(2, 1)] / (2.0 * ROOT_3) - position.z;
        let square = m * m + n * n;
        let inner = m * m * p * p - square * (p * p - n * n);
        assert!(inner > 0.0, "{case}");
        let feet = machine()
            .inverse(&Pose { position, rotation: *r }, machine().branch(), &Joints::zeros())
            .unwrap();
        for root in [inner.sqrt(), -inner.sqrt()] {
            roots += 1;
            let cosine = (-m * p + root) / square;
            let sine = (1.0 - cosine * cosine).sqrt();
            // Eq. 5 with the foot at `along` in the leg's frame.
            let foot = |along: f64, sine: f64| {
                let leg = Vector3::new(0.0, along * cosine, along * sine);
                position + r * (leg + Vector3::new(0.0, -SIDE / (2.0 * ROOT_3), 0.0))
            };
            let printed = |sine: f64| {
                height
                    * (r[(2, 1)] * (cosine + 1.0 / 3.0) - r[(2, 2)] * (sine + 1.0 / 3.0)
                        + 2.0 / ROOT_3 * position.z)
            };
            let low = |along: f64| foot(along, sine).z.abs().min(foot(along, -sine).z.abs());
            assert!(low(height) > 1e-4, "{case}: eq. 5 closes with +h");
            let printed = printed(sine).abs().min(printed(-sine).abs());
            assert!(printed > 1e-6, "{case}: eq. 7 closes");
            let chosen = if foot(-height, sine).z.abs() < 1e-12 { sine } else { -sine };
            bent += i32::from(chosen < 0.0);
            let right = foot(-height, chosen);
            for x in [0.5, -0.5] {
                let corner = position + r * Vector3::new(x * SIDE, -SIDE / (2.0 * ROOT_3), 0.0);
                assert!(((right - corner).norm() - SIDE).abs() < 1e-15, "{case}");
            }
            closed += i32::from(right.z.abs() < 1e-12);
            let off = Vector3::new(feet[4], feet[5], 0.0) - right;
            met += i32::from(off.norm() < 1e-12);
        }
    }
    // Every root closes, one of each pair is the outward leg of the machine, and a few have a
    // negative sine: the positive root of 1 − cos² would miss them.
    assert_eq!((closed, roots, met), (600, 600, 300));
    assert!(bent > 0, "no leg past the upright was tried");
}
