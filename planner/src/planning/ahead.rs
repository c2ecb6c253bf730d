//! The queue of windows that are planned but not taken yet. Each keeps a checkpoint, from which planning can
//! start again.

use std::collections::VecDeque;

use machine::Mechanism;

use super::run::Outlet;
use super::{Checkpoint, Failure, Planning, Trials, Window};
use crate::error::PlanError;
use messages::plan::PlanFacts;

/// What a plan comes to.
type FactsOf<'f, const N: usize, M> = dyn Fn(&Planning<'_, N, M>) -> PlanFacts + 'f;

/// Windows on their way from the planning to who takes them.
pub(super) struct Ahead<const N: usize, M: Mechanism<N>> {
    /// Each with where it was planned from.
    waiting: VecDeque<(Checkpoint<N, M>, Box<Window>)>,
    /// Their setpoints.
    setpoints: usize,
    /// Whether there is no window after these.
    is_over: bool,
    /// Whether a window has been taken since the rate changed.
    has_moved: bool,
    /// The window that was planned again last, by its start, and how.
    again: Option<(f64, Trials)>,
}

impl<const N: usize, M: Mechanism<N>> Default for Ahead<N, M> {
    fn default() -> Self {
        Self {
            waiting: VecDeque::new(),
            setpoints: 0,
            is_over: false,
            has_moved: true,
            again: None,
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
            self.hand_on(outlet);
            let has_room = self.waiting.len() < 2 || self.setpoints < outlet.ahead();
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
        if let Some((checkpoint, _)) = self.waiting.pop_front() {
            planning.restore(checkpoint);
            outlet.forget(count);
            *self = Self::default();
        }
        self.has_moved = false;
        planning.set_rate(rate);
    }

    /// Hands on what there is room for. The newest window stays until the next is known: only then all of
    /// its samples have been checked.
    fn hand_on(&mut self, outlet: &mut dyn Outlet) {
        while self.is_over || self.waiting.len() > 1 {
            let Some((checkpoint, window)) = self.waiting.pop_front() else { return };
            let count = window.setpoints.len();
            if let Err(window) = outlet.take(window) {
                self.waiting.push_front((checkpoint, window));
                return;
            }
            self.setpoints -= count;
            self.has_moved = true;
        }
    }

    /// Plans the next window, or the last one again where only that can mend what the next would break.
    fn plan_next(
        &mut self,
        planning: &mut Planning<'_, N, M>,
        outlet: &mut dyn Outlet,
        facts: &FactsOf<'_, N, M>,
    ) -> Result<(), PlanError> {
        let checkpoint = planning.checkpoint();
        planning.release(self.waiting.front().map_or(&checkpoint, |(oldest, _)| oldest));
        let trials = self.trials_at(checkpoint.time());
        let may_go_back = !self.waiting.is_empty();
        match planning.next_window(trials, may_go_back, &|| outlet.is_abandoned()) {
            Ok(Some(window)) => {
                self.setpoints += window.setpoints.len();
                outlet.note(&window);
                self.waiting.push_back((checkpoint, Box::new(window)));
                outlet.heed(&|| facts(planning), false);
            }
            Ok(None) => {
                self.is_over = true;
                outlet.heed(&|| facts(planning), true);
            }
            Err(Failure::Here(error)) => return Err(error),
            Err(Failure::Before(error)) => {
                let Some((before, window)) = self.waiting.pop_back() else { return Err(error) };
                let mut trials = self.trials_at(before.time());
                if !planning.tighten(&mut trials, &error) {
                    return Err(error);
                }
                self.again = Some((before.time(), trials));
                self.setpoints -= window.setpoints.len();
                outlet.forget(1);
                planning.restore(before);
            }
        }
        Ok(())
    }

    /// How the window that begins at `start` [s] is planned: less and less of the limits each time.
    fn trials_at(&self, start: f64) -> Trials {
        match &self.again {
            Some((at, trials)) if *at == start => trials.clone(),
            _ => Trials::new(N),
        }
    }
}
