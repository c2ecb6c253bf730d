//! Directions of the tool, on a machine whose joints go straight with it.
//!
//! Whoever stands before a CoreXY and jogs means x and y of the machine, and not its belts. There the way of
//! each joint is so much of the way of the tool, everywhere.

use messages::{AxisArray, MAX_AXES};
use nalgebra::DMatrix;

use crate::kinematics::{Joints, Mechanism};
use crate::machine::Machine;
use crate::mechanisms::MechanismVisitor;

/// Ways of tool and joints that belong together.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Directions {
    /// Way of the tool along x, y and z for each way of a joint [m/m or m/rad].
    tool: [AxisArray; 3],
    /// Way of each joint for a way of the tool along x, y and z; `None` where it cannot go that way alone.
    levers: [Option<AxisArray>; 3],
}

impl Directions {
    /// Of this machine; none where its joints do not go straight with the tool.
    pub fn of(machine: &Machine) -> Self {
        machine.mechanism.visit(OfMechanism(machine))
    }

    /// Way of each joint for a way of the tool along x, y or z, 0 to 2.
    pub fn lever(&self, direction: usize) -> Option<&AxisArray> {
        self.levers.get(direction)?.as_ref()
    }

    /// Way of the tool along x, y or z for each way of a joint.
    pub fn tool(&self, direction: usize) -> &AxisArray {
        &self.tool[direction]
    }

    /// Whether several joints move the tool along x, y or z, so that none of their limits says where it may go.
    pub fn is_crossed(&self, direction: usize) -> bool {
        self.tool[direction].iter().filter(|way| **way != 0.0).count() > 1
    }
}

struct OfMechanism<'a>(&'a Machine);

impl MechanismVisitor for OfMechanism<'_> {
    type Output = Directions;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Directions {
        /// What a way of rounding errors is.
        const NOTHING: f64 = 1e-9;
        let home = Joints::<N>::from_fn(|axis, _| {
            self.0.home_joints.get(axis).copied().unwrap_or_default()
        });
        let mut directions = Directions::default();
        let Ok(chain) = mechanism.solve(&home, mechanism.branch(), None) else { return directions };
        if !mechanism.is_linear() || N > MAX_AXES {
            return directions;
        }
        let jacobian = mechanism.jacobian(&chain);
        let tool = DMatrix::from_fn(3, N, |row, axis| jacobian[(row, axis)]);
        for (direction, ways) in directions.tool.iter_mut().enumerate() {
            for (axis, way) in ways.iter_mut().enumerate().take(N) {
                let own = tool[(direction, axis)];
                *way = if own.abs() > NOTHING { own } else { 0.0 };
            }
        }
        let Ok(inverse) = tool.clone().pseudo_inverse(NOTHING) else { return directions };
        for (direction, lever) in directions.levers.iter_mut().enumerate() {
            let ways = inverse.column(direction);
            let goes = &tool * ways;
            let is_straight = (0..3).all(|row| {
                let due = if row == direction { 1.0 } else { 0.0 };
                (goes[row] - due).abs() < NOTHING
            });
            *lever = is_straight.then(|| {
                core::array::from_fn(|axis| {
                    let way = if axis < N { ways[axis] } else { 0.0 };
                    if way.abs() > NOTHING { way } else { 0.0 }
                })
            });
        }
        directions
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn machine(name: &str) -> Machine {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../machines");
        Machine::load(&folder.join(name), &[]).unwrap()
    }

    #[test]
    fn both_belts_of_a_corexy_move_its_tool_along_x_and_against_each_other_along_y() {
        let directions = Directions::of(&machine("corexy.toml"));
        let near = |one: f64, other: f64| (one - other).abs() < 1e-12;
        let [x, y] = [0, 1].map(|direction| directions.lever(direction).unwrap());
        assert!(near(x[0], 1.0) && near(x[1], 1.0) && near(y[0], 1.0) && near(y[1], -1.0));
        assert_eq!(directions.lever(2), None);
        assert!(directions.is_crossed(0) && directions.is_crossed(1) && !directions.is_crossed(2));
        assert!(near(directions.tool(1)[1], -0.5));
    }

    #[test]
    fn an_axis_of_a_cartesian_machine_is_a_direction_and_an_arm_has_none() {
        let directions = Directions::of(&machine("cartesian.toml"));
        assert_eq!(directions.lever(0).unwrap()[..2], [1.0, 0.0]);
        assert!(!directions.is_crossed(0) && !directions.is_crossed(1));
        assert_eq!(Directions::of(&machine("five_bar.toml")), Directions::default());
    }
}
