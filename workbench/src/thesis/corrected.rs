//! The linkages of chapters 5 and 6 with the corrected equations (5.3, 5.7 to 5.12, 6.3 to 6.9) on what
//! the source prints: rigid, without losses and rotors, along the marks with their run-ins.

use machine::Mechanism;
use machine::kinematics::{Joints, KinematicsError};
use machine::mechanisms::{FiveBar, FiveBarBranch, Prrrp, PrrrpBranch};
use nalgebra::Vector3;

use super::convention::{Stretch, stretches};
use super::data::{CART_TRAVEL, FIVE_BAR_GEAR, HEIGHTS, LETTERS, SPEEDS_IMPLIED};

/// Middle of the drawing on the 5R [m].
const FIVE_BAR_HOME: [f64; 2] = [0.0, 0.33];

/// Middle of the drawing on the "assi impropri" [m]: the place is not printed, here the links are at
/// right angles.
const PRRRP_HOME: [f64; 2] = [0.212, 0.0];

/// The largest values at the joints while a letter is marked.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Largest {
    /// Speed of each joint [rad/s or m/s].
    pub(super) speed: [f64; 2],
    /// Torque at each motor [N·m].
    pub(super) torque: [f64; 2],
}

impl Largest {
    /// Those of one motor.
    pub(super) fn speed_and_torque(&self, motor: usize) -> (f64, f64) {
        (self.speed[motor], self.torque[motor])
    }
}

/// A value for each letter at each height.
pub(super) type All = [[Largest; 3]; 4];

/// The 5R with gear 250.
///
/// # Errors
/// A letter that is out of reach.
pub(super) fn five_bar() -> Result<All, KinematicsError> {
    five_bar_over(|stretch| stretch.is_mark)
}

/// The same over the stretches that count.
fn five_bar_over(counts: impl Fn(&Stretch) -> bool) -> Result<All, KinematicsError> {
    let mechanism = FiveBar {
        half_base: 0.05,
        proximal: 0.2,
        distal: 0.25,
        proximal_mass: 0.156,
        proximal_inertia: 0.156 * 0.2 * 0.2 / 12.0,
        distal_mass: 0.195,
        distal_inertia: 0.195 * 0.25 * 0.25 / 12.0,
        tool_mass: 0.33,
        bar_mass: 0.186,
        type_1_limit: 1e-3,
        type_2_limit: 1e-3,
        branch: FiveBarBranch { working_mode: [1, -1], assembly_mode: 1 },
        elasticity: None,
    };
    all(&mechanism, FIVE_BAR_HOME, 1.0 / FIVE_BAR_GEAR, counts)
}

/// The "assi impropri".
///
/// # Errors
/// A letter that is out of reach.
pub(super) fn prrrp() -> Result<All, KinematicsError> {
    prrrp_at(PRRRP_HOME[0], |stretch| stretch.is_mark)
}

/// The same with the drawing's middle at `x` [m], over the stretches that count.
fn prrrp_at(x: f64, counts: impl Fn(&Stretch) -> bool) -> Result<All, KinematicsError> {
    let mechanism = Prrrp {
        link: 0.3,
        link_mass: 0.234,
        link_inertia: 0.234 * 0.3 * 0.3 / 12.0,
        cart_mass: 0.2,
        tool_mass: 0.33,
        bar_mass: 0.186,
        type_1_limit: 1e-3,
        type_2_limit: 1e-3,
        branch: PrrrpBranch { side: 1 },
        elasticity: None,
    };
    all(&mechanism, [x, PRRRP_HOME[1]], CART_TRAVEL, counts)
}

/// `travel` is that of a joint per radian of its motor [m/rad or rad/rad].
fn all<M: Mechanism<2>>(
    mechanism: &M,
    home: [f64; 2],
    travel: f64,
    counts: impl Fn(&Stretch) -> bool,
) -> Result<All, KinematicsError> {
    let home = Vector3::new(home[0], home[1], 0.0);
    let mut all = All::default();
    for (row, letter) in LETTERS.into_iter().enumerate() {
        for (column, height) in HEIGHTS.into_iter().enumerate() {
            let speed = SPEEDS_IMPLIED[row][column];
            let stretches = stretches(letter, height, home, speed);
            let counted = stretches.iter().filter(|stretch| counts(stretch));
            all[row][column] = largest(mechanism, counted, travel)?;
        }
    }
    Ok(all)
}

