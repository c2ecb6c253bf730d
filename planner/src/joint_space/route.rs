//! How the joints get to where something begins, in the dark: together along a straight line of
//! theirs, or with the tool along a straight line of its own.

use std::sync::Arc;

use machine::kinematics::{KinematicsError, Pose, ToolMotion};
use machine::{Mechanism, WorkArea};
use nalgebra::Vector3;

use crate::geometry::path::Path;
use crate::joint_space::configuration::{
    Configuration, PathFunction, Refused, candidates, keeps_margins, trail, walk,
};
use crate::joint_space::joint_move::JointMove;
use crate::law::End;
use crate::law::windows::{between, straight};
use crate::limits::along::{AlongPath, SpeedLimit};
use crate::limits::limit_id::LimitId;
use crate::limits::motion_limits::{MotionLimits, Scope};
use crate::limits::tightening::Tightening;
use crate::trajectory::{Errand, Motion};

/// Configurations tried for one path, the nearest first.
const TRIED: usize = 6;

/// Rounding allowed at the edge of the area [m].
const ROUNDING: f64 = 1e-9;

/// Shorter moves of the tool are not made [m].
const NOTHING: f64 = 1e-12;

/// Places at which the way of a joint move is held to the area and to the margins. It is an arc or a
/// screw line of at most a few turns.
const PLACES: u32 = 32;

/// The way to where something begins.
pub(crate) struct Approach<const N: usize> {
    /// What to do, and how long it takes [s]; `None` where the joints stand there already.
    pub(crate) motion: Option<(f64, Motion)>,
    /// The configuration in which it begins.
    pub(crate) start: Configuration<N>,
}

/// Where the joints stand, and what they keep to.
pub(crate) struct Router<'a, 'm, const N: usize, M: Mechanism<N>> {
    pub(crate) limits: &'a MotionLimits<'m, N, M>,
    pub(crate) area: &'a WorkArea,
    pub(crate) shares: &'a Tightening,
    pub(crate) now: Configuration<N>,
}

impl<const N: usize, M: Mechanism<N>> Router<'_, '_, N, M> {
    /// Where the tool is.
    pub(crate) fn tool(&self) -> Result<Pose, KinematicsError> {
        let assembly = self.limits.solve(&self.now.joints, self.now.branch, None)?;
        Ok(self.limits.mechanism.pose(&assembly))
    }

