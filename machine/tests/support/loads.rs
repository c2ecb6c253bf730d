//! The bodies of a five-axis and of a polar machine, for the tests and benchmarks that need some.

#![allow(dead_code, unreachable_pub)]

use machine::mechanisms::mcm::McmLoad;
use machine::mechanisms::polar::PolarLoad;

/// Of a five-axis machine.
pub const MCM: McmLoad = McmLoad {
    carriage_mass: 9.0,
    slide_mass: 5.5,
    table_inertia: 0.031,
    yoke_inertia: 0.012,
    head_mass: 2.3,
    head_center: 0.045,
    head_inertia: [0.0081, 0.0077, 0.0019],
    counterbalance: 60.0,
    gravity: machine::kinematics::STANDARD_GRAVITY,
};

/// Of a polar machine.
pub const POLAR: PolarLoad = PolarLoad {
    arm_mass: 1.2,
    arm_center: 0.105,
    arm_inertia: 0.0095,
    head_mass: 0.38,
    head_center: 0.252,
    head_inertia: 3.2e-4,
    table_inertia: 0.018,
    workpiece_mass: 1.1,
    workpiece_center: 0.004,
    workpiece_inertia: 0.0026,
    counterbalance: 2.0,
    gravity: machine::kinematics::STANDARD_GRAVITY,
};
