//! Paths at one speed: how they are entered, timed and left.

use std::sync::Arc;

use machine::Mechanism;

use super::entry::Entry;
use super::path_run::PathRun;
use super::speeds::limit_before;
use super::timing::Timed;
use super::{Draft, Planning};
use crate::drawing::Note;
use crate::error::PlanError;
use crate::geometry::contour::Contour;
use crate::geometry::path::Path;
use crate::joint_space::configuration::{
    Configuration, PathFunction, Refused, candidates, trail, walk,
};
use crate::law::End;
use crate::law::row::Side;
use crate::law::time_law::TimeLaw;
use crate::law::windows::{even_speed, keeps_even};
use crate::limits::along::AlongPath;
use crate::limits::motion_limits::Scope;
use crate::limits::tightening::Tightening;

/// How much of the speed that an end allows it is passed at, so that its limits leave room to
/// begin to change it.
pub(super) const END_SHARE: f64 = 0.995;

/// How much slower an end is tried that cannot be met, and how often before it is met at rest.
pub(super) const END_SLOWER: f64 = 0.8;

pub(super) const END_TRIALS: usize = 14;

/// How often another configuration is timed where the one before cannot be reached.
const CONFIGURATIONS: usize = 7;

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// A path at one speed, entered and left at it.
    pub(super) fn begin_constant(
        &mut self,
        contour: Arc<Contour>,
        draft: &mut Draft<'_>,
    ) -> Result<(), PlanError> {
        let top = contour.top_speed(&self.limits.path);
        let speeds = self.speed_limits(&contour);
        let fastest = speeds.iter().map(|speed| speed.speed).fold(0.0, f64::max);
        let is_open = contour.demands().iter().all(|demand| demand.speed.is_none());
        let most = (is_open && top < fastest).then_some(top);
        let speeds = self.limits_for(&contour, most);
        let fastest = speeds.iter().map(|speed| speed.speed).fold(0.0, f64::max);
        let smoothed_for = Some(fastest.min(top));
        let path = contour.trace(smoothed_for, &self.limits.path);
        let length = path.length();
        let middle = |share: f64| path.tool(length * share, [1.0, 0.0, 0.0]);
        let mut wanted = match self.wanted(&path, &middle) {
            Ok(wanted) => wanted,
            Err(cause) => return self.in_parts(&contour, cause, draft),
        };
        let mut ends = [true; 2];
        for _ in 0..CONFIGURATIONS {
            let trail = trail(&self.limits, &wanted, &path)
                .map_err(|cause| self.refusal(Refused::Kinematics(cause)))?;
            let mut run = self.run(contour.clone(), path.clone(), trail, speeds.clone());
            (run.follows, run.smoothed_for, run.most) = (false, smoothed_for, most);
            let evenly = speeds.len() == 1 && fastest <= top;
            let timed = self
                .time_constant(&mut run, evenly, &mut ends, draft.shares)
                .map_err(|cause| self.refusal(cause))?;
            match self.enter(&run, &middle, draft.shares) {
                Ok(entry) if entry.start.is_like(&wanted) => {
                    return self.add_constant(run, timed, entry, draft);
                }
                Ok(entry) => wanted = entry.start,
                // There is no room to come to speed.
                Err(_) if ends[0] => ends[0] = false,
                Err(cause) => return Err(self.refusal(cause)),
            }
        }
        Err(self.refusal(Refused::NoConfiguration { tried: CONFIGURATIONS }))
    }

    fn add_constant(
        &mut self,
        run: PathRun<N>,
        timed: Timed,
        entry: Entry<N>,
        draft: &mut Draft<'_>,
    ) -> Result<(), PlanError> {
        if run.follows {
            let text =
                "marked with power in proportion to the speed near its ends: there is no room to \
                        come to speed in the dark"
                    .to_owned();
            let told = |notes: &[Note]| notes.iter().any(|note| note.text == text);
            if !told(&self.account.notes) && !told(&draft.notes) {
                draft.notes.push(Note { line: run.contour.line, text });
            }
        }
        let stroke = self.front.light.stroke + 1;
        for (duration, motion) in entry.motions {
            self.push(duration, motion, stroke, draft);
        }
        self.front.moving = None;
        self.front.now = entry.start;
        self.add(run, timed, draft)
    }

    /// The configuration at the start of a path from which it can be gone, the nearest.
    fn wanted(&self, path: &Path, middle: &PathFunction<'_>) -> Result<Configuration<N>, Refused> {
        if self.limits.scope == Scope::PathAlone {
            return Ok(self.front.now);
        }
        let first = path.tool(0.0, [1.0, 0.0, 0.0]);
        if self.limits.mechanism.is_linear() {
            let start = self.joints_at(&first, &self.front.now)?;
            walk(&self.limits, start, &[middle])?.within(&self.limits)?;
            return Ok(start);
        }
        let found = candidates(&self.limits, &self.front.now, &first, &[middle])?;
        found.first().map(|(start, _)| *start).ok_or(Refused::NoConfiguration { tried: 0 })
    }

    /// Times the first window of a path that is entered and left at speed, as far as `ends` say; sets
    /// them to false where it must be at rest.
    fn time_constant(
        &self,
        run: &mut PathRun<N>,
        evenly: bool,
        ends: &mut [bool; 2],
        shares: &Tightening,
    ) -> Result<Timed, Refused> {
        let length = run.path.length();
        let fastest = run.speeds[0].speed;
        let mut speeds = [0.0; 2];
        {
            let mut along =
                AlongPath::new(&self.limits, &run.path, &run.speeds, &run.trail, shares);
            along.is_tool_free = true;
            let even = fastest * shares.speed;
            if evenly && *ends == [true; 2] && keeps_even(&mut along, 0.0, length, even) {
                run.even = Some(even);
            }
            if let Some(cause) = along.error {
                return Err(Refused::Kinematics(cause));
            }
            (along.is_tool_free, along.is_exact) = (false, true);
            for (end, (place, side)) in
                [(0.0, Side::After), (length, Side::Before)].into_iter().enumerate()
            {
                let most = self.limits.path.rapid.max(self.limits.path.speed) * 2.0;
                let allowed = even_speed(&mut along, place, side, most);
                let demand =
                    if end == 0 { run.speeds[0] } else { run.speeds[run.speeds.len() - 1] };
                let asked = shares.speed * demand.speed;
                // The speed asked for needs no room to begin to change: it is held.
                let is_asked = allowed >= asked * (1.0 - 1e-9);
                speeds[end] = if is_asked { asked } else { END_SHARE * allowed };
            }
        }
        if let Some(speed) = run.even {
            run.begin = End::Moving { speed, acceleration: 0.0 };
            run.exit = run.begin;
            // The way to rest is there from the end of the path at this speed, or else from rest.
            let law = TimeLaw::even(0.0, length, speed, 0);
            let keeps = || !self.tighten_tail(run, &law, &mut shares.clone());
            let leaves = || self.can_leave(run, speed, shares);
            if self.front.goes_on || (keeps() && leaves()) {
                return self.time(run, shares)?.map_err(|_| Refused::NoConfiguration { tried: 1 });
            }
            run.even = None;
        }
        let mut trials = [0; 2];
        loop {
            for end in 0..2 {
                ends[end] &= trials[end] < END_TRIALS;
            }
            let [begin, exit] = [0, 1].map(|end| match ends[end] {
                true => End::Moving { speed: speeds[end], acceleration: 0.0 },
                false => End::Rest,
            });
            (run.begin, run.exit) = (begin, exit);
            run.follows = ends.contains(&false);
            // What goes on has no end yet.
            if ends[1] && !self.front.goes_on && !self.can_leave(run, speeds[1], shares) {
                trials[1] += 2;
                speeds[1] *= END_SLOWER * END_SLOWER;
                continue;
            }
            match self.time(run, shares)? {
                Ok(timed) => return Ok(timed),
                Err(found) => {
                    let end = usize::from(found.at_end);
                    let end = if ends[end] { end } else { 1 - end };
                    if !ends[end] {
                        return Err(Refused::NoConfiguration { tried: 1 });
                    }
                    speeds[end] *= if trials[end] == 0 { END_SHARE } else { END_SLOWER };
                    trials[end] += 1;
                }
            }
        }
    }
}

/// How much slower the end of a path is passed where it cannot be left at its speed, and how often
/// that is tried.
const SLOWER: f64 = 0.8;

const TRIALS: usize = 20;

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
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
        if !run.contour.is_entered_at_speed() {
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
}