    /// The way to a configuration from which `parts` can be gone, `first` being the tool at their
    /// start.
    ///
    /// # Errors
    /// Why there is none.
    pub(crate) fn approach(
        &self,
        first: &ToolMotion,
        parts: &[&PathFunction<'_>],
    ) -> Result<Approach<N>, Refused> {
        if self.limits.mechanism.is_linear() || self.limits.scope == Scope::PathAlone {
            return self.straight(first, parts);
        }
        let found = candidates(self.limits, &self.now, first, parts)?;
        let mut refused = None;
        for (start, _) in found.into_iter().take(TRIED) {
            match self.joint_move(&start) {
                Ok(step) => {
                    let motion = step.map(|step| (step.duration(), Motion::Joints(step)));
                    return Ok(Approach { motion, start });
                }
                Err(cause) => {
                    refused.get_or_insert(cause);
                }
            }
        }
        self.straight(first, parts).map_err(|cause| refused.map_or(cause, Refused::Kinematics))
    }

    /// The joint move to `to`, if it stays inside the area and away from collisions.
    fn joint_move(&self, to: &Configuration<N>) -> Result<Option<JointMove>, KinematicsError> {
        let limits = self.limits;
        // The chain must be closed in the same way before and after.
        let branch = to.branch;
        let here = limits.mechanism.pose(&limits.solve(&self.now.joints, branch, None)?);
        let off = (here.position - self.tool()?.position).norm();
        if off > ROUNDING {
            return Err(KinematicsError {
                code: "assembly_mode",
                axis: None,
                value: off,
                limit: ROUNDING,
                detail: "the chain would have to be taken apart to close in the other way",
            });
        }
        let step = JointMove::new(limits, &self.now.joints, &to.joints, branch, self.shares)?;
        if let Some(step) = &step {
            self.check(step)?;
        }
        Ok(step)
    }

    /// That the tool stays inside the area during `step`, and the mechanism away from collisions.
    fn check(&self, step: &JointMove) -> Result<(), KinematicsError> {
        let line = step.line::<N>();
        let mut near = None;
        for index in 0..=PLACES {
            let joints = line.from + line.change * (f64::from(index) / f64::from(PLACES));
            let assembly = self.limits.solve(&joints, step.branch, near.as_ref())?;
            let tool = self.limits.mechanism.pose(&assembly).position;
            for row in 0..3 {
                let inside = tool[row].clamp(self.area.lower[row], self.area.upper[row]);
                if (tool[row] - inside).abs() > ROUNDING {
                    return Err(KinematicsError {
                        code: "area",
                        axis: None,
                        value: tool[row],
                        limit: inside,
                        detail: "on the way of the joints the tool leaves the area",
                    });
                }
            }
            keeps_margins(self.limits.mechanism, &assembly)?;
            near = Some(assembly);
        }
        Ok(())
    }

    /// That the joints stand as a motion of the tool from here asks for: it may be turned otherwise.
    fn starts_here(&self, tool: &ToolMotion) -> Result<(), KinematicsError> {
        /// Joints nearer to each other than this are the same [m or rad].
        const SAME: f64 = 1e-8;
        let mut branch = self.now.branch;
        let motion = self.limits.follow(tool, &mut branch, &self.now.joints)?;
        let off = motion.position - self.now.joints;
        if off.amax() <= SAME {
            return Ok(());
        }
        Err(KinematicsError {
            code: "discontinuous",
            axis: Some(off.iamax()),
            value: off.amax(),
            limit: SAME,
            detail: "the tool would have to be turned before a straight move",
        })
    }

    /// The way straight with the tool to where `parts` begin.
    fn straight(
        &self,
        first: &ToolMotion,
        parts: &[&PathFunction<'_>],
    ) -> Result<Approach<N>, Refused> {
        let from = self.tool()?.position;
        let to = first.position;
        let rotation = first.attitude.rotation;
        let line = |share: f64| {
            let pose = Pose { position: from + (to - from) * share, rotation };
            ToolMotion { velocity: to - from, ..ToolMotion::rest(&pose) }
        };
        let is_free = self.limits.scope == Scope::PathAlone;
        if !is_free {
            self.starts_here(&line(0.0))?;
        }
        let start = if (to - from).norm() <= NOTHING || is_free {
            self.now
        } else {
            walk(self.limits, self.now, &[&line])?.end
        };
        if !is_free {
            walk(self.limits, start, parts)?.within(self.limits)?;
        }
        if (to - from).norm() <= NOTHING {
            return Ok(Approach { motion: None, start });
        }
        let path = Path::line(from, to).facing(rotation);
        let motion = straight_move(self.limits, &self.now, path, self.shares)?;
        Ok(Approach { motion: Some(motion), start })
    }
}

/// A move of the tool along a straight path from rest to rest, and how long it takes [s].
fn straight_move<const N: usize, M: Mechanism<N>>(
    limits: &MotionLimits<'_, N, M>,
    now: &Configuration<N>,
    path: Path,
    shares: &Tightening,
) -> Result<(f64, Motion), Refused> {
    let trail = trail(limits, now, &path)?;
    let speeds = [SpeedLimit { from: 0.0, speed: limits.path.rapid, source: LimitId::RAPID }];
    let mut along = AlongPath::new(limits, &path, &speeds, &trail, shares);
    along.is_exact = true;
    let law = match straight(&mut along, path.length()) {
        Some(law) => law,
        None => {
            along.is_exact = false;
            between(&mut along, 0.0, path.length(), [End::Rest; 2], None).unwrap_or_default()
        }
    };
    if let Some(cause) = along.error {
        return Err(Refused::Kinematics(cause));
    }
    let duration = law.duration();
    let errand = Errand::Rapid;
    let motion = Motion::Path { path: Arc::new(path), law: Arc::new(law), errand };
    Ok((duration, motion))
}

/// The tool at rest at `place` [m].
pub(crate) fn still(place: Vector3<f64>) -> ToolMotion {
    ToolMotion::rest(&Pose::at(place))
}
