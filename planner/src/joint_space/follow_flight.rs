//! Whether the joints can follow a flight of the tool.

use machine::kinematics::{Attitude, KinematicsError, ToolMotion};
use machine::{Mechanism, WorkArea};

use crate::joint_space::configuration::{Configuration, keeps_margins};
use crate::law::flight::Flight;
use crate::law::row::Row;
use crate::limits::local::Local;
use crate::limits::motion_limits::{MotionLimits, Scope};
use crate::limits::source::Source;
use crate::limits::tightening::Tightening;

/// Time between two looks at a flight [s], and how many there are at least: a joint's speed peaks
/// shortly after a flight begins.
const APART: f64 = 1e-3;
const LEAST_LOOKS: f64 = 12.0;

/// A joint that goes farther than this between two looks jumps [m or rad].
const JUMP: f64 = 0.3;

/// Joints nearer to each other than this are the same [m or rad].
const SAME: f64 = 1e-8;

/// Rounding at the edge of the area and at a soft limit [m or rad].
const ROUNDING: f64 = 1e-9;

/// Whether the tool stays inside `area`.
pub(crate) fn stays_inside(flight: &Flight, area: &WorkArea) -> bool {
    let [lower, upper] = flight.bounds();
    (0..3).all(|row| {
        lower[row] >= area.lower[row] - ROUNDING && upper[row] <= area.upper[row] + ROUNDING
    })
}

/// Where the joints end when they follow `flight` from `start`; `None` where they cannot.
pub(crate) fn follow_flight<const N: usize, M: Mechanism<N>>(
    limits: &MotionLimits<'_, N, M>,
    area: &WorkArea,
    start: &Configuration<N>,
    flight: &Flight,
    shares: &Tightening,
) -> Option<Configuration<N>> {
    if limits.scope == Scope::Machine && !stays_inside(flight, area) {
        return None;
    }
    let count = (flight.duration() / APART).ceil().max(LEAST_LOOKS) as usize;
    let mut now = *start;
    let mut rows = Vec::new();
    for index in 0..=count {
        let tool = tool(flight, flight.duration() * index as f64 / count as f64);
        now = step(limits, &now, &tool, shares, &mut rows).ok()??;
        // A tool that must first be turned cannot fly from here.
        let starts_elsewhere = index == 0 && (now.joints - start.joints).amax() > SAME;
        if starts_elsewhere && limits.scope == Scope::Machine {
            return None;
        }
    }
    Some(now)
}

/// The tool's motion in a flight.
pub(crate) fn tool(flight: &Flight, time: f64) -> ToolMotion {
    let now = flight.at(time);
    ToolMotion {
        position: now.position,
        velocity: now.velocity,
        acceleration: now.acceleration,
        jerk: now.jerk,
        attitude: Attitude::LEVEL,
    }
}

/// Follows the tool to one instant, at which time itself is the parameter of the limits.
fn step<const N: usize, M: Mechanism<N>>(
    limits: &MotionLimits<'_, N, M>,
    before: &Configuration<N>,
    tool: &ToolMotion,
    shares: &Tightening,
    rows: &mut Vec<Row>,
) -> Result<Option<Configuration<N>>, KinematicsError> {
    let mut branch = before.branch;
    let motion = limits.follow(tool, &mut branch, &before.joints)?;
    let now = Configuration { joints: motion.position, branch };
    if limits.scope == Scope::PathAlone {
        return Ok(Some(now));
    }
    if (motion.position - before.joints).amax() > JUMP {
        return Ok(None);
    }
    for (index, axis) in limits.axes.iter().enumerate().take(N) {
        let [lower, upper] = axis.limits.position;
        if motion.position[index] < lower - ROUNDING || motion.position[index] > upper + ROUNDING {
            return Ok(None);
        }
    }
    let state = limits.solve(&motion.position, branch, None)?;
    keeps_margins(limits.mechanism, &state)?;
    rows.clear();
    let mut local = Local::new(f64::INFINITY, Source::RAPID, 1.0, f64::INFINITY);
    limits.joint_rows(&motion, &state, shares, &mut local, rows)?;
    let fits = |row: &Row| row.base[2] + row.by_speed[2] <= row.top + row.top_by_speed;
    Ok((local.speed >= 1.0 && rows.iter().all(fits)).then_some(now))
}
