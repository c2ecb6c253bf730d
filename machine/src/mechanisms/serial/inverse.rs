//! The joints for a pose by damped least squares, and their derivatives by Taylor series.
//!
//! The damping follows the square of what is missing (Fan and Yuan, Computing 74, 2005), so that the
//! steps are Newton's in the end and short where the chain is far away or nearly singular.

use messages::math;

use super::task::ROWS;
use super::{JointKind, Serial};
use crate::kinematics::{
    JointMotion, Joints, KinematicsError, Pose, TaskSpace, ToolMotion, finite,
};
use crate::taylor::Taylor;

/// How near the tool must come to its target, position [m] and direction [rad].
pub(super) const TOLERANCE: f64 = 1e-12;

/// Below this smallest singular value a motion is refused: joints would move ten thousand times as
/// much as the tool.
pub(super) const SINGULAR: f64 = 1e-4;

/// How far the chain's plane may be from the target's [m]: a path's rounding.
const PLANE_TOLERANCE: f64 = 1e-9;

/// Steps before a start is given up; ten are usual, and a fully stretched arm takes thirty.
const STEPS: usize = 100;

/// Starts besides the previous joints, for a pose on its own.
const STARTS: u8 = 24;

/// Longest step of a revolute joint [rad], and of a sliding one in reaches.
const LONGEST_STEP: f64 = 1.0;

/// A tool velocity that a chain with fewer joints than rows may miss, as a share.
const MISSED: f64 = 1e-9;

/// Why a start does not lead to the target.
#[derive(Debug, Clone, Copy)]
enum Miss {
    /// The chain comes no nearer than `distance` [m]; `limit` would do.
    Far { distance: f64, limit: f64 },
    /// It comes there, but may not.
    Refused(KinematicsError),
}

/// Where a start ended.
struct Descent<const N: usize> {
    q: Joints<N>,
    /// What is missing there; dimensionless.
    distance: f64,
}

impl<const N: usize> Serial<N> {
    /// Joints for `pose`, next to `previous`; from elsewhere only if `previous` leads nowhere.
    pub(super) fn joints_of_pose(
        &self,
        pose: &Pose,
        previous: &Joints<N>,
    ) -> Result<Joints<N>, KinematicsError> {
        check_numbers(pose, previous)?;
        let reach = self.reach();
        let first = match self.settle(pose, previous, previous, reach) {
            Ok(q) => return Ok(q),
            Err(miss) => miss,
        };
        let mut nearest = first;
        for start in 0..STARTS {
            match self.settle(pose, &self.start(start), previous, reach) {
                Ok(q) => return Ok(q),
                Err(miss) => nearest = nearest.clearer(miss),
            }
        }
        Err(nearest.error())
    }

    /// The joints' motion for a motion of the tool, next to `previous`.
    pub(super) fn joints_of_motion(
        &self,
        tool: &ToolMotion,
        previous: &Joints<N>,
    ) -> Result<JointMotion<N>, KinematicsError> {
        let pose = tool.pose();
        check_numbers(&pose, previous)?;
        let reach = self.reach();
        let position = self.settle(&pose, previous, previous, reach).map_err(Miss::error)?;
        let turn = &tool.attitude;
        let linear: [Taylor; 3] = tool.series().map(Taylor::derivative);
        let angular: [Taylor; 3] = core::array::from_fn(|row| {
            Taylor::new(turn.velocity[row], turn.acceleration[row], turn.jerk[row], 0.0)
        });
        let still = |series: &Taylor| *series == Taylor::default();
        if linear.iter().chain(&angular).all(still) {
            // At rest even a singular chain is fine.
            return Ok(JointMotion::rest(position));
        }
        let start: [f64; N] = position.into();
        let smallest = self.rows(&self.chain(&start), reach).smallest_singular_value();
        if smallest < SINGULAR {
            return Err(KinematicsError {
                code: "singular",
                axis: None,
                value: smallest,
                limit: SINGULAR,
                detail: "joint rates would grow without bound",
            });
        }

        // q̇ = J⁺(q)·v holds at every instant. With q known to some order, both sides are known to
        // that order, and so is q to the next.
        let mut q = start.map(Taylor::from);
        for _ in 0..3 {
            let chain = self.chain(&q);
            let rows = self.rows(&chain, reach);
            let velocity = self.velocity_rows(&chain, reach, &linear, &angular);
            let rates = rows.solve(&velocity, 0.0);
            if rows.count > N {
                check_missed(&rows.entries[..rows.count], &rates, &velocity)?;
            }
            q = core::array::from_fn(|joint| {
                Taylor::integral(start[joint], rates[joint] * self.unit(joint, reach))
            });
        }
        Ok(JointMotion::of_series(&q))
    }

