//! Moves of all joints together from rest to rest, in the dark: the quickest way between two
//! configurations, and the only one where the tool's straight line leaves the mechanism's reach.
//!
//! The joints go along a straight line `q(x) = from + x·change`, 0 ≤ x ≤ 1, so that all start and end
//! together; x follows a time law. The tool then goes along a curve `p(x)`, whose derivatives give its
//! velocity, acceleration and jerk by the chain rule.

use std::sync::Arc;

use machine::Mechanism;
use machine::kinematics::{Attitude, Joints, KinematicsError, Pose, ToolMotion};
use messages::AxisArray;
use messages::axis::axis_array;
use nalgebra::Vector3;

use crate::law::profile::Along;
use crate::law::time_law::TimeLaw;
use crate::law::windows::time_law;
use crate::limits::along::AlongJointLine;
use crate::limits::motion_limits::MotionLimits;
use crate::limits::tightening::Tightening;

/// Joints nearer to each other than this need no move [m or rad].
const NOTHING: f64 = 1e-12;

/// How far apart the joints are at the places that the tool's derivatives are taken from [m or rad]:
/// the second differences of `J·change` then err by less than 10⁻⁶ of the value, half for the
/// length of the step and half for rounding.
const APART: f64 = 1e-3;

/// A synchronised move of the joints, or standing still.
#[derive(Debug, Clone, PartialEq)]
pub struct JointMove {
    from: AxisArray,
    change: AxisArray,
    /// How the share of the way goes with time; `None` while the joints stand.
    pub(crate) law: Option<Arc<TimeLaw>>,
    /// The mechanism's branch during the move and after it, by its number in [`branches`].
    ///
    /// [`branches`]: crate::joint_space::configuration::branches
    pub(crate) branch: usize,
}

/// The joints at one instant of a [`JointMove`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointsAt {
    /// [m or rad].
    pub position: AxisArray,
    /// [m/s or rad/s].
    pub velocity: AxisArray,
    /// [m/s² or rad/s²].
    pub acceleration: AxisArray,
    /// [m/s³ or rad/s³].
    pub jerk: AxisArray,
    /// The share of the way that is done, and its derivatives.
    pub(crate) share: Along,
    /// The branch of the mechanism.
    pub(crate) branch: usize,
    /// Where the line of the joints begins, and how far it goes.
    pub(crate) from: AxisArray,
    pub(crate) change: AxisArray,
}

impl JointMove {
    /// At rest at `joints` [m or rad].
    pub(crate) fn standing<const N: usize>(joints: &Joints<N>, branch: usize) -> Self {
        let change = [0.0; messages::MAX_AXES];
        Self { from: axis_array(joints.as_slice()), change, law: None, branch }
    }

    /// From rest at `from` to rest at `to` within all limits; `None` where there is nothing to move.
    ///
    /// # Errors
    /// Where the chain does not close on the way, or a motor cannot hold its load.
    pub(crate) fn new<const N: usize, M: Mechanism<N>>(
        limits: &MotionLimits<'_, N, M>,
        from: &Joints<N>,
        to: &Joints<N>,
        branch: usize,
        shares: &Tightening,
    ) -> Result<Option<Self>, KinematicsError> {
        let change = to - from;
        if change.amax() <= NOTHING {
            return Ok(None);
        }
        let line = JointLine { from: *from, change };
        let shares = &shares.with_room_for_loops();
        let mut along =
            AlongJointLine { limits, line: &line, branch, shares, near: None, error: None };
        let law = time_law(&mut along, 1.0);
        match along.error {
            Some(cause) => Err(cause),
            None => Ok(Some(Self {
                from: axis_array(from.as_slice()),
                change: axis_array(change.as_slice()),
                law: Some(Arc::new(law)),
                branch,
            })),
        }
    }

    /// [s].
    pub fn duration(&self) -> f64 {
        self.law.as_ref().map_or(0.0, |law| law.duration())
    }

