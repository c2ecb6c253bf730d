//! Paths that are too long to be known whole: the next part of one is put behind what is left of it
//! before planning looks that far, and what lies behind the tool is let go.

use std::sync::Arc;

use machine::Mechanism;

use super::paths::{END_SHARE, PathRun};
use super::windows::WINDOW;
use super::{Draft, Planning, plateau};
use crate::error::PlanError;
use crate::geometry::contour::Contour;
use crate::joint_space::configuration::{Configuration, trail};
use crate::law::End;
use crate::law::row::Side;
use crate::law::windows::{even_speed, keeps_even};
use crate::light::Policy;
use crate::limits::along::{AlongPath, SpeedLimit};
use crate::limits::tightening::Tightening;

/// How much slower the end of a path is passed where it cannot be left at its speed, and how often
/// that is tried.
const SLOWER: f64 = 0.8;
const TRIALS: usize = 20;

/// How much longer than it takes at full acceleration a change of speed may take.
const GENTLE: f64 = 1.5;

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// `contour` with as many of its next parts behind it as planning looks ahead.
    pub(super) fn with_next_parts(
        &mut self,
        contour: Arc<Contour>,
    ) -> Result<Arc<Contour>, PlanError> {
        let mut contour = contour;
        self.front.goes_on = true;
        while contour.length() < self.look_ahead(&self.speed_limits(&contour)) {
            let Some(next) = self.operations.next_part(self.front.next)? else { break };
            self.take_part(&next);
            contour = Arc::new(contour.followed_by(0.0, &next).0);
        }
        self.front.goes_on = self.operations.next_part(self.front.next)?.is_some();
        Ok(contour)
    }

    /// Puts the next parts behind the path under way, so that planning can look far enough ahead.
    pub(super) fn lengthen(
        &mut self,
        run: &mut PathRun<N>,
        draft: &mut Draft<'_>,
    ) -> Result<(), PlanError> {
        while self.front.goes_on && run.path.length() - run.at < self.look_ahead(&run.speeds) {
            self.front.goes_on = false;
            // Where the joints cannot go on it ends here, and the next part is a path of its own.
            if let Some(next) = self.operations.next_part(self.front.next)? {
                self.stays_inside(&next)?;
                if let Some(longer) = self.longer(run, &next, draft) {
                    *run = longer;
                    self.take_part(&next);
                    self.front.goes_on = self.operations.next_part(self.front.next)?.is_some();
                }
            }
            if !self.front.goes_on {
                self.choose_exit(run, draft.shares);
            }
        }
        Ok(())
    }

    /// How far ahead of the tool a path must be known [m].
    fn look_ahead(&self, speeds: &[SpeedLimit]) -> f64 {
        let limits = &self.limits.path;
        let top = speeds.iter().map(|speed| speed.speed).fold(0.0, f64::max);
        let stop = top * top / limits.acceleration + top * limits.acceleration / limits.jerk;
        top * (plateau::LONGEST + 2.0 * WINDOW) + 20.0 * (stop + 1e-5)
    }

    /// Counts the next part as one of the path under way.
    fn take_part(&mut self, next: &Contour) {
        self.go_as_low_as(next);
        self.front.next += 1;
        self.front.estimated += self.estimate_of(next);
        self.front.place = next.end().point;
    }

    /// `run` with `next` behind it; `None` where the joints cannot go there without being turned back
    /// first.
    fn longer(
        &self,
        run: &PathRun<N>,
        next: &Contour,
        draft: &mut Draft<'_>,
    ) -> Option<PathRun<N>> {
        let (contour, left_out) = run.contour.followed_by(run.at, next);
        let path = contour.trace(run.smoothed_for, &self.limits.path);
        let near = run.trail.partition_point(|(at, _)| *at <= left_out).max(1) - 1;
        let tool = path.at(0.0).motion(1.0, 0.0, 0.0);
        let start = self.joints_at(&tool, &run.trail[near].1).ok()?;
        let trail = trail(&self.limits, &start, &path).ok()?;
        let within = |(_, now): &(f64, Configuration<N>)| self.is_within_travel(now);
        let end = path.end().motion(1.0, 0.0, 0.0);
        let end = self.joints_at(&end, &trail.last()?.1).ok()?;
        if !trail.iter().all(within) || !self.is_within_travel(&end) {
            return None;
        }
        let was_lit = run.contour.demands().last().is_some_and(|demand| demand.power > 0.0);
        if run.at > 0.0 {
            self.note_drawn(next, was_lit, draft);
        }
        let known = run.path.length() - left_out;
        // What is known already stays: it may be more than is asked for, where the tool has it.
        let mut speeds = moved_back(&run.speeds, left_out);
        speeds.retain(|limit| limit.from < known);
        speeds.extend(limits_from(&self.limits_for(&contour, run.most), known));
        let mut longer = PathRun {
            at: run.at - left_out,
            fallback: run.fallback.as_ref().map(|law| law.moved_back(left_out)),
            contour: Arc::new(contour),
            path: Arc::new(path),
            trail: Arc::new(trail),
            speeds: Arc::new(speeds),
            ..run.clone()
        };
        longer.least_reach = self.least_reach(&longer.speeds);
        longer.even = longer.even.filter(|_| {
            longer.speeds.iter().all(|limit| limit.speed == run.speeds[0].speed)
                && self.goes_evenly(
                    &longer,
                    longer.at.max(known - run.contour.last_length()),
                    draft.shares,
                )
        });
        Some(longer)
    }

    /// Whether `run` can be gone from `place` on at its one speed.
    fn goes_evenly(&self, run: &PathRun<N>, place: f64, shares: &Tightening) -> bool {
        let Some(speed) = run.even else { return false };
        let mut along = AlongPath::new(&self.limits, &run.path, &run.speeds, &run.trail, shares);
        along.is_tool_free = true;
        keeps_even(&mut along, place, run.path.length(), speed)
    }

    fn is_within_travel(&self, now: &Configuration<N>) -> bool {
        self.limits.axes.iter().zip(now.joints.iter()).all(|(axis, joint)| {
            (axis.limits.position[0]..=axis.limits.position[1]).contains(joint)
        })
    }

    /// How a path ends whose end was not known when it began: at its speed where that can be, as the
    /// policy has it, else at rest.
    pub(super) fn choose_exit(&self, run: &mut PathRun<N>, shares: &Tightening) {
        run.exit = End::Rest;
        if let Some(speed) = run.even
            && self.can_leave(run, speed, shares)
        {
            run.exit = End::Moving { speed, acceleration: 0.0 };
            return;
        }
        run.even = None;
        if run.contour.policy == Policy::Proportional || !run.contour.is_lit() {
            return;
        }
        let length = run.path.length();
        let mut along = AlongPath::new(&self.limits, &run.path, &run.speeds, &run.trail, shares);
        along.is_exact = true;
        let most = self.limits.path.rapid.max(self.limits.path.speed) * 2.0;
        let allowed = even_speed(&mut along, length, Side::Before, most);
        let asked = shares.speed * limit_before(&run.speeds, length).speed;
        let mut speed = if allowed >= asked * (1.0 - 1e-9) { asked } else { END_SHARE * allowed };
        for _ in 0..TRIALS {
            if self.can_leave(run, speed, shares) {
                run.exit = End::Moving { speed, acceleration: 0.0 };
                return;
            }
            speed *= SLOWER;
        }
        run.follows = true;
    }

    /// Marks at `rate` times the speeds asked for from here on, 1 as the job has them.
    pub(crate) fn set_rate(&mut self, rate: f64) {
        if rate == self.rate {
            return;
        }
        self.rate = rate;
        let Some(mut run) = self.front.run.take() else { return };
        let mut speeds = self.limits_for(&run.contour, run.most);
        if let Some(speed) = run.even
            && !self.front.goes_on
        {
            // Near its end a path at one speed is ended at it, of which it is known that it can be left.
            let most = speeds.iter().map(|limit| limit.speed).fold(speed, f64::max);
            if run.path.length() - run.at < self.way_to_slow_down(most) {
                self.front.run = Some(run);
                return;
            }
        }
        if let End::Moving { speed, acceleration } = run.begin {
            // What it still gains before its acceleration is gone.
            let quickening = acceleration.max(0.0);
            let gained = quickening * quickening / self.limits.path.jerk;
            let to = run.at + self.way_to_slow_down(speed + gained);
            keep_up(&mut speeds, run.at, to, speed + gained);
        }
        run.least_reach = self.least_reach(&speeds);
        run.speeds = Arc::new(speeds);
        run.even = None;
        if !self.front.goes_on && matches!(run.exit, End::Moving { .. }) {
            self.choose_exit(&mut run, &Tightening::none(N));
        }
        self.front.run = Some(run);
    }

    /// A way on which the tool surely comes from `speed` to any lower one, or from any lower one to it
    /// [m].
    fn way_to_slow_down(&self, speed: f64) -> f64 {
        let limits = &self.limits.path;
        let time = speed / limits.acceleration + limits.acceleration / limits.jerk;
        GENTLE * speed * time
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
fn moved_back(speeds: &[SpeedLimit], distance: f64) -> Vec<SpeedLimit> {
    let first = speeds.partition_point(|limit| limit.from <= distance).max(1) - 1;
    let moved =
        |limit: &SpeedLimit| SpeedLimit { from: (limit.from - distance).max(0.0), ..*limit };
    speeds[first..].iter().map(moved).collect()
}

/// Those from `place` on [m].
fn limits_from(speeds: &[SpeedLimit], place: f64) -> Vec<SpeedLimit> {
    let first = speeds.partition_point(|limit| limit.from <= place).max(1) - 1;
    let kept = |limit: &SpeedLimit| SpeedLimit { from: limit.from.max(place), ..*limit };
    speeds[first..].iter().map(kept).collect()
}

/// Lets the speeds from `from` to `to` [m] be at least `least` [m/s]: what the tool has it cannot lose at
/// once.
fn keep_up(speeds: &mut Vec<SpeedLimit>, from: f64, to: f64, least: f64) {
    let mut kept = Vec::with_capacity(speeds.len() + 2);
    for (index, limit) in speeds.iter().enumerate() {
        let end = speeds.get(index + 1).map_or(f64::INFINITY, |next| next.from);
        for (start, stop) in [(limit.from, from), (limit.from.max(from), to), (to, end)] {
            let (start, stop) = (start.max(limit.from), stop.min(end));
            if stop <= start {
                continue;
            }
            let is_kept = start >= from && stop <= to;
            let speed = if is_kept { limit.speed.max(least) } else { limit.speed };
            kept.push(SpeedLimit { from: start, speed, ..*limit });
        }
    }
    *speeds = kept;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::limit_id::LimitId;

    #[test]
    fn a_speed_that_the_tool_has_is_kept_for_a_while() {
        let limit = |from, speed| SpeedLimit { from, speed, source: LimitId::FEED };
        let mut speeds = vec![limit(0.0, 1.0), limit(2.0, 3.0)];
        keep_up(&mut speeds, 1.0, 2.5, 2.0);
        let expected = [limit(0.0, 1.0), limit(1.0, 2.0), limit(2.0, 3.0), limit(2.5, 3.0)];
        assert_eq!(speeds, expected);
    }
}
