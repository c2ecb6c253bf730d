//! Moves of all joints together from rest to rest, in the dark: the quickest way between two
//! postures, and the only one where the tool's straight line leaves the mechanism's reach.
//!
//! The joints go along a straight line `q(x) = from + x·change`, 0 ≤ x ≤ 1, so that all start and end
//! together; x follows a [`Move`], played `pace` times slower. The tool then goes along a curve
//! `p(x)`, whose derivatives give its velocity, acceleration and jerk by the chain rule.

use machine::Mechanism;
use machine::kinematics::{Attitude, Joints, KinematicsError, Pose, ToolMotion};
use nalgebra::Vector3;
use signals::AxisArray;

use crate::demand::Demands;
use crate::profile::{Motion, Move};

/// Joints nearer to each other than this need no move [m or rad].
const NOTHING: f64 = 1e-12;

/// How far apart the joints are at the looks that the tool's derivatives are taken from [m or rad]:
/// the second differences of `J·change` then err by less than 10⁻⁶ of the value, half for the
/// length of the step and half for rounding.
const APART: f64 = 1e-3;

/// A synchronised move of the joints, or standing still.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointMove {
    from: AxisArray,
    change: AxisArray,
    profile: Move,
    /// How many times slower than the profile, so that every limit holds [1].
    pace: f64,
    /// The mechanism's branch during the move and after it, by its number in [`branches`].
    ///
    /// [`branches`]: crate::posture::branches
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
    pub(crate) share: Motion,
}

impl JointMove {
    /// At rest at `joints` [m or rad].
    pub(crate) fn standing<const N: usize>(joints: &Joints<N>, branch: usize) -> Self {
        Self {
            from: signals::axis::axis_array(joints.as_slice()),
            change: [0.0; signals::MAX_AXES],
            profile: Move::default(),
            pace: 1.0,
            branch,
        }
    }

    /// From rest at `from` to rest at `to` within all limits of `demands`; `None` where there is
    /// nothing to move.
    ///
    /// # Errors
    /// Where the chain does not close on the way, or the limits leave no speed at all.
    pub(crate) fn new<const N: usize, M: Mechanism<N>>(
        demands: &Demands<'_, N, M>,
        from: &Joints<N>,
        to: &Joints<N>,
        branch: usize,
    ) -> Result<Option<Self>, KinematicsError> {
        let change = to - from;
        let reach = change.amax();
        if reach <= NOTHING {
            return Ok(None);
        }
        let way = Way { from: *from, change };
        let looks = ((reach / 0.05).ceil()).clamp(4.0, 64.0) as u32;
        let longest = way.longest(demands.mechanism, demands.branches[branch], looks)?;
        let [speed, acceleration, jerk] = demands.along(&change, from, branch, longest)?;
        let profile = Move::new(1.0, speed, acceleration, jerk);
        let mut slowed = Self {
            from: signals::axis::axis_array(from.as_slice()),
            change: signals::axis::axis_array(change.as_slice()),
            profile,
            pace: 1.0,
            branch,
        };
        slowed.pace = slowed.needed_pace(demands, &way, looks)?;
        Ok(Some(slowed))
    }

    /// How many times slower than its profile this move must be played.
    fn needed_pace<const N: usize, M: Mechanism<N>>(
        &self,
        demands: &Demands<'_, N, M>,
        way: &Way<N>,
        looks: u32,
    ) -> Result<f64, KinematicsError> {
        /// How near to the ends of a phase to look, as a share of it: the jerk steps there.
        const INSIDE: f64 = 1e-9;
        let mut pace: f64 = 1.0;
        let mut start = 0.0;
        let mut near = None;
        for (duration, _) in self.profile.phases() {
            if duration <= 0.0 {
                continue;
            }
            for index in 0..=looks {
                let share = (f64::from(index) / f64::from(looks)).clamp(INSIDE, 1.0 - INSIDE);
                let along = self.profile.at(start + duration * share);
                let kind = demands.branches[self.branch];
                let (tool, assembly) = way.tool(demands.mechanism, kind, along, near.as_ref())?;
                pace = pace.max(demands.pace(&way.joints(&along), &tool, &assembly)?);
                near = Some(assembly);
            }
            start += duration;
        }
        // A top between two looks is higher than both by less than a hundredth.
        Ok(if pace > 1.0 { pace * 1.01 } else { pace })
    }

    /// Whether the joints stand still.
    pub(crate) fn stands(&self) -> bool {
        self.change.iter().all(|change| *change == 0.0)
    }

    /// Makes it at `share` of its speed.
    pub(crate) fn slow(&mut self, share: f64) {
        self.pace /= share;
    }

    /// [s].
    pub fn duration(&self) -> f64 {
        self.profile.duration() * self.pace
    }

    /// Where it ends [m or rad].
    pub fn to(&self) -> AxisArray {
        self.at(self.duration()).position
    }

    /// The joints at `time` since the start [s].
    pub fn at(&self, time: f64) -> JointsAt {
        let rate = 1.0 / self.pace;
        let along = self.profile.at(time * rate);
        let share = Motion {
            position: along.position,
            velocity: along.velocity * rate,
            acceleration: along.acceleration * rate * rate,
            jerk: along.jerk * rate * rate * rate,
        };
        let times = |factor: f64| self.change.map(|change| change * factor);
        let position =
            std::array::from_fn(|axis| self.from[axis] + self.change[axis] * share.position);
        JointsAt {
            position,
            velocity: times(share.velocity),
            acceleration: times(share.acceleration),
            jerk: times(share.jerk),
            share,
        }
    }

    /// The way of the joints of a mechanism with `N` axes.
    pub(crate) fn way<const N: usize>(&self) -> Way<N> {
        Way {
            from: Joints::from_fn(|axis, _| self.from[axis]),
            change: Joints::from_fn(|axis, _| self.change[axis]),
        }
    }
}

/// A straight line in the space of the joints.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Way<const N: usize> {
    pub(crate) from: Joints<N>,
    pub(crate) change: Joints<N>,
}

impl<const N: usize> Way<N> {
    /// The joints' motion when the share of the way goes as `along`.
    pub(crate) fn joints(&self, along: &Motion) -> machine::kinematics::JointMotion<N> {
        machine::kinematics::JointMotion {
            position: self.from + self.change * along.position,
            velocity: self.change * along.velocity,
            acceleration: self.change * along.acceleration,
            jerk: self.change * along.jerk,
        }
    }

    /// The largest |p′(x)| on the way [m].
    fn longest<M: Mechanism<N>>(
        &self,
        mechanism: &M,
        branch: M::Branch,
        looks: u32,
    ) -> Result<f64, KinematicsError> {
        let mut longest: f64 = 0.0;
        let mut near = None;
        for index in 0..=looks {
            let position = f64::from(index) / f64::from(looks);
            let (slope, assembly) = self.slope(mechanism, branch, position, near.as_ref())?;
            longest = longest.max(slope.norm());
            near = Some(assembly);
        }
        Ok(longest)
    }

    /// p′(x) [m] and the mechanism there.
    fn slope<M: Mechanism<N>>(
        &self,
        mechanism: &M,
        branch: M::Branch,
        x: f64,
        near: Option<&M::Assembly>,
    ) -> Result<(Vector3<f64>, M::Assembly), KinematicsError> {
        let joints = self.from + self.change * x;
        let assembly = mechanism.assemble(&joints, branch, near)?;
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
        along: Motion,
        near: Option<&M::Assembly>,
    ) -> Result<(ToolMotion, M::Assembly), KinematicsError> {
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
