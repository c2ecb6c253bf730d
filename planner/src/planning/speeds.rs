//! The speed limits along a path, at the rate at which the job is marked.

use machine::Mechanism;

use super::path_run::PathRun;
use super::timing::WINDOW;
use super::{Planning, plateau};
use crate::geometry::contour::{Contour, Demand};
use crate::law::row::{Limits, Side};
use crate::light::exposure::{change_speeds, source_speeds};
use crate::limits::along::{AlongPath, SpeedLimit};
use crate::limits::limit_id::LimitId;

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// How much faster than the job asks for a stretch of light is marked: as much as the override says,
    /// the largest speed allows, and the power can make up for.
    pub(super) fn faster(&self, demand: &Demand) -> f64 {
        let speeds = &self.task.speeds;
        let asked = speeds.of(demand.speed);
        (asked * self.rate.min(1.0 / demand.power)).min(speeds.most) / asked
    }

    /// The speed limits along a contour, stretch by stretch.
    pub(super) fn speed_limits(&self, contour: &Contour) -> Vec<SpeedLimit> {
        let path = &self.limits.path;
        let by_source = source_speeds(contour, &self.task.machine.laser);
        let by_light =
            by_source.into_iter().zip(change_speeds(contour, self.task.machine.realtime.period));
        let by_light = by_light.map(|(source, changes)| source.min(changes));
        let mut limits: Vec<SpeedLimit> = Vec::new();
        for (demand, least) in contour.demands().iter().zip(by_light) {
            let (speed, source) = if demand.power > 0.0 {
                let most = self.task.speeds.most;
                let asked = self.task.speeds.of(demand.speed) * self.faster(demand);
                (asked, if asked < most { LimitId::FEED } else { LimitId::MARKING_SPEED })
            } else {
                match demand.speed {
                    Some(speed) if speed * self.rate < path.rapid => {
                        (speed * self.rate, LimitId::FEED)
                    }
                    _ => (path.rapid, LimitId::RAPID),
                }
            };
            let speed = speed.min(least);
            if limits.last().is_none_or(|last| last.speed != speed || last.source != source) {
                limits.push(SpeedLimit { from: demand.from, speed, source });
            }
        }
        limits
    }

    /// The speed limits along a contour of which the job leaves the speed open, up to `most` [m/s].
    pub(super) fn limits_for(&self, contour: &Contour, most: Option<f64>) -> Vec<SpeedLimit> {
        let mut limits = self.speed_limits(contour);
        if let Some(most) = most {
            // One speed all along.
            let source = LimitId::TOOL_ACCELERATION;
            limits.iter_mut().for_each(|limit| {
                (limit.speed, limit.source) = (limit.speed.min(most), source);
            });
        }
        limits
    }
}

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// How far ahead of the tool a path must be known [m].
    pub(super) fn look_ahead(&self, speeds: &[SpeedLimit]) -> f64 {
        let limits = &self.limits.path;
        let top = speeds.iter().map(|speed| speed.speed).fold(0.0, f64::max);
        let stop = top * top / limits.acceleration + top * limits.acceleration / limits.jerk;
        top * (plateau::LONGEST + 2.0 * WINDOW) + 20.0 * (stop + 1e-5)
    }
}

/// The limit just before `place` [m].
pub(super) fn limit_before(speeds: &[SpeedLimit], place: f64) -> &SpeedLimit {
    &speeds[speeds.partition_point(|limit| limit.from < place).max(1) - 1]
}

/// The limit from `place` on [m].
pub(super) fn limit_at(speeds: &[SpeedLimit], place: f64) -> &SpeedLimit {
    &speeds[speeds.partition_point(|limit| limit.from <= place).max(1) - 1]
}

/// Speeds along a path that begins `distance` later [m].
pub(super) fn moved_back(speeds: &[SpeedLimit], distance: f64) -> Vec<SpeedLimit> {
    let first = speeds.partition_point(|limit| limit.from <= distance).max(1) - 1;
    let moved =
        |limit: &SpeedLimit| SpeedLimit { from: (limit.from - distance).max(0.0), ..*limit };
    speeds[first..].iter().map(moved).collect()
}

/// Those from `place` on [m].
pub(super) fn limits_from(speeds: &[SpeedLimit], place: f64) -> Vec<SpeedLimit> {
    let first = speeds.partition_point(|limit| limit.from <= place).max(1) - 1;
    let kept = |limit: &SpeedLimit| SpeedLimit { from: limit.from.max(place), ..*limit };
    speeds[first..].iter().map(kept).collect()
}

/// The speed asked for just after `place` [m/s], and the limit that it is.
pub(super) fn asked<const N: usize, M: Mechanism<N>>(
    run: &PathRun<N>,
    along: &mut AlongPath<'_, '_, N, M>,
    place: f64,
) -> (f64, u16) {
    let limit = limit_at(&run.speeds, place).source.0;
    (along.site(place, Side::After, &mut Vec::new()).speed, limit)
}
