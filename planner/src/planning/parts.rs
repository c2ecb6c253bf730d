//! Paths that are too long to be known whole: the next part of one is put behind what is left of it
//! before planning looks that far, and what lies behind the tool is let go.

use std::sync::Arc;

use machine::Mechanism;

use super::path_run::PathRun;
use super::speeds::{limits_from, moved_back};
use super::{Draft, Planning};
use crate::error::PlanError;
use crate::geometry::contour::Contour;
use crate::joint_space::configuration::{Configuration, trail};
use crate::law::windows::keeps_even;
use crate::limits::along::AlongPath;
use crate::limits::tightening::Tightening;

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
        let tool = path.tool(0.0, [1.0, 0.0, 0.0]);
        let start = self.joints_at(&tool, &run.trail[near].1).ok()?;
        let trail = trail(&self.limits, &start, &path).ok()?;
        let within = |(_, now): &(f64, Configuration<N>)| self.is_within_travel(now);
        let end = path.end_tool([1.0, 0.0, 0.0]);
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
}
