//! Whether the joints can follow a flight of the tool, and which of their limits it takes too much of.

use machine::kinematics::{Branch, KinematicsError, ToolMotion};
use machine::{Mechanism, WorkArea};

use crate::joint_space::configuration::{Configuration, crosses, keeps_margins};
use crate::law::flight::Flight;
use crate::law::row::Row;
use crate::limits::limit_id::{JointLimit, LimitId};
use crate::limits::local::Local;
use crate::limits::motion_limits::{MotionLimits, Scope};
use crate::limits::tightening::Tightening;

/// Time between two looks at a flight [s], and how many there are at least: a joint's speed peaks
/// shortly after a flight begins.
const APART: f64 = 1e-3;
const LEAST_LOOKS: f64 = 12.0;

/// How far beside a break of a flight it is looked at, as a share of its duration.
const BESIDE: f64 = 1e-9;

/// A joint that goes farther than this between two looks jumps [m or rad].
const JUMP: f64 = 0.3;

/// Joints nearer to each other than this are the same [m or rad].
const SAME: f64 = 1e-8;

/// Rounding at the edge of the area and at a soft limit [m or rad].
const ROUNDING: f64 = 1e-9;

/// How the joints follow a flight.
#[derive(Debug, Clone)]
pub(crate) struct Followed<const N: usize> {
    pub(crate) end: Configuration<N>,
    /// The largest share of each joint's limits in use, by [`JointLimit`] [1].
    pub(crate) used: [[f64; JointLimit::COUNT]; N],
}

/// The shares of their limits that the joints use where they follow `tool`, being near `near`; `None`
/// where they cannot.
pub(crate) fn uses<const N: usize, M: Mechanism<N>>(
    limits: &MotionLimits<'_, N, M>,
    near: &Configuration<N>,
    tool: &ToolMotion,
    shares: &Tightening,
) -> Option<[[f64; JointLimit::COUNT]; N]> {
    let mut followed = Followed { end: *near, used: [[0.0; JointLimit::COUNT]; N] };
    step(limits, &mut followed, tool, shares, &mut Vec::new())?;
    Some(followed.used)
}

impl<const N: usize> Followed<N> {
    /// Whether all limits are kept.
    pub(crate) fn fits(&self) -> bool {
        self.used.iter().flatten().all(|used| *used <= 1.0)
    }

    fn note(&mut self, source: LimitId, used: f64) {
        if let Some((axis, limit)) = source.joint_limit()
            && axis < N
        {
            let most = &mut self.used[axis][limit as usize];
            // Put this way what is no number is kept.
            *most = if used <= *most { *most } else { used };
        }
    }
}

/// Whether the tool stays inside `area`, and not below `lowest` [m].
pub(crate) fn stays_inside(flight: &Flight, area: &WorkArea, lowest: f64) -> bool {
    let [lower, upper] = flight.bounds();
    lower[2] >= lowest - ROUNDING
        && (0..3).all(|row| {
            lower[row] >= area.lower[row] - ROUNDING && upper[row] <= area.upper[row] + ROUNDING
        })
}

/// How the joints follow `flight` from `start`, up to where they use more than `most` of a limit; `None`
/// where they cannot at any speed.
pub(crate) fn follow_flight<const N: usize, M: Mechanism<N>>(
    limits: &MotionLimits<'_, N, M>,
    area: &WorkArea,
    start: &Configuration<N>,
    flight: &Flight,
    shares: &Tightening,
    most: f64,
) -> Option<Followed<N>> {
    if limits.scope == Scope::Machine && !stays_inside(flight, area, limits.lowest) {
        return None;
    }
    let mut followed = Followed { end: *start, used: [[0.0; JointLimit::COUNT]; N] };
    let mut rows = Vec::new();
    let (mut before, mut side) = (0.0, None);
    for (index, time) in looks(flight).into_iter().enumerate() {
        let from = followed.end;
        let now = step(limits, &mut followed, &flight.tool(time), shares, &mut rows)?;
        let within = |share: f64| flight.tool(before + (time - before) * share);
        if side.is_some() && now != side && !crosses(limits, &from, &within).ok()? {
            return None;
        }
        (before, side) = (time, now);
        if followed.used.iter().flatten().any(|used| used.is_nan() || *used > most) {
            return Some(followed);
        }
        // A tool that must first be turned cannot fly from here.
        let starts_elsewhere = index == 0 && (followed.end.joints - start.joints).amax() > SAME;
        if starts_elsewhere && limits.scope == Scope::Machine {
            return None;
        }
    }
    Some(followed)
}

/// When a flight is looked at: evenly, and on both sides of each change of the jerk, where
/// accelerations have their extremes.
fn looks(flight: &Flight) -> Vec<f64> {
    let duration = flight.duration();
    let count = (duration / APART).ceil().max(LEAST_LOOKS) as usize;
    let beside = duration * BESIDE;
    let breaks = flight.breaks().flat_map(|time| [time - beside, time + beside]);
    let mut looks: Vec<f64> = (0..=count)
        .map(|index| duration * index as f64 / count as f64)
        .chain(breaks.filter(|time| *time > 0.0 && *time < duration))
        .collect();
    looks.sort_by(f64::total_cmp);
    looks
}

/// Follows the tool to one instant, at which time itself is the parameter of the limits; the side that the
/// mechanism is on there, where the machine's limits are asked for.
fn step<const N: usize, M: Mechanism<N>>(
    limits: &MotionLimits<'_, N, M>,
    followed: &mut Followed<N>,
    tool: &ToolMotion,
    shares: &Tightening,
    rows: &mut Vec<Row>,
) -> Option<Option<M::Branch>> {
    let before = followed.end;
    let mut branch = before.branch;
    let motion = limits.follow(tool, &mut branch, &before.joints).ok()?;
    followed.end = Configuration { joints: motion.position, branch };
    if limits.scope == Scope::PathAlone {
        return Some(None);
    }
    if (motion.position - before.joints).amax() > JUMP {
        return None;
    }
    for (index, axis) in limits.axes.iter().enumerate().take(N) {
        let [lower, upper] = axis.limits.position;
        if motion.position[index] < lower - ROUNDING || motion.position[index] > upper + ROUNDING {
            return None;
        }
    }
    let mut look = || -> Result<(Local, M::Branch), KinematicsError> {
        let state = limits.solve_at(tool, &motion.position, branch, None)?;
        keeps_margins(limits.mechanism, &state)?;
        rows.clear();
        let mut local = Local::new(f64::INFINITY, LimitId::RAPID, 1.0, f64::INFINITY);
        limits.joint_rows(&motion, &state, shares, &mut local, rows)?;
        Ok((local, limits.mechanism.branch_of(&state).in_any_turn()))
    };
    let (local, side) = look().ok()?;
    followed.note(local.speed_source, 1.0 / local.speed);
    for row in rows.iter() {
        let used = row.base[2] + row.by_speed[2];
        let room = row.top + row.top_by_speed;
        // Where the speed alone leaves nothing, only less of it helps.
        followed.note(LimitId(row.limit), if room > 0.0 { used / room } else { f64::INFINITY });
    }
    Some(Some(side))
}
