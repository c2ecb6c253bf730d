//! Source 003 ch. 6.

use machine::Mechanism;
use machine::kinematics::Joints;
use machine::mechanisms::{Prrrp, PrrrpBranch};
use nalgebra::Matrix2;

use super::{only_corrected, slope};

const LINK: f64 = 0.3;
/// Travel of a cart [m/rad].
const P: f64 = 0.02;

/// Eq. 6.1 and 6.2, which are right.
fn tool([first, second]: [f64; 2]) -> [f64; 2] {
    let half = P * (second - first) / 2.0;
    [(LINK * LINK - half * half).sqrt(), P * (first + second) / 2.0]
}

/// Eq. 6.3, 6.4, 6.5 and 6.10: from small turns of the motors.
#[test]
fn the_jacobian_is_that_of_two_links() {
    let angles = [-7.0, 11.0];
    let apart = angles[1] - angles[0];
    let truth = Matrix2::from_fn(|axis, motor| {
        slope(|by| {
            let mut there = angles;
            there[motor] += by;
            tool(there)[axis]
        })
    });
    let root = (4.0 * (LINK / P) * (LINK / P) - apart * apart).sqrt();
    let edge = apart / (2.0 * root);
    // Eq. 6.3 has the signs of its first row the other way round.
    only_corrected("6.3", truth[(0, 0)], P * edge, -P * edge, 1e-8);
    only_corrected("6.3", truth[(0, 1)], -P * edge, P * edge, 1e-8);
    // Eq. 6.4 has two equal rows.
    let inverse = truth.try_inverse().unwrap();
    only_corrected("6.4", inverse[(1, 0)], -root / apart / P, root / apart / P, 1e-8);
    // Eq. 6.5 lacks P² and has the sign of 6.3.
    only_corrected("6.5", truth.determinant(), P * P * edge, -edge, 1e-8);
    // Eq. 6.10 lacks a factor of 2.
    let product = (truth * truth.transpose())[(0, 0)];
    let fourth = P * P * P * P * apart * apart;
    let span = 4.0 * LINK * LINK - P * P * apart * apart;
    only_corrected("6.10", product, fourth / (2.0 * span), fourth / (4.0 * span), 1e-8);
}

/// Sec. 6.5: where the tool moves alike in all directions.
#[test]
fn the_mechanism_is_isotropic_at_the_link_over_root_2() {
    let machine = Prrrp {
        link: LINK,
        link_mass: 0.2,
        link_inertia: 1e-3,
        cart_mass: 0.2,
        tool_mass: 0.3,
        bar_mass: 0.0,
        type_1_limit: 0.05,
        type_2_limit: 0.1,
        branch: PrrrpBranch { side: 1 },
        elasticity: None,
    };
    // Halving for the place where both singular values are the same.
    let uneven = |x: f64| {
        let half = (LINK * LINK - x * x).sqrt();
        let chain = machine.solve(&Joints::from([-half, half]), machine.branch, None);
        let jacobian = machine.jacobian(&chain.unwrap());
        jacobian[(0, 0)].abs() - jacobian[(1, 0)].abs()
    };
    let (mut low, mut high) = (0.1 * LINK, 0.9 * LINK);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if uneven(middle) > 0.0 { low = middle } else { high = middle }
    }
    let root_2 = core::f64::consts::SQRT_2;
    only_corrected("6.5", low, LINK / root_2, root_2 / (2.0 * LINK), 1e-9);
}
