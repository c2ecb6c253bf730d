//! The platform as it was measured: its legs' lengths, where the stator stands, and where the tool is.

use nalgebra::{Matrix3, Vector3};

use super::{CORNERS, HINGES, Legs, TriPlanar};
use crate::kinematics::{Joints, Mechanism, Pose};
use crate::taylor::Scalar;

/// Where the stator stands and where the tool is, as measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mounting {
    /// The stator's frame in the machine's.
    pub base: Pose,
    /// The tool's frame in the platform's.
    pub tool: Pose,
}

/// A pose that the machine is known to stand in: with it the assembly is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// The feet [m].
    pub joints: Joints<6>,
    /// The platform in the stator's frame.
    pub platform: Pose,
    /// How the legs lean.
    pub legs: Legs,
}

/// Whether the first corner of a hinge lies towards the start of its direction, `outward × z`.
const SENSES: [f64; 3] = [-1.0, -1.0, 1.0];

/// A rotation matrix over any scalar, row by row.
pub(super) type Rows<S> = [[S; 3]; 3];

impl TriPlanar {
    /// How far along the hinge from the middle of its side a leg's foot is, and how far from it [m].
    pub(super) fn shape(&self, leg: usize) -> (f64, f64) {
        let [first, second] = self.struts[leg];
        if first == self.side && second == self.side {
            return (0.0, self.height());
        }
        let along = (first * first - second * second) / (2.0 * self.side);
        let part = self.side / 2.0 + along;
        (along * SENSES[leg], (first * first - part * part).sqrt())
    }

    /// The platform in the stator's frame for the tool in the machine's, rotations row by row.
    pub(super) fn platform_of<S: Scalar>(
        &self,
        position: &[S; 3],
        rotation: &Rows<S>,
    ) -> ([S; 3], Rows<S>) {
        let Some(Mounting { base, tool }) = &self.mounting else { return (*position, *rotation) };
        let [from, by] = [base.position, tool.position];
        let about = |row: usize, of: &dyn Fn(usize) -> S| {
            of(0) * base.rotation[(0, row)]
                + of(1) * base.rotation[(1, row)]
                + of(2) * base.rotation[(2, row)]
        };
        let turned: Rows<S> = core::array::from_fn(|row| {
            core::array::from_fn(|column| about(row, &|k| rotation[k][column]))
        });
        let platform: Rows<S> = turned.map(|row| {
            core::array::from_fn(|column| {
                row[0] * tool.rotation[(column, 0)]
                    + row[1] * tool.rotation[(column, 1)]
                    + row[2] * tool.rotation[(column, 2)]
            })
        });
        let place = core::array::from_fn(|row| {
            let [x, y, z] = platform[row];
            about(row, &|k| position[k] - from[k]) - (x * by.x + y * by.y + z * by.z)
        });
        (place, platform)
    }

    /// The same of one pose.
    pub(super) fn platform_pose(&self, pose: &Pose) -> Pose {
        let rotation = rows(&pose.rotation);
        let (position, rotation) = self.platform_of(&pose.position.into(), &rotation);
        Pose {
            position: position.into(),
            rotation: Matrix3::from_fn(|row, column| rotation[row][column]),
        }
    }

    /// The tool in the machine's frame for the platform in the stator's.
    pub(super) fn tool_pose(&self, platform: &Pose) -> Pose {
        let Some(Mounting { base, tool }) = &self.mounting else { return *platform };
        let position = platform.position + platform.rotation * tool.position;
        Pose {
            position: base.position + base.rotation * position,
            rotation: base.rotation * platform.rotation * tool.rotation,
        }
    }

    /// That it stands with the feet at `joints` [m] and the tool at `pose`, or with the only platform that
    /// closes on these feet; `None` where nothing does.
    pub fn standing_near(&self, joints: &Joints<6>, pose: &Pose) -> Option<Standing> {
        let chain = self.solve_at(pose, joints, self.legs.into(), None).ok()?;
        let platform = Pose { position: chain.position, rotation: chain.rotation };
        Some(Standing { joints: *joints, platform, legs: chain.folds() })
    }

    /// What it measures from the corners to the feet [m], leg by leg as in [`Self::struts`], where the
    /// tool is at `pose` with the feet at `joints` [m]: [`Self::struts`] themselves if all is as it says.
    pub fn measured_struts(&self, pose: &Pose, joints: &Joints<6>) -> [[f64; 2]; 3] {
        self.strut_vectors(pose, joints).map(|pair| pair.map(|strut| strut.norm()))
    }

    /// The same as vectors from the feet to the corners, in the stator's frame.
    pub fn strut_vectors(&self, pose: &Pose, joints: &Joints<6>) -> [[Vector3<f64>; 2]; 3] {
        let platform = self.platform_pose(pose);
        let arms = self.arms(&platform.rotation);
        core::array::from_fn(|leg| {
            let foot = Vector3::new(joints[2 * leg], joints[2 * leg + 1], 0.0);
            HINGES[leg].map(|corner| platform.position + arms[corner] - foot)
        })
    }

    /// The corners at which the struts of each leg end, in the platform's frame [m].
    pub fn hinge_corners(&self) -> [[Vector3<f64>; 2]; 3] {
        HINGES.map(|pair| {
            pair.map(|corner| {
                let [x, y] = CORNERS[corner];
                Vector3::new(x, y, 0.0) * self.side
            })
        })
    }
}

/// A matrix row by row.
pub(super) fn rows(matrix: &Matrix3<f64>) -> Rows<f64> {
    core::array::from_fn(|row| core::array::from_fn(|column| matrix[(row, column)]))
}
