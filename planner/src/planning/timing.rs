//! The time law of the next stretch of a path, and what is left of it as the way to rest.

use machine::Mechanism;

use super::constant::{END_SHARE, END_SLOWER, END_TRIALS};
use super::path_run::PathRun;
use super::tail::TAIL_TRIALS;
use super::{Planning, plateau};
use crate::joint_space::configuration::Refused;
use crate::law::time_law::TimeLaw;
use crate::law::windows::{between, keeps_even, straight};
use crate::law::{End, Infeasible};
use crate::limits::along::AlongPath;
use crate::limits::tightening::Tightening;

/// The time that a window should take [s].
pub(super) const WINDOW: f64 = 1.2;

/// The part of a window that is handed on, at least and at most; the rest, in which it comes to rest, is
/// planned anew with what follows.
const HANDED_ON: [f64; 2] = [0.6, 0.85];

/// The longest law of a whole straight path that is one window [s]: what is longer goes by windows, so
/// that an override acts soon.
const LONGEST_STRAIGHT: f64 = 4.0;

/// How long the tool goes on at its speed where it cannot change it yet [s].
const STEP: f64 = 0.05;

/// A stretch of a path, timed.
pub(super) struct Timed {
    pub(super) law: TimeLaw,
    /// How the next stretch begins; `None` where the path ends.
    pub(super) next: Option<End>,
    /// From there to rest.
    pub(super) fallback: Option<TimeLaw>,
}

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// Times the next stretch of `run`, such that its end keeps the limits.
    pub(super) fn time(
        &self,
        run: &PathRun<N>,
        shares: &Tightening,
    ) -> Result<Result<Timed, Infeasible>, Refused> {
        let mut own = shares.clone();
        let mut timed = self.time_within(run, &own)?;
        for _ in 0..TAIL_TRIALS {
            let Ok(found) = &timed else { break };
            if run.even.is_some() || !self.tighten_tail(run, &found.law, &mut own) {
                break;
            }
            let again = self.time_within(run, &own)?;
            if again.is_ok() || run.at == 0.0 {
                timed = again;
            } else {
                break;
            }
        }
        Ok(timed)
    }

    /// Times the next stretch of `run` as it shall end, or else as it can: with a slower end, with an end
    /// at rest, by the way to rest that is known, or a little way on as it is.
    pub(super) fn time_somehow(
        &self,
        run: &mut PathRun<N>,
        shares: &Tightening,
    ) -> Result<Result<Timed, Infeasible>, Refused> {
        let found = match self.time(run, shares)? {
            Ok(timed) => return Ok(Ok(timed)),
            Err(found) => found,
        };
        let (exit, follows) = (run.exit, run.follows);
        if let (true, End::Moving { speed, .. }) = (found.at_end, exit) {
            let mut speed = speed * END_SHARE;
            for _ in 0..END_TRIALS {
                run.exit = End::Moving { speed, acceleration: 0.0 };
                if self.can_leave(run, speed, shares)
                    && let Ok(timed) = self.time(run, shares)?
                {
                    return Ok(Ok(timed));
                }
                speed *= END_SLOWER;
            }
        }
        if found.at_end || run.fallback.is_none() {
            (run.exit, run.follows) = (End::Rest, true);
            if let Ok(timed) = self.time(run, shares)? {
                return Ok(Ok(timed));
            }
            (run.exit, run.follows) = (exit, follows);
        }
        if let Some(law) = run.fallback.clone() {
            let next = if law.places().end < run.path.length() {
                Some(End::Rest)
            } else {
                run.exit = End::Rest;
                None
            };
            return Ok(Ok(Timed { law, next, fallback: None }));
        }
        Ok(self.step_evenly(run, shares).ok_or(found))
    }

    fn time_within(
        &self,
        run: &PathRun<N>,
        shares: &Tightening,
    ) -> Result<Result<Timed, Infeasible>, Refused> {
        let length = run.path.length();
        let mut along = AlongPath::new(&self.limits, &run.path, &run.speeds, &run.trail, shares);
        let goes_on = self.front.goes_on;
        // What one speed takes too much of, that speed does not mend.
        if let Some(speed) = run.even
            && (run.at == 0.0 || *shares == Tightening::none(N))
        {
            let next = End::Moving { speed, acceleration: 0.0 };
            let to = run.at + speed * WINDOW;
            // The last window begins where there is still room for a stop.
            let to = if goes_on || to + run.stopping_room() < length { to } else { length };
            let law = TimeLaw::even(run.at, to, speed, run.speeds[0].source.0);
            if to >= length {
                return Ok(Ok(Timed { law, next: None, fallback: None }));
            }
            let fallback = plateau::rest_from(run, &mut along, to, next);
            return Ok(Ok(Timed { law, next: Some(next), fallback }));
        }
        let is_whole = !goes_on && run.at == 0.0 && run.begin == End::Rest && run.exit == End::Rest;
        if is_whole && run.path.is_straight() {
            along.is_exact = true;
            if let Some(law) = straight(&mut along, length)
                && law.duration() <= LONGEST_STRAIGHT
            {
                return Ok(Ok(Timed { law, next: None, fallback: None }));
            }
            along.is_exact = false;
        }
        if let Some(timed) = Self::plateau(run, &mut along) {
            return Ok(Ok(timed));
        }
        let ends = !goes_on && length - run.at <= 1.3 * run.reach;
        let to = if ends { length } else { (run.at + run.reach).min(length) };
        let end = if to < length { End::Rest } else { run.exit };
        if to < length
            && let Some(timed) = Self::onto_plateau(run, &mut along, to)
        {
            return Ok(Ok(timed));
        }
        let way = run.fallback.as_ref();
        let law = between(&mut along, run.at, to, [run.begin, end], way);
        if let Some(cause) = along.error {
            return Err(Refused::Kinematics(cause));
        }
        let law = match law {
            Ok(law) => law,
            Err(infeasible) => return Ok(Err(infeasible)),
        };
        if to >= length {
            return Ok(Ok(Timed { law, next: None, fallback: None }));
        }
        let part = 1.0 - run.stopping_room() / (to - run.at);
        Ok(Ok(cut(law, run.at + part.clamp(HANDED_ON[0], HANDED_ON[1]) * (to - run.at))))
    }

    /// A little way on at the speed that the tool has, where there is no other yet: the limits that leave
    /// no room to change it here may do so there, or behind the end.
    fn step_evenly(&self, run: &mut PathRun<N>, shares: &Tightening) -> Option<Timed> {
        let begin @ End::Moving { speed, acceleration: 0.0 } = run.begin else { return None };
        let length = run.path.length();
        let to = (run.at + speed * STEP).min(length);
        let mut along = AlongPath::new(&self.limits, &run.path, &run.speeds, &run.trail, shares);
        along.is_tool_free = true;
        if !keeps_even(&mut along, run.at, to, speed) {
            return None;
        }
        let law = TimeLaw::even(run.at, to, speed, run.speeds[0].source.0);
        if to < length {
            return Some(Timed { law, next: Some(begin), fallback: None });
        }
        if self.front.goes_on || !self.can_leave(run, speed, shares) {
            return None;
        }
        run.exit = begin;
        Some(Timed { law, next: None, fallback: None })
    }
}

/// The part of a law up to `place` that is handed on, and what is left of it as the way to rest.
fn cut(law: TimeLaw, place: f64) -> Timed {
    let (first, rest) = law.split(place);
    if first.is_empty() || rest.is_empty() {
        return Timed { law, next: Some(End::Rest), fallback: None };
    }
    let now = rest.at(0.0);
    let next = if now.velocity > 0.0 {
        End::Moving { speed: now.velocity, acceleration: now.acceleration }
    } else {
        End::Rest
    };
    Timed { law: first, next: Some(next), fallback: Some(rest) }
}
