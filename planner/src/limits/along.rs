//! The limits along a path of the tool, and along a straight line of the joints.

use machine::Mechanism;
use machine::kinematics::KinematicsError;

use crate::geometry::path::{Path, PathCursor};
use crate::joint_space::configuration::Configuration;
use crate::joint_space::joint_move::JointLine;
use crate::law::profile::Along;
use crate::law::row::{Limits, Row, Side, Site};
use crate::limits::limit_id::LimitId;
use crate::limits::local::{Local, derivatives, tool_rows};
use crate::limits::motion_limits::{MotionLimits, Scope};
use crate::limits::tightening::Tightening;

/// How far beside a border its sides are looked at [m]: more than rounding, less than any span.
const NEAR: f64 = 1e-13;

/// A speed that the tool must keep from a place on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SpeedLimit {
    /// Where it begins [m].
    pub(crate) from: f64,
    /// Of the tool [m/s].
    pub(crate) speed: f64,
    pub(crate) source: LimitId,
}

/// The limits along a path of the tool.
pub(crate) struct AlongPath<'a, 'm, const N: usize, M: Mechanism<N>> {
    limits: &'a MotionLimits<'m, N, M>,
    path: &'a Path,
    speeds: &'a [SpeedLimit],
    /// Configurations on the way, by place [m]: the joints nearby follow from them.
    trail: &'a [(f64, Configuration<N>)],
    shares: &'a Tightening,
    /// Where the path was looked at last.
    near: PathCursor,
    /// Whether the tool's own limits are left out.
    pub(crate) is_tool_free: bool,
    /// Whether the law keeps its rows everywhere, as a closed form does, and not at places only.
    pub(crate) is_exact: bool,
    /// Why a place could not be looked at.
    pub(crate) error: Option<KinematicsError>,
}

impl<'a, 'm, const N: usize, M: Mechanism<N>> AlongPath<'a, 'm, N, M> {
    pub(crate) fn new(
        limits: &'a MotionLimits<'m, N, M>,
        path: &'a Path,
        speeds: &'a [SpeedLimit],
        trail: &'a [(f64, Configuration<N>)],
        shares: &'a Tightening,
    ) -> Self {
        let (is_tool_free, is_exact, near) = (false, false, PathCursor::default());
        Self { limits, path, speeds, trail, shares, near, is_tool_free, is_exact, error: None }
    }

    fn speed(&self, place: f64, before: bool) -> SpeedLimit {
        let after = self
            .speeds
            .partition_point(|speed| if before { speed.from < place } else { speed.from <= place });
        self.speeds[after.max(1) - 1]
    }

    fn look(
        &mut self,
        place: f64,
        before: bool,
        rows: &mut Vec<Row>,
    ) -> Result<Local, KinematicsError> {
        let tool = self.path.tool_on_side(place, before, [1.0, 0.0, 0.0], &mut self.near);
        let limit = self.speed(place, before);
        let (path, shares) = (&self.limits.path, self.shares);
        let by_places = shares.by_places();
        let [acceleration, jerk] =
            if self.is_exact { [shares.acceleration, shares.jerk] } else { by_places };
        let (acceleration, jerk) = (acceleration * path.acceleration, jerk * path.jerk);
        let speed = if self.is_tool_free { f64::INFINITY } else { shares.speed * limit.speed };
        let mut local = Local::new(speed, limit.source, tool.velocity.norm(), jerk);
        if !self.is_tool_free {
            tool_rows(derivatives(&tool), acceleration, jerk, rows);
        }
        if self.limits.scope == Scope::PathAlone {
            return Ok(local);
        }
        let after = self.trail.partition_point(|(at, _)| *at <= place);
        let Configuration { joints, mut branch } = self.trail[after.max(1) - 1].1;
        let motion = self.limits.follow(&tool, &mut branch, &joints)?;
        let state = self.limits.solve_at(&tool, &motion.position, branch, None)?;
        self.limits.joint_rows(&motion, &state, shares, &mut local, rows)?;
        Ok(local)
    }
}

