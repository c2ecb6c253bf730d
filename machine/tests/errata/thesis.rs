//! Source 003 ch. 2 to 4: run-ins, screws, belts and the limits of force.

use core::f64::consts::{FRAC_PI_2, PI, TAU};

use machine::Mechanism;
use machine::kinematics::Joints;
use machine::mechanisms::CoreXy;
use machine::transmission::{in_series, screw};
use messages::math;
use nalgebra::Vector2;

use super::only_corrected;

/// Eq. 2.2, 2.4 and 2.5: time and length of a run-in, by integrating its jerk.
#[test]
fn a_run_in_takes_as_long_as_its_jerk_says() {
    let (jerk, most, speed) = (500.0, 10.0, 0.3);
    let rise = most / jerk;
    let (mut time, mut way, mut velocity, mut acceleration) = (0.0, 0.0, 0.0, 0.0);
    // Jerk up, none, jerk down: each phase one exact cubic.
    for (sign, duration) in [(1.0, rise), (0.0, speed / most - rise), (-1.0, rise)] {
        let (j, t): (f64, f64) = (sign * jerk, duration);
        way += velocity * t + acceleration * t * t / 2.0 + j * t * t * t / 6.0;
        velocity += acceleration * t + j * t * t / 2.0;
        acceleration += j * t;
        time += t;
    }
    assert!((velocity - speed).abs() < 1e-12 && acceleration.abs() < 1e-12);
    // Eq. 2.2 is an instant, the end of the second phase; eq. 2.4 adds it as a duration.
    let instant = (-jerk * rise * rise + most * rise + speed) / most;
    only_corrected("2.2", time, instant + rise, rise + instant + rise, 1e-12);
    let length = |middle: f64, power: i32| {
        let whole = rise + middle;
        let third = if power == 3 { whole * whole * whole } else { whole * whole };
        -jerk * whole * whole * whole / 6.0
            + jerk * whole * whole * middle / 2.0
            + most * third / 2.0
            + jerk * whole * rise * rise / 2.0
            - most * whole * rise
            - jerk * whole * middle * middle / 2.0
            - jerk * rise * rise * rise / 3.0
            + most * rise * rise / 2.0
            + jerk * middle * middle * middle / 6.0
    };
    let duration = speed / most - rise;
    only_corrected("2.5", way, speed * time / 2.0, length(duration, 3), 1e-12);
    only_corrected("2.5, exponent", way, length(instant, 2), length(instant, 3), 1e-12);
}

/// Eq. 2.6 asks for 2 %; the angle printed with it is another one.
#[test]
fn a_chord_of_two_percent_is_23_degrees_wide() {
    let error = |degrees: f64| {
        let half = degrees * PI / 360.0;
        // The sagitta of a unit circle, from the chord's middle.
        let chord = 2.0 * math::sin(half);
        1.0 - (1.0 - chord * chord / 4.0).sqrt()
    };
    only_corrected("2.6", 0.02, error(22.956), error(5.73), 1e-3);
}

/// Eq. 3.1, 3.2, 3.17, 3.33, 3.36 to 3.38: power and energy on both sides of a screw.
#[test]
fn a_screw_counts_per_radian() {
    let (lead, mass, acceleration) = (5e-3, 1.93, 10.0);
    // A turn of the nut takes a lead: 1000 small turns, added up.
    let p = lead / TAU;
    let turned: f64 = (0..1000).map(|_| TAU / 1000.0).sum();
    only_corrected("3.1", lead, p * turned, lead * turned, 1e-9);
    // The work of a turn is force times lead.
    let force = mass * acceleration;
    let torque = force * lead / TAU;
    only_corrected("3.17", torque, p * force, lead * force, 1e-12);
    only_corrected("3.38", torque, force * (lead / TAU), force * (TAU / lead), 1e-12);
    // The energy of the carriage at one turn per second.
    let energy = mass * lead * lead / 2.0;
    let inertia = 2.0 * energy / (TAU * TAU);
    only_corrected("3.33", inertia, mass * p * p, mass * TAU / lead, 1e-12);
}

/// Eq. 3.30: the carriage goes back by both springs' yielding, which is less stiff than either.
#[test]
fn the_springs_of_a_screw_stand_in_a_row() {
    let (axial, torsional, p) = (4e7, 900.0, 5e-3 / TAU);
    let force = 100.0;
    let moved = force / axial + force * p / torsional * p;
    let seen = axial * p * p;
    let series = seen * torsional / (seen + torsional);
    // What the motor's side must turn to bring the carriage back.
    only_corrected("3.30", moved / p, force * p / series, force * p / (seen + torsional), 1e-12);
    let mixed = axial * torsional / (axial + torsional);
    only_corrected("3.30, units", moved / p, force * p / series, force * p / mixed, 1e-12);
    let spring = screw::at_nut(in_series([seen, torsional]), p);
    assert!((force / spring - moved).abs() < 1e-15);
}

