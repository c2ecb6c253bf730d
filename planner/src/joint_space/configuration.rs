//! Which joints bring the tool somewhere: the mechanism's branches, the turns of its tables, and how
//! a path goes on from one configuration to the next.

use core::f64::consts::TAU;

use machine::kinematics::{Branch, JointMotion, Joints, KinematicsError, Pose, ToolMotion};
use machine::{Axis, Mechanism};

use crate::geometry::path::Path;
use crate::limits::motion_limits::{MotionLimits, Scope};

/// If a joint moves by more than this between two samples, the other branches are tried too [m or rad].
const JUMP: f64 = 0.3;

/// The shortest step along a part, as a fraction of it. If the joints still change too much over that, they
/// jump.
const SHORTEST: f64 = 1e-7;

/// Steps of a walk along one part, before they are refined.
const STEPS: usize = 64;

/// Rounding allowed at a soft limit [m or rad].
const ROUNDING: f64 = 1e-9;

/// All branches of a mechanism that can be chosen one value at a time, at most 32; the first is its
/// own. Which turn a table is in is no branch here: turns are chosen among the joints.
///
/// A branch is known by its place in this list, so the list does not depend on which side `near` is on.
pub(crate) fn branches<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    near: &Joints<N>,
) -> Vec<M::Branch> {
    /// Six legs with two sides each would be 64; no shipped mechanism comes near.
    const MOST: usize = 32;
    let own = mechanism.branch().in_any_turn();
    // What the mechanism itself leaves open is named by the branch that a configuration is in.
    let named = mechanism
        .solve(near, own, None)
        .map(|assembly| mechanism.branch_of(&assembly).in_any_turn());
    let names = |branch: M::Branch| {
        let mut choices = branch.choices();
        if let Ok(named) = named {
            let open = named.choices();
            let known = choices.clone();
            choices.extend(
                open.into_iter()
                    .filter(|(name, _)| known.iter().all(|(other, _)| other != name))
                    .map(|(name, values)| (name, values.into_iter().map(i32::abs).collect())),
            );
        }
        choices
    };
    let mut found = vec![own];
    let mut next = 0;
    while let Some(&branch) = found.get(next) {
        next += 1;
        for (name, values) in names(branch) {
            for index in 0..values.len() {
                for sign in [1, -1] {
                    let mut other = values.clone();
                    other[index] *= sign;
                    if let Some(chosen) = branch.choose(name, &other)
                        && !found.contains(&chosen)
                        && found.len() < MOST
                    {
                        found.push(chosen);
                    }
                }
            }
        }
    }
    found
}

/// Which joints bring the tool to the same place after a whole turn.
pub(crate) fn periodic<const N: usize, M: Mechanism<N>>(
    limits: &MotionLimits<'_, N, M>,
    configuration: &Configuration<N>,
) -> [bool; N] {
    /// How near two poses must be to be the same, in metres and in the rotation's entries.
    const SAME: f64 = 1e-9;
    let pose = |joints: &Joints<N>| {
        let assembly = limits.solve(joints, configuration.branch, None).ok()?;
        Some(limits.mechanism.pose(&assembly))
    };
    let here = pose(&configuration.joints);
    core::array::from_fn(|axis| {
        let mut turned = configuration.joints;
        turned[axis] += TAU;
        match (here, pose(&turned)) {
            (Some(one), Some(other)) => {
                (one.position - other.position).amax() <= SAME
                    && (one.rotation - other.rotation).amax() <= SAME
            }
            _ => false,
        }
    })
}

/// The joints at rest somewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Configuration<const N: usize> {
    pub(crate) joints: Joints<N>,
    pub(crate) branch: usize,
}

impl<const N: usize> Configuration<N> {
    /// Whether `other` is this configuration at a place near by: the same branch and the same turns.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        /// Configurations differ by a branch or a turn, which is more than this [rad].
        const SAME: f64 = 1.0;
        self.branch == other.branch && (self.joints - other.joints).amax() <= SAME
    }
}

/// The joints' motion for `tool`, continuous with `previous`. Where the branch would make them jump,
/// as an arm over the centre of its table, the branch that goes on most smoothly is taken.
pub(crate) fn follow<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    branches: &[M::Branch],
    tool: &ToolMotion,
    branch: &mut usize,
    previous: &Joints<N>,
) -> Result<JointMotion<N>, KinematicsError> {
    let jump = |motion: &JointMotion<N>| (motion.position - previous).amax();
    let here = mechanism.joint_motion(tool, branches[*branch], previous);
    if here.as_ref().is_ok_and(|motion| jump(motion) <= JUMP) {
        return here;
    }
    let mut least = here.as_ref().map_or(f64::INFINITY, jump);
    let mut best = here;
    for (index, other) in branches.iter().enumerate() {
        if let Ok(motion) = mechanism.joint_motion(tool, *other, previous)
            && jump(&motion) < least
        {
            least = jump(&motion);
            *branch = index;
            best = Ok(motion);
        }
    }
    best
}