    /// Goes from `start` to `pose`, turned to be nearest to `previous`, and sees to the limits.
    fn settle(
        &self,
        pose: &Pose,
        start: &Joints<N>,
        previous: &Joints<N>,
        reach: f64,
    ) -> Result<Joints<N>, Miss> {
        let Descent { mut q, distance } = self.descend(pose, start, reach);
        let limit = dimensionless_tolerance(reach);
        if distance > limit || distance.is_nan() {
            return Err(Miss::Far { distance: distance * reach, limit: limit * reach });
        }
        if self.task_space == TaskSpace::Plane {
            let joints: [f64; N] = q.into();
            let off = pose.position.z - self.chain(&joints).tool.origin[2];
            if off.abs() > PLANE_TOLERANCE {
                return Err(Miss::Refused(KinematicsError {
                    code: "out_of_plane",
                    axis: None,
                    value: off,
                    limit: PLANE_TOLERANCE,
                    detail: "the mechanism moves in x and y only",
                }));
            }
        }
        for (joint, link) in self.links.iter().enumerate() {
            if link.kind == JointKind::Revolute {
                let near = math::nearest_turn(q[joint], previous[joint]);
                // The turn that is within the limits, where the nearest is not.
                let turn = if near > link.upper {
                    -math::TURN * ((near - link.upper) / math::TURN).ceil()
                } else if near < link.lower {
                    math::TURN * ((link.lower - near) / math::TURN).ceil()
                } else {
                    0.0
                };
                let within = near + turn;
                let inside = within >= link.lower && within <= link.upper;
                q[joint] = if inside { within } else { near };
            }
        }
        self.check_limits(&q).map_err(Miss::Refused)?;
        Ok(q)
    }

    /// Refuses joints beyond their limits.
    fn check_limits(&self, q: &Joints<N>) -> Result<(), KinematicsError> {
        for (joint, link) in self.links.iter().enumerate() {
            let value = q[joint];
            if value < link.lower || value > link.upper {
                return Err(KinematicsError {
                    code: "out_of_limits",
                    axis: Some(joint),
                    value,
                    limit: if value < link.lower { link.lower } else { link.upper },
                    detail: "the joint cannot go there",
                });
            }
        }
        Ok(())
    }

    /// A starting point inside the limits: the middle first, then ever finer in between.
    fn start(&self, number: u8) -> Joints<N> {
        // Roberts's sequence spreads evenly for any number of joints: powers of the root of
        // x⁽ᴺ⁺¹⁾ = x + 1.
        let mut root = 1.5_f64;
        for _ in 0..60 {
            root = math::pow(1.0 + root, 1.0 / (N as f64 + 1.0));
        }
        let mut step = 1.0;
        Joints::from_fn(|joint, _| {
            step /= root;
            let share = (0.5 + f64::from(number) * step).fract();
            let link = &self.links[joint];
            let (lower, upper) = if link.lower.is_finite() && link.upper.is_finite() {
                (link.lower, link.upper)
            } else {
                (-math::TURN / 2.0, math::TURN / 2.0)
            };
            lower + share * (upper - lower)
        })
    }

