//! Source 003 ch. 5.

use machine::Mechanism;
use machine::kinematics::Joints;
use machine::mechanisms::{FiveBar, FiveBarBranch};
use messages::math;
use nalgebra::{Matrix2, Vector2};

use super::{only_corrected, slope};

const BASE: f64 = 0.05;
const PROXIMAL: f64 = 0.2;
const DISTAL: f64 = 0.25;

/// The tool where two circles about the elbows meet.
fn tool([first, second]: [f64; 2]) -> Vector2<f64> {
    let elbow = |base: f64, angle: f64| {
        let (s, c) = math::sin_cos(angle);
        Vector2::new(base + PROXIMAL * c, PROXIMAL * s)
    };
    let (a, b) = (elbow(-BASE, first), elbow(BASE, second));
    let between = b - a;
    let up = Vector2::new(-between.y, between.x) / between.norm();
    (a + b) / 2.0 + up * (DISTAL * DISTAL - between.norm_squared() / 4.0).sqrt()
}

/// Eq. 5.3 and 5.6: the Jacobian from small turns of the arms, off the machine's axis of symmetry.
#[test]
fn the_jacobian_is_that_of_two_circles() {
    let angles = [2.2, 0.7];
    let place = tool(angles);
    let column = |arm: usize, axis: usize| {
        slope(|by| {
            let mut there = angles;
            there[arm] += by;
            tool(there)[axis]
        })
    };
    let (x, y) = (place.x, place.y);
    let [(s1, c1), (s2, c2)] = angles.map(math::sin_cos);
    let closing = Matrix2::new(
        x + BASE - PROXIMAL * c1,
        y - PROXIMAL * s1,
        x - BASE - PROXIMAL * c2,
        y - PROXIMAL * s2,
    );
    let drive = |factor: f64, second: f64| {
        let diagonal = Vector2::new(y * c1 - (x + BASE) * s1, y * c2 - (x + second) * s2) * factor;
        closing.try_inverse().unwrap() * Matrix2::from_diagonal(&diagonal)
    };
    let (right, printed) = (drive(PROXIMAL, -BASE), drive(1.0, BASE));
    // Eq. 5.6, the same multiplied out: here only with b and with (X − e) in the second column.
    let determinant = closing.determinant();
    let out = |factor: f64, base: f64| {
        let turn = [s1 * (x + BASE) - y * c1, s2 * (x + base) - y * c2];
        let rows = Matrix2::new(
            turn[0] * (y - PROXIMAL * s2),
            -turn[1] * (y - PROXIMAL * s1),
            turn[0] * (BASE - x + PROXIMAL * c2),
            turn[1] * (x + BASE - PROXIMAL * c1),
        );
        -rows * factor / determinant
    };
    let sigma = s1 * (BASE - x)
        + s2 * (BASE + x)
        + y * (c1 - c2)
        + PROXIMAL * math::sin(angles[0] - angles[1]);
    let machine = machine();
    let chain = machine.solve(&Joints::from(angles), machine.branch, None).unwrap();
    for axis in 0..2 {
        for arm in 0..2 {
            let truth = column(arm, axis);
            only_corrected("5.3", truth, right[(axis, arm)], printed[(axis, arm)], 1e-8);
            let printed = out(1.0, BASE)[(axis, arm)] * -determinant / sigma;
            only_corrected("5.6", truth, out(PROXIMAL, -BASE)[(axis, arm)], printed, 1e-8);
            assert!((machine.jacobian(&chain)[(axis, arm)] - truth).abs() < 1e-9);
        }
    }
}

/// Text after eq. 5.6: forearms in line are singular wherever that happens, not in special cases only.
#[test]
fn forearms_in_line_are_singular() {
    let machine = FiveBar { half_base: 0.07, ..machine() };
    let first = 2.9;
    let at = |second: f64| machine.solve(&Joints::from([first, second]), machine.branch, None).ok();
    // Halving for the angle at which the elbows are two forearms apart: nothing is symmetric there.
    let (mut low, mut high) = (0.3, 1.2);
    for _ in 0..50 {
        let middle = (low + high) / 2.0;
        if at(middle).is_some() { high = middle } else { low = middle }
    }
    assert!((first + high - core::f64::consts::PI).abs() > 0.1);
    let measure = |away: f64| {
        let chain = at(high + away).unwrap();
        (machine.margins(&chain)[1].value, machine.jacobian(&chain).amax())
    };
    let [(near, fast), (far, slow)] = [measure(1e-6), measure(1e-2)];
    assert!(near < 0.01 && far > 0.1, "{near} {far}");
    // The tool's speed per turn grows as the margin falls.
    assert!((fast * near / (slow * far) - 1.0).abs() < 0.2, "{fast} {slow}");
}

fn machine() -> FiveBar {
    FiveBar {
        half_base: BASE,
        proximal: PROXIMAL,
        distal: DISTAL,
        proximal_mass: 0.1,
        proximal_inertia: 1e-4,
        distal_mass: 0.1,
        distal_inertia: 1e-4,
        tool_mass: 0.3,
        bar_mass: 0.0,
        type_1_limit: 0.01,
        type_2_limit: 0.05,
        branch: FiveBarBranch { working_mode: [1, -1], assembly_mode: 1 },
        elasticity: None,
    }
}
