//! A path in windows: the time law of the next stretch, closed by a stop, of which the first part is
//! handed on.

use std::sync::Arc;

use machine::Mechanism;

use super::path_run::PathRun;
use super::refusals::too_short;
use super::run_in_out::state;
use super::timing::{Timed, WINDOW};
use super::{Draft, Planning};
use crate::error::PlanError;
use crate::geometry::contour::Demand;
use crate::joint_space::configuration::Refused;
use crate::law::{End, Infeasible};
use crate::trajectory::{Errand, Motion};

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// Goes on along the path that is under way.
    pub(super) fn go_on(&mut self, draft: &mut Draft<'_>) -> Result<(), PlanError> {
        let Some(mut run) = self.front.run.take() else { return Ok(()) };
        self.lengthen(&mut run, draft)?;
        self.front.line = run.line_at(run.at);
        let timed = self.time_somehow(&mut run, draft.shares);
        let timed = timed.map_err(|cause| self.refusal(cause))?;
        let timed = timed.map_err(|found| self.stuck(&run, &found))?;
        self.add(run, timed, draft)
    }

    /// A motion that cannot go on, which the plan of the window before excludes.
    fn stuck(&self, run: &PathRun<N>, found: &Infeasible) -> PlanError {
        self.refusal(Refused::Kinematics(machine::kinematics::KinematicsError {
            code: "no_time_law",
            axis: None,
            value: found.place,
            limit: run.path.length(),
            detail: "no speed was found at which the limits hold along this path",
        }))
    }

    /// Adds a timed stretch of `run` to the draft, with its light.
    pub(super) fn add(
        &mut self,
        mut run: PathRun<N>,
        timed: Timed,
        draft: &mut Draft<'_>,
    ) -> Result<(), PlanError> {
        let Timed { law, next, fallback } = timed;
        let duration = law.duration();
        if duration.is_nan() || duration >= super::LONGEST {
            return Err(PlanError::TooLong { duration });
        }
        let start = self.front.time;
        let before = self.front.light.stroke;
        let begins = run.at == 0.0;
        draft.is_fixed = run.fallback.as_ref() == Some(&law);
        // A stop in the light would burn.
        let stops = next == Some(End::Rest) || (run.at > 0.0 && run.begin == End::Rest);
        let follows = run.follows || stops;
        let speeds = &self.task.speeds;
        let asked = |demand: &Demand| speeds.asked(demand.speed);
        let light = &mut self.front.light;
        light.path(&run.contour, &law, start, follows, &asked, &run.speeds).map_err(too_short)?;
        let stroke = if run.contour.is_lit() {
            (before + 1).min(self.front.light.stroke.max(1))
        } else {
            before
        };
        if begins {
            self.note_drawn(&run.contour, false, draft);
        }
        if run.even.is_some_and(|speed| !law.is_even_at(speed)) {
            run.even = None;
        }
        self.account(&run, &law, draft);
        let places = law.places();
        let last = law.at(duration);
        run.reach = (WINDOW * (places.end - places.start) / duration).max(run.least_reach);
        let motion = Motion::Path {
            path: run.path.clone(),
            law: Arc::new(law),
            errand: if run.contour.is_lit() { Errand::Marks } else { Errand::Dark },
        };
        self.push(duration, motion, stroke, draft);
        match next {
            Some(begin) => {
                run.at = places.end;
                run.begin = begin;
                run.fallback = fallback;
                self.front.run = Some(run);
            }
            None => self.leave(&run, last.velocity)?,
        }
        Ok(())
    }

    /// Ends a path: the joints are where it ends, at rest or moving at `speed` [m/s].
    fn leave(&mut self, run: &PathRun<N>, speed: f64) -> Result<(), PlanError> {
        let tool = run.path.end_tool([1.0, 0.0, 0.0]);
        let now = self.joints_at(&tool, &run.trail[run.trail.len() - 1].1);
        self.front.now = now.map_err(|cause| self.refusal(cause))?;
        self.front.moving =
            (run.exit != End::Rest).then(|| state(&run.path.end_tool([speed, 0.0, 0.0])));
        Ok(())
    }
}