fn largest<'a, M: Mechanism<2>>(
    mechanism: &M,
    stretches: impl Iterator<Item = &'a Stretch>,
    travel: f64,
) -> Result<Largest, KinematicsError> {
    let branch = mechanism.branch();
    let mut largest = Largest::default();
    for stretch in stretches {
        for motor in 0..2 {
            let moving = |tool: &_| mechanism.joint_motion(tool, branch, &Joints::zeros());
            let fastest = stretch.largest(|tool| Ok(moving(tool)?.velocity[motor].abs()))?;
            let strongest = stretch.largest(|tool| {
                let joints = moving(tool)?;
                let chain = mechanism.solve(&joints.position, branch, None)?;
                let efforts =
                    mechanism.inverse_dynamics(&chain, &joints.velocity, &joints.acceleration);
                Ok::<_, KinematicsError>((efforts[motor] * travel).abs())
            })?;
            largest.speed[motor] = largest.speed[motor].max(fastest);
            largest.torque[motor] = largest.torque[motor].max(strongest);
        }
    }
    Ok(largest)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use planner::job::letters::Letter;
    use serde_json::Value;

    /// Each row of a golden list, which has a speed of its own for S at 2 cm. Its speeds are those of the
    /// marks; its torques have some of the free moves in them. It was sampled coarsely: `close` says
    /// how near it is.
    fn check(list: &str, marks: &All, whole: &All, close: impl Fn(bool, f64, f64) -> bool) {
        let text = include_str!(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../tests/golden/thesis_chapters_5_6.json"
        ));
        let golden: Value = serde_json::from_str(text).unwrap();
        let rows = golden[list].as_array().unwrap();
        assert_eq!(rows.len(), 12);
        for (row, letter) in LETTERS.into_iter().enumerate() {
            for column in 0..HEIGHTS.len() {
                let expected = &rows[3 * row + column];
                assert_eq!(expected[0], format!("{letter:?}"));
                if letter == Letter::S && column == 1 {
                    continue;
                }
                for motor in 0..2 {
                    let what = format!("{list} {letter:?} {column} {motor}");
                    let [marks, whole] = [marks, whole].map(|all| all[row][column]);
                    let [speed, torque] = [2, 4].map(|at| expected[at][motor].as_f64().unwrap());
                    let found = marks.speed[motor];
                    assert!(close(true, found, speed), "{what}: {found} for {speed}");
                    // At least the marks', at most with all free moves.
                    let [least, most] = [marks, whole].map(|all| all.torque[motor] * 1e3);
                    let is_within = torque >= least && torque <= most;
                    let is_close = close(false, least, torque) || close(false, most, torque);
                    assert!(is_within || is_close, "{what}: {least} to {most} for {torque}");
                }
            }
        }
    }

    #[test]
    fn the_five_bar_agrees_with_its_golden_rows() {
        let [marks, whole] = [five_bar(), five_bar_over(|_| true)].map(Result::unwrap);
        check("5R_J500", &marks, &whole, |is_speed, found, golden| {
            (found - golden).abs() < if is_speed { 3e-3 } else { 0.15 }
        });
    }

    #[test]
    fn the_prrrp_agrees_with_its_golden_rows() {
        for (list, place) in [("PR_0.212_J500", 0.212), ("PR_0.26_J500", 0.26)] {
            let [marks, whole] =
                [prrrp_at(place, |it| it.is_mark), prrrp_at(place, |_| true)].map(Result::unwrap);
            check(list, &marks, &whole, |is_speed, found, golden| {
                let allowed = if is_speed { 1e-3 + 0.02 * golden } else { 0.05 + 0.03 * golden };
                (found - golden).abs() < allowed
            });
        }
    }

    #[test]
    fn values_are_those_of_an_independent_computation() {
        let close = |found: f64, expected: f64, digits: f64| {
            assert!((found - expected).abs() < digits, "{found} for {expected}");
        };
        let all = five_bar().unwrap();
        // N at 5 cm, S at 2 cm.
        close(all[0][2].speed[1], 1.2527, 1e-4);
        close(all[2][1].speed[0], 0.3001, 1e-4);
        close(all[0][2].torque[1], 6.05e-3, 6e-6);
        close(all[2][1].torque[1], 3.27e-3, 6e-6);
        let all = prrrp().unwrap();
        close(all[0][2].speed[1], 0.3797, 1e-4);
        close(all[2][2].speed[0], 0.1294, 1e-4);
        close(all[0][2].torque[1], 16.79e-3, 1e-5);
    }
}
