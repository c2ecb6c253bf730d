//! Stretches that can be passed at the speed asked for. They need no optimisation: only their length is
//! sought, and a way to rest from their end.

use machine::Mechanism;

use super::Planning;
use super::path_run::PathRun;
use super::speeds::asked;
use super::timing::Timed;
use crate::law::End;
use crate::law::time_law::TimeLaw;
use crate::law::windows::{between, keeps_even};
use crate::limits::along::AlongPath;

/// The fraction of the speed asked for at which a plateau runs: a little less, so that the profile before it
/// can reach it.
const SHARE: f64 = 0.999;

/// The time of one step along a plateau, and of the longest that is handed on [s].
const STEP: f64 = 0.5;
pub(super) const LONGEST: f64 = 2.0;

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// The next stretch of `run` at an even speed, where it begins at one and can go on at it for long
    /// enough to be worth it.
    pub(super) fn plateau(run: &PathRun<N>, along: &mut AlongPath<'_, '_, N, M>) -> Option<Timed> {
        let End::Moving { speed, acceleration: 0.0 } = run.begin else { return None };
        if speed < 0.99 * SHARE * asked(run, along, run.at).0 {
            return None;
        }
        let most = farthest(run, run.at).min(run.at + speed * LONGEST);
        let step = speed * STEP;
        let mut to = run.at;
        while to + step <= most && keeps_even(along, to, to + step, speed) {
            to += step;
        }
        if to <= run.at {
            return None;
        }
        let next = End::Moving { speed, acceleration: 0.0 };
        let fallback = rest_from(run, along, to, next)?;
        let source = asked(run, along, run.at).1;
        let law = TimeLaw::even(run.at, to, speed, source);
        Some(Timed { law, next: Some(next), fallback: Some(fallback) })
    }

    /// The next stretch of `run` up to `to`, where a plateau begins.
    pub(super) fn onto_plateau(
        run: &PathRun<N>,
        along: &mut AlongPath<'_, '_, N, M>,
        to: f64,
    ) -> Option<Timed> {
        let speed = SHARE * asked(run, along, to).0;
        let end = to + speed * STEP;
        if speed.is_nan()
            || speed <= 0.0
            || end > farthest(run, to)
            || !keeps_even(along, to, end, speed)
        {
            return None;
        }
        let next = End::Moving { speed, acceleration: 0.0 };
        let fallback = rest_from(run, along, to, next)?;
        let law = between(along, run.at, to, [run.begin, next], run.fallback.as_ref()).ok()?;
        Some(Timed { law, next: Some(next), fallback: Some(fallback) })
    }
}

/// How far a plateau at `place` may go [m]: as far as the same speed is asked for, and the way to rest
/// from the end of the path.
fn farthest<const N: usize>(run: &PathRun<N>, place: f64) -> f64 {
    let after = run.speeds.partition_point(|speed| speed.from <= place);
    let changes = run.speeds.get(after).map_or(f64::INFINITY, |speed| speed.from);
    changes.min(run.path.length() - 1.01 * run.stopping_room())
}

/// The way to rest from `place`; `None` where the limits leave none.
pub(super) fn rest_from<const N: usize, M: Mechanism<N>>(
    run: &PathRun<N>,
    along: &mut AlongPath<'_, '_, N, M>,
    place: f64,
    begin: End,
) -> Option<TimeLaw> {
    between(along, place, place + run.stopping_room(), [begin, End::Rest], None).ok()
}
