//! The queue of windows that are planned but not taken yet. Each keeps a checkpoint, from which planning can
//! start again.

use std::collections::VecDeque;

use machine::Mechanism;

use super::front::Checkpoint;
use super::outlet::Outlet;
use super::trials::{Failure, Trials};
use super::{Planning, Window};
use crate::error::PlanError;
use messages::plan::PlanFacts;

/// What a plan comes to.
type FactsOf<'f, const N: usize, M> = dyn Fn(&Planning<'_, N, M>) -> PlanFacts + 'f;

/// How often windows are planned again before one of them can be handed on.
const MOST_AGAIN: usize = 50;

/// A window that has been planned.
struct Planned<const N: usize, M: Mechanism<N>> {
    /// Where it was planned from, and with how much of the limits.
    checkpoint: Checkpoint<N, M>,
    trials: Trials,
    window: Box<Window>,
}

/// Windows on their way from the planning to who takes them.
pub(super) struct Ahead<const N: usize, M: Mechanism<N>> {
    waiting: VecDeque<Planned<N, M>>,
    /// Their setpoints.
    setpoints: usize,
    /// Whether there is no window after these.
    is_over: bool,
    /// Whether a window has been taken since the rate changed.
    has_moved: bool,
    /// How the next window is planned: with less of the limits where it is planned again.
    trials: Trials,
    /// How often one has been planned again since one was taken.
    again: usize,
}

impl<const N: usize, M: Mechanism<N>> Default for Ahead<N, M> {
    fn default() -> Self {
        Self {
            waiting: VecDeque::new(),
            setpoints: 0,
            is_over: false,
            has_moved: true,
            trials: Trials::new(N),
            again: 0,
        }
    }
}

impl<const N: usize, M: Mechanism<N>> Ahead<N, M> {
    /// Plans windows and hands them on until the last is taken.
    pub(super) fn run(
        mut self,
        planning: &mut Planning<'_, N, M>,
        outlet: &mut dyn Outlet,
        facts: &FactsOf<'_, N, M>,
    ) -> Result<(), PlanError> {
        loop {
            if outlet.is_abandoned() {
                return Err(PlanError::Abandoned);
            }
            self.heed_rate(planning, outlet);
            self.hand_on(planning, outlet);
            let has_room = !self.is_ready(planning) || self.setpoints < outlet.ahead();
            if !self.is_over && has_room {
                self.plan_next(planning, outlet, facts)?;
            } else if self.waiting.is_empty() {
                return Ok(());
            } else {
                outlet.wait();
            }
        }
    }

    /// Plans what is still here anew where the job shall be faster or slower, once for each window that is
    /// taken: a rate that changes all the time must not hold the job up.
    fn heed_rate(&mut self, planning: &mut Planning<'_, N, M>, outlet: &mut dyn Outlet) {
        let rate = outlet.rate();
        if !self.has_moved || rate == planning.rate() {
            return;
        }
        let count = self.waiting.len();
        if let Some(Planned { checkpoint, .. }) = self.waiting.pop_front() {
            planning.restore(checkpoint);
            outlet.forget(count);
            *self = Self::default();
        }
        self.has_moved = false;
        planning.set_rate(rate);
    }

    /// Whether the oldest window can be handed on: all samples that it has a part in have been checked, and
    /// there is another to go on from, unless it is the last.
    fn is_ready(&self, planning: &Planning<'_, N, M>) -> bool {
        let Some(oldest) = self.waiting.front() else { return false };
        let is_checked = oldest.window.needed <= planning.sampled();
        self.is_over || (is_checked && self.waiting.len() > 1)
    }

    /// Hands on what there is room for.
    fn hand_on(&mut self, planning: &Planning<'_, N, M>, outlet: &mut dyn Outlet) {
        while self.is_ready(planning) {
            let Some(Planned { checkpoint, trials, window }) = self.waiting.pop_front() else {
                return;
            };
            let count = window.setpoints.len();
            if let Err(window) = outlet.take(window) {
                self.waiting.push_front(Planned { checkpoint, trials, window });
                return;
            }
            self.setpoints -= count;
            self.has_moved = true;
            self.again = 0;
        }
    }

    /// Plans the next window, or one before it again where only that can mend what the next would break.
    fn plan_next(
        &mut self,
        planning: &mut Planning<'_, N, M>,
        outlet: &mut dyn Outlet,
        facts: &FactsOf<'_, N, M>,
    ) -> Result<(), PlanError> {
        let checkpoint = planning.checkpoint();
        planning.release(self.waiting.front().map_or(&checkpoint, |oldest| &oldest.checkpoint));
        let mut trials = core::mem::replace(&mut self.trials, Trials::new(N));
        let may_go_back = !self.waiting.is_empty() && self.again < MOST_AGAIN;
        let abandoned = || outlet.is_abandoned();
        match planning.next_window(&checkpoint, &mut trials, may_go_back, &abandoned) {
            Ok(Some(window)) => {
                self.setpoints += window.setpoints.len();
                outlet.note(&window);
                let window = Box::new(window);
                self.waiting.push_back(Planned { checkpoint, trials, window });
                outlet.heed(&|| facts(planning), false);
            }
            Ok(None) => {
                self.is_over = true;
                outlet.heed(&|| facts(planning), true);
            }
            Err(Failure::Here(error)) => return Err(error),
            Err(Failure::Before(error)) => self.go_back(error, planning, outlet)?,
        }
        Ok(())
    }

    /// Goes back to the window in which `error` says that a limit is broken, or to one before it where that
    /// cannot mend it, and leaves it less of that limit.
    fn go_back(
        &mut self,
        error: PlanError,
        planning: &mut Planning<'_, N, M>,
        outlet: &mut dyn Outlet,
    ) -> Result<(), PlanError> {
        let PlanError::Limit { violation, .. } = &error else { return Err(error) };
        let mends = |planned: &mut Planned<N, M>| {
            planned.checkpoint.time() <= violation.time
                && !planned.window.is_fixed
                && planning.tighten(&mut planned.trials, violation)
        };
        let Some(index) = self.waiting.iter_mut().rposition(mends) else { return Err(error) };
        let mut again = self.waiting.drain(index..);
        let Some(Planned { checkpoint, trials, window }) = again.next() else {
            return Err(error);
        };
        let others: Vec<usize> = again.map(|planned| planned.window.setpoints.len()).collect();
        self.setpoints -= window.setpoints.len() + others.iter().sum::<usize>();
        outlet.forget(1 + others.len());
        planning.restore(checkpoint);
        self.trials = trials;
        self.again += 1;
        Ok(())
    }
}
