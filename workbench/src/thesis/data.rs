//! What source 003 prints. The decimal comma is a point here; rows stand in the source's order.

use planner::job::letters::Letter;

/// The letters, in the order of the tables.
pub const LETTERS: [Letter; 4] = [Letter::N, Letter::A, Letter::S, Letter::O];

/// The heights [m].
pub const HEIGHTS: [f64; 3] = [0.01, 0.02, 0.05];

/// A value for each letter at each height, in the order of [`LETTERS`] and [`HEIGHTS`].
pub type Printed = [[f64; 3]; 4];

/// The same for the two motors.
pub type PrintedPair = [[[f64; 2]; 3]; 4];

/// Acceleration along the path, A [m/s²].
pub const ACCELERATION: f64 = 10.0;

/// Jerk along the path [m/s³]: printed as J_e = 50·(10 m/s³).
pub const JERK: f64 = 500.0;

/// Largest speed of free moves [m/s].
pub const RAPID: f64 = 0.25;

/// Table 3-1, times to mark [s].
pub const TIMES: Printed =
    [[0.58, 0.80, 1.32], [0.58, 0.80, 1.34], [2.27, 2.99, 4.43], [2.23, 2.90, 4.26]];

/// Table 3-1, marking speeds [m/s].
pub const SPEEDS: Printed =
    [[0.16, 0.22, 0.24], [0.16, 0.23, 0.24], [0.04, 0.05, 0.08], [0.03, 0.05, 0.07]];

/// The marking speeds that the other tables imply [m/s]: S at 2 cm has 0.06 in tables 3-2 and 4-1.
pub const SPEEDS_IMPLIED: Printed =
    [[0.16, 0.22, 0.24], [0.16, 0.23, 0.24], [0.04, 0.06, 0.08], [0.03, 0.05, 0.07]];

/// Table 3-2, the Cartesian's motors [rpm].
pub const CARTESIAN_RPM: Printed = [
    [1920.0, 2640.0, 2880.0],
    [1920.0, 2760.0, 2880.0],
    [480.0, 720.0, 960.0],
    [360.0, 600.0, 840.0],
];

/// Table 4-1, the CoreXY's motors [rpm].
pub const COREXY_RPM: Printed = [
    [1729.0, 2378.0, 2593.0],
    [1729.0, 2485.0, 2593.0],
    [431.0, 648.0, 864.0],
    [323.0, 540.0, 756.0],
];

/// Table 5-1, the 5R's arms [rad/s].
pub const FIVE_BAR_ARMS: PrintedPair = [
    [[0.69, 0.69], [0.86, 0.86], [0.87, 0.88]],
    [[0.70, 0.71], [0.86, 0.86], [0.88, 0.88]],
    [[0.14, 0.16], [0.18, 0.22], [0.26, 0.35]],
    [[0.14, 0.14], [0.20, 0.20], [0.32, 0.32]],
];

/// Table 5-2, the 5R's motors [rpm].
pub const FIVE_BAR_RPM: PrintedPair = [
    [[1647.0, 1647.0], [2053.0, 2053.0], [2076.0, 2100.0]],
    [[1671.0, 1695.0], [2053.0, 2053.0], [2100.0, 2100.0]],
    [[334.0, 381.0], [429.0, 525.0], [620.0, 835.0]],
    [[334.0, 334.0], [477.0, 477.0], [763.0, 763.0]],
];

/// Table 5-3, torques of the 5R's motors [mN·m].
pub const FIVE_BAR_TORQUES: PrintedPair = [
    [[11.0, 9.0], [11.0, 10.0], [12.0, 11.0]],
    [[10.0, 11.0], [10.0, 11.0], [10.0, 12.0]],
    [[6.0, 6.0], [7.0, 8.0], [8.0, 9.0]],
    [[6.0, 6.0], [7.0, 7.0], [9.0, 9.0]],
];

/// Table 6-1, the carts of the "assi impropri" [m/s].
pub const CARTS: PrintedPair = [
    [[0.29, 0.16], [0.38, 0.20], [0.52, 0.19]],
    [[0.29, 0.33], [0.36, 0.42], [0.41, 0.56]],
    [[0.07, 0.06], [0.10, 0.09], [0.18, 0.16]],
    [[0.06, 0.05], [0.08, 0.07], [0.13, 0.13]],
];

/// Table 6-2, their motors [rpm].
pub const CARTS_RPM: PrintedPair = [
    [[1450.0, 800.0], [1900.0, 1000.0], [2600.0, 950.0]],
    [[1450.0, 1650.0], [1800.0, 2100.0], [2050.0, 2800.0]],
    [[350.0, 300.0], [500.0, 450.0], [900.0, 800.0]],
    [[300.0, 250.0], [400.0, 350.0], [650.0, 650.0]],
];

/// Table 6-3, torques of their motors [mN·m].
pub const CARTS_TORQUES: PrintedPair = [
    [[23.0, 20.0], [25.0, 21.0], [30.0, 27.0]],
    [[22.0, 19.0], [24.0, 20.0], [25.0, 16.0]],
    [[8.0, 8.0], [10.0, 9.0], [15.0, 14.0]],
    [[9.0, 9.0], [11.0, 11.0], [14.0, 14.0]],
];

/// The gear of chapter 5 as it is computed; the one that is built has 236.09.
pub const FIVE_BAR_GEAR: f64 = 250.0;

/// The 5R's gear as it is built.
pub const FIVE_BAR_GEAR_BUILT: f64 = 236.09;

/// Travel of the Cartesian's carriages per radian of the motor [m/rad]: 15 mm a turn, gear 3.
pub const CARTESIAN_TRAVEL: f64 = 0.015 / (core::f64::consts::TAU * 3.0);

/// Travel of the CoreXY's belts per radian of the motor [m/rad]: a radius of 10 mm, gear 8.
pub const COREXY_TRAVEL: f64 = 0.01 / 8.0;

/// Travel of the "assi impropri" carts per radian of the motor [m/rad]: 36 mm a turn, gear 3.
pub const CART_TRAVEL: f64 = 0.036 / (core::f64::consts::TAU * 3.0);
