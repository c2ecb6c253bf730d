//! The ways from rest into a path and out of it to rest, in the dark.

use std::sync::Arc;

use machine::Mechanism;
use machine::kinematics::ToolMotion;

use super::path_run::PathRun;
use super::{Draft, Planning};
use crate::error::PlanError;
use crate::joint_space::configuration::{Configuration, Refused};
use crate::joint_space::directions::{Parts, directions};
use crate::joint_space::follow_flight::{Followed, follow_flight};
use crate::law::flight::{DirectionLimit, Flight, FlightLimits, State};
use crate::limits::limit_id::JointLimit;
use crate::limits::motion_limits::Scope;
use crate::limits::tightening::Tightening;
use crate::trajectory::Motion;

/// Trials of a flight, each with smaller limits where the one before broke a joint's.
pub(super) const FOLLOW_TRIALS: usize = 8;
/// The fraction of a joint's limit that the next trial aims at.
const FITS: f64 = 0.9995;
/// The smallest factor by which one trial reduces a limit.
const LEAST_FIT: f64 = 0.5;

/// A flight that takes so much of a limit is not followed further.
pub(super) const FAR_BEYOND: f64 = 1e3;

/// Why no flight was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unfit {
    /// It goes where tool or joints cannot be.
    Place,
    /// No limits were found within which the joints can follow one.
    Limits,
}

/// Finds a flight within limits of the tool and along directions.
type Make<'a> = dyn Fn(&FlightLimits, &[DirectionLimit]) -> Option<Flight> + 'a;

/// Says how the joints follow it.
type Follow<'a, const N: usize> = dyn Fn(&Flight) -> Option<Followed<N>> + 'a;

/// What of acceleration, and squared of jerk, a run-in from rest takes where joints turn.
const GENTLE: f64 = 0.5;

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
        let tool = run.path.end_tool([1.0, 0.0, 0.0]);
        let Ok(now) = self.joints_at(&tool, &run.trail[run.trail.len() - 1].1) else {
            return false;
        };
        self.run_out(&state(&run.path.end_tool([speed, 0.0, 0.0])), &now, &shares.with_reserve())
            .is_some()
    }

    /// The tool's limits in a flight.
    pub(super) fn flight_limits(&self, shares: &Tightening) -> FlightLimits {
        let path = &self.limits.path;
        FlightLimits {
            speed: shares.speed * path.rapid.max(path.speed),
            acceleration: shares.acceleration * path.acceleration,
            jerk: shares.jerk * path.jerk,
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
            .ok_or(Refused::NoConfiguration { tried: FOLLOW_TRIALS })
    }

    /// The way to rest from `state`, and where the joints then stand.
    pub(super) fn run_out(
        &self,
        state: &State,
        now: &Configuration<N>,
        shares: &Tightening,
    ) -> Option<(Flight, Configuration<N>)> {
        let make = |limits: &FlightLimits, directions: &[DirectionLimit]| {
            Flight::run_out(state, limits, directions)
        };
        let follow = |flight: &Flight| {
            follow_flight(&self.limits, self.area, now, flight, shares, FAR_BEYOND)
        };
        let (flight, followed) = self.flown(&[*now], shares, &make, &follow).ok()?;
        Some((flight, followed.end))
    }

    /// The way from rest to `state`, where the joints are as in `start`.
    pub(super) fn run_in(
        &self,
        state: &State,
        start: &Configuration<N>,
        shares: &Tightening,
    ) -> Option<Flight> {
        let follow = |flight: &Flight| {
            let first = self.before(flight, start)?;
            follow_flight(&self.limits, self.area, &first, flight, shares, FAR_BEYOND)
        };
        // Joints that turn may turn back on the way, and need a moment until friction is against them.
        let gentle = if self.limits.mechanism.is_linear() { 1.0 } else { GENTLE };
        [gentle, 1.0].into_iter().find_map(|share| {
            let make = |limits: &FlightLimits, directions: &[DirectionLimit]| {
                let limits = FlightLimits {
                    acceleration: share * limits.acceleration,
                    jerk: share * share * limits.jerk,
                    ..*limits
                };
                Flight::run_in(state, &limits, directions)
            };
            self.flown(&[*start], shares, &make, &follow).ok().map(|(flight, _)| flight)
        })
    }

    /// The flight that `make` finds within the limits of the tool, or within those and the ones of the
    /// joints near `near`, which `follow` it; less and less of those that it takes too much of.
    pub(super) fn flown(
        &self,
        near: &[Configuration<N>],
        shares: &Tightening,
        make: &Make<'_>,
        follow: &Follow<'_, N>,
    ) -> Result<(Flight, Followed<N>), Unfit> {
        let limits = self.flight_limits(shares);
        let mut parts: Parts<N> = [[1.0; JointLimit::COUNT]; N];
        let mut sides = Vec::new();
        for trial in 0..FOLLOW_TRIALS {
            let flight = make(&limits, &sides).ok_or(Unfit::Limits)?;
            let followed = follow(&flight).ok_or(Unfit::Place)?;
            if followed.fits() {
                return Ok((flight, followed));
            }
            if trial > 0 {
                let parts = parts.iter_mut().flatten();
                for (part, used) in parts.zip(followed.used.iter().flatten()) {
                    *part *= if *used > 1.0 { (FITS / used).max(LEAST_FIT) } else { 1.0 };
                }
            }
            sides.clear();
            for near in near {
                sides.extend(
                    directions(&self.limits, near, shares, &parts).map_err(|_| Unfit::Place)?,
                );
            }
        }
        Err(Unfit::Limits)
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
                self.limits.follow(&flight.tool(time), &mut now.branch, &now.joints).ok()?;
            now.joints = motion.position;
        }
        Some(now)
    }
}

/// The state of a tool in motion.
pub(super) fn state(tool: &ToolMotion) -> State {
    State {
        position: tool.position,
        velocity: tool.velocity,
        acceleration: tool.acceleration,
        rotation: tool.attitude.rotation,
    }
}
