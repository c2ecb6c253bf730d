//! Source 000.

use machine::kinematics::Joints;
use machine::mechanisms::polar::{PolarBranch, PolarLoad};
use machine::{Mechanism, Polar};
use messages::math;
use nalgebra::{Rotation3, Vector2, Vector3, Vector6};

use super::{only_corrected, slope};

const ARM: f64 = 0.25;

fn machine() -> Polar {
    Polar {
        arm: ARM,
        center_distance: 0.25,
        height: 0.0,
        singular_radius: 2e-4,
        endless: true,
        branch: PolarBranch::default(),
        load: PolarLoad { head_center: 0.23, counterbalance: 0.0, ..super::loads::POLAR },
        elasticity: None,
    }
}

/// Eq. 4.3 has the same rotation on both sides; only the pair's other one is its transpose.
#[test]
fn a_rotation_is_not_its_own_transpose() {
    let ahead = Rotation3::from_euler_angles(0.0, 0.0, 0.4).into_inner();
    let back = Rotation3::from_euler_angles(0.0, 0.0, -0.4).into_inner();
    assert!((back - ahead.transpose()).amax() < 1e-15);
    assert!((ahead - ahead.transpose()).amax() > 0.7);
}

/// Eq. 4.5 and 4.6: the angular velocity of the arm, from where its tip goes in the machine's frame.
#[test]
fn the_table_does_not_turn_the_arm() {
    let machine = machine();
    let (arm, table) = (0.7, -1.9);
    let tip = |time: f64| {
        let q = Joints::from([0.6 + arm * time, 1.1 + table * time, 0.0]);
        let p = machine.pose(&q).position;
        let (s, c) = math::sin_cos(q[1]);
        let place = Vector2::new(c * p.x - s * p.y + machine.center_distance, s * p.x + c * p.y);
        math::atan2(place.y, place.x)
    };
    only_corrected("4.5", slope(tip), arm, arm + table, 1e-9);
}

/// Eq. 5.4, 5.5 and 5.8: the torque from the work of force and moment in a small turn.
#[test]
fn a_moment_about_the_vertical_loads_the_arm() {
    let (force, moment) = (Vector3::new(3.0, -2.0, 1.5), Vector3::new(0.1, 0.2, 0.7));
    let angle = 0.8;
    let turned = |by: f64| Rotation3::from_axis_angle(&Vector3::z_axis(), angle + by);
    let place = |by: f64, axis: usize| (turned(by) * Vector3::new(ARM, 0.0, 0.0))[axis];
    let velocity = Vector3::new(slope(|by| place(by, 0)), slope(|by| place(by, 1)), 0.0);
    let work = (turned(0.0) * force).dot(&velocity) + (turned(0.0) * moment).z;
    // The arm's frame is turned by θ₁ − θ₂ against the work's, in which a wrench is told.
    let q = Joints::from([angle, -0.5, 0.0]);
    let to_work = Rotation3::from_axis_angle(&Vector3::z_axis(), q[0] - q[1]);
    let (force_there, moment_there) = (to_work * force, to_work * moment);
    let wrench =
        Vector6::from_fn(|row, _| if row < 3 { force_there[row] } else { moment_there[row - 3] });
    let torque = machine().wrench_efforts(&q, &wrench)[0];
    only_corrected("5.8", work, torque, ARM * force.y, 1e-9);
}

/// Eq. 7.6 to 7.8, 7.12 and 7.19: the energy of arm and head from where their centres go.
#[test]
fn the_arms_inertia_is_the_same_all_round() {
    let machine = machine();
    let load = machine.load;
    for angle in [0.2, 0.9, -1.3, 2.5] {
        let rate = 1.0;
        let square = |radius: f64| {
            let x = slope(|time| radius * math::cos(angle + rate * time));
            let y = slope(|time| radius * math::sin(angle + rate * time));
            x * x + y * y
        };
        let inertia = load.arm_mass * square(load.arm_center)
            + load.arm_inertia
            + load.head_mass * square(load.head_center)
            + load.head_inertia;
        let q = Joints::from([angle, 0.3, 0.0]);
        let mass = machine.mass_matrix(&q)[(0, 0)];
        let (s, c) = math::sin_cos(angle);
        let plain = load.arm_inertia + load.head_inertia;
        let arm = load.arm_center * load.arm_center * load.arm_mass;
        let printed = 4.0 * ARM * ARM * load.head_mass + arm * (c + s) + plain;
        only_corrected("7.12", inertia, mass, printed, 1e-9);
        // Where the energy is the same everywhere, turning evenly takes no torque.
        let speed = 6.0;
        let torque = machine.bias(&q, &Joints::from([speed, 0.0, 0.0]))[0];
        only_corrected("7.19", 0.0, torque, 0.5 * arm * (c - s) * speed * speed, 1e-9);
    }
}