impl<const N: usize, M: Mechanism<N>> Limits for AlongPath<'_, '_, N, M> {
    fn borders(&self, from: f64, to: f64, borders: &mut Vec<f64>) {
        let first = borders.len();
        self.path.borders(from, to, borders);
        let after = self.speeds.partition_point(|speed| speed.from < from);
        let speeds = self.speeds[after..].iter().map(|speed| speed.from);
        borders.extend(speeds.take_while(|border| *border <= to));
        borders[first..].sort_by(f64::total_cmp);
        borders.dedup();
    }

    fn site(&mut self, place: f64, side: Side, rows: &mut Vec<Row>) -> Site {
        let start = rows.len();
        let length = self.path.length();
        // A border that comes back from the law may be off by rounding: the side decides.
        let aside = NEAR.max(length * f64::EPSILON * 2.0);
        let place = match side {
            Side::Before => place - aside,
            Side::At => place,
            Side::After => place + aside,
        };
        match self.look(place.clamp(0.0, length), side == Side::Before, rows) {
            Ok(local) => site(&local, start, rows),
            Err(cause) => refused(&mut self.error, cause, start, rows),
        }
    }
}

/// The limits along a straight line of the joints, by the share of it.
pub(crate) struct AlongJointLine<'a, 'm, const N: usize, M: Mechanism<N>> {
    pub(crate) limits: &'a MotionLimits<'m, N, M>,
    pub(crate) line: &'a JointLine<N>,
    pub(crate) branch: usize,
    pub(crate) shares: &'a Tightening,
    /// An assembly on the line, from which the next is found.
    pub(crate) near: Option<M::ChainState>,
    pub(crate) error: Option<KinematicsError>,
}

impl<const N: usize, M: Mechanism<N>> AlongJointLine<'_, '_, N, M> {
    fn look(&mut self, place: f64, rows: &mut Vec<Row>) -> Result<Local, KinematicsError> {
        let along = Along { position: place, velocity: 1.0, ..Along::default() };
        let kind = self.limits.branches[self.branch];
        let near = self.near.as_ref();
        let (tool, state) = self.line.tool(self.limits.mechanism, kind, along, near)?;
        self.near = Some(state);
        let (path, shares) = (&self.limits.path, self.shares);
        let [acceleration, jerk] = shares.by_places();
        let (acceleration, jerk) = (acceleration * path.acceleration, jerk * path.jerk);
        let stretch = tool.velocity.norm();
        let speed = shares.speed * path.rapid;
        let mut local = Local::new(speed, LimitId::RAPID, stretch, jerk);
        if stretch > 0.0 {
            tool_rows(derivatives(&tool), acceleration, jerk, rows);
        }
        let motion = self.line.joints(&along);
        self.limits.joint_rows(&motion, &state, shares, &mut local, rows)?;
        Ok(local)
    }
}

impl<const N: usize, M: Mechanism<N>> Limits for AlongJointLine<'_, '_, N, M> {
    fn borders(&self, _from: f64, _to: f64, _borders: &mut Vec<f64>) {}

    fn site(&mut self, place: f64, _side: Side, rows: &mut Vec<Row>) -> Site {
        let start = rows.len();
        match self.look(place.clamp(0.0, 1.0), rows) {
            Ok(local) => site(&local, start, rows),
            Err(cause) => refused(&mut self.error, cause, start, rows),
        }
    }
}

fn site(local: &Local, start: usize, rows: &[Row]) -> Site {
    Site {
        speed: local.speed,
        speed_limit: local.speed_source.0,
        rows: start..rows.len(),
        launch: local.launch,
        launch_limit: local.launch_source.0,
    }
}

/// A place without limits stands still; why is kept.
fn refused(
    error: &mut Option<KinematicsError>,
    cause: KinematicsError,
    start: usize,
    rows: &mut Vec<Row>,
) -> Site {
    error.get_or_insert(cause);
    rows.truncate(start);
    Site { speed: 0.0, speed_limit: 0, rows: start..start, launch: 0.0, launch_limit: 0 }
}
