//! A path that is under way.

use core::ops::Range;
use std::sync::Arc;

use machine::Mechanism;

use super::Planning;
use super::speeds::limit_at;
use crate::geometry::contour::{Contour, Demand};
use crate::geometry::path::Path;
use crate::joint_space::configuration::Configuration;
use crate::law::End;
use crate::law::time_law::TimeLaw;
use crate::limits::along::SpeedLimit;

/// The way that is added to what surely leads to rest [m], and how long it may take at most [s].
const SLOW_ROOM: f64 = 1e-5;
const SLOW_TIME: f64 = 0.05;

/// A path that is under way.
#[derive(Debug, Clone)]
pub(super) struct PathRun<const N: usize> {
    pub(super) contour: Arc<Contour>,
    pub(super) path: Arc<Path>,
    pub(super) trail: Arc<Vec<(f64, Configuration<N>)>>,
    pub(super) speeds: Arc<Vec<SpeedLimit>>,
    /// Where the next window begins [m], and how.
    pub(super) at: f64,
    pub(super) begin: End,
    /// How the path ends.
    pub(super) exit: End,
    /// The speed that its joints were smoothed for [m/s]; `None` for as wide as they may be.
    pub(super) smoothed_for: Option<f64>,
    /// The speed that it must keep all along, where the job leaves it open [m/s].
    pub(super) most: Option<f64>,
    /// The one speed of the path, where it has one [m/s].
    pub(super) even: Option<f64>,
    /// Whether the power follows the speed whatever the policy.
    pub(super) follows: bool,
    /// How far the next window goes, and at least [m].
    pub(super) reach: f64,
    pub(super) least_reach: f64,
    /// The way to rest from where the next window begins.
    pub(super) fallback: Option<TimeLaw>,
}

impl<const N: usize> PathRun<N> {
    /// Line of the job file at a place [m].
    pub(super) fn line_at(&self, place: f64) -> u64 {
        let demands = self.contour.demands();
        let after = demands.partition_point(|demand| demand.from <= place);
        demands.get(after.max(1) - 1).map_or(0, |demand| demand.line)
    }

    /// What a stop surely takes [m].
    pub(super) fn stopping_room(&self) -> f64 {
        10.0 * self.least_reach
    }

    /// What the job asks for where it marks something between two places, each with the middle of what lies
    /// between them [m] and the speed limit there [m/s].
    pub(super) fn lit_within(
        &self,
        places: Range<f64>,
    ) -> impl Iterator<Item = (&Demand, f64, f64)> + '_ {
        let demands = self.contour.demands();
        let first = demands.partition_point(|demand| demand.from <= places.start).max(1) - 1;
        let after = demands.partition_point(|demand| demand.from < places.end).max(first + 1);
        let ends = demands.iter().skip(first + 1).map(|demand| demand.from).chain([f64::INFINITY]);
        let within = demands[first..after.min(demands.len())].iter().zip(ends);
        within.filter(|(demand, _)| demand.power > 0.0).map(move |(demand, end)| {
            let middle = (demand.from.max(places.start) + end.min(places.end)) / 2.0;
            (demand, middle, limit_at(&self.speeds, middle).speed)
        })
    }
}

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    pub(super) fn run(
        &self,
        contour: Arc<Contour>,
        path: Path,
        trail: Vec<(f64, Configuration<N>)>,
        speeds: Vec<SpeedLimit>,
    ) -> PathRun<N> {
        let top = speeds.iter().map(|speed| speed.speed).fold(0.0, f64::max);
        let least_reach = self.least_reach(&speeds);
        let fraction = if path.is_straight() { 1.0 } else { 0.5 };
        PathRun {
            contour,
            path: Arc::new(path),
            trail: Arc::new(trail),
            speeds: Arc::new(speeds),
            at: 0.0,
            begin: End::Rest,
            exit: End::Rest,
            smoothed_for: None,
            most: None,
            even: None,
            follows: true,
            reach: (fraction * top).max(10.0 * least_reach),
            least_reach,
            fallback: None,
        }
    }

    /// The least way of a window, a tenth of what surely leads to rest [m].
    pub(super) fn least_reach(&self, speeds: &[SpeedLimit]) -> f64 {
        let limits = &self.limits.path;
        let top = speeds.iter().map(|speed| speed.speed).fold(0.0, f64::max);
        // Twice the way to rest, at least, and some more; of a slow path no more than a moment of it, as windows are
        // worked out by time.
        let room = SLOW_ROOM.min(top * SLOW_TIME);
        let rest = top * top / limits.acceleration + top * limits.acceleration / limits.jerk + room;
        rest * 0.1
    }
}
