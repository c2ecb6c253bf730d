//! Closed chains in the plane, in every working mode.

use machine::kinematics::Joints;
use machine::mechanisms::{
    ActuatorBodies, FiveBar, FiveBarBranch, Prrrp, PrrrpBranch, TwinActuator, TwinBranch,
};
use machine::transmission::Elasticity;
use machine::{Mechanism, Pose};
use nalgebra::{Vector2, Vector3};

use super::suite::conforms;
use super::{SCREW, sample::Random};

/// Joints for a tool anywhere in the square of half edge `half` about `middle`, in the mechanism's
/// own branch.
fn over<M: Mechanism<2>>(
    mechanism: M,
    middle: [f64; 2],
    half: f64,
) -> impl FnMut(&mut Random) -> Joints<2> {
    move |random| {
        let place = Vector3::new(middle[0], middle[1], 0.0)
            + Vector3::new(random.next(), random.next(), 0.0) * half;
        mechanism.inverse(&Pose::at(place), mechanism.branch(), &Joints::zeros()).unwrap()
    }
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
    for (mode, chain, height, half) in [
        ([1, -1], 1, 0.3, 0.05),
        ([-1, 1], -1, -0.3, 0.05),
        ([-1, 1], -1, 0.3, 0.05),
        ([1, 1], 1, 0.3, 0.02),
        ([-1, -1], 1, 0.3, 0.02),
    ] {
        let mechanism = five_bar(mode, chain);
        conforms(&mechanism, &[mechanism.branch], over(mechanism, [0.01, height], half));
    }
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
        let middle = [0.17 * f64::from(side), -0.4];
        conforms(&mechanism, &[mechanism.branch], over(mechanism, middle, 0.07));
    }
}

#[test]
fn the_twin_actuator_conforms_on_a_base_line_that_lies_askew() {
    let bodies = |mass| ActuatorBodies {
        housing_inertia: 0.01 * mass,
        rod_mass: mass,
        rod_inertia: 0.002,
        rod_center: 0.15,
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
        let middle = [0.3, 0.4 * f64::from(elbow)];
        conforms(&mechanism, &[mechanism.branch], over(mechanism, middle, 0.08));
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
        let (sine, cosine) = messages::math::sin_cos(turn);
        let pose = Pose::at(Vector3::new(cosine, sine, 0.0) * 0.3);
        let q = mechanism.inverse(&pose, mechanism.branch, &previous).unwrap();
        if let Some(start) = first {
            let moved: f64 = (q - previous).amax();
            assert!((moved - core::f64::consts::TAU / 1000.0).abs() < 1e-12, "{moved}");
            let since: f64 = q[0] - start;
            assert!((since - turn).abs() < 1e-9, "{since} {turn}");
        } else {
            first = Some(q[0]);
        }
        previous = q;
    }
}