    /// The joints at `time` since the start [s].
    pub fn at(&self, time: f64) -> JointsAt {
        let share = self.law.as_ref().map_or_else(Along::default, |law| law.at(time));
        let times = |factor: f64| self.change.map(|change| change * factor);
        let position =
            std::array::from_fn(|axis| self.from[axis] + self.change[axis] * share.position);
        JointsAt {
            position,
            velocity: times(share.velocity),
            acceleration: times(share.acceleration),
            jerk: times(share.jerk),
            share,
            branch: self.branch,
            from: self.from,
            change: self.change,
        }
    }

    /// The line of the joints of a mechanism with `N` axes.
    pub(crate) fn line<const N: usize>(&self) -> JointLine<N> {
        JointLine::of(&self.from, &self.change)
    }
}

/// A straight line in the space of the joints.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointLine<const N: usize> {
    pub(crate) from: Joints<N>,
    pub(crate) change: Joints<N>,
}

impl<const N: usize> JointLine<N> {
    /// From its start and its extent.
    pub(crate) fn of(from: &AxisArray, change: &AxisArray) -> Self {
        Self {
            from: Joints::from_fn(|axis, _| from[axis]),
            change: Joints::from_fn(|axis, _| change[axis]),
        }
    }

    /// The joints' motion when the share of the way goes as `along`.
    pub(crate) fn joints(&self, along: &Along) -> machine::kinematics::JointMotion<N> {
        machine::kinematics::JointMotion {
            position: self.from + self.change * along.position,
            velocity: self.change * along.velocity,
            acceleration: self.change * along.acceleration,
            jerk: self.change * along.jerk,
        }
    }

    /// p′(x) [m] and the mechanism there.
    fn slope<M: Mechanism<N>>(
        &self,
        mechanism: &M,
        branch: M::Branch,
        x: f64,
        near: Option<&M::ChainState>,
    ) -> Result<(Vector3<f64>, M::ChainState), KinematicsError> {
        let joints = self.from + self.change * x;
        let assembly = mechanism.solve(&joints, branch, near)?;
        let rates = mechanism.jacobian(&assembly) * self.change;
        Ok((rates.fixed_rows::<3>(0).into_owned(), assembly))
    }

    /// The tool's motion when the share of the way goes as `along`, and the mechanism there.
    ///
    /// # Errors
    /// Where the chain does not close.
    pub(crate) fn tool<M: Mechanism<N>>(
        &self,
        mechanism: &M,
        branch: M::Branch,
        along: Along,
        near: Option<&M::ChainState>,
    ) -> Result<(ToolMotion, M::ChainState), KinematicsError> {
        let x = along.position;
        let (first, assembly) = self.slope(mechanism, branch, x, near)?;
        let pose: Pose = mechanism.pose(&assembly);
        let still = Vector3::zeros();
        let mut tool = ToolMotion {
            position: pose.position,
            velocity: first * along.velocity,
            acceleration: still,
            jerk: still,
            // How the tool is turned is of no concern in the dark.
            attitude: Attitude::fixed(pose.rotation),
        };
        let reach = self.change.amax();
        if reach <= NOTHING {
            return Ok((tool, assembly));
        }
        let step = (APART / reach).min(0.25);
        // Both neighbours on the way itself: beyond its ends the chain need not close.
        let centre = x.clamp(step, 1.0 - step);
        let at = |x: f64| Ok(self.slope(mechanism, branch, x, Some(&assembly))?.0);
        let (behind, ahead) = (at(centre - step)?, at(centre + step)?);
        let middle = if centre == x { first } else { at(centre)? };
        let third = (ahead - middle * 2.0 + behind) / (step * step);
        let second = (ahead - behind) / (2.0 * step) + third * (x - centre);
        let (v, a, j) = (along.velocity, along.acceleration, along.jerk);
        tool.acceleration = second * (v * v) + first * a;
        tool.jerk = third * (v * v * v) + second * (3.0 * v * a) + first * j;
        Ok((tool, assembly))
    }
}
