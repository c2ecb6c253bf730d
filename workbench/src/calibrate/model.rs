//! The unknowns, and how the struts change with them.

use machine::Pose;
use machine::mechanisms::tri_planar::{Mounting, TriPlanar};
use nalgebra::{DMatrix, Rotation3, Vector3};

/// What of a platform may be identified, six numbers each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The lengths of the legs' sides.
    Legs,
    /// Where the stator stands in the frame that the poses are measured in.
    Base,
    /// Where the measured point is on the platform.
    Tool,
}

impl Part {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Legs => "legs",
            Self::Base => "base",
            Self::Tool => "tool",
        }
    }

    /// The names of its numbers.
    pub(super) fn unknowns(self) -> [&'static str; 6] {
        match self {
            Self::Legs => ["leg AD", "leg CD", "leg CE", "leg BE", "leg AF", "leg BF"],
            Self::Base => {
                ["base x", "base y", "base z", "base about x", "base about y", "base about z"]
            }
            Self::Tool => {
                ["tool x", "tool y", "tool z", "tool about x", "tool about y", "tool about z"]
            }
        }
    }
}

/// How many numbers the `free` parts have.
pub(super) fn count(free: &[Part]) -> usize {
    6 * free.len()
}

/// Stator and tool as the machine has them.
pub(super) fn mounting(mechanism: &TriPlanar) -> Mounting {
    let drawn = Pose::at(Vector3::zeros());
    mechanism.mounting.unwrap_or(Mounting { base: drawn, tool: drawn })
}

/// The machine after a step of all unknowns, turns as lengths at the side's distance [m].
pub(super) fn moved(mechanism: &TriPlanar, free: &[Part], step: &[f64]) -> TriPlanar {
    let mut moved = *mechanism;
    let mut mounting = mounting(mechanism);
    for (part, step) in free.iter().zip(step.chunks(6)) {
        match part {
            Part::Legs => {
                for (strut, step) in moved.struts.iter_mut().flatten().zip(step) {
                    *strut += step;
                }
            }
            Part::Base => mounting.base = shifted(&mounting.base, step, mechanism.side),
            Part::Tool => mounting.tool = shifted(&mounting.tool, step, mechanism.side),
        }
    }
    moved.mounting = Some(mounting);
    moved
}

/// A frame moved and turned in its own axes.
fn shifted(frame: &Pose, step: &[f64], side: f64) -> Pose {
    let by = |first: usize| Vector3::new(step[first], step[first + 1], step[first + 2]);
    Pose {
        position: frame.position + frame.rotation * by(0),
        rotation: frame.rotation * Rotation3::new(by(3) / side).into_inner(),
    }
}

/// The six numbers of a part as they are printed: lengths, or a place and the turns about x, then y, then
/// z [m, rad].
pub(super) fn numbers(mechanism: &TriPlanar, part: Part) -> [f64; 6] {
    let mounting = mounting(mechanism);
    let frame = match part {
        Part::Legs => {
            return core::array::from_fn(|index| mechanism.struts[index / 2][index % 2]);
        }
        Part::Base => mounting.base,
        Part::Tool => mounting.tool,
    };
    let (roll, pitch, yaw) = Rotation3::from_matrix_unchecked(frame.rotation).euler_angles();
    [frame.position.x, frame.position.y, frame.position.z, roll, pitch, yaw]
}

/// How the printed numbers of all `free` parts change with a step of the unknowns, turns as lengths.
pub(super) fn slopes(mechanism: &TriPlanar, free: &[Part]) -> DMatrix<f64> {
    /// Half of the difference, in sides: what is left out and rounding are both far below 1e-6.
    const HALF: f64 = 1e-5;
    let half = HALF * mechanism.side;
    let mut slopes = DMatrix::zeros(count(free), count(free));
    for column in 0..count(free) {
        let after = |by: f64| {
            let mut step = vec![0.0; count(free)];
            step[column] = by;
            numbers(&moved(mechanism, free, &step), free[column / 6])
        };
        let [ahead, behind] = [half, -half].map(after);
        let first = column - column % 6;
        for (index, (ahead, behind)) in ahead.into_iter().zip(behind).enumerate() {
            let is_turn = free[column / 6] != Part::Legs && index >= 3;
            let difference =
                if is_turn { turn(ahead - behind) * mechanism.side } else { ahead - behind };
            slopes[(first + index, column)] = difference / (2.0 * half);
        }
    }
    slopes
}

/// The difference of two angles, within half a turn to either side [rad].
pub(super) fn turn(difference: f64) -> f64 {
    use core::f64::consts::{PI, TAU};
    PI - (PI - difference).rem_euclid(TAU)
}

/// How a strut's excess length over its leg changes with each unknown: `strut` from foot to corner, the
/// `corner` in the stator's frame, and in the `platform`'s [m].
pub(super) fn row(
    mechanism: &TriPlanar,
    free: &[Part],
    pose: &Pose,
    (number, strut, foot, corner): (usize, &Vector3<f64>, &Vector3<f64>, &Vector3<f64>),
) -> Vec<f64> {
    let Mounting { base, tool } = mounting(mechanism);
    let direction = strut.normalize();
    let place = foot + strut;
    // Of the tool's frame in the stator's.
    let turned = base.rotation.tr_mul(&pose.rotation);
    let seen = tool.rotation.tr_mul(&(corner - tool.position));
    let mut row = Vec::with_capacity(count(free));
    for part in free {
        let [linear, angular] = match part {
            Part::Legs => {
                row.extend((0..6).map(|leg| if leg == number { -1.0 } else { 0.0 }));
                continue;
            }
            // The stator moves, so the corner goes back in its frame by v + w × place.
            Part::Base => [-direction, -place.cross(&direction)],
            Part::Tool => {
                let own = turned.tr_mul(&direction);
                [-own, -seen.cross(&own)]
            }
        };
        row.extend(linear.iter());
        row.extend((angular / mechanism.side).iter());
    }
    row
}
