//! The ways from rest into a path and out of it to rest, in the dark.

use std::sync::Arc;

use machine::Mechanism;

use super::paths::PathRun;
use super::{Draft, Planning};
use crate::error::PlanError;
use crate::geometry::jet::Jet;
use crate::joint_space::configuration::{Configuration, Refused};
use crate::joint_space::follow_flight::{follow_flight, tool};
use crate::law::flight::{Flight, FlightLimits, State};
use crate::limits::motion_limits::Scope;
use crate::limits::tightening::Tightening;
use crate::trajectory::Motion;

/// How much slower a run-in or run-out is tried that the axes cannot follow, and how often.
const RUN_SLOWER: f64 = 0.87;
pub(super) const RUN_TRIALS: usize = 24;

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// Comes to rest, if the tool moves.
    pub(super) fn halt(&mut self, draft: &mut Draft<'_>) -> Result<(), PlanError> {
        let Some(state) = self.front.moving.take() else { return Ok(()) };
        let now = self.front.now;
        let (flight, end) =
            self.way_to_rest(&state, &now, draft.shares).map_err(|cause| self.refusal(cause))?;
        let stroke = self.front.light.stroke;
        self.push(flight.duration(), Motion::Flight(Arc::new(flight)), stroke, draft);
        self.front.now = end;
        Ok(())
    }

    /// Whether there is a way to rest from the end of a path that is passed at `speed` [m/s].
    pub(super) fn can_leave(&self, run: &PathRun<N>, speed: f64, shares: &Tightening) -> bool {
        if self.limits.scope == Scope::PathAlone {
            return true;
        }
        let end = run.path.end();
        let tool = end.motion(1.0, 0.0, 0.0);
        let Configuration { joints, mut branch } = run.trail[run.trail.len() - 1].1;
        let Ok(motion) = self.limits.follow(&tool, &mut branch, &joints) else { return false };
        let now = Configuration { joints: motion.position, branch };
        self.run_out(&state(&end, speed), &now, shares).is_some()
    }

    /// The tool's limits in a flight, with less of them where it is played slower.
    pub(super) fn flight_limits(&self, shares: &Tightening, slower: f64) -> FlightLimits {
        let path = &self.limits.path;
        FlightLimits {
            speed: shares.speed * path.rapid.max(path.speed),
            acceleration: shares.acceleration * path.acceleration * slower * slower,
            jerk: shares.jerk * path.jerk * slower * slower * slower,
        }
    }

    /// The way to rest where a path has ended in motion: it did so because there was one within all
    /// limits, so with less of them the longer one that keeps them, or else that.
    pub(super) fn way_to_rest(
        &self,
        state: &State,
        now: &Configuration<N>,
        shares: &Tightening,
    ) -> Result<(Flight, Configuration<N>), Refused> {
        self.run_out(state, now, shares)
            .or_else(|| self.run_out(state, now, &Tightening::none(N)))
            .ok_or(Refused::NoConfiguration { tried: RUN_TRIALS })
    }

    /// The way to rest from `state`, and where the joints then stand.
    pub(super) fn run_out(
        &self,
        state: &State,
        now: &Configuration<N>,
        shares: &Tightening,
    ) -> Option<(Flight, Configuration<N>)> {
        let mut slower = 1.0;
        for _ in 0..RUN_TRIALS {
            let limits = self.flight_limits(shares, slower);
            if state.acceleration.norm() >= 0.999 * limits.acceleration && slower < 1.0 {
                return None;
            }
            if let Some(flight) = Flight::run_out(state, &limits)
                && let Some(end) = follow_flight(&self.limits, self.area, now, &flight, shares)
            {
                return Some((flight, end));
            }
            slower *= RUN_SLOWER;
        }
        None
    }

    /// The way from rest to `state`, where the joints are as in `start`.
    pub(super) fn run_in(
        &self,
        state: &State,
        start: &Configuration<N>,
        shares: &Tightening,
    ) -> Option<Flight> {
        let mut slower = 1.0;
        for _ in 0..RUN_TRIALS {
            let limits = self.flight_limits(shares, slower);
            if state.acceleration.norm() >= 0.999 * limits.acceleration && slower < 1.0 {
                return None;
            }
            if let Some(flight) = Flight::run_in(state, &limits)
                && let Some(first) = self.before(&flight, start)
                && follow_flight(&self.limits, self.area, &first, &flight, shares).is_some()
            {
                return Some(flight);
            }
            slower *= RUN_SLOWER;
        }
        None
    }

    /// The joints at the start of a flight that ends in `end`.
    pub(super) fn before(
        &self,
        flight: &Flight,
        end: &Configuration<N>,
    ) -> Option<Configuration<N>> {
        const STEPS: u32 = 16;
        let mut now = *end;
        for step in (0..STEPS).rev() {
            let time = flight.duration() * f64::from(step) / f64::from(STEPS);
            let motion =
                self.limits.follow(&tool(flight, time), &mut now.branch, &now.joints).ok()?;
            now.joints = motion.position;
        }
        Some(now)
    }
}

/// The tool's state at a place of a path that is passed at an even speed [m/s].
pub(super) fn state(jet: &Jet, speed: f64) -> State {
    let tool = jet.motion(speed, 0.0, 0.0);
    State { position: tool.position, velocity: tool.velocity, acceleration: tool.acceleration }
}
