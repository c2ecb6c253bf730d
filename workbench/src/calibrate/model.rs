//! The unknowns, and how the struts change with them.

use machine::Pose;
use machine::mechanisms::tri_planar::{Mounting, TriPlanar};
use nalgebra::{Rotation3, Vector3};

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