/// The largest force along `angle` with no motor beyond 1, by trying.
fn largest(angle: f64, motors: impl Fn(Vector2<f64>) -> Vector2<f64>) -> Vector2<f64> {
    let (s, c) = math::sin_cos(angle);
    let direction = Vector2::new(c, s);
    direction / motors(direction).amax()
}

/// Eq. 3.19, 3.20 and the sectors after it.
#[test]
fn the_cartesians_force_is_bounded_by_one_motor() {
    let p = 8e-4;
    for step in 0..24 {
        let angle = 0.1 + f64::from(step) * TAU / 24.0;
        let truth = largest(angle, |force| force * p);
        let tangent = math::tan(angle);
        if truth.x.abs() > truth.y.abs() {
            let x = truth.x.signum() / p;
            let printed = 1.0 / (p * tangent);
            only_corrected("sector of x", truth.y, x * tangent, printed, 1e-9);
        } else {
            let y = truth.y.signum() / p;
            assert!((y / tangent - truth.x).abs() < 1e-9 / p);
        }
        let quotient = math::atan(truth.y / truth.x);
        let whole = math::atan2(truth.y, truth.x);
        assert!((math::nearest_turn(whole, angle) - angle).abs() < 1e-12);
        let off = (math::nearest_turn(quotient, angle) - angle).abs();
        assert_eq!(off > 1.0, truth.x < 0.0, "3.19: {angle}");
    }
}

/// Eq. 4.9, and the sectors after 4.10.
#[test]
fn the_corexys_force_is_bounded_by_one_motor() {
    let r = 0.01;
    // By virtual work with eq. 4.1 and 4.2.
    let motors =
        |force: Vector2<f64>| Vector2::new(force.x + force.y, force.x - force.y) * (r / 2.0);
    for step in 0..24 {
        let angle = 0.05 + f64::from(step) * TAU / 24.0;
        let force = largest(angle, motors);
        let found = motors(force);
        let whole = (2.0 * found.norm_squared()).sqrt() / r;
        only_corrected("4.9", force.norm(), whole, (found.norm_squared() / 2.0).sqrt(), 1e-12);
        let t = math::tan(angle);
        let sector = [
            [1.0, (1.0 - t) / (1.0 + t)],
            [-(1.0 + t) / (1.0 - t), -1.0],
            [-1.0, -(1.0 - t) / (1.0 + t)],
            [(1.0 + t) / (1.0 - t), 1.0],
        ][(angle / FRAC_PI_2) as usize];
        assert!((found - Vector2::from(sector)).amax() < 1e-9, "{angle}: {found} {sector:?}");
    }
}

/// Eq. 4.32 repeats the first belt: rigid belts do not stretch wherever the head goes.
#[test]
fn each_belt_has_a_stretch_of_its_own() {
    let r = 0.01;
    let (first, second) = (1.3, -0.4);
    let (x, y) = (r * (first + second) / 2.0, r * (first - second) / 2.0);
    only_corrected("4.31", 0.0, first * r - (x + y), first * r - (y - x), 1e-12);
    only_corrected("4.32", 0.0, second * r - (x - y), second * r - (x + y), 1e-12);
}

/// Sec. 4.5: the torque of a diagonal, by the power of the masses, the heavy one in y.
#[test]
fn a_diagonal_takes_half_of_what_is_printed() {
    let r = 1.25e-3;
    let (mass, acceleration) = ([0.33, 1.06], [10.0, 10.0]);
    let machine = CoreXy::rigid(mass);
    let q = Joints::from([0.1, 0.0]);
    let chain = machine.solve(&q, (), None).unwrap();
    // Joints are the belts' travels: along x = y the second one stands.
    let efforts = machine.inverse_dynamics(&chain, &Joints::zeros(), &Joints::from([20.0, 0.0]));
    let speed = 0.2;
    let power = (mass[0] * acceleration[0] + mass[1] * acceleration[1]) * speed;
    // The motor turns by the belt's travel, twice that of x.
    let torque = power / (2.0 * speed / r);
    only_corrected("4.5", torque, efforts[0] * r, 0.0173, 1e-9);
    assert!((torque - 0.00869).abs() < 5e-6);
}