/// A part of a path: the tool's motion as a function of the fraction of it that is done, 0 to 1.
pub(crate) type PathFunction<'a> = dyn Fn(f64) -> ToolMotion + 'a;

/// Why a configuration does not do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Refused {
    /// The tool cannot be there.
    Kinematics(KinematicsError),
    /// A joint would leave its soft limits.
    Position { axis: usize, value: f64, limit: f64 },
    /// So many were tried, and none that the axes can follow can be reached.
    NoConfiguration { tried: usize },
}

impl From<KinematicsError> for Refused {
    fn from(cause: KinematicsError) -> Self {
        Self::Kinematics(cause)
    }
}

/// Where the joints go on a walk along parts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Walked<const N: usize> {
    pub(crate) end: Configuration<N>,
    /// The least and the largest value of each joint [m or rad].
    pub(crate) lower: Joints<N>,
    pub(crate) upper: Joints<N>,
}

impl<const N: usize> Walked<N> {
    /// That the soft limits held all the way.
    pub(crate) fn within<M: Mechanism<N>>(
        &self,
        limits: &MotionLimits<'_, N, M>,
    ) -> Result<(), Refused> {
        for (index, axis) in limits.axes.iter().enumerate().take(N) {
            turn(axis, false, index, [self.lower[index], self.upper[index]], 0.0)?;
        }
        Ok(())
    }
}

/// Whether the joints go on without a jump over a step of the tool on which the mechanism changes its side,
/// from `before` on; `tool` is a function of the share of the step, 0 to 1.
///
/// A path through a singularity, as the centre of a table, changes sides there and its joints go on. One that
/// passes beside it does so only where it is looked at too seldom.
pub(crate) fn crosses<const N: usize, M: Mechanism<N>>(
    limits: &MotionLimits<'_, N, M>,
    before: &Configuration<N>,
    tool: &PathFunction<'_>,
) -> Result<bool, KinematicsError> {
    /// Halvings of the step, after which the joints do not go farther than rounding.
    const HALVINGS: usize = 30;
    /// How far apart the joints may then be on both sides [m or rad].
    const TOGETHER: f64 = 1e-7;
    let side = |at: &Configuration<N>| {
        let assembly = limits.solve(&at.joints, at.branch, None)?;
        Ok(limits.mechanism.branch_of(&assembly).in_any_turn())
    };
    let follow = |at: f64, near: &Configuration<N>| {
        let mut branch = near.branch;
        let motion = limits.follow(&tool(at), &mut branch, &near.joints)?;
        Ok(Configuration { joints: motion.position, branch })
    };
    let own = side(before)?;
    let (mut near, mut low, mut high) = (*before, 0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = (low + high) / 2.0;
        let now = follow(middle, &near)?;
        if (now.joints - near.joints).amax() > JUMP {
            return Ok(false);
        }
        if side(&now)? == own {
            (near, low) = (now, middle);
        } else {
            high = middle;
        }
    }
    let beyond = follow(high, &near)?;
    Ok(side(&beyond)? != own && (beyond.joints - near.joints).amax() <= TOGETHER)
}

