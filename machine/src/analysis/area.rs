//! The area of a machine, place by place: the one rule that says what is reached.

use nalgebra::{Matrix3, Vector3};

use super::Place;
use super::place::joints;
use crate::kinematics::{Branch, Joints, KinematicsError, Margin};
use crate::{Machine, Mechanism, MechanismVisitor, Pose};

/// Rounding allowed at a soft limit [m or rad].
const ROUNDING: f64 = 1e-9;

/// Why the tool does not come to a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refusal {
    /// Code of the kinematics, name of a margin, or `limit` of an axis.
    pub code: &'static str,
    /// The axis that it concerns, from 0.
    pub axis: Option<usize>,
    /// Whether the place is singular, or too near to a singularity or a collision.
    pub is_singular: bool,
}

impl From<KinematicsError> for Refusal {
    fn from(error: KinematicsError) -> Self {
        let is_singular = error.code.starts_with("singular") || error.code.contains("collision");
        Self { code: error.code, axis: error.axis, is_singular }
    }
}

/// How the tool comes to a place.
#[derive(Debug, Clone)]
pub struct Reached<const N: usize, S> {
    /// [m or rad].
    pub joints: Joints<N>,
    /// The chain solved there.
    pub chain: S,
    /// What is kept of the margins.
    pub margins: Vec<Margin>,
}

/// A machine that goes from place to place, with the attitude of home and on the branch in which it
/// is built, whichever turn a table is in.
#[derive(Debug)]
pub struct Area<'a, const N: usize, M: Mechanism<N>> {
    machine: &'a Machine,
    mechanism: &'a M,
    branch: M::Branch,
    rotation: Matrix3<f64>,
    home: Joints<N>,
    /// The joints at the last place that was reached [m or rad].
    previous: Joints<N>,
}

impl<'a, const N: usize, M: Mechanism<N>> Area<'a, N, M> {
    /// `machine` at home; `mechanism` is its own.
    ///
    /// # Errors
    /// Where the mechanism has no solution at home.
    pub fn new(machine: &'a Machine, mechanism: &'a M) -> Result<Self, KinematicsError> {
        let home = joints::<N>(&machine.home_joints);
        let branch = mechanism.branch().in_any_turn();
        let rotation = mechanism.forward(&home, branch)?.rotation;
        Ok(Self { machine, mechanism, branch, rotation, home, previous: home })
    }

    /// The tool at `position` [m], reached on from the place before or else from home, within the axes'
    /// limits and with all margins kept.
    ///
    /// # Errors
    /// Why it is not reached.
    pub fn reach(&mut self, position: &Vector3<f64>) -> Result<Reached<N, M::ChainState>, Refusal> {
        let pose = Pose { position: *position, rotation: self.rotation };
        let reached =
            self.solve(&pose, &self.previous).or_else(|_| self.solve(&pose, &self.home))?;
        self.previous = reached.joints;
        Ok(reached)
    }

    fn solve(
        &self,
        pose: &Pose,
        previous: &Joints<N>,
    ) -> Result<Reached<N, M::ChainState>, Refusal> {
        let joints = self.mechanism.inverse(pose, self.branch, previous)?;
        for (axis, (settings, joint)) in self.machine.axes.iter().zip(joints.iter()).enumerate() {
            let [lower, upper] = settings.limits.position;
            // Put this way a joint that is no number is beyond.
            if !(*joint >= lower - ROUNDING && *joint <= upper + ROUNDING) {
                return Err(Refusal { code: "limit", axis: Some(axis), is_singular: false });
            }
        }
        let chain = self.mechanism.solve(&joints, self.branch, None)?;
        let margins = self.mechanism.margins(&chain);
        match margins.iter().find(|margin| margin.value < margin.limit) {
            Some(margin) => Err(Refusal { code: margin.name, axis: None, is_singular: true }),
            None => Ok(Reached { joints, chain, margins }),
        }
    }
}

/// A place of a grid of `size` columns and rows over the area of `machine`, its edges included, at the
/// height of home [m]. Exact at all edges.
pub fn grid_position(machine: &Machine, size: [usize; 2], at: [usize; 2]) -> Vector3<f64> {
    let along = |axis: usize| {
        let share = at[axis] as f64 / size[axis].saturating_sub(1).max(1) as f64;
        machine.area.lower[axis] * (1.0 - share) + machine.area.upper[axis] * share
    };
    Vector3::new(along(0), along(1), machine.home[2])
}

/// Column and row of every place of a grid of `size`, each beside the one before: row by row, to and
/// fro.
pub fn to_and_fro(size: [usize; 2]) -> impl Iterator<Item = [usize; 2]> {
    let [columns, rows] = size;
    (0..rows).flat_map(move |row| {
        (0..columns).map(move |step| [if row % 2 == 0 { step } else { columns - 1 - step }, row])
    })
}

/// `machine` at every place of a grid of `size` columns and rows over its area, row by row from the
/// lowest y, along x; `None` where it is not reached.
///
/// # Errors
/// Where the mechanism has no solution at home.
pub fn places(machine: &Machine, size: [usize; 2]) -> Result<Vec<Option<Place>>, KinematicsError> {
    machine.mechanism.visit(Places { machine, size })
}

struct Places<'a> {
    machine: &'a Machine,
    size: [usize; 2],
}

impl MechanismVisitor for Places<'_> {
    type Output = Result<Vec<Option<Place>>, KinematicsError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let mut area = Area::new(self.machine, &mechanism)?;
        let mut places = vec![None; self.size[0] * self.size[1]];
        for at in to_and_fro(self.size) {
            let position = grid_position(self.machine, self.size, at);
            places[at[1] * self.size[0] + at[0]] = area.reach(&position).ok().map(|reached| {
                let Reached { joints, chain, margins } = reached;
                Place::of_chain(self.machine, &mechanism, &joints, &chain, margins)
            });
        }
        Ok(places)
    }
}
