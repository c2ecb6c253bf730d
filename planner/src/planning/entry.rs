//! How the tool comes to the start of a path: in a flight from where it is, or by way of a rest.

use std::sync::Arc;

use machine::Mechanism;
use machine::kinematics::ToolMotion;

use super::Planning;
use super::path_run::PathRun;
use super::run_in_out::{FAR_BEYOND, FOLLOW_TRIALS, Unfit, state};
use crate::drawing::Turns;
use crate::joint_space::configuration::{Configuration, PathFunction, Refused, candidates, walk};
use crate::joint_space::follow_flight::follow_flight;
use crate::law::End;
use crate::law::flight::{DirectionLimit, Flight, FlightLimits, State};
use crate::limits::motion_limits::Scope;
use crate::limits::tightening::Tightening;
use crate::trajectory::Motion;

/// How the tool comes to the start of a path.
pub(super) struct Entry<const N: usize> {
    pub(super) motions: Vec<(f64, Motion)>,
    /// The configuration at the start of the path.
    pub(super) start: Configuration<N>,
}

impl Entry<0> {
    fn time(motions: &[(f64, Motion)]) -> f64 {
        motions.iter().map(|(time, _)| time).sum()
    }
}

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// Comes to the start of `run` as it begins: in a flight from where the tool is, or from rest.
    pub(super) fn enter(
        &self,
        run: &PathRun<N>,
        middle: &PathFunction<'_>,
        shares: &Tightening,
    ) -> Result<Entry<N>, Refused> {
        let first = run.path.tool(0.0, [1.0, 0.0, 0.0]);
        let End::Moving { speed, .. } = run.begin else {
            return self.enter_from_rest(None, &first, middle, shares);
        };
        let to = state(&run.path.tool(0.0, [speed, 0.0, 0.0]));
        let flown =
            (self.task.turns == Turns::Fly).then(|| self.fly(run, &to, middle, shares)).flatten();
        let is_linear = self.limits.mechanism.is_linear();
        match flown {
            Some(entry) if is_linear => Ok(entry),
            flown => match (flown, self.enter_from_rest(Some(&to), &first, middle, shares)) {
                (Some(flown), Ok(other)) => {
                    let quicker = Entry::time(&flown.motions) <= Entry::time(&other.motions);
                    Ok(if quicker { flown } else { other })
                }
                (Some(flown), Err(_)) => Ok(flown),
                (None, other) => other,
            },
        }
    }

    /// In one flight from where the tool is.
    fn fly(
        &self,
        run: &PathRun<N>,
        to: &State,
        middle: &PathFunction<'_>,
        shares: &Tightening,
    ) -> Option<Entry<N>> {
        let from = match &self.front.moving {
            Some(state) => *state,
            None => State::rest(self.router(shares).tool().ok()?.position),
        };
        let now = self.front.now;
        let follow = |flight: &Flight, most: f64| {
            follow_flight(&self.limits, self.area, &now, flight, shares, most)
        };
        let make = |limits: &FlightLimits, directions: &[DirectionLimit]| {
            Flight::within(&from, to, limits, directions)
        };
        let near = [now, run.trail[0].1];
        let near = if self.limits.mechanism.is_linear() { &near[..1] } else { &near };
        let found = self.flown(near, shares, &make, &|flight| follow(flight, FAR_BEYOND));
        let (flight, followed) = match found {
            Ok(found) => found,
            Err(Unfit::Limits) => return None,
            // A slower one may keep inside.
            Err(Unfit::Place) => {
                let mut fits =
                    |flight: &Flight| follow(flight, 1.0).is_some_and(|followed| followed.fits());
                let limits = self.flight_limits(shares);
                let flight = Flight::new(&from, to, &limits, &mut fits)?;
                let followed = follow(&flight, 1.0)?;
                (flight, followed)
            }
        };
        let start = followed.end;
        if self.limits.scope == Scope::Machine {
            walk(&self.limits, start, &[middle]).ok()?.within(&self.limits).ok()?;
        }
        let motions = vec![(flight.duration(), Motion::Flight(Arc::new(flight)))];
        Some(Entry { motions, start })
    }

    /// From rest: to where a run-in begins, or to the start itself.
    fn enter_from_rest(
        &self,
        to: Option<&State>,
        first: &ToolMotion,
        middle: &PathFunction<'_>,
        shares: &Tightening,
    ) -> Result<Entry<N>, Refused> {
        let mut motions = Vec::new();
        let mut router = self.router(shares);
        if let Some(state) = &self.front.moving {
            let (flight, end) = self.way_to_rest(state, &router.now, shares)?;
            motions.push((flight.duration(), Motion::Flight(Arc::new(flight))));
            router.now = end;
        }
        let Some(to) = to else {
            let approach = router.approach(first, &[middle])?;
            motions.extend(approach.motion);
            let start = self.joints_at(first, &approach.start)?;
            return Ok(Entry { motions, start });
        };
        let near = self.joints_at(first, &self.wanted_near(first, &router.now)?)?;
        let run_in = self.run_in(to, &near, shares);
        let run_in = run_in.ok_or(Refused::NoConfiguration { tried: FOLLOW_TRIALS })?;
        let into = |share: f64| run_in.tool(run_in.duration() * share);
        let approach = router.approach(&into(0.0), &[&into, middle])?;
        motions.extend(approach.motion);
        let end = if self.limits.scope == Scope::PathAlone {
            approach.start
        } else {
            walk(&self.limits, approach.start, &[&into])?.end
        };
        let start = self.joints_at(first, &end)?;
        motions.push((run_in.duration(), Motion::Flight(Arc::new(run_in))));
        Ok(Entry { motions, start })
    }

    /// Joints that bring the tool to `first` on some branch, the nearest to `now`.
    fn wanted_near(
        &self,
        first: &ToolMotion,
        now: &Configuration<N>,
    ) -> Result<Configuration<N>, Refused> {
        if self.limits.mechanism.is_linear() || self.limits.scope == Scope::PathAlone {
            return Ok(*now);
        }
        let found = candidates(&self.limits, now, first, &[])?;
        found.first().map(|(start, _)| *start).ok_or(Refused::NoConfiguration { tried: 0 })
    }

    /// The configuration in which the tool moves as `first` says, near another.
    pub(super) fn joints_at(
        &self,
        first: &ToolMotion,
        near: &Configuration<N>,
    ) -> Result<Configuration<N>, Refused> {
        let mut branch = near.branch;
        let motion = self.limits.follow(first, &mut branch, &near.joints)?;
        Ok(Configuration { joints: motion.position, branch })
    }
}
