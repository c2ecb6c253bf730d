//! What the joints of a machine must do at the worst place of its area.

use super::draft::Draft;
use core::f64::consts::FRAC_1_SQRT_2;
use machine::analysis::{Area, grid_position, to_and_fro};
use machine::kinematics::{Attitude, Branch, Joints, KinematicsError, ToolMotion};
use machine::{Machine, Mechanism, MechanismVisitor};
use nalgebra::Vector3;

/// Places along x, and along y.
const GRID: usize = 9;

/// Directions in which the tool is sent, each to and fro; the last only where it moves in z.
const DIRECTIONS: [[f64; 3]; 5] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0],
    [FRAC_1_SQRT_2, -FRAC_1_SQRT_2, 0.0],
    [0.0, 0.0, 1.0],
];

/// What a joint must do, and between which places.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Worst {
    /// Largest speed [m/s or rad/s].
    pub(super) speed: f64,
    /// Largest acceleration [m/s² or rad/s²].
    pub(super) acceleration: f64,
    /// Largest effort of the load, gravity included [N or N·m].
    pub(super) effort: f64,
    /// Largest effort of gravity [N or N·m].
    pub(super) gravity: f64,
    /// Largest load that it moves, the other joints at rest [kg or kg·m²].
    pub(super) load: f64,
    /// Largest way of the tool per joint unit [m/m or m/rad].
    pub(super) lever: f64,
    /// Where it goes [m or rad].
    pub(super) range: [f64; 2],
}

impl Worst {
    const NONE: Self = Self {
        speed: 0.0,
        acceleration: 0.0,
        effort: 0.0,
        gravity: 0.0,
        load: 0.0,
        lever: 0.0,
        range: [f64::INFINITY, f64::NEG_INFINITY],
    };
}

/// What the joints of `machine`, drafted as `draft`, must do for a speed [m/s] and an acceleration
/// [m/s²] of the tool at once, in any direction, anywhere in the area.
pub(super) fn over_area(
    machine: &Machine,
    draft: &Draft,
    motion: [f64; 2],
) -> Result<Vec<Worst>, KinematicsError> {
    machine.mechanism.visit(Survey { machine, draft, motion })
}

struct Survey<'a> {
    machine: &'a Machine,
    draft: &'a Draft,
    motion: [f64; 2],
}

impl Survey<'_> {
    /// Heights of the area that are looked at [m].
    fn heights(&self) -> Vec<f64> {
        let [low, high] = [self.machine.area.lower[2], self.machine.area.upper[2]];
        if self.draft.z.is_some() {
            vec![low, self.machine.home[2], high]
        } else {
            vec![self.machine.home[2]]
        }
    }
}

impl MechanismVisitor for Survey<'_> {
    type Output = Result<Vec<Worst>, KinematicsError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let [speed, acceleration] = self.motion;
        let mut area = Area::new(self.machine, &mechanism)?;
        let branch = mechanism.branch().in_any_turn();
        let home = Joints::<N>::from_fn(|row, _| self.machine.home_joints[row]);
        let rotation = mechanism.forward(&home, branch)?.rotation;
        let directions = if self.draft.z.is_some() { &DIRECTIONS[..] } else { &DIRECTIONS[..4] };
        let own: [Option<[f64; 2]>; N] = core::array::from_fn(|axis| self.draft.axes[axis].own);
        let mut worst = [Worst::NONE; N];
        for height in self.heights() {
            for at in to_and_fro([GRID, GRID]) {
                let mut position = grid_position(self.machine, [GRID, GRID], at);
                position.z = height;
                let Ok(place) = area.reach(&position) else { continue };
                let mass = mechanism.mass_matrix(&place.chain);
                let gravity = mechanism.gravity(&place.chain);
                let jacobian = mechanism.jacobian(&place.chain);
                for axis in 0..N {
                    let of = &mut worst[axis];
                    let joint = place.joints[axis];
                    of.range = [of.range[0].min(joint), of.range[1].max(joint)];
                    of.gravity = of.gravity.max(gravity[axis].abs());
                    of.load = of.load.max(mass[(axis, axis)]);
                    of.lever = of.lever.max(jacobian.fixed_view::<3, 1>(0, axis).norm());
                    of.effort = of.effort.max(of.gravity);
                }
                for (direction, sign) in directions.iter().flat_map(|it| [(it, 1.0), (it, -1.0)]) {
                    let direction = Vector3::from(*direction);
                    let motion = ToolMotion {
                        position,
                        velocity: direction * speed,
                        acceleration: direction * (sign * acceleration),
                        jerk: Vector3::zeros(),
                        attitude: Attitude::fixed(rotation),
                    };
                    let Ok(joints) = mechanism.joint_motion(&motion, branch, &place.joints) else {
                        continue;
                    };
                    // What a joint is not let do, its motor need not.
                    let capped = |values: Joints<N>, which: usize| {
                        Joints::<N>::from_fn(|axis, _| {
                            let most = own[axis].map_or(f64::INFINITY, |own| own[which]);
                            values[axis].clamp(-most, most)
                        })
                    };
                    let velocity = capped(joints.velocity, 0);
                    let acceleration = capped(joints.acceleration, 1);
                    let effort = mechanism.inverse_dynamics(&place.chain, &velocity, &acceleration);
                    for axis in 0..N {
                        let of = &mut worst[axis];
                        of.speed = of.speed.max(velocity[axis].abs());
                        of.acceleration = of.acceleration.max(acceleration[axis].abs());
                        of.effort = of.effort.max(effort[axis].abs());
                    }
                }
                for (axis, own) in own.iter().enumerate() {
                    let Some([speed, acceleration]) = own else { continue };
                    let of = &mut worst[axis];
                    of.speed = *speed;
                    of.acceleration = *acceleration;
                    let most = gravity[axis].abs() + mass[(axis, axis)] * acceleration;
                    of.effort = of.effort.max(most);
                }
            }
        }
        Ok(worst.to_vec())
    }
}