    /// Damped least squares from `start`, to the last digit or to where nothing more is gained.
    fn descend(&self, pose: &Pose, start: &Joints<N>, reach: f64) -> Descent<N> {
        let tolerance = dimensionless_tolerance(reach);
        let measure = |q: &Joints<N>| {
            let chain = self.chain(&(*q).into());
            let missing = self.missing(&chain, reach, pose);
            (chain, norm(&missing), missing)
        };
        let mut q = *start;
        let (mut chain, mut distance, mut missing) = measure(&q);
        let mut weight = 0.1;
        for _ in 0..STEPS {
            if distance == 0.0 {
                break;
            }
            let rows = self.rows(&chain, reach);
            let pull = rows.transposed(&missing);
            // At rest in a hollow that is not the target.
            if distance > tolerance && norm(&pull) < 1e-9 * distance {
                break;
            }
            let step = rows.solve(&missing, weight * distance * distance);
            let longest = step.iter().fold(0.0, |longest: f64, part| longest.max(part.abs()));
            let share = (LONGEST_STEP / longest).min(1.0);
            let ahead = Joints::from_fn(|joint, _| {
                q[joint] + share * step[joint] * self.unit(joint, reach)
            });
            let (next_chain, next_distance, next_missing) = measure(&ahead);
            let done = distance <= tolerance && next_distance >= distance / 2.0;
            if next_distance < distance {
                (q, chain, distance, missing) = (ahead, next_chain, next_distance, next_missing);
                weight = (weight / 4.0).max(1e-6);
            } else {
                weight *= 8.0;
            }
            if done {
                break;
            }
        }
        Descent { q, distance }
    }
}

/// The tolerance of position and direction both, where lengths are divided by `reach`.
fn dimensionless_tolerance(reach: f64) -> f64 {
    TOLERANCE / reach.max(1.0)
}

fn norm(parts: &[f64]) -> f64 {
    parts.iter().map(|part| part * part).sum::<f64>().sqrt()
}

impl Miss {
    /// The one that says more: a joint's limit before a distance, and the shorter distance.
    fn clearer(self, other: Self) -> Self {
        match (&self, &other) {
            (Self::Far { .. }, Self::Refused(_)) => other,
            (Self::Far { distance: one, .. }, Self::Far { distance, .. }) if distance < one => {
                other
            }
            _ => self,
        }
    }

    /// What is told of it.
    fn error(self) -> KinematicsError {
        match self {
            Self::Far { distance, limit } => KinematicsError {
                code: "unreachable",
                axis: None,
                value: distance,
                limit,
                detail: "the nearest that the chain comes to the target",
            },
            Self::Refused(cause) => cause,
        }
    }
}

/// Refuses what is not a number: its descent would end nowhere.
fn check_numbers<const N: usize>(pose: &Pose, previous: &Joints<N>) -> Result<(), KinematicsError> {
    finite(&pose.position)?;
    for column in pose.rotation.column_iter() {
        finite(&column.into_owned())?;
    }
    finite(previous)
}

/// Refuses a motion that a chain with too few joints cannot make.
fn check_missed<const N: usize>(
    rows: &[[Taylor; N]],
    rates: &[Taylor; N],
    velocity: &[Taylor; ROWS],
) -> Result<(), KinematicsError> {
    let (mut missed, mut asked) = (0.0_f64, 0.0_f64);
    for (row, wanted) in rows.iter().zip(velocity) {
        let mut given = Taylor::default();
        for (entry, rate) in row.iter().zip(rates) {
            given = given + *entry * *rate;
        }
        missed = missed.max((given.value - wanted.value).abs());
        asked = asked.max(wanted.value.abs());
    }
    if missed <= MISSED * asked {
        return Ok(());
    }
    Err(KinematicsError {
        code: "unreachable",
        axis: None,
        value: missed,
        limit: MISSED * asked,
        detail: "the chain has no joint for this motion of the tool",
    })
}