/// Walks from `start` along `parts` in small steps.
pub(crate) fn walk<const N: usize, M: Mechanism<N>>(
    limits: &MotionLimits<'_, N, M>,
    start: Configuration<N>,
    parts: &[&PathFunction<'_>],
) -> Result<Walked<N>, KinematicsError> {
    walk_noting(limits, start, parts, &mut |_, _| ())
}

/// The same, with each step told by the share of its part at which it ends.
fn walk_noting<const N: usize, M: Mechanism<N>>(
    limits: &MotionLimits<'_, N, M>,
    start: Configuration<N>,
    parts: &[&PathFunction<'_>],
    note: &mut dyn FnMut(f64, &Configuration<N>),
) -> Result<Walked<N>, KinematicsError> {
    let Configuration { mut joints, mut branch } = start;
    let (mut lower, mut upper) = (joints, joints);
    let mechanism = limits.mechanism;
    let mut near: Option<M::ChainState> = None;
    // Where the start does not tell its side, the first step does.
    let mut before_side = limits
        .solve(&joints, branch, None)
        .ok()
        .map(|assembly| mechanism.branch_of(&assembly).in_any_turn());
    for part in parts {
        let whole = 1.0 / STEPS as f64;
        let (mut at, mut step) = (0.0, whole);
        while at < 1.0 {
            let next = (at + step).min(1.0);
            let mut tried = branch;
            let tool = part(next);
            let motion = limits.follow(&tool, &mut tried, &joints)?;
            let change = motion.position - joints;
            let before = Configuration { joints, branch };
            let is_steady = change.amax() <= JUMP;
            let assembly = if is_steady {
                Some(limits.solve_at(&tool, &motion.position, tried, near.as_ref())?)
            } else {
                None
            };
            let side = assembly.as_ref().map(|it| mechanism.branch_of(it).in_any_turn());
            let within = |share: f64| part(at + (next - at) * share);
            let is_same = before_side.is_none() || side == before_side;
            let goes_on = is_steady && (is_same || crosses(limits, &before, &within)?);
            let Some(assembly) = assembly.filter(|_| goes_on) else {
                step /= 2.0;
                if step < SHORTEST {
                    return Err(KinematicsError {
                        code: "discontinuous",
                        axis: Some(change.iamax()),
                        value: change.amax(),
                        limit: JUMP,
                        detail: "the joints would have to jump",
                    });
                }
                continue;
            };
            keeps_margins(mechanism, &assembly)?;
            (near, before_side) = (Some(assembly), side);
            (joints, branch, at) = (motion.position, tried, next);
            note(at, &Configuration { joints, branch });
            lower = lower.inf(&joints);
            upper = upper.sup(&joints);
            step = (step * 2.0).min(whole);
        }
    }
    Ok(Walked { end: Configuration { joints, branch }, lower, upper })
}

/// The configurations along a path of the tool from `start` on, by its parameter [m], near enough to
/// each other that those between follow from them.
pub(crate) fn trail<const N: usize, M: Mechanism<N>>(
    limits: &MotionLimits<'_, N, M>,
    start: &Configuration<N>,
    path: &Path,
) -> Result<Vec<(f64, Configuration<N>)>, KinematicsError> {
    let length = path.length();
    let mut trail = vec![(0.0, *start)];
    if limits.mechanism.is_linear() || limits.scope == Scope::PathAlone {
        return Ok(trail);
    }
    let along = |share: f64| path.tool(length * share, [1.0, 0.0, 0.0]);
    walk_noting(limits, *start, &[&along], &mut |share, now| {
        trail.push((length * share, *now));
    })?;
    Ok(trail)
}

/// That the mechanism keeps its distance to collisions and to singularities in which it would lose
/// its stiffness.
pub(crate) fn keeps_margins<const N: usize, M: Mechanism<N>>(
    mechanism: &M,
    assembly: &M::ChainState,
) -> Result<(), KinematicsError> {
    match mechanism
        .margins(assembly)
        .into_iter()
        .find(|margin| margin.value < margin.limit && !margin.kind.may_be_passed())
    {
        None => Ok(()),
        Some(margin) => Err(KinematicsError {
            code: margin.name,
            axis: None,
            value: margin.value,
            limit: margin.limit,
            detail: "too near to a singularity or a collision",
        }),
    }
}

/// The configurations from which `parts` can be gone whole, nearest to `now` first. The first part's start
/// is where the configuration is taken.
///
/// # Errors
/// Where there is none: what is wrong with the one on the branch of `now`, or with the first.
pub(crate) fn candidates<const N: usize, M: Mechanism<N>>(
    limits: &MotionLimits<'_, N, M>,
    now: &Configuration<N>,
    first: &ToolMotion,
    parts: &[&PathFunction<'_>],
) -> Result<Vec<(Configuration<N>, Configuration<N>)>, Refused> {
    let mechanism = limits.mechanism;
    let first = &limits.attitude.apply(first)?;
    let mut found: Vec<(f64, Configuration<N>, Configuration<N>)> = Vec::new();
    let mut refused = None;
    let order = core::iter::once(now.branch)
        .chain((0..limits.branches.len()).filter(|branch| *branch != now.branch));
    for branch in order {
        let pose: Pose = first.pose();
        let walked = mechanism
            .inverse(&pose, limits.branches[branch], &now.joints)
            .or_else(|_| {
                // The direction of motion may decide where the place alone does not.
                let motion = mechanism.joint_motion(first, limits.branches[branch], &now.joints)?;
                Ok(motion.position)
            })
            .and_then(|joints| {
                let start = Configuration { joints, branch };
                Ok((start, walk(limits, start, parts)?))
            });
        let (start, walked) = match walked {
            Ok(walked) => walked,
            Err(cause) => {
                refused.get_or_insert(Refused::Kinematics(cause));
                continue;
            }
        };
        let turns = periodic(limits, &start);
        let mut shift = Joints::<N>::zeros();
        let fits = (0..N).try_for_each(|axis| {
            let range = [walked.lower[axis], walked.upper[axis]];
            let gap = start.joints[axis] - now.joints[axis];
            shift[axis] = turn(&limits.axes[axis], turns[axis], axis, range, gap)?;
            Ok(())
        });
        if let Err(cause) = fits {
            refused.get_or_insert(cause);
            continue;
        }
        let start = Configuration { joints: start.joints + shift, branch };
        let end = Configuration { joints: walked.end.joints + shift, branch: walked.end.branch };
        found.push((time(limits, &(start.joints - now.joints)), start, end));
    }
    if let (true, Some(refused)) = (found.is_empty(), refused) {
        return Err(refused);
    }
    // Of equal ones the first, which is the branch that the machine is in.
    found.sort_by(|(one, ..), (other, ..)| one.total_cmp(other));
    Ok(found.into_iter().map(|(_, start, end)| (start, end)).collect())
}

/// How long the joints need for `change` at their own speeds [s].
fn time<const N: usize, M: Mechanism<N>>(
    limits: &MotionLimits<'_, N, M>,
    change: &Joints<N>,
) -> f64 {
    (0..N).map(|axis| change[axis].abs() / limits.axes[axis].limits.velocity).fold(0.0, f64::max)
}

/// By which whole turns a joint that goes over `range` [m or rad] must start differently to stay
/// within its limits, and as near as can be to where it is, `gap` before it.
fn turn(
    axis: &Axis,
    turns: bool,
    index: usize,
    [from, to]: [f64; 2],
    gap: f64,
) -> Result<f64, Refused> {
    let [lower, upper] = axis.limits.position;
    let outside = || {
        let (value, limit) = if from < lower { (from, lower) } else { (to, upper) };
        Refused::Position { axis: index, value, limit }
    };
    if !turns {
        let fits = from >= lower - ROUNDING && to <= upper + ROUNDING;
        return if fits { Ok(0.0) } else { Err(outside()) };
    }
    let least = ((lower - ROUNDING - from) / TAU).ceil();
    let most = ((upper + ROUNDING - to) / TAU).floor();
    if least > most {
        return Err(outside());
    }
    Ok((-gap / TAU).round().clamp(least, most) * TAU)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::path::Path;

    use machine::{Machine, MechanismKind};
    use nalgebra::Vector3;

    use super::*;
    use crate::geometry::attitude::AttitudeLaw;

    /// The joints at the end of a line of 100 mm that passes `beside` the centre of a table [m].
    fn past_the_centre(beside: f64) -> [Joints<3>; 2] {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../machines/polar.toml");
        let machine = Machine::load(Path::new(file), &[]).unwrap();
        let MechanismKind::Polar(polar) = &machine.mechanism else { panic!("{file}") };
        let place = |x: f64| Pose::at(Vector3::new(x, beside, 0.05));
        let from = polar.inverse(&place(-0.05), polar.branch, &Joints::zeros()).unwrap();
        let law = AttitudeLaw::Level;
        let limits = MotionLimits::new(polar, &machine, machine.path, &from, law, Scope::Machine);
        let line = |share: f64| ToolMotion {
            velocity: Vector3::x() * 0.1,
            ..ToolMotion::rest(&place(share * 0.1 - 0.05))
        };
        let start = Configuration { joints: from, branch: 0 };
        [from, walk(&limits, start, &[&line]).unwrap().end.joints]
    }

    #[test]
    fn the_arm_changes_sides_where_a_path_goes_through_the_centre() {
        let [from, to] = past_the_centre(0.0);
        assert!((to[0] + from[0]).abs() < 1e-9, "{from:?} {to:?}");
        // The table goes on by half of what the arm turns: θ₂ = θ₁/2 + π/2 − φ on a line in direction φ.
        let arm = to[0] - from[0];
        assert!((to[1] - from[1] - arm / 2.0).abs() < 1e-9, "{from:?} {to:?}");
    }

    #[test]
    fn the_table_turns_where_a_path_passes_beside_the_centre_however_near() {
        for beside in [1e-3, 5e-5, 1e-6] {
            let [from, to] = past_the_centre(beside);
            assert!((to[0] - from[0]).abs() < 1e-9, "{from:?} {to:?}");
            let turned = (to[1] - from[1]).abs();
            assert!((turned - core::f64::consts::PI).abs() < 0.1, "{from:?} {to:?}");
        }
    }
}