/// Tables 3-5 and 7-1: what moves, part by part, on paper.
#[test]
fn masses_are_the_sums_of_their_parts() {
    let [mirror, motor, carriage, screw, pulley] = [0.03, 0.5, 0.3, 0.264, 0.1];
    let head = mirror + carriage;
    // The y axis rides on x: head, carriage, screw, motor, and two bearings of 0.2 kg.
    let first: f64 = [head, carriage, screw, motor, 0.2, 0.2].iter().sum();
    only_corrected("m1", first, 1.794, 1.93, 1e-9);
    let corexy: f64 = [head, carriage, 4.0 * pulley, mirror].iter().sum();
    assert!((corexy - 1.06).abs() < 1e-9);
    // Arms, forearms, tool and guide; carts, links, tool and guide.
    let five_bar = 2.0 * 0.156 + 2.0 * 0.195 + head + 0.186;
    only_corrected("mass of the 5R", five_bar, 1.218, 1.31, 1e-9);
    let prrrp = 2.0 * 0.2 + 2.0 * 0.234 + head + 0.186;
    only_corrected("mass of the PRRRP", prrrp, 1.384, 1.22, 1e-9);
}

/// Table 4-2.
#[test]
fn the_belt_breaks_at_half_of_what_is_printed() {
    let [stress, section] = [6e6, 0.5e-4];
    only_corrected("4-2", stress * section, 300.0, 600.0, 1e-9);
}

/// Table 7-1: the row "C·η" is C/η, of the CoreXY with another's η; and P is that times the speed.
#[test]
fn the_last_table_divides_by_the_efficiency() {
    let [torque, printed] = [0.0173, 0.0247];
    // A gear that loses a fifth takes in a quarter more than it gives.
    let given = 1.0;
    let taken = given / (1.0 - 0.2);
    only_corrected("C·η of the CoreXY", torque * taken / given, torque / 0.8, torque * 0.8, 1e-9);
    only_corrected("η of the CoreXY", torque * taken / given, 0.0216, printed, 2e-3 / 1.5);
    assert!((torque / 0.7 - printed).abs() < 5e-5, "with the 5R's efficiency it is as printed");
    // Largest torque times largest speed; in one instant a motor that accelerates evenly to its largest
    // speed and goes on has less than half of it on average.
    for (torque, rpm, power) in [(0.19, 2880.0, 57.3), (0.017, 2053.0, 3.65), (0.06, 2600.0, 16.33)]
    {
        let product = torque * rpm * PI / 30.0;
        assert!((product / power - 1.0_f64).abs() < 0.005, "{product} for {power}");
    }
}

/// Table 7-1: 20 cm by 20 cm around (0, 0.33).
#[test]
fn the_five_bar_does_not_reach_its_working_area() {
    let corner = Vector2::new(0.1, 0.33 + 0.1);
    let motor = Vector2::new(-0.05, 0.0);
    let distance = (corner - motor).norm();
    only_corrected("reach of the 5R", distance, 0.4554, 0.45, 1e-4 / 1.5);
    assert!(distance > 0.2 + 0.25);
}

/// The text has 7850 kg/m³, and tables 3-5, 5-4 and 6-4 have 7800.
#[test]
fn the_bars_are_as_dense_as_the_screw() {
    for (length, mass) in [(0.2, 0.156), (0.25, 0.195), (0.3, 0.234)] {
        let density = mass / (0.01 * 0.01 * length);
        only_corrected("density", density, 7800.0, 7850.0, 6e-5);
    }
}

/// "Colpo di frusta" above 1100 rpm: the slowest bending mode of the screw of table 3-5, clamped at one end
/// and free at the other, by Rayleigh's quotient of a beam that hangs through.
#[test]
fn the_screw_whips_far_above_what_is_printed() {
    let [diameter, length, modulus, density] = [0.014, 0.25, 22e10, 7800.0];
    let section = PI * diameter * diameter / 4.0;
    let second = PI * diameter * diameter * diameter * diameter / 64.0;
    // The shape under even load, x²·(x² − 4·L·x + 6·L²), with its curvature 12·(x − L)².
    let (mut bent, mut moved) = (0.0, 0.0);
    let steps = 10_000;
    for step in 0..steps {
        let x = (f64::from(step) + 0.5) / f64::from(steps) * length;
        let shape = x * x * (x * x - 4.0 * length * x + 6.0 * length * length);
        let curvature = 12.0 * (x - length) * (x - length);
        bent += modulus * second * curvature * curvature;
        moved += density * section * shape * shape;
    }
    let lowest = (bent / moved).sqrt() / TAU * 60.0;
    let root: f64 = 1.875_104;
    let closed = root * root / (TAU * length * length)
        * (diameter / 4.0)
        * (modulus / density).sqrt()
        * 60.0;
    only_corrected("speed of whipping", lowest, closed, 1100.0, 5e-3);
}
